/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Closest rotations in batches.
 *
 * Horn, "Closed-form solution of absolute orientation using unit quaternions", 1987: the quaternion of the rotation
 * that maximises tr R'M is the eigenvector of a symmetric 4x4 matrix K(M) with the largest eigenvalue. The eigenvalue
 * comes from Newton's method on the characteristic quartic in the form of Markley, "Attitude determination using vector
 * observations: a fast optimal matrix algorithm", 1993, the eigenvector from the adjugate of K - lambda I. One Newton
 * step on SO(3) removes what the adjugate lost to cancellation. A unit quaternion keeps the result orthonormal however
 * bad the input is.
 *
 * All of that is straight-line code over blocks of matrices, which compilers turn into SIMD; strict C contracts no
 * products with sums, so that every kind of processor gives the same bits. Each lane also says whether its result can
 * be trusted; the few that cannot (nearly no unique answer, extreme scales) go through a Jacobi eigenvalue iteration.
 */
#include "linalg/rotation.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/simd.h"

/* Selections only become SIMD where a comparison need not raise a floating-point flag. */
#if defined(__GNUC__) && !defined(__clang__)
#  pragma GCC optimize("no-trapping-math")
#endif

enum { LANES = 32, NEWTON_STEPS = 8, JACOBI_SWEEPS = 24 };

/* Matrices outside this range would under- or overflow in the quartic; the Jacobi path rescales them. */
#define SCALE_MIN 1e-280
#define SCALE_MAX 1e280

/* Relative gap of the two largest eigenvalues of K below which the maximisers count as a whole space of quaternions. */
#define DEGENERATE_GAP 1e-12

typedef struct block {
  double matrix[9][LANES], scale[LANES], scaled[9][LANES];
  double norm2[LANES], determinant8[LANES], adjugate4[LANES], root[LANES];
  double quaternion[4][LANES];
  double rotation[9][LANES], trusted[LANES]; /* trusted where positive */
} block;

/* Rows of the rotation of the unit quaternion (w, x, y, z). */
INLINE void quaternion_rotation(double w, double x, double y, double z, double r[9])
{
  r[0] = w * w + x * x - y * y - z * z;
  r[1] = 2 * (x * y - w * z);
  r[2] = 2 * (x * z + w * y);
  r[3] = 2 * (x * y + w * z);
  r[4] = w * w - x * x + y * y - z * z;
  r[5] = 2 * (y * z - w * x);
  r[6] = 2 * (x * z - w * y);
  r[7] = 2 * (y * z + w * x);
  r[8] = w * w - x * x - y * y + z * z;
}

/* The quartic of which the sum of the singular values, with the sign of the determinant on the last one, is the largest
 * root: (t^2 - |M|^2)^2 - 8 t det M - 4 |adj M|^2. All its roots are real, so that Newton's method comes down to the
 * largest one from above without overshooting. */
typedef struct quartic {
  double norm2, determinant8, adjugate4; /* |M|^2, 8 det M, 4 |adj M|^2 */
} quartic;

INLINE quartic characteristic(const double m[9])
{
  double const c0 = m[4] * m[8] - m[5] * m[7];
  double const c1 = m[5] * m[6] - m[3] * m[8];
  double const c2 = m[3] * m[7] - m[4] * m[6];
  double const c3 = m[2] * m[7] - m[1] * m[8];
  double const c4 = m[0] * m[8] - m[2] * m[6];
  double const c5 = m[1] * m[6] - m[0] * m[7];
  double const c6 = m[1] * m[5] - m[2] * m[4];
  double const c7 = m[2] * m[3] - m[0] * m[5];
  double const c8 = m[0] * m[4] - m[1] * m[3];
  quartic p;
  p.norm2 = (m[0] * m[0] + m[1] * m[1] + m[2] * m[2]) + (m[3] * m[3] + m[4] * m[4] + m[5] * m[5]) +
            (m[6] * m[6] + m[7] * m[7] + m[8] * m[8]);
  p.determinant8 = 8 * (m[0] * c0 + m[1] * c1 + m[2] * c2);
  p.adjugate4 = 4 * ((c0 * c0 + c1 * c1 + c2 * c2) + (c3 * c3 + c4 * c4 + c5 * c5) + (c6 * c6 + c7 * c7 + c8 * c8));
  return p;
}

/* The root satisfies t^2 = |M|^2 + sqrt(4 |adj M|^2 + 8 t det M), so that an upper bound on the right gives one on the
 * left; sqrt(3) |M| is one to start from. */
INLINE double root_bound(quartic p)
{
  double const torque = p.determinant8 > 0 ? p.determinant8 * sqrt(3 * p.norm2) : 0;
  return sqrt(p.norm2 + sqrt(p.adjugate4 + torque));
}

