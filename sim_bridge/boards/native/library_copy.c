/* library_copy.c: see library_copy.h. The only file of the native board that knows the operating system. */
#ifndef _WIN32
#define _POSIX_C_SOURCE 200809L
#endif

#include "boards/native/library_copy.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#include <unistd.h>
#endif

#ifdef _WIN32

/* Names of files in wide characters: a user's name need not be of the system's code page. */
static bool write_copy(wchar_t *path, const unsigned char *bytes, size_t size) {
  wchar_t folder[MAX_PATH + 1];
  if (GetTempPathW(MAX_PATH + 1, folder) == 0 || GetTempFileNameW(folder, L"bot", 0, path) == 0) {
    return false;
  }
  FILE *file = _wfopen(path, L"wb");
  if (file == NULL) {
    return false;
  }
  const bool written = fwrite(bytes, 1, size, file) == size;
  return fclose(file) == 0 && written;
}

bool library_load(library_copy *library, const unsigned char *bytes, size_t size, char *error, size_t error_size) {
  wchar_t path[MAX_PATH] = L"";
  *library = (library_copy){NULL, NULL};
  if (!write_copy(path, bytes, size)) {
    snprintf(error, error_size, "cannot write a temporary copy of the firmware library");
    return false;
  }
  library->handle = (void *)LoadLibraryW(path);
  if (library->handle == NULL) {
    snprintf(error, error_size, "Windows says error %lu", GetLastError());
    DeleteFileW(path);
    return false;
  }
  library->path = _wcsdup(path);
  return true;
}

void *library_symbol(const library_copy *library, const char *name) {
  return (void *)GetProcAddress((HMODULE)library->handle, name);
}

void library_unload(library_copy *library) {
  if (library->handle != NULL) {
    FreeLibrary((HMODULE)library->handle);
    DeleteFileW(library->path);
    free(library->path);
    *library = (library_copy){NULL, NULL};
  }
}

#else

bool library_load(library_copy *library, const unsigned char *bytes, size_t size, char *error, size_t error_size) {
  *library = (library_copy){NULL, NULL};
  const char *folder = getenv("TMPDIR");
  char path[4096];
  snprintf(path, sizeof path, "%s/boebot-firmware-XXXXXX", folder != NULL && folder[0] != '\0' ? folder : "/tmp");
  const int file = mkstemp(path);
  if (file < 0) {
    snprintf(error, error_size, "cannot make a temporary file %s: %s", path, strerror(errno));
    return false;
  }
  FILE *copy = fdopen(file, "wb");
  const bool written = copy != NULL && fwrite(bytes, 1, size, copy) == size;
  if (copy != NULL && fclose(copy) == 0 && written) {
    library->handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (library->handle == NULL) {
      const char *reason = dlerror(), *after = strstr(reason, ": ");
      const bool names_copy = after != NULL && strncmp(reason, path, (size_t)(after - reason)) == 0;
      snprintf(error, error_size, "%s", names_copy ? after + 2 : reason);
    }
  } else {
    snprintf(error, error_size, "cannot write a temporary copy of the firmware library: %s", strerror(errno));
  }
  unlink(path); /* the loaded copy lives on without a name */
  return library->handle != NULL;
}

void *library_symbol(const library_copy *library, const char *name) { return dlsym(library->handle, name); }

void library_unload(library_copy *library) {
  if (library->handle != NULL) {
    dlclose(library->handle);
    library->handle = NULL;
  }
}

#endif
