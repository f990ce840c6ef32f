/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What is left of a mesh in the reduced solver, against the mesh itself: constraints, dictionary, edge groups, the
 * basis, the energy by proxies and its derivative through the rotations. */
#include "amrap_fixture.h"
#include "deform/amrap/deformer.h"
#include "linalg/dense.h"

/* ------------------------------------------------------------------------------------------------------ bound meshes
 */

/** What the deformer keeps to itself. */
static amrap_deformer *inside(const fixture *f)
{
  return (amrap_deformer *)f->deformer;
}

enum { CASES = 5 };

/* In space with few and with many exemplars (vertices then carry the proxies; handles' atoms are mixtures), in a tilted
 * plane, with groups of few vertices. */
static fixture *bound_case(int which)
{
  size_t const exemplars[CASES] = {3, 9, 3, 2, 13};
  int const is_planar = which == 2 || which == 4;
  fixture *f = is_planar ? fixture_grid(exemplars[which]) : fixture_bar(exemplars[which]);
  if (is_planar) {
    double tilt[3][3], offset[3] = {1, -2, 0.5};
    fixture_rotation(1, 2, 0.5, 0.9, tilt);
    fixture_move(f, (const double(*)[3])tilt, offset);
  }
  f->settings.edge_group_count = which == 3 ? 30 : 0;
  fixture_handle_near(f, EXM_HANDLE_PINNED, 0, 0, 0, 0);
  fixture_handle_near(f, EXM_HANDLE_ORIENTED, 1, 0.1, 0.1, 1);
  fixture_handle_near(f, EXM_HANDLE_PINNED, 0.45, 0.3, 0, 1);
  fixture_handle_near(f, EXM_HANDLE_FREE, 0.05, 0.3, 0.25, 0);
  if (!fixture_bind(f)) {
    exit(1);
  }
  test_about("case %d: %zu exemplars %s", which, f->exemplar_count, is_planar ? "in a plane" : "in space");
  return f;
}

static double *random_numbers(test_random *random, size_t count)
{
  double *numbers = test_array(count, sizeof *numbers);
  for (size_t i = 0; i < count; ++i) {
    numbers[i] = 2 * test_uniform(random) - 1;
  }
  return numbers;
}

static double norm2(size_t count, const double *x)
{
  return dense_dot(count, x, x);
}

/* A pose u under c, in every guise. */
typedef struct pose {
  double *u, *c, *y, *T, *positions; /* positions [V][d] in the coordinates of the space */
} pose;

static double *values_of(const dictionary *d, const double *T, size_t width)
{
  double *values = test_array(d->vertex_count * width, sizeof *values);
  double *atoms = test_array(1 + d->exemplar_count * d->dimension, sizeof *atoms);
  for (size_t v = 0; v < d->vertex_count; ++v) {
    for (size_t i = d->weight_offsets[v]; i < d->weight_offsets[v + 1]; ++i) {
      size_t const h = d->weight_handles[i], first = d->atom_offsets[h];
      dictionary_atoms(d, h, v, d->weight_values[i], atoms);
      for (size_t a = first; a < d->atom_offsets[h + 1]; ++a) {
        dense_axpy(width, atoms[a - first], T + a * width, values + v * width);
      }
    }
  }
  free(atoms);
  return values;
}

static double *scratch_of(const reduced_mesh *r)
{
  return test_array(reduced_scratch(r) * (r->exemplar_count * r->dimension + 1), sizeof(double));
}

static pose pose_of(const fixture *f, double *u, double *c)
{
  const reduced_mesh *r = &inside(f)->solver.reduced;
  size_t const d = r->dimension;
  pose p = {.u = u, .c = c, .y = test_array(r->shape_rows * d, sizeof(double))};
  double *scratch = scratch_of(r), *held = test_array(r->shape_rows * d, sizeof *held);
  reduced_to_shapes(r, d, u, scratch, p.y);
  reduced_hold(r, c, scratch, held);
  dense_axpy(r->shape_rows * d, 1, held, p.y);
  p.T = test_array(r->atom_count * d, sizeof(double));
  reduced_coefficients(r, u, c, scratch, p.T);
  if (r->carriers) {
    p.positions = test_array(r->atom_count * d, sizeof(double));
    memcpy(p.positions, p.T, r->atom_count * d * sizeof(double));
  } else {
    p.positions = values_of(&inside(f)->atoms, p.T, d);
  }
  free(scratch);
  free(held);
  return p;
}

