/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What callers get wrong, and what is unusual but right. */
#include "blended_fixture.h"

static exm_status create(bent_bar *bar, const exm_blended_bind_settings *settings, exm_deformer **out)
{
  return exm_blended_create(bar->mesh, bar->exemplars, BAR_SHAPES, bar_handles(bar), settings, NULL, NULL, out);
}

TEST(bind_arguments)
{
  bent_bar bar = bar_make();
  exm_deformer *deformer = (exm_deformer *)&bar;
  const exm_handles *handles = bar_handles(&bar);
  CHECK_STATUS(exm_blended_create(bar.mesh, bar.exemplars, BAR_SHAPES, handles, NULL, NULL, NULL, NULL),
               EXM_ERROR_ARGUMENT, "out is NULL");
  CHECK_STATUS(exm_blended_create(NULL, bar.exemplars, BAR_SHAPES, handles, NULL, NULL, NULL, &deformer),
               EXM_ERROR_ARGUMENT, "mesh is NULL");
  CHECK(deformer == NULL);
  CHECK_STATUS(exm_blended_create(bar.mesh, NULL, BAR_SHAPES, handles, NULL, NULL, NULL, &deformer), EXM_ERROR_ARGUMENT,
               "exemplars is NULL");
  CHECK_STATUS(exm_blended_create(bar.mesh, bar.exemplars, 0, handles, NULL, NULL, NULL, &deformer), EXM_ERROR_ARGUMENT,
               "exemplar_count is 0");
  CHECK_STATUS(exm_blended_create(bar.mesh, bar.exemplars, BAR_SHAPES, NULL, NULL, NULL, NULL, &deformer),
               EXM_ERROR_ARGUMENT, "handles is NULL");
  bar.exemplars[3 * 7 + 1] = NAN;
  CHECK_STATUS(create(&bar, NULL, &deformer), EXM_ERROR_ARGUMENT, "exemplar 0", "vertex 7");
  bar_free(&bar);
}

/* One field at a time, from the defaults. */
#define REFUSED(field, value, ...)                                                                                     \
  do {                                                                                                                 \
    exm_blended_bind_settings_init(&settings);                                                                         \
    settings.field = (value);                                                                                          \
    CHECK_STATUS(create(&bar, &settings, &deformer), EXM_ERROR_ARGUMENT, __VA_ARGS__);                                 \
  } while (0)

TEST(bind_settings)
{
  bent_bar bar = bar_make();
  exm_deformer *deformer = NULL;
  exm_blended_bind_settings settings;
  REFUSED(struct_size, 0, "struct_size is 0");
  REFUSED(dictionary, 2, "settings.dictionary is 2");
  REFUSED(dimension, 4, "settings.dimension is 4");
  REFUSED(start_eigenfunction_count, 0, "start_eigenfunction_count is 0");
  REFUSED(eigenfunction_count, 3, "eigenfunction_count is 3", "start_eigenfunction_count, 4");
  REFUSED(eigenfunction_count, 100000, "eigenfunction_count is 100000", "vertices");
  REFUSED(bone_count, 100000, "bone_count is 100000");
  REFUSED(cluster_count, 100000, "cluster_count is 100000");
  REFUSED(atoms_kept, 0, "atoms_kept is 0");
  REFUSED(atoms_kept, 1.5, "atoms_kept is 1.5");
  REFUSED(atoms_kept, NAN, "atoms_kept is");
  REFUSED(dictionary_exemplar_count, 5, "dictionary_exemplar_count is 5", "4 exemplars");
  REFUSED(compared_exemplar_count, 6, "compared_exemplar_count is 6");
  REFUSED(weights, bar.exemplars, "settings.bone_count is 0");
  REFUSED(smoothness, -1, "smoothness is -1");
  REFUSED(constraint_weight, 0, "constraint_weight is 0");
  REFUSED(constraint_weight, INFINITY, "constraint_weight is inf");
  bar_free(&bar);
}

#define UNSOLVED(field, value, ...)                                                                                    \
  do {                                                                                                                 \
    exm_blended_solve_settings_init(&settings);                                                                        \
    settings.field = (value);                                                                                          \
    CHECK_STATUS(exm_blended_solve(deformer, targets, &settings, NULL), EXM_ERROR_ARGUMENT, __VA_ARGS__);              \
  } while (0)