INLINE double root_step(quartic p, double t)
{
  double const excess = t * t - p.norm2;
  double const value = excess * excess - p.determinant8 * t - p.adjugate4;
  double const slope = 4 * t * excess - p.determinant8;
  return t - (slope > 0 ? value / slope : 0);
}

/* The column of largest norm of the adjugate of K - t I, by way of 2x2 minors; not normalised. */
INLINE void eigenvector(const double m[9], double t, double q[4])
{
  double const kww = m[0] + m[4] + m[8] - t, kxx = m[0] - m[4] - m[8] - t;
  double const kyy = m[4] - m[0] - m[8] - t, kzz = m[8] - m[0] - m[4] - t;
  double const kwx = m[7] - m[5], kwy = m[2] - m[6], kwz = m[3] - m[1];
  double const kxy = m[1] + m[3], kxz = m[2] + m[6], kyz = m[5] + m[7];
  double const s0 = kww * kxx - kwx * kwx, s1 = kww * kxy - kwx * kwy, s2 = kww * kxz - kwx * kwz;
  double const s3 = kwx * kxy - kxx * kwy, s4 = kwx * kxz - kxx * kwz, s5 = kwy * kxz - kxy * kwz;
  double const c5 = kyy * kzz - kyz * kyz, c4 = kxy * kzz - kxz * kyz, c3 = kxy * kyz - kxz * kyy;
  double const c2 = kwy * kzz - kwz * kyz, c1 = kwy * kyz - kwz * kyy;
  double const b00 = kxx * c5 - kxy * c4 + kxz * c3, b01 = -kwx * c5 + kwy * c4 - kwz * c3;
  double const b02 = kxz * s5 - kyz * s4 + kzz * s3, b03 = -kxy * s5 + kyy * s4 - kyz * s3;
  double const b11 = kww * c5 - kwy * c2 + kwz * c1, b12 = -kwz * s5 + kyz * s2 - kzz * s1;
  double const b13 = kwy * s5 - kyy * s2 + kyz * s1, b22 = kwz * s4 - kxz * s2 + kzz * s0;
  double const b23 = -kwy * s4 + kxy * s2 - kyz * s0, b33 = kwy * s3 - kxy * s1 + kyy * s0;
  /* The adjugate is a multiple of q q': its largest diagonal entry marks its largest column. */
  double const a0 = fabs(b00), a1 = fabs(b11), a2 = fabs(b22), a3 = fabs(b33);
  double const upper = a1 > a0 ? a1 : a0, lower = a3 > a2 ? a3 : a2;
  double const u0 = a1 > a0 ? b01 : b00, u1 = a1 > a0 ? b11 : b01, u2 = a1 > a0 ? b12 : b02, u3 = a1 > a0 ? b13 : b03;
  double const l0 = a3 > a2 ? b03 : b02, l1 = a3 > a2 ? b13 : b12, l2 = a3 > a2 ? b23 : b22, l3 = a3 > a2 ? b33 : b23;
  q[0] = lower > upper ? l0 : u0;
  q[1] = lower > upper ? l1 : u1;
  q[2] = lower > upper ? l2 : u2;
  q[3] = lower > upper ? l3 : u3;
}

/* Turn the rotation by Newton's step towards a symmetric R'M: (tr S I - S) omega = axial(S - S'), S = R'M. Returns a
 * positive number where the step is small enough for its quadratic convergence to be trusted to rounding, and the
 * matrix on the left, whose eigenvalues are half the gaps of K, is safely positive. */
INLINE double polish(const double m[9], double q[4], double r[9])
{
  quaternion_rotation(q[0], q[1], q[2], q[3], r);
  double s[9];
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      s[3 * i + j] = r[i] * m[j] + r[3 + i] * m[3 + j] + r[6 + i] * m[6 + j];
    }
  }
  double const a0 = s[7] - s[5], a1 = s[2] - s[6], a2 = s[3] - s[1];
  double const h00 = s[4] + s[8], h11 = s[0] + s[8], h22 = s[0] + s[4];
  double const h01 = -0.5 * (s[1] + s[3]), h02 = -0.5 * (s[2] + s[6]), h12 = -0.5 * (s[5] + s[7]);
  double const d00 = h11 * h22 - h12 * h12, d01 = h02 * h12 - h01 * h22, d02 = h01 * h12 - h02 * h11;
  double const d11 = h00 * h22 - h02 * h02, d12 = h01 * h02 - h00 * h12, d22 = h00 * h11 - h01 * h01;
  double const determinant = h00 * d00 + h01 * d01 + h02 * d02;
  double const half = 0.5 / determinant;
  double const x = half * (d00 * a0 + d01 * a1 + d02 * a2);
  double const y = half * (d01 * a0 + d11 * a1 + d12 * a2);
  double const z = half * (d02 * a0 + d12 * a1 + d22 * a2);
  double const w = q[0] - q[1] * x - q[2] * y - q[3] * z;
  double const i = q[1] + q[0] * x + q[2] * z - q[3] * y;
  double const j = q[2] + q[0] * y + q[3] * x - q[1] * z;
  double const k = q[3] + q[0] * z + q[1] * y - q[2] * x;
  double const turn2 = x * x + y * y + z * z;
  double const inverse = 1 / sqrt(w * w + i * i + j * j + k * k);
  quaternion_rotation(w * inverse, i * inverse, j * inverse, k * inverse, r);
  double const trace = h00 + h11 + h22;
  double const spread = determinant / (trace * trace * trace);
  /* The smallest of the numbers that have to be positive. */
  double const step = spread > 1e-9 ? 1e-15 * spread - turn2 : -1;
  double const convex = h00 < d22 ? h00 : d22;
  return convex < step ? convex : step;
}