static pose random_pose(const fixture *f, test_random *random)
{
  const reduced_mesh *r = &inside(f)->solver.reduced;
  return pose_of(f, random_numbers(random, r->rank * r->dimension),
                 random_numbers(random, r->constraint_count * r->dimension));
}

static void pose_free(pose *p)
{
  free(p->u);
  free(p->c);
  free(p->y);
  free(p->T);
  free(p->positions);
}

/* 1/2 sum over triangles, their corners' groups (a third each) and edges of c |edge - target edge|^2, where target
 * [G][V][d] are positions for each group; NULL: zeros. */
static double mesh_energy(const fixture *f, const double *positions, const double *targets)
{
  const mesh *m = f->reference;
  size_t const d = inside(f)->coordinates.dimension;
  double energy = 0;
  for (size_t t = 0; t < m->triangle_count; ++t) {
    for (size_t corner = 0; corner < 3; ++corner) {
      const double *target =
          targets ? targets + inside(f)->groups[m->triangles[t][corner]] * m->vertex_count * d : NULL;
      for (size_t i = 0; i < 3; ++i) {
        size_t const a = m->triangles[t][(i + 1) % 3], b = m->triangles[t][(i + 2) % 3];
        for (size_t k = 0; k < d; ++k) {
          double edge = positions[a * d + k] - positions[b * d + k];
          edge -= target ? target[a * d + k] - target[b * d + k] : 0;
          energy += m->cotangents[t][i] * edge * edge / 6;
        }
      }
    }
  }
  return energy;
}

/* What exemplars turned by a's rotations and blended by its weights are, group by group. */
static double *blended_positions(const fixture *f)
{
  const amrap *a = &inside(f)->solver;
  size_t const d = a->reduced.dimension, S = f->exemplar_count, V = f->vertex_count;
  double *out = test_array(a->reduced.group_count * V * d, sizeof *out);
  for (size_t g = 0; g < a->reduced.group_count; ++g) {
    for (size_t s = 0; s < S; ++s) {
      const double *rotation = a->rotations + (g * S + s) * d * d;
      for (size_t v = 0; v < V; ++v) {
        const double *x = inside(f)->atoms.exemplars + (v * S + s) * d;
        for (size_t j = 0; j < d; ++j) {
          dense_axpy(d, a->B[g * S + s] * x[j], rotation + j * d, out + (g * V + v) * d);
        }
      }
    }
  }
  return out;
}

/* -------------------------------------------------------------------------------------------------------- constraints
 */

static void check_affine(const fixture *f, const constraints *held, const space *s, test_random *random)
{
  size_t const d = s->dimension;
  double M[3][3], t[3], targets[FIXTURE_HANDLES * 12];
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      M[i][k] = (i == k) + 0.8 * (2 * test_uniform(random) - 1);
    }
    t[i] = 2 * test_uniform(random) - 1;
  }
  double *wanted = test_array(held->row_count * d, sizeof *wanted);
  for (size_t h = 0; h < f->handle_count; ++h) {
    for (size_t i = 0; i < 3; ++i) {
      targets[12 * h + 4 * i + 3] = t[i];
      for (size_t k = 0; k < 3; ++k) {
        targets[12 * h + 4 * i + k] = M[i][k];
        for (size_t j = f->offsets[h]; j < f->offsets[h + 1]; ++j) {
          targets[12 * h + 4 * i + 3] +=
              M[i][k] * f->reference->positions[f->vertices[j]][k] / (double)(f->offsets[h + 1] - f->offsets[h]);
        }
      }
    }
  }
  constraints_targets(held, s, targets, wanted);
  for (size_t i = 0; i < held->row_count; ++i) {
    double value[3] = {0};
    for (size_t j = 0; j < held->rows[i].term_count; ++j) {
      const double *x = f->reference->positions[held->rows[i].vertices[j]];
      double moved[3], coordinates[3];
      for (int k = 0; k < 3; ++k) {
        moved[k] = M[k][0] * x[0] + M[k][1] * x[1] + M[k][2] * x[2] + t[k];
      }
      space_from_point(s, moved, coordinates);
      dense_axpy(d, held->rows[i].weights[j], coordinates, value);
    }
    for (size_t k = 0; k < d; ++k) {
      CHECK_NEAR(value[k], wanted[i * d + k], d == 2 ? 1e-6 : 1e-11); /* floats leave a tilted plane */
    }
  }
  free(wanted);
}

