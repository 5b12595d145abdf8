/* last_resort.c: see last_resort.h. */
#include "last_resort.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { HOLD = 0, WAIT = 253, END = 254, HEED = 255 };

static atomic_int first; /* number of the signal that began the countdown; 0: there is none */

int last_resort_signal(void) { return first; }

static double now_s(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void end_process(int number, const char *sentence) {
  if (write(STDERR_FILENO, sentence, strlen(sentence)) < 0) {
    /* nobody reads it */
  }
  _exit(128 + number);
}

void last_resort_watch(int descriptor, unsigned long signals, double limit_s, double again_s, double one_press_s,
                       const char *sentence) {
  bool held = false;
  first = 0;
  double end_s = INFINITY, last_s = -INFINITY;
  for (;;) {
    double left_s = end_s - now_s();
    struct pollfd line = {.fd = descriptor, .events = POLLIN};
    int ready = poll(&line, 1, isinf(end_s) ? -1 : left_s > 0.0 ? (int)ceil(1e3 * left_s) : 0);
    if (ready < 0 && errno != EINTR) return;
    if (ready == 0 && now_s() >= end_s) end_process(first, sentence);
    if (ready <= 0) continue;
    unsigned char byte;
    if (read(descriptor, &byte, 1) != 1 || byte == END) return;
    if (byte == WAIT) {
      end_s = INFINITY;
    } else if (byte == HOLD || byte == HEED) {
      held = byte == HOLD;
      first = 0;
      end_s = INFINITY;
    } else if (!held && byte < 8 * sizeof signals && (signals >> byte & 1)) {
      double at_s = now_s(), since_s = at_s - last_s;
      last_s = at_s;
      if (first == 0) {
        first = byte;
        end_s = at_s + limit_s;
      } else if (since_s > one_press_s) {
        end_s = fmin(end_s, at_s + again_s);
      }
    }
  }
}
