/* reader.c: see reader.h. */
#include "reader.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* Five seconds of a line at 500,000 bit/s, in chunks as small as they come from a USB adapter. */
#define RING_BYTES (1u << 18)
#define RING_CHUNKS (1u << 13)
/* A terminal that was flushed between poll and read has nothing to read; one that is always so has gone. */
#define EMPTY_READS_MAX 100
#define EMPTY_READ_PAUSE_NS 1000000L

typedef struct {
  double time;
  uint32_t end; /* free-running count of bytes */
} chunk;

struct reader {
  int descriptor;
  bool terminal;
  pid_t process; /* whose thread it is: a forked child has a copy of all this, but no thread */
  int wake[2];   /* a pipe: a byte in it ends the thread */
  pthread_t thread;
  bool running;

  pthread_mutex_t lock; /* for all that follows */
  pthread_cond_t filled, emptied;
  bool stopping, ended;
  uint32_t head, tail; /* free-running counts of bytes read and handed out */
  uint32_t chunk_head, chunk_tail;
  chunk chunks[RING_CHUNKS];
  uint8_t bytes[RING_BYTES];
};

static double seconds_now(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static struct timespec instant(double seconds) {
  const double whole = floor(seconds);
  return (struct timespec){.tv_sec = (time_t)whole, .tv_nsec = (long)((seconds - whole) * 1e9)};
}

static bool is_ours(const reader *self) { return self->process == getpid(); }

static uint32_t smaller(uint32_t a, uint32_t b) { return a < b ? a : b; }

/* Waits until there is room for a chunk; how many bytes in one piece, 0 when the thread is to end. */
static uint32_t wait_for_room(reader *self) {
  pthread_mutex_lock(&self->lock);
  while (!self->stopping &&
         (self->head - self->tail == RING_BYTES || self->chunk_head - self->chunk_tail == RING_CHUNKS)) {
    pthread_cond_wait(&self->emptied, &self->lock);
  }
  const uint32_t room = smaller(RING_BYTES - (self->head - self->tail), RING_BYTES - self->head % RING_BYTES);
  const bool stopping = self->stopping;
  pthread_mutex_unlock(&self->lock);
  return stopping ? 0 : smaller(room, READER_CHUNK);
}

/* Waits until the descriptor can be read; false when the thread is to end. */
static bool wait_for_bytes(const reader *self, bool *hung_up) {
  struct pollfd wanted[2] = {{.fd = self->descriptor, .events = POLLIN}, {.fd = self->wake[0], .events = POLLIN}};
  while (poll(wanted, 2, -1) < 0) {
    if (errno != EINTR) {
      return false;
    }
  }
  *hung_up = (wanted[0].revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
  return wanted[1].revents == 0;
}

static void append(reader *self, uint32_t count, double time) {
  pthread_mutex_lock(&self->lock);
  self->head += count;
  self->chunks[self->chunk_head++ % RING_CHUNKS] = (chunk){.time = time, .end = self->head};
  pthread_cond_signal(&self->filled);
  pthread_mutex_unlock(&self->lock);
}

static void *read_on(void *argument) {
  reader *self = argument;
  int empty = 0;
  bool hung_up = false;
  uint32_t room;
  while ((room = wait_for_room(self)) > 0 && wait_for_bytes(self, &hung_up)) {
    const ssize_t count = read(self->descriptor, self->bytes + self->head % RING_BYTES, room);
    const double time = seconds_now();
    if (count > 0) {
      append(self, (uint32_t)count, time);
      empty = 0;
    } else if (count == 0 && self->terminal && !hung_up && ++empty < EMPTY_READS_MAX) {
      nanosleep(&(struct timespec){.tv_nsec = EMPTY_READ_PAUSE_NS}, NULL);
    } else if (count == 0 || (errno != EINTR && errno != EAGAIN)) {
      break;
    }
  }
  pthread_mutex_lock(&self->lock);
  self->ended = true;
  pthread_cond_broadcast(&self->filled);
  pthread_mutex_unlock(&self->lock);
  return NULL;
}

/* Signals are for Python's main thread. */
static int start_thread(reader *self) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  const int error = pthread_create(&self->thread, NULL, read_on, self);
  pthread_sigmask(SIG_SETMASK, &before, NULL);
  return error;
}

static void prepare_lock(reader *self) {
  pthread_condattr_t monotonic;
  pthread_condattr_init(&monotonic);
  pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
  pthread_mutex_init(&self->lock, NULL);
  pthread_cond_init(&self->filled, &monotonic);
  pthread_cond_init(&self->emptied, &monotonic);
  pthread_condattr_destroy(&monotonic);
}

reader *reader_start(int descriptor) {
  reader *self = calloc(1, sizeof *self);
  if (self == NULL || pipe(self->wake) != 0) {
    free(self);
    return NULL;
  }
  self->descriptor = descriptor;
  self->terminal = isatty(descriptor) == 1;
  self->process = getpid();
  prepare_lock(self);
  self->running = start_thread(self) == 0;
  if (!self->running) {
    reader_free(self);
    return NULL;
  }
  return self;
}

/* Under the lock: copies the oldest chunk to bytes + at. */
static uint32_t copy_chunk(reader *self, uint8_t *bytes, uint32_t at) {
  const uint32_t end = self->chunks[self->chunk_tail++ % RING_CHUNKS].end;
  const uint32_t count = end - self->tail;
  const uint32_t start = self->tail % RING_BYTES;
  memcpy(bytes + at, self->bytes + start, count); /* a chunk never wraps */
  self->tail = end;
  return count;
}

int reader_take(reader *self, double wait_s, uint8_t *bytes, uint32_t room, double *times, uint32_t *ends,
                int chunk_room) {
  int chunks = 0;
  uint32_t at = 0;
  if (!is_ours(self)) {
    return -1;
  }
  pthread_mutex_lock(&self->lock);
  if (self->chunk_head == self->chunk_tail && !self->ended && wait_s > 0) {
    const struct timespec until = instant(seconds_now() + wait_s);
    int error = 0;
    while (self->chunk_head == self->chunk_tail && !self->ended && error == 0) {
      error = pthread_cond_timedwait(&self->filled, &self->lock, &until);
    }
  }
  while (chunks < chunk_room && self->chunk_tail != self->chunk_head) {
    const chunk *next = &self->chunks[self->chunk_tail % RING_CHUNKS];
    if (next->end - self->tail > room - at) {
      break;
    }
    times[chunks] = next->time;
    at += copy_chunk(self, bytes, at);
    ends[chunks++] = at;
  }
  const bool gone = chunks == 0 && self->ended;
  pthread_cond_signal(&self->emptied);
  pthread_mutex_unlock(&self->lock);
  return gone ? -1 : chunks;
}

void reader_forget(reader *self) {
  if (!is_ours(self)) {
    return;
  }
  pthread_mutex_lock(&self->lock);
  self->tail = self->head;
  self->chunk_tail = self->chunk_head;
  pthread_cond_signal(&self->emptied);
  pthread_mutex_unlock(&self->lock);
}

void reader_stop(reader *self) {
  if (!is_ours(self)) {
    return;
  }
  pthread_mutex_lock(&self->lock);
  const bool running = self->running;
  self->running = false;
  self->stopping = true;
  pthread_cond_broadcast(&self->emptied);
  pthread_mutex_unlock(&self->lock);
  if (running) {
    const ssize_t written = write(self->wake[1], "", 1);
    (void)written; /* an empty pipe takes a byte */
    pthread_join(self->thread, NULL);
  }
}

void reader_free(reader *self) {
  if (!is_ours(self)) { /* the thread may have held the lock at the fork: it can be neither locked nor destroyed */
    close(self->wake[0]);
    close(self->wake[1]);
    free(self);
    return;
  }
  reader_stop(self);
  close(self->wake[0]);
  close(self->wake[1]);
  pthread_cond_destroy(&self->filled);
  pthread_cond_destroy(&self->emptied);
  pthread_mutex_destroy(&self->lock);
  free(self);
}