/* Rows measure of the reference, moved by any affine map, what constraints_targets asks for. */
TEST(rows_reproduce_affine_maps)
{
  test_random random = {1};
  for (int which = 0; which < CASES; ++which) {
    fixture *f = bound_case(which);
    size_t frames = 0;
    for (size_t i = 0; i < inside(f)->held.row_count; ++i) {
      frames += inside(f)->held.rows[i].is_frame != 0;
    }
    CHECK(frames >= 2 && frames <= inside(f)->coordinates.dimension);
    CHECK(inside(f)->held.row_count == 3 + frames);
    for (int round = 0; round < 5; ++round) {
      check_affine(f, &inside(f)->held, &inside(f)->coordinates, &random);
    }
    fixture_free(f);
  }
}

/* A handle of one vertex borrows the rings around it; one in a flat part leaves the direction across it free. */
TEST(frames_of_single_vertices)
{
  test_random random = {2};
  for (int is_flat = 0; is_flat < 2; ++is_flat) {
    fixture *f = is_flat ? fixture_new(zoo_grid(8, 8, 1, 1), 2, 0) : fixture_new(zoo_sphere(2), 2, 0);
    fixture_handle_near(f, EXM_HANDLE_ORIENTED, 0.3, 0.3, 0.3, 0);
    fixture_handle_near(f, EXM_HANDLE_PINNED, 0, 0, 0, 0);
    test_about(is_flat ? "on a flat surface" : "on a sphere");
    REQUIRE(fixture_bind(f));
    size_t const rows = inside(f)->held.row_count;
    CHECK(is_flat ? rows == 4 : rows == 4 || rows == 5);
    check_affine(f, &inside(f)->held, &inside(f)->coordinates, &random);
    for (size_t i = 0; i < rows; ++i) {
      const double *across = inside(f)->held.rows[i].direction;
      CHECK(!is_flat || fabs(across[2]) < 1e-9);
    }
    fixture_free(f);
  }
}

/* The matrix over atoms is the functional of the positions. */
TEST(the_constraint_matrix_measures_positions)
{
  test_random random = {3};
  for (int which = 0; which < CASES; ++which) {
    fixture *f = bound_case(which);
    const dictionary *d = &inside(f)->atoms;
    const constraints *held = &inside(f)->held;
    double *T = random_numbers(&random, d->atom_count), *values = values_of(d, T, 1);
    double *A = test_array(held->row_count * d->atom_count, sizeof *A);
    double *scratch = test_array(1 + d->exemplar_count * d->dimension, sizeof *scratch);
    constraints_matrix(held, d, scratch, A);
    for (size_t i = 0; i < held->row_count; ++i) {
      double direct = 0;
      for (size_t j = 0; j < held->rows[i].term_count; ++j) {
        direct += held->rows[i].weights[j] * values[held->rows[i].vertices[j]];
      }
      CHECK_NEAR(dense_dot(d->atom_count, A + i * d->atom_count, T), direct, 1e-11);
    }
    free(T);
    free(values);
    free(A);
    free(scratch);
    fixture_free(f);
  }
}

/* --------------------------------------------------------------------------------------------------------- dictionary
 */

