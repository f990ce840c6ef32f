/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The elastic net [Zou and Hastie, "Regularization and variable selection via the elastic net", 2005],
 *
 *     minimise  1/2 |A x - y|^2 + 1/2 sum_j ridge_j x_j^2 + sum_j lasso_j |x_j|,
 *
 * by cyclic coordinate descent on the Gram matrix, along a path of falling lasso with warm starts [Friedman, Hastie and
 * Tibshirani, "Regularization paths for generalized linear models via coordinate descent", 2010]. */
#ifndef EXM_NUMERIC_ELASTIC_NET_H
#define EXM_NUMERIC_ELASTIC_NET_H

#include <stddef.h>

typedef struct elastic_net {
  size_t count;        /* unknowns */
  const double *gram;  /* [count][count] A'A without the ridge */
  const double *ridge; /* [count] >= 0 */
  const double *lasso; /* [count] >= 0 */
  size_t path_count;   /* steps of the path, at least 1 */
  size_t sweep_limit;  /* through all unknowns, a step */
  double tolerance;    /* of the optimality conditions, relative to the largest |A'y| */
} elastic_net;

/**
 * product  [count] A'y
 * x        [count] out: from zero, so that the result depends on the problem alone
 * scratch  [count]
 *
 * Unknowns that nothing depends on (zero column and ridge) stay 0. Returns by how much the optimality conditions are
 * violated at the end, relative to the largest |A'y|.
 */
double elastic_net_solve(const elastic_net *net, const double *product, double *scratch, double *x);

#endif
