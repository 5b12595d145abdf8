/* bounds_native.c: what happens in a PC process when a loop runs more often than its bound says (bounds.h): one sentence
 * for whoever runs the firmware, or on standard error and the end of the process. */
#include <stdio.h>
#include <stdlib.h>

#include "bounds.h"
#include "hal/native/bounds_native.h"

void (*native_bound_broken)(const char *sentence);

void bounds_broken(const char *file, int line, uint32_t most) {
  char sentence[NATIVE_FAULT_SIZE];
  snprintf(sentence, sizeof sentence, "%s:%d: a loop makes more than the %lu passes that bound it", file, line,
           (unsigned long)most);
  if (native_bound_broken != NULL) {
    native_bound_broken(sentence);
  }
  fprintf(stderr, "%s\n", sentence);
  abort();
}