TEST(coefficients_give_the_exemplars_back)
{
  for (int which = 0; which < CASES; ++which) {
    fixture *f = bound_case(which);
    const dictionary *d = &inside(f)->atoms;
    size_t const width = d->exemplar_count * d->dimension;
    double *T = test_array(d->atom_count * width, sizeof *T), worst = 0;
    dictionary_exemplar_coefficients(d, T);
    double *values = values_of(d, T, width);
    for (size_t i = 0; i < d->vertex_count * width; ++i) {
      worst = fmax(worst, fabs(values[i] - d->exemplars[i]));
    }
    CHECK_NEAR(worst, 0, 1e-6); /* mixtures leave a displacement of 1e-7 out */
    free(T);
    free(values);
    fixture_free(f);
  }
}

/* From coefficients to the affine maps that skinning applies, and to the caller's space. */
TEST(affine_maps_are_the_coefficients)
{
  test_random random = {4};
  for (int which = 0; which < CASES; ++which) {
    fixture *f = bound_case(which);
    const dictionary *d = &inside(f)->atoms;
    const space *s = &inside(f)->coordinates;
    size_t const rows = 1 + 3 * d->exemplar_count;
    double *T = random_numbers(&random, d->atom_count * d->dimension), *values = values_of(d, T, d->dimension);
    double *affine = test_array(f->handle_count * rows * 3, sizeof *affine), worst = 0;
    double *scratch = test_array((1 + d->exemplar_count * d->dimension) * d->dimension, sizeof *scratch);
    dictionary_affine(d, s, T, NULL, scratch, affine);
    for (size_t v = 0; v < d->vertex_count; ++v) {
      double point[3] = {0}, expected[3];
      for (size_t i = d->weight_offsets[v]; i < d->weight_offsets[v + 1]; ++i) {
        const double *map = affine + d->weight_handles[i] * rows * 3;
        dense_axpy(3, d->weight_values[i], map, point);
        for (size_t k = 0; k < 3 * d->exemplar_count; ++k) {
          double const coordinate = (double)f->exemplars[(k / 3 * f->vertex_count + v) * 3 + k % 3];
          dense_axpy(3, d->weight_values[i] * coordinate, map + (1 + k) * 3, point);
        }
      }
      space_to_point(s, values + v * d->dimension, expected);
      for (int k = 0; k < 3; ++k) {
        worst = fmax(worst, fabs(point[k] - expected[k]));
      }
    }
    CHECK_NEAR(worst / f->diagonal, 0, 1e-6); /* a planar mesh's float coordinates leave its plane by that much */
    free(T);
    free(values);
    free(affine);
    free(scratch);
    fixture_free(f);
  }
}

/* -------------------------------------------------------------------------------------------------------- edge groups
 */

/* Each group's factor has the energy of its triangles, each with its share; for groups of any size. */
TEST(group_factors_have_the_energy_of_their_triangles)
{
  test_random random = {5};
  for (int which = 0; which < CASES; ++which) {
    fixture *f = bound_case(which);
    const dictionary *d = &inside(f)->atoms;
    const mesh *m = f->reference;
    size_t const groups = f->deformer->info.edge_group_count;
    arena memory = {0};
    group_factor *factors = ARENA_NEW(&memory, group_factor, groups);
    CHECK_STATUS(group_factors_create(&memory, m, d, inside(f)->groups, groups, NULL, factors), EXM_OK);
    for (int round = 0; round < 3; ++round) {
      double *T = random_numbers(&random, d->atom_count), *values = values_of(d, T, 1);
      double *direct = test_array(groups, sizeof *direct);
      for (size_t t = 0; t < m->triangle_count; ++t) {
        for (size_t i = 0; i < 3; ++i) {
          double const edge = values[m->triangles[t][(i + 1) % 3]] - values[m->triangles[t][(i + 2) % 3]];
          for (size_t corner = 0; corner < 3; ++corner) {
            direct[inside(f)->groups[m->triangles[t][corner]]] += m->cotangents[t][i] * edge * edge / 6;
          }
        }
      }
      for (size_t g = 0; g < groups; ++g) {
        double energy = 0;
        for (size_t i = 0; i < factors[g].row_count; ++i) {
          double row = 0;
          for (size_t j = 0; j < factors[g].column_count; ++j) {
            row += factors[g].rows[i * factors[g].column_count + j] * T[factors[g].columns[j]];
          }
          energy += row * row / 2;
        }
        CHECK_NEAR(energy, direct[g], 1e-10 * fmax(1, direct[g]));
      }
      free(T);
      free(values);
      free(direct);
    }
    arena_release(&memory);
    fixture_free(f);
  }
}

