/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Pose a mesh between two exemplars, in a page.
 *
 *   pose REST.obj POSED.obj X Y Z
 *
 * Two files of one connectivity: the mesh at rest, and a pose of it. Three handles: the lowest vertices are held, the
 * highest ones go to X Y Z, those in the middle are free. Prints the posed vertices as OBJ, and what was found to
 * stderr.
 */
#include <exemplar.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { HANDLES = 3, EXEMPLARS = 2 };

static void must(exm_status status)
{
  if (status > 0) {
    fprintf(stderr, "warning: %s\n", exm_last_error());
  } else if (status < 0) {
    fprintf(stderr, "error: %s\n", exm_last_error());
    exit(1);
  }
}

/* The vertices whose share of the mesh's height is within `reach` of 0, 1/2 and 1, handle after handle. */
static void choose_vertices(const float *positions, size_t vertex_count, double reach, uint32_t *vertices,
                            size_t offsets[HANDLES + 1])
{
  double low = INFINITY, high = -INFINITY;
  for (size_t v = 0; v < vertex_count; v++) {
    low = fmin(low, positions[3 * v + 2]);
    high = fmax(high, positions[3 * v + 2]);
  }
  offsets[0] = 0;
  for (size_t h = 0; h < HANDLES; h++) {
    size_t count = offsets[h];
    for (size_t v = 0; v < vertex_count; v++) {
      if (fabs((positions[3 * v + 2] - low) / (high - low) - 0.5 * (double)h) <= reach) {
        vertices[count++] = (uint32_t)v;
      }
    }
    offsets[h + 1] = count;
  }
}

int main(int argc, char **argv)
{
  if (argc != 6) {
    fprintf(stderr, "usage: %s REST.obj POSED.obj X Y Z\n", argv[0]);
    return 2;
  }
  exm_mesh *rest = NULL, *posed = NULL;
  must(exm_mesh_read(argv[1], &rest));
  must(exm_mesh_read(argv[2], &posed));
  exm_mesh_report size, other;
  exm_mesh_report_init(&size);
  exm_mesh_report_init(&other);
  must(exm_mesh_get_report(rest, &size));
  must(exm_mesh_get_report(posed, &other));
  const size_t vertices = size.vertex_count, triangles = size.triangle_count;
  if (other.vertex_count != vertices || other.triangle_count != triangles) {
    fprintf(stderr, "error: %zu vertices in one file, %zu in the other\n", vertices, other.vertex_count);
    return 1;
  }

  float *exemplars = malloc(EXEMPLARS * vertices * 3 * sizeof *exemplars);
  uint32_t *corners = malloc(triangles * 3 * sizeof *corners);
  uint32_t *members = malloc(vertices * sizeof *members);
  if (!exemplars || !corners || !members) {
    fprintf(stderr, "error: out of memory\n");
    return 1;
  }
  must(exm_mesh_get_arrays(rest, exemplars, corners));
  must(exm_mesh_get_arrays(posed, exemplars + 3 * vertices, NULL));

  size_t offsets[HANDLES + 1];
  choose_vertices(exemplars, vertices, 0.1, members, offsets);
  const int32_t kinds[HANDLES] = {EXM_HANDLE_PINNED, EXM_HANDLE_FREE, EXM_HANDLE_PINNED};
  const exm_handles handles = {HANDLES, kinds, offsets, members};

  exm_deformer *deformer = NULL;
  must(exm_amrap_create(rest, exemplars, EXEMPLARS, &handles, NULL, NULL, NULL, &deformer));
  double targets[HANDLES][3][4];
  must(exm_deformer_handle_pose(deformer, 0, &targets[0][0][0]));
  for (int axis = 0; axis < 3; axis++) {
    targets[2][axis][3] = strtod(argv[3 + axis], NULL);
  }
  exm_solve_report report;
  exm_solve_report_init(&report);
  must(exm_amrap_solve(deformer, &targets[0][0][0], NULL, &report));

  double blend[EXEMPLARS];
  must(exm_amrap_blend_average(deformer, blend));
  fprintf(stderr, "%d iterations, %.3f ms, handles met to %.1e, blend %.3f of the rest and %.3f of the pose\n",
          report.iterations, 1e3 * report.seconds, report.constraint_residual, blend[0], blend[1]);
  must(exm_deformer_positions(deformer, 0, exemplars));
  for (size_t v = 0; v < vertices; v++) {
    printf("v %.6g %.6g %.6g\n", exemplars[3 * v], exemplars[3 * v + 1], exemplars[3 * v + 2]);
  }
  for (size_t f = 0; f < triangles; f++) {
    printf("f %u %u %u\n", corners[3 * f] + 1, corners[3 * f + 1] + 1, corners[3 * f + 2] + 1);
  }
  exm_deformer_destroy(deformer);
  exm_mesh_destroy(posed);
  exm_mesh_destroy(rest);
  free(exemplars);
  free(corners);
  free(members);
  return 0;
}