TEST(solve_settings)
{
  bent_bar bar = bar_make();
  exm_deformer *deformer = NULL;
  exm_blended_solve_settings settings;
  double targets[BAR_HANDLES * 12];
  REQUIRE(create(&bar, NULL, &deformer) == EXM_OK);
  CHECK(exm_deformer_handle_pose(deformer, 1, targets) == EXM_OK);
  UNSOLVED(sparsity, -1, "sparsity is -1");
  UNSOLVED(begin, 2, "begin is 2");
  UNSOLVED(scale, 3, "scale is 3");
  UNSOLVED(start, 2, "start is 2");
  UNSOLVED(average_iterations, -1, "average_iterations is -1");
  UNSOLVED(minimal_iterations, 0, "minimal_iterations is 0");
  UNSOLVED(final_iterations, -2, "final_iterations is -2");
  UNSOLVED(tolerance, NAN, "tolerance is");
  CHECK_STATUS(exm_blended_solve(deformer, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "targets is NULL");
  CHECK_STATUS(exm_blended_solve(NULL, targets, NULL, NULL), EXM_ERROR_ARGUMENT, "deformer is NULL");
  targets[12 * 3 + 7] = INFINITY;
  CHECK_STATUS(exm_blended_solve(deformer, targets, NULL, NULL), EXM_ERROR_ARGUMENT, "column 3 of handle 3");
  exm_blended_outcome outcome;
  exm_blended_outcome_init(&outcome);
  CHECK_STATUS(exm_blended_get_outcome(deformer, &outcome), EXM_ERROR_ARGUMENT, "has not solved");
  CHECK_STATUS(exm_amrap_solve(deformer, targets, NULL, NULL), EXM_ERROR_ARGUMENT, "Blended", "AMRAP");
  exm_deformer_destroy(deformer);
  bar_free(&bar);
}

TEST(rows)
{
  bent_bar bar = bar_make();
  exm_deformer *deformer = NULL;
  double targets[BAR_HANDLES * 12], values[2] = {1, 2}, weight = -1, bad = NAN;
  size_t offsets[2] = {0, 2}, none[2] = {0, 0}, shifted[2] = {1, 2};
  uint32_t vertices[2] = {1, 2}, outside[2] = {1, 100000};
  exm_rows rows = {.count = 1, .offsets = offsets, .vertices = vertices, .coefficients = values};
  REQUIRE(create(&bar, NULL, &deformer) == EXM_OK);
  CHECK_STATUS(exm_blended_add_rows(deformer, NULL), EXM_ERROR_ARGUMENT, "rows is NULL");
  rows.vertices = outside;
  CHECK_STATUS(exm_blended_add_rows(deformer, &rows), EXM_ERROR_ARGUMENT, "row 0", "vertex 100000");
  rows.vertices = vertices;
  rows.offsets = none;
  CHECK_STATUS(exm_blended_add_rows(deformer, &rows), EXM_ERROR_ARGUMENT, "row 0 has no terms");
  rows.offsets = shifted;
  CHECK_STATUS(exm_blended_add_rows(deformer, &rows), EXM_ERROR_ARGUMENT, "begins with 1");
  rows.offsets = offsets;
  rows.weights = &weight;
  CHECK_STATUS(exm_blended_add_rows(deformer, &rows), EXM_ERROR_ARGUMENT, "weight of row 0 is -1");
  rows.weights = NULL;
  values[1] = NAN;
  CHECK_STATUS(exm_blended_add_rows(deformer, &rows), EXM_ERROR_ARGUMENT, "coefficient of vertex 2");
  values[1] = 2;
  CHECK(exm_blended_add_rows(deformer, &rows) == EXM_OK);
  CHECK_STATUS(exm_blended_remove_rows(deformer, 1, 1), EXM_ERROR_ARGUMENT, "rows 1 to 2", "there are 1");
  CHECK_STATUS(exm_blended_weigh_rows(deformer, 0, 1, &bad), EXM_ERROR_ARGUMENT, "weight of row 0");
  CHECK_STATUS(exm_blended_weigh_rows(deformer, 0, 1, NULL), EXM_ERROR_ARGUMENT, "weights is NULL");
  CHECK(exm_deformer_handle_pose(deformer, 1, targets) == EXM_OK);
  CHECK_STATUS(exm_blended_solve(deformer, targets, NULL, NULL), EXM_ERROR_ARGUMENT, "row_targets is NULL", "1 rows");
  double weights[BAR_HANDLES] = {1, -2};
  CHECK_STATUS(exm_blended_weigh_handles(deformer, weights), EXM_ERROR_ARGUMENT, "weight of handle 1 is -2");
  memset(weights, 0, sizeof weights);
  CHECK(exm_blended_remove_rows(deformer, 0, 1) == EXM_OK);
  CHECK(exm_blended_weigh_handles(deformer, weights) == EXM_OK);
  CHECK_STATUS(exm_blended_solve(deformer, targets, NULL, NULL), EXM_ERROR_UNCONSTRAINED, "weight above 0");
  CHECK_STATUS(exm_blended_set_energies(deformer, -1, 0), EXM_ERROR_ARGUMENT, "constraint_weight is -1");
  exm_deformer_destroy(deformer);
  bar_free(&bar);
}

TEST(keys)
{
  bent_bar bar = bar_make();
  exm_deformer *deformer = NULL;
  double targets[BAR_HANDLES * 12], times[2] = {1, 1};
  size_t size = 0;
  REQUIRE(create(&bar, NULL, &deformer) == EXM_OK);
  CHECK(exm_blended_key_size(deformer, &size) == EXM_OK);
  double *keys = test_array(2 * size, sizeof(double));
  CHECK_STATUS(exm_blended_get_key(deformer, keys), EXM_ERROR_ARGUMENT, "no solved pose");
  CHECK(exm_deformer_handle_pose(deformer, 1, targets) == EXM_OK);
  CHECK(exm_blended_solve(deformer, targets, NULL, NULL) == EXM_OK);
  CHECK(exm_blended_get_key(deformer, keys) == EXM_OK);
  memcpy(keys + size, keys, size * sizeof(double));
  CHECK_STATUS(exm_blended_interpolate(deformer, keys, times, 0, 1), EXM_ERROR_ARGUMENT, "count is 0");
  CHECK_STATUS(exm_blended_interpolate(deformer, keys, times, 2, 1), EXM_ERROR_ARGUMENT, "time 1, 1, is not after");
  times[1] = 2;
  CHECK_STATUS(exm_blended_interpolate(deformer, keys, times, 2, NAN), EXM_ERROR_ARGUMENT, "time is not finite");
  CHECK_STATUS(exm_blended_interpolate(deformer, NULL, times, 2, 1), EXM_ERROR_ARGUMENT, "keys is NULL");
  keys[size] = NAN;
  CHECK_STATUS(exm_blended_interpolate(deformer, keys, times, 2, 1), EXM_ERROR_ARGUMENT, "key 1 is not one");
  free(keys);
  exm_deformer_destroy(deformer);
  bar_free(&bar);
}

/* ----------------------------------------------------------------------------------------- unusual, each with a result
 */

static void check_solves(exm_deformer *deformer, exm_status expected)
{
  double targets[BAR_HANDLES * 12];
  exm_deformer_info info;
  exm_deformer_info_init(&info);
  CHECK(exm_deformer_get_info(deformer, &info) == EXM_OK);
  CHECK(exm_deformer_handle_pose(deformer, info.exemplar_count - 1, targets) == EXM_OK);
  CHECK(exm_blended_solve(deformer, targets, NULL, NULL) == expected);
  double *found = test_array(3 * info.vertex_count, sizeof(double));
  CHECK(exm_deformer_positions_f64(deformer, found) == EXM_OK);
  for (size_t i = 0; i < 3 * info.vertex_count; i++) {
    CHECK(isfinite(found[i]));
  }
  free(found);
}

TEST(one_function_one_exemplar_more_atoms_than_vertices)
{
  bent_bar bar = bar_make();
  exm_deformer *deformer = NULL;
  exm_blended_bind_settings settings;
  exm_blended_bind_settings_init(&settings);
  settings.start_eigenfunction_count = settings.eigenfunction_count = 1;
  CHECK(create(&bar, &settings, &deformer) == EXM_OK);
  check_solves(deformer, EXM_OK);
  exm_deformer_destroy(deformer);
  exm_blended_bind_settings_init(&settings);
  CHECK(exm_blended_create(bar.mesh, bar.exemplars, 1, bar_handles(&bar), &settings, NULL, NULL, &deformer) == EXM_OK);
  check_solves(deformer, EXM_OK);
  exm_deformer_destroy(deformer);
  settings.atoms_kept = 1;
  settings.eigenfunction_count = 40;
  exm_blended_info info;
  exm_blended_info_init(&info);
  CHECK(create(&bar, &settings, &deformer) == EXM_OK);
  CHECK(exm_blended_get_info(deformer, &info) == EXM_OK && info.atom_count > bar.shape.vertex_count);
  check_solves(deformer, EXM_OK);
  exm_deformer_destroy(deformer);
  settings.dictionary = EXM_DICTIONARY_SKELETON;
  settings.bone_count = 1;
  CHECK(create(&bar, &settings, &deformer) == EXM_OK);
  check_solves(deformer, EXM_OK);
  exm_deformer_destroy(deformer);
  bar_free(&bar);
}

TEST(identical_and_mirrored_exemplars_are_told)
{
  bent_bar bar = bar_make();
  size_t const V = bar.shape.vertex_count;
  exm_deformer *deformer = NULL;
  for (size_t v = 0; v < V; v++) { /* exemplar 3 becomes exemplar 1, turned by a right angle about x and moved */
    const float *from = bar.exemplars + (V + v) * 3;
    float *to = bar.exemplars + (3 * V + v) * 3;
    to[0] = from[0] + 5;
    to[1] = -from[2];
    to[2] = from[1] - 2;
  }
  CHECK_STATUS(create(&bar, NULL, &deformer), EXM_WARNING_EXEMPLARS, "exemplars 1 and 3 are the same");
  REQUIRE(deformer != NULL);
  check_solves(deformer, EXM_OK);
  exm_deformer_destroy(deformer);
  for (size_t v = 0; v < V; v++) {
    float *own = bar.exemplars + (3 * V + v) * 3;
    own[2] = -own[2];
  }
  CHECK_STATUS(create(&bar, NULL, &deformer), EXM_WARNING_EXEMPLARS, "exemplar 3 is a mirror image");
  exm_element kind;
  size_t index = 0;
  exm_last_error_element(&kind, &index);
  CHECK(kind == EXM_ELEMENT_EXEMPLAR && index == 3);
  REQUIRE(deformer != NULL);
  check_solves(deformer, EXM_OK);
  exm_deformer_destroy(deformer);
  bar_free(&bar);
}

TEST(few_constraints_leave_something_open)
{
  bent_bar bar = bar_make();
  exm_deformer *deformer = NULL;
  for (size_t h = 1; h < BAR_HANDLES; h++) {
    bar.kinds[h] = EXM_HANDLE_FREE;
  }
  CHECK_STATUS(create(&bar, NULL, &deformer), EXM_WARNING_UNDERDETERMINED, "in one point");
  check_solves(deformer, EXM_WARNING_UNDERDETERMINED);
  exm_deformer_destroy(deformer);
  bar.kinds[5] = EXM_HANDLE_PINNED;
  CHECK_STATUS(create(&bar, NULL, &deformer), EXM_WARNING_UNDERDETERMINED, "on a line");
  check_solves(deformer, EXM_WARNING_UNDERDETERMINED);
  exm_deformer_destroy(deformer);
  bar.kinds[0] = bar.kinds[5] = EXM_HANDLE_FREE;
  CHECK_STATUS(create(&bar, NULL, &deformer), EXM_ERROR_UNCONSTRAINED, "only free handles");
  bar_free(&bar);
}

TEST(contradictions_are_met_in_the_middle)
{
  bent_bar bar = bar_make();
  exm_deformer *deformer = NULL;
  double targets[BAR_HANDLES * 12], one = 1;
  size_t offsets[2] = {0, 1};
  exm_rows const rows = {.count = 1, .offsets = offsets, .vertices = &bar.vertices[0], .coefficients = &one};
  REQUIRE(create(&bar, NULL, &deformer) == EXM_OK);
  CHECK(exm_blended_add_rows(deformer, &rows) == EXM_OK);
  CHECK(exm_deformer_handle_pose(deformer, 0, targets) == EXM_OK);
  double const there[3] = {targets[3], targets[7], targets[11]}, apart[3] = {targets[3], targets[7] + 1, targets[11]};
  exm_blended_solve_settings settings;
  exm_solve_report report;
  exm_blended_solve_settings_init(&settings);
  exm_solve_report_init(&report);
  settings.scale = EXM_SCALE_HELD;
  settings.row_targets = there;
  CHECK(exm_blended_solve(deformer, targets, &settings, NULL) == EXM_OK);
  settings.row_targets = apart;
  CHECK_STATUS(exm_blended_solve(deformer, targets, &settings, &report), EXM_WARNING_CONTRADICTORY,
               "constraints 0 and 6");
  CHECK(report.constraint_residual > 0.4 && report.constraint_residual < 0.8);
  exm_deformer_destroy(deformer);
  bar_free(&bar);
}