/* Loops over the lanes one after another, because each is a long chain of dependent operations: the processor overlaps
 * the chains of a short loop's turns. */
SIMD_CLONES static void fit_block(block *b)
{
  for (int k = 0; k < LANES; k++) {
    double scale = 0;
    for (int e = 0; e < 9; e++) {
      double const size = fabs(b->matrix[e][k]);
      scale = scale > size ? scale : size;
    }
    b->scale[k] = scale;
    double const inverse = 1 / scale;
    double m[9];
    for (int e = 0; e < 9; e++) {
      m[e] = b->matrix[e][k] * inverse;
      b->scaled[e][k] = m[e];
    }
    quartic const p = characteristic(m);
    b->norm2[k] = p.norm2;
    b->determinant8[k] = p.determinant8;
    b->adjugate4[k] = p.adjugate4;
    b->root[k] = root_bound(p);
  }
  for (int step = 0; step < NEWTON_STEPS; step++) {
    for (int k = 0; k < LANES; k++) {
      quartic const p = {b->norm2[k], b->determinant8[k], b->adjugate4[k]};
      b->root[k] = root_step(p, b->root[k]);
    }
  }
  for (int k = 0; k < LANES; k++) {
    double m[9], q[4];
    for (int e = 0; e < 9; e++) {
      m[e] = b->scaled[e][k];
    }
    eigenvector(m, b->root[k], q);
    double const length = 1 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int e = 0; e < 4; e++) {
      b->quaternion[e][k] = q[e] * length;
    }
  }
  for (int k = 0; k < LANES; k++) {
    double m[9], q[4], r[9];
    for (int e = 0; e < 9; e++) {
      m[e] = b->scaled[e][k];
    }
    for (int e = 0; e < 4; e++) {
      q[e] = b->quaternion[e][k];
    }
    double const good = polish(m, q, r);
    /* Comparisons with NaN are false, so that a lane that broke down anywhere above is not trusted. */
    double const room = b->scale[k] < SCALE_MAX ? b->scale[k] - SCALE_MIN : -1;
    b->trusted[k] = good < room ? good : room;
    for (int e = 0; e < 9; e++) {
      b->rotation[e][k] = r[e];
    }
  }
}

/* Eigenvalues on the diagonal of `k` and eigenvectors in the columns of `v` of a symmetric 4x4 matrix: cyclic Jacobi.
 */
static void jacobi4(double k[4][4], double v[4][4])
{
  memset(v, 0, 16 * sizeof(double));
  for (int i = 0; i < 4; i++) {
    v[i][i] = 1;
  }
  for (int sweep = 0; sweep < JACOBI_SWEEPS; sweep++) {
    int turned = 0;
    for (int p = 0; p < 3; p++) {
      for (int q = p + 1; q < 4; q++) {
        if (fabs(k[p][q]) <= DBL_EPSILON * 0.01) {
          continue; /* the matrix is scaled to entries of about one */
        }
        turned = 1;
        double const theta = (k[q][q] - k[p][p]) / (2 * k[p][q]);
        double const t = (theta >= 0 ? 1 : -1) / (fabs(theta) + sqrt(1 + theta * theta));
        double const c = 1 / sqrt(1 + t * t), s = c * t;
        for (int i = 0; i < 4; i++) {
          double const kip = k[i][p], kiq = k[i][q];
          k[i][p] = c * kip - s * kiq;
          k[i][q] = s * kip + c * kiq;
        }
        for (int i = 0; i < 4; i++) {
          double const kpi = k[p][i], kqi = k[q][i], vip = v[i][p], viq = v[i][q];
          k[p][i] = c * kpi - s * kqi;
          k[q][i] = s * kpi + c * kqi;
          v[i][p] = c * vip - s * viq;
          v[i][q] = s * vip + c * viq;
        }
      }
    }
    if (!turned) {
      break;
    }
  }
}

