/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Greedy choice of sites [SEQ, 3.2.2]. Every step adds one function to the space, so one column to a QR factorisation
 * and one term to the residual; nothing is fitted anew. The function that a site adds is phi around it plus the
 * combination of phi around the sites before that meets the side conditions with the smallest coefficients. */
#include "numeric/thin_plate.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/* Share of a column that must be new, or it is taken for a combination of the others. */
static double const SMALLEST_NEW = 1e-11;

/* Share of a site's row (1, x, y) that must be new for it to count as a new direction. */
static double const SMALLEST_DIRECTION = 1e-6;

typedef struct fitting {
  const thin_plate_request *request;
  double (*points)[2]; /* [n] scaled */
  double *kernel;      /* [n][n] phi between points */
  uint32_t *order;
  size_t site_count;
  uint8_t *is_passed; /* [n] chosen or passed over */
  /* The rows (1, x, y) of the sites: an orthonormal basis of what they span, and their Gram matrix in it. */
  double directions[3][3], gram[3][3];
  size_t direction_count;
  /* The space of splines as columns of values at the points: polynomials, then one a site from the fourth on. */
  size_t column_count, polynomial_count;
  double *columns;      /* [columns][n] orthonormal */
  double *triangle;     /* [columns][columns] column j holds R's, rows 0 .. j */
  double *combinations; /* [columns][l] coefficients of phi around the sites, or of the polynomials in the first ones */
  double *projections;  /* [columns][m] columns' values */
  double *residual;     /* [n][m] */
  double *candidate;    /* [n] */
  size_t capacity;      /* of columns */
} fitting;

/* --------------------------------------------------------------------------------------------------------- columns */

/** Append the column in f->candidate; its combination is in place. 0 where it is nothing new. */
static int append_column(fitting *f)
{
  size_t const n = f->request->point_count, m = f->request->value_count, c = f->column_count;
  double *column = f->candidate, *coefficients = f->triangle + c * f->capacity;
  double const before = sqrt(dense_dot(n, column, column));
  double length = before;
  memset(coefficients, 0, f->capacity * sizeof(double));
  for (int pass = 0; pass < 2; pass++) { /* Gram and Schmidt, again only where the first pass cancelled digits */
    double const last = length;
    for (size_t j = 0; j < c; j++) {
      double const share = dense_dot(n, f->columns + j * n, column);
      coefficients[j] += share;
      dense_axpy(n, -share, f->columns + j * n, column);
    }
    length = sqrt(dense_dot(n, column, column));
    if (length > 0.5 * last) {
      break;
    }
  }
  if (!(length > SMALLEST_NEW * before)) {
    return 0;
  }
  coefficients[c] = length;
  double *kept = f->columns + c * n, *projection = f->projections + c * m;
  memset(projection, 0, m * sizeof(double));
  for (size_t i = 0; i < n; i++) {
    kept[i] = column[i] / length;
    dense_axpy(m, kept[i], f->residual + i * m, projection);
  }
  for (size_t i = 0; i < n; i++) {
    dense_axpy(m, -kept[i], projection, f->residual + i * m);
  }
  f->column_count++;
  return 1;
}

static double weight_of(const fitting *f, size_t i)
{
  return f->request->weights ? f->request->weights[i] : 1;
}

static void append_polynomials(fitting *f)
{
  for (size_t k = 0; k < 3; k++) {
    for (size_t i = 0; i < f->request->point_count; i++) {
      f->candidate[i] = weight_of(f, i) * (k == 0 ? 1 : f->points[i][k - 1]);
    }
    memset(f->combinations + f->column_count * f->capacity, 0, f->capacity * sizeof(double));
    f->combinations[f->column_count * f->capacity + k] = 1;
    append_column(f); /* not a new one where the points lie on a line or in one place */
  }
  f->polynomial_count = f->column_count;
}

/* ----------------------------------------------------------------------------------------------------------- sites */