/* ------------------------------------------------------------------------------------------------------- reduced mesh
 */

TEST(coefficients_meet_their_constraints)
{
  test_random random = {6};
  for (int which = 0; which < CASES; ++which) {
    fixture *f = bound_case(which);
    const constraints *held = &inside(f)->held;
    size_t const d = inside(f)->coordinates.dimension;
    for (int round = 0; round < 5; ++round) {
      pose p = random_pose(f, &random);
      double worst = 0, largest = 1;
      for (size_t i = 0; i < held->row_count; ++i) {
        double value[3] = {0};
        for (size_t j = 0; j < held->rows[i].term_count; ++j) {
          dense_axpy(d, held->rows[i].weights[j], p.positions + held->rows[i].vertices[j] * d, value);
        }
        for (size_t k = 0; k < d; ++k) {
          worst = fmax(worst, fabs(value[k] - p.c[i * d + k]));
        }
      }
      for (size_t i = 0; i < inside(f)->solver.reduced.atom_count * d; ++i) {
        largest = fmax(largest, fabs(p.T[i])); /* a random u is a wild pose, of large coefficients */
      }
      CHECK_NEAR(worst / largest, 0, 1e-12);
      pose_free(&p);
    }
    fixture_free(f);
  }
}

/* U'U = 1 and U'F = 0: the energy of any pose is that of u and that of c, apart. Seen from the mesh. */
TEST(the_basis_is_orthonormal_in_the_energy)
{
  test_random random = {7};
  for (int which = 0; which < CASES; ++which) {
    fixture *f = bound_case(which);
    const reduced_mesh *r = &inside(f)->solver.reduced;
    size_t const d = r->dimension, bound = r->constraint_count;
    for (int round = 0; round < 5; ++round) {
      pose p = random_pose(f, &random);
      double *c = test_array(bound * d, sizeof *c);
      memcpy(c, p.c, bound * d * sizeof *c);
      pose still = pose_of(f, test_array(r->rank * d, sizeof(double)), c);
      double const held = mesh_energy(f, still.positions, NULL), direct = mesh_energy(f, p.positions, NULL);
      CHECK_NEAR((norm2(r->rank * d, p.u) / 2 + held) / direct, 1, 1e-6);
      pose_free(&still);
      pose_free(&p);
    }
    fixture_free(f);
  }
}

/* What the cone program multiplies proxies with: G X, or with carriers A P P' A' X from the sorted P P'. */
static double *by_green(const amrap *a, size_t width, const double *X)
{
  const reduced_mesh *r = &a->reduced;
  size_t const V = r->atom_count, rows = r->shape_rows;
  double *out = test_array(rows * width, sizeof *out);
  if (!r->carriers) {
    dense_times(rows, rows, width, r->G, X, out);
    return out;
  }
  double *forces = test_array(V * width, sizeof *forces), *points = test_array(V * width, sizeof *points);
  double *carried = test_array(V * width, sizeof *carried);
  for (size_t g = 0; g < r->group_count; ++g) {
    const uint32_t *places = a->columns.green_places + r->carriers->offsets[g];
    reduced_carry(r, g, width, X + r->shape_offsets[g] * width, carried);
    for (size_t k = 0; k < r->carriers->offsets[g + 1] - r->carriers->offsets[g]; ++k) {
      CHECK(places[k] >= a->columns.green_starts[g]); /* a group is in its suffix */
      dense_axpy(width, 1, carried + k * width, forces + places[k] * width);
    }
  }
  dense_times(V, V, width, a->columns.green, forces, points);
  for (size_t g = 0; g < r->group_count; ++g) {
    size_t const n = r->carriers->offsets[g + 1] - r->carriers->offsets[g];
    for (size_t i = r->shape_offsets[g]; i < r->shape_offsets[g + 1]; ++i) {
      const double *root = r->carriers->shapes[g] + (i - r->shape_offsets[g]) * n;
      for (size_t k = 0; k < n; ++k) {
        size_t const place = a->columns.green_places[r->carriers->offsets[g] + k];
        dense_axpy(width, root[k], points + place * width, out + i * width);
      }
    }
  }
  free(forces);
  free(points);
  free(carried);
  return out;
}