/* Among the quaternions spanned by the chosen columns, the one of smallest turn: the identity's projection. Where all
 * of them are half turns, the projection of the first axis that is not orthogonal to them. */
static void smallest_turn(double v[4][4], const int chosen[4], double q[4])
{
  for (int target = 0; target < 4; target++) {
    double length2 = 0;
    for (int i = 0; i < 4; i++) {
      q[i] = 0;
      for (int c = 0; c < 4; c++) {
        q[i] += chosen[c] ? v[i][c] * v[target][c] : 0;
      }
      length2 += q[i] * q[i];
    }
    if (length2 > 1e-8) {
      for (int i = 0; i < 4; i++) {
        q[i] /= sqrt(length2);
      }
      return;
    }
  }
}

/* The careful route for one matrix. */
static void fit_one(const double matrix[9], double rotation[9])
{
  double m[9], scale = 0;
  double q[4] = {1, 0, 0, 0};
  for (int e = 0; e < 9; e++) {
    if (!isfinite(matrix[e])) {
      scale = 0;
      break;
    }
    scale = fmax(scale, fabs(matrix[e]));
  }
  if (scale > 0) {
    int exponent;
    frexp(scale, &exponent);
    for (int e = 0; e < 9; e++) {
      m[e] = ldexp(matrix[e], -exponent);
    }
    double const kwx = m[7] - m[5], kwy = m[2] - m[6], kwz = m[3] - m[1];
    double const kxy = m[1] + m[3], kxz = m[2] + m[6], kyz = m[5] + m[7];
    double k[4][4] = {{m[0] + m[4] + m[8], kwx, kwy, kwz},
                      {kwx, m[0] - m[4] - m[8], kxy, kxz},
                      {kwy, kxy, m[4] - m[0] - m[8], kyz},
                      {kwz, kxz, kyz, m[8] - m[0] - m[4]}};
    double v[4][4];
    jacobi4(k, v);
    double const top = fmax(fmax(k[0][0], k[1][1]), fmax(k[2][2], k[3][3]));
    int chosen[4];
    for (int c = 0; c < 4; c++) {
      chosen[c] = k[c][c] >= top * (1 - DEGENERATE_GAP);
    }
    smallest_turn(v, chosen, q);
  }
  double const length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  quaternion_rotation(q[0] / length, q[1] / length, q[2] / length, q[3] / length, rotation);
}

void rotation_fit3(size_t count, const double *matrices, double *rotations)
{
  block b;
  for (size_t first = 0; first < count; first += LANES) {
    size_t const lanes = count - first < LANES ? count - first : LANES;
    double const *source = matrices + 9 * first;
    double *target = rotations + 9 * first;
    for (size_t k = 0; k < LANES; k++) {
      double const *from = source + 9 * (k < lanes ? k : 0);
      for (size_t e = 0; e < 9; e++) {
        b.matrix[e][k] = from[e];
      }
    }
    fit_block(&b);
    for (size_t k = 0; k < lanes; k++) {
      if (b.trusted[k] > 0) {
        for (size_t e = 0; e < 9; e++) {
          target[9 * k + e] = b.rotation[e][k];
        }
      } else {
        double m[9];
        for (size_t e = 0; e < 9; e++) {
          m[e] = b.matrix[e][k];
        }
        fit_one(m, target + 9 * k);
      }
    }
  }
}

void rotation_fit2(size_t count, const double *matrices, double *rotations)
{
  for (size_t k = 0; k < count; k++) {
    double const *m = matrices + 4 * k;
    double *r = rotations + 4 * k;
    double const scale = fmax(fmax(fabs(m[0]), fabs(m[1])), fmax(fabs(m[2]), fabs(m[3])));
    double cosine = 1, sine = 0;
    if (scale > 0 && isfinite(m[0]) && isfinite(m[1]) && isfinite(m[2]) && isfinite(m[3])) {
      /* Sums stay finite, and keep their digits; hypot is safe at every scale. */
      double const factor = scale < SCALE_MIN ? 0x1p300 : 0.25;
      double const c = factor * m[0] + factor * m[3], s = factor * m[2] - factor * m[1];
      double const length = hypot(c, s);
      if (length > DEGENERATE_GAP * factor * scale) {
        cosine = c / length;
        sine = s / length;
      }
    }
    r[0] = cosine;
    r[1] = -sine;
    r[2] = sine;
    r[3] = cosine;
  }
}

void rotation_fit(size_t dimension, size_t count, const double *matrices, double *rotations)
{
  if (dimension == 3) {
    rotation_fit3(count, matrices, rotations);
  } else {
    rotation_fit2(count, matrices, rotations);
  }
}
