/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/elastic_net.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/* The path begins where all penalised unknowns are 0, and falls geometrically. */
static double path_begin(const elastic_net *net, const double *gradient)
{
  double most = 1;
  for (size_t j = 0; j < net->count; j++) {
    if (net->lasso[j] > 0) {
      most = fmax(most, fabs(gradient[j]) / net->lasso[j]);
    }
  }
  return most;
}

/* The best x_j with the others as they are; `gradient` is A'(y - A x) and follows. Returns the step. */
static double update(const elastic_net *net, size_t j, double factor, double *gradient, double *x)
{
  const double *column = net->gram + j * net->count;
  double const curvature = column[j] + net->ridge[j];
  if (!(curvature > 0)) {
    return 0;
  }
  double const pull = gradient[j] + column[j] * x[j], lasso = factor * net->lasso[j];
  double const next = fabs(pull) <= lasso ? 0 : (pull - copysign(lasso, pull)) / curvature;
  double const step = next - x[j];
  if (step != 0) {
    x[j] = next;
    dense_axpy(net->count, -step, column, gradient);
  }
  return fabs(step) * curvature;
}

/* Over all unknowns, or over those in use. Returns the largest change of a gradient. */
static double sweep(const elastic_net *net, double factor, int only_used, double *gradient, double *x)
{
  double most = 0;
  for (size_t j = 0; j < net->count; j++) {
    if (!only_used || x[j] != 0) {
      most = fmax(most, update(net, j, factor, gradient, x));
    }
  }
  return most;
}

/* One step of the path: unknowns in use until they settle, then all of them for newcomers. */
static void descend(const elastic_net *net, double factor, double limit, double *gradient, double *x)
{
  size_t sweeps = 0;
  while (sweeps++ < net->sweep_limit && sweep(net, factor, 0, gradient, x) > limit) {
    while (sweeps++ < net->sweep_limit && sweep(net, factor, 1, gradient, x) > limit) {
    }
  }
}

/* Subgradient conditions: the residual's correlation equals ridge x + lasso sign x, or is below lasso where x is 0. */
static double violation(const elastic_net *net, const double *gradient, const double *x)
{
  double most = 0;
  for (size_t j = 0; j < net->count; j++) {
    double const smooth = gradient[j] - net->ridge[j] * x[j];
    double const wrong =
        x[j] != 0 ? fabs(smooth - copysign(net->lasso[j], x[j])) : fmax(fabs(smooth) - net->lasso[j], 0);
    most = fmax(most, net->gram[j * net->count + j] + net->ridge[j] > 0 ? wrong : 0);
  }
  return most;
}

double elastic_net_solve(const elastic_net *net, const double *product, double *gradient, double *x)
{
  double size = 0;
  memcpy(gradient, product, net->count * sizeof(double));
  memset(x, 0, net->count * sizeof(double));
  for (size_t j = 0; j < net->count; j++) {
    size = fmax(size, fabs(product[j]));
  }
  if (!(size > 0)) {
    return 0;
  }
  double const limit = net->tolerance * size, ratio = path_begin(net, gradient);
  for (size_t step = 1; step <= net->path_count; step++) {
    double const left = (double)(net->path_count - step) / (double)net->path_count;
    descend(net, pow(ratio, left), limit, gradient, x);
  }
  return violation(net, gradient, x) / size;
}