TEST(to_the_basis_and_back_are_adjoint_and_shrink)
{
  test_random random = {8};
  size_t with_carriers = 0;
  for (int which = 0; which < CASES; ++which) {
    fixture *f = bound_case(which);
    const reduced_mesh *r = &inside(f)->solver.reduced;
    size_t const width = 2;
    double *X = random_numbers(&random, r->shape_rows * width), *u = random_numbers(&random, r->rank * width);
    double *scratch = scratch_of(r), *in_basis = test_array(r->rank * width, sizeof *in_basis);
    double *in_shapes = test_array(r->shape_rows * width, sizeof *in_shapes);
    with_carriers += r->carriers != NULL;
    reduced_to_basis(r, width, X, scratch, in_basis);
    reduced_to_shapes(r, width, u, scratch, in_shapes);
    CHECK_NEAR(dense_dot(r->rank * width, in_basis, u), dense_dot(r->shape_rows * width, in_shapes, X), 1e-9);
    CHECK(norm2(r->rank * width, in_basis) <= norm2(r->shape_rows * width, X) * (1 + 1e-9));
    CHECK(norm2(r->shape_rows * width, in_shapes) <= norm2(r->rank * width, u) * (1 + 1e-9));
    double *response = by_green(&inside(f)->solver, width, X);
    reduced_to_shapes(r, width, in_basis, scratch, in_shapes);
    for (size_t i = 0; i < r->shape_rows * width; ++i) {
      CHECK_NEAR(response[i], in_shapes[i], 1e-9);
    }
    free(X);
    free(u);
    free(scratch);
    free(in_basis);
    free(in_shapes);
    free(response);
    fixture_free(f);
  }
  CHECK(with_carriers > 0 && with_carriers < CASES); /* both kinds were seen */
}

/* Random blends and rotations, from a solve for a random pose. */
static void shake(fixture *f, test_random *random)
{
  amrap *a = &inside(f)->solver;
  size_t const S = f->exemplar_count;
  double *targets = fixture_targets(f);
  fixture_mix(f, 0, 1, test_uniform(random), 0.2, random, targets);
  free(fixture_solve(f, targets, NULL, NULL));
  for (size_t g = 0; g < a->reduced.group_count; ++g) {
    double sum = 0;
    for (size_t s = 0; s < S; ++s) {
      a->B[g * S + s] = test_uniform(random);
      sum += a->B[g * S + s];
    }
    for (size_t s = 0; s < S; ++s) {
      a->B[g * S + s] /= sum;
    }
  }
  amrap_blend_shapes(a);
  free(targets);
}

/* The energy that the solver evaluates on proxies is that of every edge of every triangle, for poses, blends and
 * rotations that have nothing to do with one another. */
TEST(the_energy_by_proxies_is_the_energy_of_the_mesh)
{
  test_random random = {9};
  for (int which = 0; which < CASES; ++which) {
    fixture *f = bound_case(which);
    amrap *a = &inside(f)->solver;
    for (int round = 0; round < 4; ++round) {
      shake(f, &random);
      pose p = random_pose(f, &random);
      amrap_set_targets(a, p.c);
      double *blended = blended_positions(f);
      double const direct = mesh_energy(f, p.positions, blended);
      CHECK_NEAR(amrap_elastic_energy(a, p.u, p.y, a->X) / direct, 1, 1e-6);
      free(blended);
      pose_free(&p);
    }
    fixture_free(f);
  }
}

