/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Four doubles side by side. Vector types rather than loops, because whether a loop becomes vector code is a compiler's
 * mood, and it is a factor of five. */
#ifndef EXM_LINALG_FOUR_H
#define EXM_LINALG_FOUR_H

#include "base/simd.h"

#if defined(__GNUC__)
typedef double four __attribute__((vector_size(32)));

/* to += from */
INLINE void four_add(four *to, const four *from)
{
  *to += *from;
}

/* to -= from */
INLINE void four_take(four *to, const four *from)
{
  *to -= *from;
}

/* to += factor from */
INLINE void four_axpy(four *to, double factor, const four *from)
{
  *to += factor * *from;
}

/* to -= factor from */
INLINE void four_subtract(four *to, double factor, const four *from)
{
  *to -= factor * *from;
}

INLINE void four_scale(four *a, double factor)
{
  *a *= factor;
}
#else
typedef struct four {
  _Alignas(32) double lane[4];
} four;

INLINE void four_axpy(four *to, double factor, const four *from)
{
  for (int k = 0; k < 4; k++) {
    to->lane[k] += factor * from->lane[k];
  }
}

INLINE void four_add(four *to, const four *from)
{
  four_axpy(to, 1, from);
}

INLINE void four_take(four *to, const four *from)
{
  four_axpy(to, -1, from);
}

INLINE void four_subtract(four *to, double factor, const four *from)
{
  four_axpy(to, -factor, from);
}

INLINE void four_scale(four *a, double factor)
{
  for (int k = 0; k < 4; k++) {
    a->lane[k] *= factor;
  }
}
#endif

#endif
