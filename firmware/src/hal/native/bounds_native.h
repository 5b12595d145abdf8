/* bounds_native.h: who is told that a loop has broken its bound. */
#ifndef BOUNDS_NATIVE_H
#define BOUNDS_NATIVE_H

#include "hal/native/machine.h"

/* Does not return. NULL: the process ends. */
extern void (*native_bound_broken)(const char *sentence);

#endif
