/* tasks.h: the tasks of tasks.def, each defined in the file that it is named after. None is put in line, so that the
 * analysis of the image finds it by its name. */
#ifndef TASKS_H
#define TASKS_H

#include "generated/values.h" /* TASK_..., their numbers: the same in all images, also in those that do not have all tasks */

#define TASK(name, period, phase, budget) void name##_task(void) __attribute__((noinline));
#include "tasks.def"

/* The constants that the analysis needs; who defines one asserts that it is the same. */
enum {
#define CONSTANT(name, value) CONSTANT_##name = (value),
#include "tasks.def"
};

#endif
