/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sequence/shape_spaces/frame_graph.h"

#include <string.h>

#include "linalg/rotation.h"
#include "linalg/rotation_log.h"
#include "sequence/shape_spaces/polar.h"

static uint32_t find_root(uint32_t *parents, uint32_t node)
{
  while (parents[node] != node) {
    parents[node] = parents[parents[node]];
    node = parents[node];
  }
  return node;
}

/** Parts by union of the links' ends, the lower root winning. */
static void find_parts(frame_graph *graph)
{
  uint32_t *roots = graph->parts;
  for (size_t i = 0; i < graph->node_count; i++) {
    roots[i] = (uint32_t)i;
  }
  for (size_t e = 0; e < graph->link_count; e++) {
    uint32_t const a = find_root(roots, graph->links[e][0]), b = find_root(roots, graph->links[e][1]);
    roots[a < b ? b : a] = a < b ? a : b;
  }
  for (size_t i = 0; i < graph->node_count; i++) {
    uint32_t const root = find_root(roots, (uint32_t)i);
    if (root == i) {
      graph->anchors[graph->part_count++] = root;
    } else {
      roots[i] = root; /* lower than i */
    }
  }
  /* From roots to numbers, the lowest first: a root's number is known before its nodes ask for it. */
  size_t count = 0;
  for (size_t i = 0; i < graph->node_count; i++) {
    int const is_root = count < graph->part_count && graph->anchors[count] == i;
    graph->parts[i] = is_root ? (uint32_t)count++ : graph->parts[graph->parts[i]];
  }
}

exm_status frame_graph_create(arena *owner, size_t node_count, size_t link_count, const uint32_t (*links)[2],
                              frame_graph *out)
{
  *out = (frame_graph){.node_count = node_count, .link_count = link_count};
  out->links = arena_array(owner, link_count, sizeof *out->links);
  out->parts = ARENA_NEW(owner, uint32_t, node_count);
  out->anchors = ARENA_NEW(owner, uint32_t, node_count);
  out->rests = arena_array(owner, node_count, sizeof *out->rests);
  out->turns = arena_array(owner, link_count, sizeof *out->turns);
  out->frames = arena_array(owner, node_count, sizeof *out->frames);
  out->rows = ARENA_NEW(owner, double, 9 * node_count);
  if (!out->links || !out->parts || !out->anchors || !out->rests || !out->turns || !out->frames || !out->rows) {
    return status_no_memory("the frames of a shape space");
  }
  memcpy(out->links, links, link_count * sizeof *links);
  find_parts(out);
  for (size_t p = 0; p < out->part_count; p++) {
    out->rests[p][0] = out->rests[p][4] = out->rests[p][8] = 1;
  }
  return EXM_OK;
}

void frame_graph_release(frame_graph *graph)
{
  cholesky_destroy(graph->factor);
  graph->factor = NULL;
}

/** Lower triangle: identities for both ends of a link and - R between them, an identity more at anchors. */
static exm_status assemble(const frame_graph *graph, arena *scratch, sparse *out)
{
  size_t const n = graph->node_count, count = 3 * graph->part_count + 15 * graph->link_count;
  uint32_t *rows = ARENA_NEW(scratch, uint32_t, count), *columns = ARENA_NEW(scratch, uint32_t, count);
  double *values = ARENA_NEW(scratch, double, count);
  size_t at = 0;
  if (!rows || !columns || !values) {
    return status_no_memory("the frames of a shape space");
  }
  for (size_t i = 0; i < 3 * graph->part_count; i++, at++) {
    rows[at] = columns[at] = 3 * graph->anchors[i / 3] + (uint32_t)(i % 3);
    values[at] = 1;
  }
  for (size_t e = 0; e < graph->link_count; e++) {
    uint32_t const a = graph->links[e][0], b = graph->links[e][1];
    for (uint32_t i = 0; i < 3; i++) {
      rows[at] = columns[at] = 3 * a + i;
      values[at++] = 1;
      rows[at] = columns[at] = 3 * b + i;
      values[at++] = 1;
      for (uint32_t j = 0; j < 3; j++, at++) {
        rows[at] = 3 * a + i;
        columns[at] = 3 * b + j;
        values[at] = -graph->turns[e][3 * i + j];
      }
    }
  }
  return sparse_from_triplets(scratch, 3 * n, count, rows, columns, values, out);
}

exm_status frame_graph_solve(frame_graph *graph)
{
  size_t const n = graph->node_count;
  arena scratch = {0};
  sparse matrix;
  exm_status status = assemble(graph, &scratch, &matrix);
  if (status >= 0) {
    status = graph->factor ? cholesky_refactor(graph->factor, &matrix) : cholesky_create(&matrix, &graph->factor);
  }
  arena_release(&scratch);
  if (status < 0) {
    return status;
  }
  memset(graph->rows, 0, 9 * n * sizeof(double));
  for (size_t p = 0; p < graph->part_count; p++) {
    const double *frame = graph->frames[graph->anchors[p]];
    for (size_t j = 0; j < 3; j++) {
      for (size_t r = 0; r < 3; r++) { /* unknown j of node, row r of its frame */
        graph->rows[9 * (size_t)graph->anchors[p] + 3 * j + r] = frame[3 * r + j];
      }
    }
  }
  TRY(cholesky_solve_rows(graph->factor, 3, graph->rows));
  for (size_t i = 0; i < n; i++) {
    for (size_t j = 0; j < 3; j++) {
      for (size_t r = 0; r < 3; r++) {
        graph->frames[i][3 * r + j] = graph->rows[9 * i + 3 * j + r];
      }
    }
  }
  rotation_fit3(n, &graph->frames[0][0], &graph->frames[0][0]);
  return EXM_OK;
}

void frame_graph_rest(frame_graph *graph)
{
  for (size_t p = 0; p < graph->part_count; p++) {
    memcpy(graph->rests[p], graph->frames[graph->anchors[p]], sizeof *graph->rests);
  }
}

void frame_graph_put_anchors(const frame_graph *graph, double scale, const double *like, double *coordinates)
{
  for (size_t p = 0; p < graph->part_count; p++) {
    double expected[3] = {0}, turn[9], back[9];
    for (size_t k = 0; like && k < 3; k++) {
      expected[k] = like[3 * p + k] / scale;
    }
    matrix_transpose(graph->rests[p], back);
    matrix_times(graph->frames[graph->anchors[p]], back, turn);
    rotation_log(turn, expected, coordinates + 3 * p);
    for (size_t k = 0; k < 3; k++) {
      coordinates[3 * p + k] *= scale;
    }
  }
}

void frame_graph_take_anchors(frame_graph *graph, double scale, const double *coordinates)
{
  for (size_t p = 0; p < graph->part_count; p++) {
    double const vector[3] = {coordinates[3 * p] / scale, coordinates[3 * p + 1] / scale,
                              coordinates[3 * p + 2] / scale};
    double turn[9];
    rotation_exp(vector, turn);
    matrix_times(turn, graph->rests[p], graph->frames[graph->anchors[p]]);
  }
}
