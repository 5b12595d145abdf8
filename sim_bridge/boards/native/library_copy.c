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
#include <sys/types.h>
#include <unistd.h>
#endif

unsigned char *library_read(const char *path, size_t *size, char *error, size_t error_size) {
  FILE *file = fopen(path, "rb");
  if (file == NULL) {
    snprintf(error, error_size, "cannot open the firmware library %s: %s", path, strerror(errno));
    return NULL;
  }
  unsigned char *bytes = NULL;
  long length = -1;
  if (fseek(file, 0, SEEK_END) == 0 && (length = ftell(file)) > 0 && fseek(file, 0, SEEK_SET) == 0) {
    bytes = malloc((size_t)length);
  }
  if (bytes != NULL && fread(bytes, 1, (size_t)length, file) != (size_t)length) {
    free(bytes);
    bytes = NULL;
  }
  fclose(file);
  if (bytes == NULL) {
    snprintf(error, error_size, "cannot read the firmware library %s", path);
    return NULL;
  }
  *size = (size_t)length;
  return bytes;
}

#ifdef _WIN32

static bool write_copy(char *path, const unsigned char *bytes, size_t size) {
  char folder[MAX_PATH];
  if (GetTempPathA(sizeof folder, folder) == 0 || GetTempFileNameA(folder, "bot", 0, path) == 0) {
    return false;
  }
  FILE *file = fopen(path, "wb");
  if (file == NULL) {
    return false;
  }
  const bool written = fwrite(bytes, 1, size, file) == size;
  return fclose(file) == 0 && written;
}

bool library_load(library_copy *library, const unsigned char *bytes, size_t size, char *error, size_t error_size) {
  char path[MAX_PATH] = "";
  *library = (library_copy){NULL, NULL};
  if (!write_copy(path, bytes, size)) {
    snprintf(error, error_size, "cannot write a temporary copy of the firmware library");
    return false;
  }
  library->handle = (void *)LoadLibraryA(path);
  if (library->handle == NULL) {
    snprintf(error, error_size, "cannot load the firmware library: error %lu", GetLastError());
    DeleteFileA(path);
    return false;
  }
  library->path = _strdup(path);
  return true;
}

void *library_symbol(const library_copy *library, const char *name) {
  return (void *)GetProcAddress((HMODULE)library->handle, name);
}

void library_unload(library_copy *library) {
  if (library->handle != NULL) {
    FreeLibrary((HMODULE)library->handle);
    DeleteFileA(library->path);
    free(library->path);
    *library = (library_copy){NULL, NULL};
  }
}

#else

static bool write_all(int file, const unsigned char *bytes, size_t size) {
  while (size > 0) {
    const ssize_t written = write(file, bytes, size);
    if (written < 0 && errno != EINTR) {
      return false;
    }
    if (written > 0) {
      bytes += written;
      size -= (size_t)written;
    }
  }
  return true;
}

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
  const bool written = write_all(file, bytes, size);
  close(file);
  if (written) {
    library->handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (library->handle == NULL) {
      snprintf(error, error_size, "cannot load the firmware library: %s", dlerror());
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
