/* SPDX-License-Identifier: GPL-3.0-or-later */
/* BLAS and LAPACK in the calling thread.
 *
 * OpenBLAS shares out even modest products, and its threads wait for each other by spinning: within Blender, or on a
 * farm with other jobs, a bind took five times the processor time and as much longer for it. What is worth a second
 * thread we share out ourselves (base/parallel.h). The number of threads is the whole process's, so it is lowered for
 * the call and given back after the last of those that are under way at once. */
#ifndef EXM_LINALG_SINGLE_BLAS_H
#define EXM_LINALG_SINGLE_BLAS_H

void single_blas_begin(void);
void single_blas_end(void);

/** One call, and what it needs around it. */
#define SINGLE_BLAS(call)                                                                                              \
  do {                                                                                                                 \
    single_blas_begin();                                                                                               \
    call;                                                                                                              \
    single_blas_end();                                                                                                 \
  } while (0)

#endif
