/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Between solved poses [Blended, 5, "Shape interpolation"]: rotations are interpolated, and one global step gives the
 * pose.
 *
 * Rotations alone do not give a key's pose back, for its constraints pulled as well: what they leave, the rest of its
 * coefficients, is interpolated along. The pose as a whole turns about its own middle: its mean rotation, centroid and
 * scale have curves of their own. Curves are cubic with the tangents of finite differences, so the motion is smooth
 * over the whole list. Where two keys were posed from different exemplars, each exemplar's curve passes through both,
 * and the one is faded into the other. */
#include "deform/blended/interpolate.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"
#include "linalg/quaternion.h"
#include "linalg/rotation.h"

/* A key: frame, exemplar, u of the last stage. */
enum { KEY_TURN = 0, KEY_SHIFT = 9, KEY_SCALE = 12, KEY_EXEMPLAR = 13, KEY_HEAD = 14 };

size_t blended_key_size(const blended *b)
{
  return KEY_HEAD + b->bases[BLENDED_LAST].rank * b->dimension;
}

void blended_get_key(const blended *b, double *key)
{
  memset(key, 0, blended_key_size(b) * sizeof(double));
  memcpy(key + KEY_TURN, b->frame.turn, sizeof b->frame.turn);
  memcpy(key + KEY_SHIFT, b->frame.shift, sizeof b->frame.shift);
  key[KEY_SCALE] = b->frame.scale;
  key[KEY_EXEMPLAR] = (double)b->exemplar;
  memcpy(key + KEY_HEAD, b->u, b->bases[BLENDED_LAST].rank * b->dimension * sizeof(double));
}

/** Four keys around a moment, the middle two enclosing it; ends repeat. */
typedef struct moment {
  const double *keys[4];
  double times[4];
  double u;       /* 0..1 between the middle two */
  int has_end[2]; /* is there a key before, a key after */
} moment;

static moment find_moment(const blended *b, const double *keys, const double *times, size_t count, double time)
{
  size_t const size = blended_key_size(b);
  size_t i = 0;
  while (i + 2 < count && time >= times[i + 1]) {
    i++;
  }
  size_t const j = i + 1 < count ? i + 1 : i;
  size_t const places[4] = {i > 0 ? i - 1 : i, i, j, j + 1 < count ? j + 1 : j};
  double const length = times[j] - times[i];
  moment m = {.u = length > 0 ? fmin(fmax((time - times[i]) / length, 0), 1) : 0,
              .has_end = {places[0]<i, places[3]> j}};
  for (int k = 0; k < 4; k++) {
    m.keys[k] = keys + places[k] * size;
    m.times[k] = times[places[k]];
  }
  return m;
}

/** Velocity, per unit of u, at an end (0 or 1) of the middle interval from the steps there and beyond: the parabola
 *  through three keys; at the list's ends the step itself. */
static double tangent(const moment *m, int end, double step, double beyond)
{
  double const length = m->times[2] - m->times[1];
  double const other = end == 0 ? m->times[1] - m->times[0] : m->times[3] - m->times[2];
  return m->has_end[end] ? (step * other + beyond * length * length / other) / (length + other) : step;
}

/** The cubic through values at the four keys. */
static double curve(const moment *m, const double values[4])
{
  double const u = m->u, step = values[2] - values[1];
  double const leaving = tangent(m, 0, step, values[1] - values[0]);
  double const arriving = tangent(m, 1, step, values[3] - values[2]);
  return values[1] + u * leaving + u * u * ((3 * step - 2 * leaving - arriving) + u * (leaving + arriving - 2 * step));
}