/** Coordinates of a row (1, x, y) in the directions; what is left of it comes back in `rest`. Gives its share. */
static double split_row(const fitting *f, const double point[2], double inside[3], double rest[3])
{
  double const row[3] = {1, point[0], point[1]};
  memcpy(rest, row, sizeof row);
  for (size_t a = 0; a < f->direction_count; a++) {
    inside[a] = dense_dot(3, f->directions[a], rest);
    dense_axpy(3, -inside[a], f->directions[a], rest);
  }
  return sqrt(dense_dot(3, rest, rest) / dense_dot(3, row, row));
}

static void add_row(fitting *f, const double point[2])
{
  double inside[3] = {0}, rest[3];
  if (split_row(f, point, inside, rest) > SMALLEST_DIRECTION) {
    double const length = sqrt(dense_dot(3, rest, rest));
    for (size_t k = 0; k < 3; k++) {
      f->directions[f->direction_count][k] = rest[k] / length;
    }
    inside[f->direction_count++] = length;
  }
  for (size_t a = 0; a < f->direction_count; a++) {
    dense_axpy(f->direction_count, inside[a], inside, f->gram[a]);
  }
}

/** Coefficients of the sites so far that, with 1 at the new one, meet the side conditions; 0 where none can. */
static int find_combination(const fitting *f, const double point[2], double *coefficients)
{
  size_t const r = f->direction_count;
  double weights[3], rest[3], factor[9], inside[3], none[3];
  if (f->site_count == 0 || split_row(f, point, weights, rest) > SMALLEST_DIRECTION) {
    return 0;
  }
  for (size_t a = 0; a < r; a++) {
    memcpy(factor + a * r, f->gram[a], r * sizeof(double));
  }
  if (!dense_cholesky(r, factor)) {
    return 0;
  }
  dense_cholesky_forward(r, factor, weights);
  dense_cholesky_backward(r, factor, weights);
  for (size_t j = 0; j < f->site_count; j++) {
    (void)split_row(f, f->points[f->order[j]], inside, none);
    coefficients[j] = -dense_dot(r, inside, weights);
  }
  coefficients[f->site_count] = 1;
  return 1;
}

/** Take point i for a site; one that adds nothing is passed over. */
static void take_site(fitting *f, size_t i)
{
  size_t const n = f->request->point_count;
  double *coefficients = f->combinations + f->column_count * f->capacity;
  f->is_passed[i] = 1;
  for (size_t j = 0; j < f->site_count; j++) { /* one at the place of another is none */
    const double *other = f->points[f->order[j]];
    if (f->points[i][0] == other[0] && f->points[i][1] == other[1]) {
      return;
    }
  }
  memset(coefficients, 0, f->capacity * sizeof(double));
  if (find_combination(f, f->points[i], coefficients)) {
    memset(f->candidate, 0, n * sizeof(double));
    f->order[f->site_count] = (uint32_t)i;
    for (size_t j = 0; j <= f->site_count; j++) {
      dense_axpy(n, coefficients[j], f->kernel + f->order[j] * n, f->candidate);
    }
    for (size_t j = 0; j < n && f->request->weights; j++) {
      f->candidate[j] *= f->request->weights[j];
    }
    if (!append_column(f)) {
      return;
    }
  }
  f->order[f->site_count++] = (uint32_t)i;
  add_row(f, f->points[i]);
}

static double squared_row(const double *row, size_t first, size_t m)
{
  return first < m ? dense_dot(m - first, row + first, row + first) : 0;
}

/** The point not passed yet with the largest row of `rows` from column `first` on; n where there is none. */
static size_t furthest(const fitting *f, const double *rows, size_t first)
{
  size_t const n = f->request->point_count, m = f->request->value_count;
  size_t found = n;
  double most = -1;
  for (size_t i = 0; i < n; i++) {
    double const length = f->is_passed[i] ? -1 : squared_row(rows + i * m, first, m);
    if (length > most) {
      most = length;
      found = i;
    }
  }
  return found;
}

