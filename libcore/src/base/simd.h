/* SPDX-License-Identifier: GPL-3.0-or-later */
/* One build that uses what the processor has: hot functions are compiled several times, and the loader picks. */
#ifndef EXM_BASE_SIMD_H
#define EXM_BASE_SIMD_H

#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__linux__)
#  define SIMD_CLONES __attribute__((target_clones("avx512f", "avx2,fma", "default")))
#else
#  define SIMD_CLONES
#endif

/* What clones call must be compiled again with them. */
#if defined(__GNUC__)
#  define INLINE static inline __attribute__((always_inline))
#else
#  define INLINE static inline
#endif

#endif