/** The same for rotations [d][d] at the four keys. */
static void curve_of_rotations(const moment *m, size_t d, const double *const rotations[4], double *out)
{
  double q[4][4], steps[3][3], leaving[3], arriving[3], found[4], full[9];
  for (int k = 0; k < 4; k++) {
    double whole[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (size_t i = 0; i < d; i++) {
      memcpy(whole + 3 * i, rotations[k] + d * i, d * sizeof(double));
    }
    quaternion_from_rotation(whole, q[k]);
  }
  for (int k = 0; k < 3; k++) {
    quaternion_turn(q[k], q[k + 1], steps[k]);
  }
  for (int k = 0; k < 3; k++) {
    leaving[k] = tangent(m, 0, steps[1][k], steps[0][k]);
    arriving[k] = tangent(m, 1, steps[1][k], steps[2][k]);
  }
  quaternion_curve(q[1], leaving, arriving, q[2], m->u, found);
  quaternion_to_rotation(found, full);
  for (size_t i = 0; i < d; i++) {
    memcpy(out + d * i, full + 3 * i, d * sizeof(double));
  }
}

/** A key as curves want it: seen from its own mean rotation and centroid. */
typedef struct posture {
  double turn[9];     /* of the pose as a whole, in the space */
  double centroid[3]; /* in the space */
  double scale;       /* logarithm */
  double *u;          /* [rank][d] about the centroid, turned upright */
} posture;

typedef struct mixer {
  const blended *b;
  const double *mean; /* [rank] the centroid of a pose is mean' u */
  const double *unit; /* [rank] u of the constant 1 */
  moment at;
  posture postures[4];
  double *rotations[4]; /* [G d][d] of one exemplar at the keys, transposed */
  double *rest[4];      /* [rank][d] what they leave */
  double *mixed;        /* [G d][d] */
  double *reached;      /* [rank][d] */
  double *scratch;      /* [rank][d] */
} mixer;

/** The rotation that fits all of a pose's clusters best, by their energies: from K u of one exemplar. */
static void mean_rotation(const blended *b, size_t exemplar, const double *u, double *scratch, double *turn)
{
  const blended_basis *basis = &b->bases[BLENDED_LAST];
  size_t const d = b->dimension, rows = b->group_count * d;
  double sum[9] = {0};
  dense_times(rows, basis->rank, d, basis->proxies + exemplar * rows * basis->rank, u, scratch);
  for (size_t g = 0; g < b->group_count; g++) {
    dense_axpy(d * d, 1, scratch + g * d * d, sum);
  }
  rotation_fit(d, 1, sum, turn); /* transposed, as all of them */
}

static void set_posture(const mixer *x, const double *key, double *scratch, posture *out)
{
  const blended *b = x->b;
  size_t const d = b->dimension, rank = b->bases[BLENDED_LAST].rank;
  double upright[9], middle[3] = {0}, moved[3];
  const double *u = key + KEY_HEAD;
  mean_rotation(b, 0, u, scratch, upright);
  dense_times(1, rank, d, x->mean, u, middle);
  for (size_t i = 0; i < rank; i++) {
    double own[3];
    memcpy(own, u + i * d, d * sizeof(double));
    dense_axpy(d, -x->unit[i], middle, own);
    dense_times(d, d, 1, upright, own, out->u + i * d);
  }
  /* The whole turn is turn upright', with rows of u as vectors: v = turn (upright' v_upright). */
  for (size_t i = 0; i < d; i++) {
    for (size_t j = 0; j < d; j++) {
      out->turn[i * d + j] = 0;
      for (size_t k = 0; k < d; k++) {
        out->turn[i * d + j] += key[KEY_TURN + i * d + k] * upright[j * d + k];
      }
    }
  }
  dense_times(d, d, 1, key + KEY_TURN, middle, moved);
  for (size_t k = 0; k < d; k++) {
    out->centroid[k] = key[KEY_SHIFT + k] + key[KEY_SCALE] * moved[k];
  }
  out->scale = log(key[KEY_SCALE]);
}

/** out = alpha Gamma^-1 K'R without constraints, for one exemplar. */
static void global_step(const mixer *x, size_t exemplar, double alpha, const double *rotations, double *out)
{
  const blended *b = x->b;
  const blended_basis *basis = &b->bases[BLENDED_LAST];
  size_t const d = b->dimension, rank = basis->rank, rows = b->group_count * d;
  dense_times_transposed(rows, rank, d, basis->proxies + exemplar * rows * rank, rank, rotations, out);
  dense_times_transposed(rank, rank, d, b->held.free_root, rank, out, x->scratch);
  dense_times(rank, rank, d, b->held.free_root, x->scratch, out);
  for (size_t i = 0; i < rank * d; i++) {
    out[i] *= alpha;
  }
}

/** One exemplar's curve through the four keys, at the moment: out [rank][d]. */
static void follow(const mixer *x, size_t exemplar, double *out)
{
  const blended *b = x->b;
  const blended_basis *basis = &b->bases[BLENDED_LAST];
  size_t const d = b->dimension, rank = basis->rank, rows = b->group_count * d;
  double alpha[4];
  for (int k = 0; k < 4; k++) {
    double *R = x->rotations[k];
    dense_times(rows, rank, d, basis->proxies + exemplar * rows * rank, x->postures[k].u, x->mixed);
    rotation_fit(d, b->group_count, x->mixed, R);
    alpha[k] = dense_dot(rows * d, R, x->mixed) / b->energy->own[exemplar];
    global_step(x, exemplar, alpha[k], R, x->reached);
    for (size_t i = 0; i < rank * d; i++) {
      x->rest[k][i] = x->postures[k].u[i] - x->reached[i];
    }
  }
  for (size_t g = 0; g < b->group_count; g++) {
    const double *const own[4] = {x->rotations[0] + g * d * d, x->rotations[1] + g * d * d, x->rotations[2] + g * d * d,
                                  x->rotations[3] + g * d * d};
    curve_of_rotations(&x->at, d, own, x->mixed + g * d * d);
  }
  global_step(x, exemplar, curve(&x->at, alpha), x->mixed, out);
  for (size_t i = 0; i < rank * d; i++) {
    double const values[4] = {x->rest[0][i], x->rest[1][i], x->rest[2][i], x->rest[3][i]};
    out[i] += curve(&x->at, values);
  }
}

/** Frame and coefficients of the moment into the solver. */
static void finish(const mixer *x, const double *u, blended *b)
{
  const blended_basis *basis = &b->bases[BLENDED_LAST];
  size_t const d = b->dimension;
  const posture *p = x->postures;
  const double *const turns[4] = {p[0].turn, p[1].turn, p[2].turn, p[3].turn};
  double const scales[4] = {p[0].scale, p[1].scale, p[2].scale, p[3].scale};
  curve_of_rotations(&x->at, d, turns, b->frame.turn);
  b->frame.scale = exp(curve(&x->at, scales));
  for (size_t k = 0; k < d; k++) {
    double const values[4] = {p[0].centroid[k], p[1].centroid[k], p[2].centroid[k], p[3].centroid[k]};
    b->frame.shift[k] = curve(&x->at, values);
  }
  memset(b->coefficients, 0, b->joint_count * d * sizeof(double));
  for (size_t i = 0; i < basis->atom_count; i++) {
    dense_times(1, basis->rank, d, basis->basis + i * basis->rank, u, b->coefficients + basis->atoms[i] * d);
  }
  b->has_solution = 0; /* rotations are not those of this pose: the next solve begins anew */
}

/** mean: of the basis functions; unit: the constant 1 in the basis. */
static void find_constant(const blended *b, double *mean, double *unit)
{
  const blended_basis *basis = &b->bases[BLENDED_LAST];
  size_t const n = basis->atom_count, rank = basis->rank, joint = b->joint_count;
  for (size_t i = 0; i < n; i++) {
    dense_axpy(rank, b->energy->masses[basis->atoms[i] * joint], basis->basis + i * rank, mean);
  }
  /* The basis is orthonormal in D'LD + D'MD, and constants have no elastic energy: <1, basis> is <1, basis>_M. */
  memcpy(unit, mean, rank * sizeof(double));
}

static exm_status allocate(arena *scratch, const blended *b, mixer *x, double **out)
{
  size_t const d = b->dimension, rank = b->bases[BLENDED_LAST].rank, rows = b->group_count * d;
  double *mean = ARENA_NEW(scratch, double, rank), *unit = ARENA_NEW(scratch, double, rank);
  x->mixed = ARENA_NEW(scratch, double, rows *d);
  x->reached = ARENA_NEW(scratch, double, rank *d);
  x->scratch = ARENA_NEW(scratch, double, rank *d);
  *out = ARENA_NEW(scratch, double, 2 * rank * d);
  int whole = mean && unit && x->mixed && x->reached && x->scratch && *out;
  for (int k = 0; k < 4; k++) {
    x->rotations[k] = ARENA_NEW(scratch, double, rows *d);
    x->rest[k] = ARENA_NEW(scratch, double, rank *d);
    x->postures[k].u = ARENA_NEW(scratch, double, rank *d);
    whole = whole && x->rotations[k] && x->rest[k] && x->postures[k].u;
  }
  if (!whole) {
    return status_no_memory("the interpolation");
  }
  find_constant(b, mean, unit);
  x->mean = mean;
  x->unit = unit;
  return EXM_OK;
}

exm_status blended_interpolate(blended *b, const double *keys, const double *times, size_t count, double time)
{
  arena scratch = {0};
  mixer x = {.b = b};
  double *out = NULL;
  exm_status const status = allocate(&scratch, b, &x, &out);
  if (status == EXM_OK) {
    size_t const size = b->bases[BLENDED_LAST].rank * b->dimension;
    x.at = find_moment(b, keys, times, count, time);
    for (int k = 0; k < 4; k++) {
      set_posture(&x, x.at.keys[k], x.mixed, &x.postures[k]);
    }
    size_t const from = (size_t)x.at.keys[1][KEY_EXEMPLAR], to = (size_t)x.at.keys[2][KEY_EXEMPLAR];
    follow(&x, from, out);
    if (to != from) {
      double const fade = x.at.u * x.at.u * (3 - 2 * x.at.u);
      follow(&x, to, out + size);
      for (size_t i = 0; i < size; i++) {
        out[i] += fade * (out[size + i] - out[i]);
      }
    }
    finish(&x, out, b);
  }
  arena_release(&scratch);
  return status;
}

int blended_key_is_valid(const blended *b, const double *key)
{
  for (size_t i = 0; i < blended_key_size(b); i++) {
    if (!isfinite(key[i])) {
      return 0;
    }
  }
  double const exemplar = key[KEY_EXEMPLAR];
  return key[KEY_SCALE] > 0 && exemplar >= 0 && exemplar < (double)b->exemplar_count && exemplar == floor(exemplar);
}
