/* noise_block.h: many normal draws at once, each the same bits as noise.h gives for it alone.
 *
 * The definition is noise_normal_of(hash_mix(key ^ step)) of noise.h, draw by draw. Processors with AVX2 mix four keys
 * and place four draws at a time; the rare draws outside their layer's rectangle are left to noise.h.
 */
#ifndef WORLD_NOISE_BLOCK_H
#define WORLD_NOISE_BLOCK_H

#include <stddef.h>
#include <stdint.h>

#include "noise.h"

/* python: begin */
/* The next `count` normal draws of a device: what so many calls of noise_next_normal give, and the same step after
 * them. All 0, and no step, where the source is off. */
void noise_block_next(noise_source *self, double *draws, size_t count);

/* One draw for each key: draw i is noise_normal_of(hash_mix(keys[i])), where keys[i] is a device's key ^ step. The keys
 * may be of any devices and steps. */
void noise_block_normals(const uint64_t *keys, double *draws, size_t count);
/* python: end */

#endif
