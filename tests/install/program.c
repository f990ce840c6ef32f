/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A stranger's program: it has the installed header and library and nothing else. */
#include <exemplar.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

int main(void)
{
  static const float positions[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  static const uint32_t triangles[2][3] = {{0, 1, 2}, {0, 2, 3}};
  exm_mesh_report report;
  exm_mesh *mesh;

  if (exm_abi_version() != EXM_ABI_VERSION) {
    return 1;
  }
  if (exm_mesh_create(positions[0], 4, triangles[0], 2, &mesh) != EXM_OK) {
    fprintf(stderr, "%s\n", exm_last_error());
    return 1;
  }
  exm_mesh_report_init(&report);
  exm_mesh_get_report(mesh, &report);
  exm_mesh_destroy(mesh);
  if (report.boundary_edge_count != 4 || fabs(report.diagonal - sqrt(2)) > 1e-12) {
    return 1;
  }
  if (exm_mesh_create(positions[0], 3, triangles[0], 2, &mesh) != EXM_ERROR_TOPOLOGY || mesh ||
      !strstr(exm_last_error(), "vertex 3")) {
    return 1;
  }
  printf("exemplar %s\n", exm_version());
  return 0;
}
