/* library_copy.h: loads a private copy of a shared library: the same file loaded twice would be one library with one
 * set of variables. */
#ifndef LIBRARY_COPY_H
#define LIBRARY_COPY_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
  void *handle;
  void *path; /* the copy's, where it cannot be removed while it is loaded; otherwise NULL */
} library_copy;

/* Loads a library from its bytes. */
bool library_load(library_copy *library, const unsigned char *bytes, size_t size, char *error, size_t error_size);

void *library_symbol(const library_copy *library, const char *name);
void library_unload(library_copy *library);

#endif
