/* reader.h: a thread that waits for bytes on a file descriptor and stamps them as they come, whatever Python is doing.
 *
 * The thread never needs Python's global lock. It reads into a ring; reader_take hands out what is there, in the chunks
 * in which it came, each with the instant at which its read had returned: never before a byte of it had arrived. When the
 * ring is full the thread waits, and the operating system keeps what comes. POSIX; one thread takes at a time.
 *
 * In a forked child there is no such thread: there reader_take returns -1, and the rest leaves the parent's alone. */
#ifndef READER_H
#define READER_H

#include <stddef.h>
#include <stdint.h>

/* python: begin */
typedef struct reader reader;

/* Starts the thread. The descriptor stays the caller's, and open until reader_stop. NULL: no memory, no pipe or no thread. */
reader *reader_start(int descriptor);

/* Waits at most wait_s seconds for the first chunk, then copies whole chunks while they fit into `room` bytes and
 * `chunk_room` entries: times[i] is the receipt of chunk i (s, CLOCK_MONOTONIC), ends[i] its end in `bytes`. Returns their
 * number; 0: nothing in time; -1: the other side has gone, and nothing is left. room >= READER_CHUNK */
int reader_take(reader *self, double wait_s, uint8_t *bytes, uint32_t room, double *times, uint32_t *ends,
                int chunk_room);

/* Forgets the bytes that were read and not yet handed out. */
void reader_forget(reader *self);

/* Ends the thread. May be called twice. */
void reader_stop(reader *self);

/* Frees it, after reader_stop if need be. */
void reader_free(reader *self);
/* python: end */

#define READER_CHUNK 4096u /* the most that one read takes */

#endif