static double squared_residual(const fitting *f)
{
  size_t const count = f->request->point_count * f->request->value_count;
  return dense_dot(count, f->residual, f->residual);
}

static exm_status choose_sites(fitting *f, const progress *report)
{
  const thin_plate_request *request = f->request;
  size_t const n = request->point_count;
  size_t const most = request->site_count ? request->site_count : n;
  while (f->site_count < most) {
    if (request->site_count == 0 && f->site_count >= 3 && squared_residual(f) <= request->limit) {
      break;
    }
    TRY(progress_report(report, (double)f->site_count / (double)most, "choosing sites"));
    /* Four that are furthest from the best-fit plane of the values, then by the residual. */
    size_t const next = f->site_count < 4 ? furthest(f, request->values, 2) : furthest(f, f->residual, 0);
    if (next == n) {
      break;
    }
    take_site(f, next);
  }
  return EXM_OK;
}

/* ---------------------------------------------------------------------------------------------------- coefficients */

/** Add the spline whose column projections are given to the coefficients [l + 3][m]. projections: destroyed. */
static void add_solution(const fitting *f, double *projections, double *coefficients)
{
  size_t const m = f->request->value_count;
  for (size_t c = f->column_count; c-- > 0;) {
    const double *column = f->triangle + c * f->capacity;
    double *solved = projections + c * m;
    for (size_t k = 0; k < m; k++) {
      solved[k] /= column[c];
    }
    for (size_t j = 0; j < c; j++) {
      dense_axpy(m, -column[j], solved, projections + j * m);
    }
  }
  for (size_t c = 0; c < f->column_count; c++) {
    const double *combination = f->combinations + c * f->capacity;
    size_t const count = c < f->polynomial_count ? 3 : f->site_count;
    double *to = coefficients + (c < f->polynomial_count ? f->site_count * m : 0);
    for (size_t j = 0; j < count; j++) {
      if (combination[j] != 0) {
        dense_axpy(m, combination[j], projections + c * m, to + j * m);
      }
    }
  }
}

static void weigh_residual(fitting *f)
{
  size_t const m = f->request->value_count;
  for (size_t i = 0; i < f->request->point_count * m && f->request->weights; i++) {
    f->residual[i] *= f->request->weights[i / m];
  }
}

/** f->residual = values - g(points), from the coefficients: with the rounding that they will have in use. */
static void measure_residual(fitting *f, const double *coefficients)
{
  size_t const n = f->request->point_count, m = f->request->value_count, l = f->site_count;
  const double *polynomial = coefficients + l * m;
  memcpy(f->residual, f->request->values, n * m * sizeof(double));
  for (size_t i = 0; i < n; i++) {
    double *row = f->residual + i * m;
    for (size_t j = 0; j < l; j++) {
      dense_axpy(m, -f->kernel[f->order[j] * n + i], coefficients + j * m, row);
    }
    dense_axpy(m, -1, polynomial, row);
    dense_axpy(m, -f->points[i][0], polynomial + m, row);
    dense_axpy(m, -f->points[i][1], polynomial + 2 * m, row);
  }
  weigh_residual(f);
}

/** Solve, and once more for what rounding left: sites close to each other make large coefficients. */
static void find_coefficients(fitting *f, double *coefficients)
{
  size_t const n = f->request->point_count, m = f->request->value_count;
  add_solution(f, f->projections, coefficients);
  measure_residual(f, coefficients);
  for (size_t c = 0; c < f->column_count; c++) {
    double *projection = f->projections + c * m;
    memset(projection, 0, m * sizeof(double));
    for (size_t i = 0; i < n; i++) {
      dense_axpy(m, f->columns[c * n + i], f->residual + i * m, projection);
    }
  }
  add_solution(f, f->projections, coefficients);
  measure_residual(f, coefficients);
}

/* ------------------------------------------------------------------------------------------------------------ doors */