/* The pose of least energy for a blend is u = Ux'X: going elsewhere costs half the square of the way. */
TEST(the_best_pose_is_in_closed_form)
{
  test_random random = {10};
  for (int which = 0; which < CASES; ++which) {
    fixture *f = bound_case(which);
    amrap *a = &inside(f)->solver;
    const reduced_mesh *r = &a->reduced;
    size_t const count = r->rank * r->dimension;
    shake(f, &random);
    double *best = test_array(count, sizeof *best), *scratch = scratch_of(r), *blended = blended_positions(f);
    reduced_to_basis(r, r->dimension, a->X, scratch, best);
    double *c = random_numbers(&random, r->constraint_count * r->dimension), lowest = 0;
    for (int round = 0; round < 4; ++round) {
      double *u = random_numbers(&random, count);
      double const step2 = round ? norm2(count, u) : 0;
      for (size_t i = 0; i < count; ++i) {
        u[i] = best[i] + (round ? u[i] : 0);
      }
      double *same_c = test_array(r->constraint_count * r->dimension, sizeof *same_c);
      memcpy(same_c, c, r->constraint_count * r->dimension * sizeof *c);
      pose p = pose_of(f, u, same_c);
      double const energy = mesh_energy(f, p.positions, blended);
      lowest = round ? lowest : energy;
      CHECK_NEAR(energy - lowest, step2 / 2, 1e-6 * fmax(energy, 1));
      pose_free(&p);
    }
    free(best);
    free(scratch);
    free(blended);
    free(c);
    fixture_free(f);
  }
}

/* ------------------------------------------------------------------------------------------------- through rotations
 */

/* 1/2 |X|^2 for the rotations that follow the pose u. */
static double blended_square(amrap *a, const double *u)
{
  const reduced_mesh *r = &a->reduced;
  double *scratch = scratch_of(r);
  memcpy(a->u, u, r->rank * r->dimension * sizeof *u);
  reduced_to_shapes(r, r->dimension, u, scratch, a->y);
  dense_axpy(r->shape_rows * r->dimension, 1, a->Fxc, a->y);
  amrap_fit_rotations(a);
  amrap_blend_shapes(a);
  free(scratch);
  return norm2(r->shape_rows * r->dimension, a->X) / 2;
}

TEST(the_slope_through_the_rotations_is_the_difference_quotient)
{
  test_random random = {11};
  for (int which = 0; which < CASES; ++which) {
    fixture *f = bound_case(which);
    amrap *a = &inside(f)->solver;
    size_t const count = a->reduced.rank * a->reduced.dimension;
    double *slope = test_array(count, sizeof *slope), *at = test_array(count, sizeof *at);
    for (int round = 0; round < 4; ++round) {
      shake(f, &random);
      memcpy(at, a->u, count * sizeof *at);
      double *direction = random_numbers(&random, count), *moved = test_array(count, sizeof *moved);
      double const length = 1e-4 * a->reduced.size / sqrt(norm2(count, direction));
      double side[2];
      for (int sign = 0; sign < 2; ++sign) {
        memcpy(moved, at, count * sizeof *at);
        dense_axpy(count, sign ? length : -length, direction, moved);
        side[sign] = blended_square(a, moved);
      }
      blended_square(a, at);
      amrap_rotation_slope(a, slope);
      double const quotient = (side[1] - side[0]) / (2 * length), expected = dense_dot(count, slope, direction);
      CHECK_NEAR(quotient, expected, 1e-4 * sqrt(norm2(count, slope) * norm2(count, direction)));
      CHECK(norm2(count, slope) > 0);
      free(direction);
      free(moved);
    }
    free(slope);
    free(at);
    fixture_free(f);
  }
}
