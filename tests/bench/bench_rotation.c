/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Our batched rotations. The file is matrices [count][3][3] in double after an int64 count.
 *
 * "go" answers seconds a matrix, "trace" the sum of <M, R>, which the closest rotations make largest. */
#include <stdint.h>

#include "linalg/rotation.h"
#include "worker.h"

int main(int argc, char **argv)
{
  FILE *file = worker_open(argc, argv);
  int64_t stored;
  char command[64];
  worker_read(file, &stored, sizeof stored, 1);
  size_t const count = (size_t)stored;
  double *matrices = worker_array(9 * count, sizeof(double)), *rotations = worker_array(9 * count, sizeof(double));
  worker_read(file, matrices, sizeof(double), 9 * count);
  fclose(file);
  worker_ready();
  while (worker_command(command, sizeof command)) {
    double const start = worker_clock();
    rotation_fit3(count, matrices, rotations);
    double const seconds = worker_clock() - start;
    double trace = 0;
    for (size_t i = 0; i < 9 * count; i++) {
      trace += matrices[i] * rotations[i];
    }
    worker_answer_one(strcmp(command, "trace") == 0 ? trace : seconds / (double)count);
  }
  free(matrices);
  free(rotations);
  return 0;
}
