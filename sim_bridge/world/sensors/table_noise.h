/* table_noise.h: a sensor known by what it was seen to read (the lookup tables of the notes' section 3.2.2).
 *
 * Readings of the real sensor are stored by distance and angle of incidence. A simulated reading draws one of them from each
 * of the four bins around the question and interpolates bilinearly, so the noise is the sensor's own. One table per serial
 * number keeps what makes equal sensors unlike.
 */
#ifndef SENSORS_TABLE_NOISE_H
#define SENSORS_TABLE_NOISE_H

#include "../noise.h"

/* python: begin */
typedef struct table_noise table_noise;

/* Bins at increasing distances (m) and angles (rad); bin (i, j) holds counts[i * angles_count + j] >= 1 samples, which
 * follow each other in `samples`. Numbers are finite. NULL without memory. */
table_noise *table_noise_new(const double *distances, int distances_count, const double *angles, int angles_count,
                             const int *counts, const double *samples);
void table_noise_destroy(table_noise *self);

/* A reading at that distance and angle; outside the table as at its border. Without noise the mean of each bin counts. */
double table_noise_read(const table_noise *self, double distance, double angle, noise_source *noise);
/* python: end */

#endif
