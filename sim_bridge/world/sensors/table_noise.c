/* table_noise.c: see table_noise.h. */
#include "table_noise.h"

#include <stdlib.h>

struct table_noise {
  int rows, columns;
  double *distances, *angles;
  double *samples;
  size_t *first; /* of each bin; one more than there are bins */
  double *means;
};

static double *copied(const double *values, size_t count) {
  double *copy = malloc(count * sizeof *copy);
  for (size_t i = 0; copy != NULL && i < count; i++) copy[i] = values[i];
  return copy;
}

/* Fills the bins' borders and means. */
static void fill(table_noise *self, const int *counts) {
  const size_t bins = (size_t)self->rows * (size_t)self->columns;
  for (size_t bin = 0; bin < bins; bin++) {
    self->first[bin + 1] = self->first[bin] + (size_t)counts[bin];
    double sum = 0.0;
    for (size_t i = self->first[bin]; i < self->first[bin + 1]; i++) sum += self->samples[i];
    self->means[bin] = sum / (double)counts[bin];
  }
}

table_noise *table_noise_new(const double *distances, int distances_count, const double *angles, int angles_count,
                             const int *counts, const double *samples) {
  const size_t bins = (size_t)distances_count * (size_t)angles_count;
  size_t total = 0;
  for (size_t bin = 0; bin < bins; bin++) total += (size_t)counts[bin];
  table_noise *self = calloc(1, sizeof *self);
  if (self == NULL) return NULL;
  self->rows = distances_count;
  self->columns = angles_count;
  self->distances = copied(distances, (size_t)distances_count);
  self->angles = copied(angles, (size_t)angles_count);
  self->samples = copied(samples, total);
  self->first = calloc(bins + 1, sizeof *self->first);
  self->means = calloc(bins, sizeof *self->means);
  const int complete = self->distances != NULL && self->angles != NULL && self->samples != NULL &&
                       self->first != NULL && self->means != NULL;
  if (!complete) {
    table_noise_destroy(self);
    return NULL;
  }
  fill(self, counts);
  return self;
}

void table_noise_destroy(table_noise *self) {
  free(self->distances);
  free(self->angles);
  free(self->samples);
  free(self->first);
  free(self->means);
  free(self);
}

/* The bin at or below `value` and how far it is on the way to the next, [0, 1]. */
static int place(const double *bins, int count, double value, double *share) {
  *share = 0.0;
  if (count == 1 || !(value > bins[0])) return 0;
  int low = 0;
  int high = count - 1;
  if (value >= bins[high]) {
    *share = 1.0;
    return high - 1;
  }
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    if (bins[middle] <= value) {
      low = middle;
    } else {
      high = middle;
    }
  }
  *share = (value - bins[low]) / (bins[low + 1] - bins[low]);
  return low;
}

static double drawn(const table_noise *self, int row, int column, noise_source *noise) {
  const size_t bin = (size_t)row * (size_t)self->columns + (size_t)column;
  if (!noise->on) return self->means[bin];
  const size_t count = self->first[bin + 1] - self->first[bin];
  return self->samples[self->first[bin] + (size_t)(noise_next_uniform(noise) * (double)count)];
}

double table_noise_read(const table_noise *self, double distance, double angle, noise_source *noise) {
  double along, across;
  const int row = place(self->distances, self->rows, distance, &along);
  const int column = place(self->angles, self->columns, angle, &across);
  const int next_row = row + 1 < self->rows ? row + 1 : row;
  const int next_column = column + 1 < self->columns ? column + 1 : column;
  const double a = drawn(self, row, column, noise);
  const double b = drawn(self, row, next_column, noise);
  const double c = drawn(self, next_row, column, noise);
  const double d = drawn(self, next_row, next_column, noise);
  const double near = a + (b - a) * across;
  const double far = c + (d - c) * across;
  return near + (far - near) * along;
}