static void scale_points(const thin_plate_request *request, thin_plate *plate, double (*points)[2])
{
  size_t const n = request->point_count;
  double spread = 0;
  for (size_t i = 0; i < n; i++) {
    plate->centre[0] += request->points[i][0] / (double)n;
    plate->centre[1] += request->points[i][1] / (double)n;
  }
  for (size_t i = 0; i < n; i++) {
    double const dx = request->points[i][0] - plate->centre[0], dy = request->points[i][1] - plate->centre[1];
    spread = fmax(spread, dx * dx + dy * dy);
  }
  plate->scale = spread > 0 ? 1 / sqrt(spread) : 1;
  for (size_t i = 0; i < n; i++) {
    points[i][0] = (request->points[i][0] - plate->centre[0]) * plate->scale;
    points[i][1] = (request->points[i][1] - plate->centre[1]) * plate->scale;
  }
}

static exm_status prepare(arena *scratch, const thin_plate_request *request, fitting *f)
{
  size_t const n = request->point_count, m = request->value_count;
  size_t const most = (request->site_count ? request->site_count : n) + 3;
  f->request = request;
  f->capacity = most;
  f->points = arena_array(scratch, n, sizeof *f->points);
  f->kernel = ARENA_NEW(scratch, double, n *n);
  f->is_passed = ARENA_NEW(scratch, uint8_t, n);
  f->columns = ARENA_NEW(scratch, double, most *n);
  f->triangle = ARENA_NEW(scratch, double, most *most);
  f->combinations = ARENA_NEW(scratch, double, (most + 1) * most);
  f->projections = ARENA_NEW(scratch, double, most *m);
  f->residual = ARENA_NEW(scratch, double, n *m);
  f->candidate = ARENA_NEW(scratch, double, n);
  if (!f->points || !f->kernel || !f->is_passed || !f->columns || !f->triangle || !f->combinations || !f->projections ||
      !f->residual || !f->candidate) {
    return status_no_memory("the pose signal");
  }
  memcpy(f->residual, request->values, n * m * sizeof(double));
  return EXM_OK;
}

static void fill_kernel(fitting *f)
{
  size_t const n = f->request->point_count;
  for (size_t i = 0; i < n; i++) {
    for (size_t j = 0; j < i; j++) {
      double const dx = f->points[i][0] - f->points[j][0], dy = f->points[i][1] - f->points[j][1];
      f->kernel[i * n + j] = f->kernel[j * n + i] = thin_plate_basis(dx * dx + dy * dy);
    }
  }
}

static exm_status fit(arena *owner, arena *scratch, const thin_plate_request *request, const progress *report,
                      fitting *f, thin_plate *plate)
{
  TRY(prepare(scratch, request, f));
  scale_points(request, plate, f->points);
  fill_kernel(f);
  weigh_residual(f);
  append_polynomials(f);
  TRY(choose_sites(f, report));
  plate->site_count = f->site_count;
  plate->value_count = request->value_count;
  plate->sites = arena_array(owner, f->site_count, sizeof *plate->sites);
  plate->coefficients = ARENA_NEW(owner, double, (f->site_count + 3) * request->value_count);
  if (!plate->sites || !plate->coefficients) {
    return status_no_memory("the pose signal");
  }
  for (size_t j = 0; j < f->site_count; j++) {
    memcpy(plate->sites[j], f->points[f->order[j]], sizeof *plate->sites);
  }
  find_coefficients(f, plate->coefficients);
  return EXM_OK;
}

exm_status thin_plate_fit(arena *owner, const thin_plate_request *request, const progress *report, thin_plate *plate,
                          double *residual)
{
  arena scratch = {0};
  fitting f = {.order = request->order};
  thin_plate found = {0};
  exm_status const status = fit(owner, &scratch, request, report, &f, &found);
  if (status >= 0) {
    *plate = found;
  }
  if (status >= 0 && residual) {
    *residual = squared_residual(&f);
  }
  arena_release(&scratch);
  return status;
}
