/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "mesh/balls.h"

#include <stdlib.h>
#include <string.h>

/* Sets of one run build on each other; the first of them is stored whole, which is little among so many. Two threads
 * share the runs of five thousand vertices evenly enough. */
enum { RUN = 256 };

typedef struct builder {
  const rings *around;
  const int32_t *radii;
  uint32_t *marks;   /* [V] of the ball that a vertex was last seen in, see `tag` */
  uint32_t tag;      /* of the ball in hand; tag + 1 marks what its base has, too */
  uint32_t *members; /* the balls of the run so far, one after another */
  size_t member_count, member_capacity;
  uint32_t *ball_starts; /* [RUN + 1] into members */
  uint32_t *place;       /* [V] where in its run a set is */
  uint32_t *entries;
  size_t entry_count, entry_capacity;
} builder;

/* Room for `more` at the end of a list; it grows by doubling. */
static exm_status reserve(uint32_t **list, size_t count, size_t more, size_t *capacity)
{
  if (count + more <= *capacity) {
    return EXM_OK;
  }
  size_t const wanted = 2 * (count + more) + 1024;
  uint32_t *grown = wanted < UINT32_MAX ? realloc(*list, wanted * sizeof **list) : NULL;
  if (!grown) {
    return status_no_memory("the neighbourhoods of all vertices");
  }
  *list = grown;
  *capacity = wanted;
  return EXM_OK;
}

/* The ball of vertex k at the end of `members`, ring by ring, each member marked with the tag. */
static exm_status collect(builder *b, uint32_t k)
{
  const rings *around = b->around;
  size_t const first = b->member_count;
  TRY(reserve(&b->members, b->member_count, 1, &b->member_capacity));
  b->members[b->member_count++] = k;
  b->marks[k] = b->tag;
  size_t begin = first;
  for (int32_t ring = 1; ring < b->radii[k] && begin < b->member_count; ring++) {
    size_t const end = b->member_count;
    for (size_t m = begin; m < end; m++) {
      uint32_t const v = b->members[m];
      TRY(reserve(&b->members, b->member_count, around->offsets[v + 1] - around->offsets[v], &b->member_capacity));
      for (uint32_t e = around->offsets[v]; e < around->offsets[v + 1]; e++) {
        uint32_t const j = around->neighbors[e];
        if (b->marks[j] != b->tag) {
          b->marks[j] = b->tag;
          b->members[b->member_count++] = j;
        }
      }
    }
    begin = end;
  }
  return EXM_OK;
}

/* The ball just collected as its difference from its base, or whole where that is shorter. */
static exm_status write_difference(builder *b, size_t in_run, set_sums *s, uint32_t k)
{
  const uint32_t *own = b->members + b->ball_starts[in_run];
  size_t const size = b->member_count - b->ball_starts[in_run];
  uint32_t const base = s->bases[k];
  size_t base_size = 0;
  const uint32_t *base_members = NULL;
  if (base != SET_SUMS_NONE) {
    size_t const at = b->place[base];
    base_members = b->members + b->ball_starts[at];
    base_size = b->ball_starts[at + 1] - b->ball_starts[at];
  }
  TRY(reserve(&b->entries, b->entry_count, size + base_size, &b->entry_capacity));
  uint32_t *to = b->entries + b->entry_count;
  size_t common = 0;
  for (size_t m = 0; m < base_size; m++) {
    common += b->marks[base_members[m]] == b->tag;
  }
  size_t const gained = size - common, lost = base_size - common;
  if (base == SET_SUMS_NONE || gained + lost + 1 >= size) {
    s->bases[k] = SET_SUMS_NONE;
    memcpy(to, own, size * sizeof *to);
    b->entry_count += size;
    s->rows.starts[2 * (size_t)k + 1] = (uint32_t)size;
    s->rows.starts[2 * (size_t)k + 2] = 0;
    return EXM_OK;
  }
  size_t written = gained;
  for (size_t m = 0; m < base_size; m++) {
    uint32_t *mark = &b->marks[base_members[m]];
    if (*mark == b->tag) {
      *mark = b->tag + 1;
    } else {
      to[written++] = base_members[m];
    }
  }
  written = 0;
  for (size_t m = 0; m < size; m++) {
    if (b->marks[own[m]] == b->tag) {
      to[written++] = own[m];
    }
  }
  b->entry_count += gained + lost;
  s->rows.starts[2 * (size_t)k + 1] = (uint32_t)gained;
  s->rows.starts[2 * (size_t)k + 2] = (uint32_t)lost;
  return EXM_OK;
}

/* Grow runs over the mesh, breadth first: a set's base is the neighbour that it was reached from. */
static void find_runs(const rings *around, set_sums *s)
{
  size_t const V = around->vertex_count;
  uint32_t const unseen = SET_SUMS_NONE - 1;
  size_t tail = 0, seed = 0;
  for (size_t v = 0; v < V; v++) {
    s->bases[v] = unseen;
  }
  for (s->run_count = 0; tail < V; s->run_count++) {
    size_t head = tail;
    s->run_starts[s->run_count] = (uint32_t)tail;
    while (s->bases[seed] != unseen) {
      seed++;
    }
    s->bases[seed] = SET_SUMS_NONE;
    s->order[tail++] = (uint32_t)seed;
    size_t const end = head + RUN;
    for (; head < tail && tail < end; head++) {
      uint32_t const v = s->order[head];
      for (uint32_t e = around->offsets[v]; e < around->offsets[v + 1] && tail < end; e++) {
        uint32_t const j = around->neighbors[e];
        if (s->bases[j] == unseen) {
          s->bases[j] = v;
          s->order[tail++] = j;
        }
      }
    }
  }
  s->run_starts[s->run_count] = (uint32_t)tail;
}

static exm_status write_run(builder *b, size_t run, set_sums *s, double *counts)
{
  b->member_count = 0;
  for (uint32_t t = s->run_starts[run]; t < s->run_starts[run + 1]; t++) {
    size_t const in_run = t - s->run_starts[run];
    uint32_t const k = s->order[t];
    b->place[k] = (uint32_t)in_run;
    b->ball_starts[in_run] = (uint32_t)b->member_count;
    b->tag += 2;
    TRY(collect(b, k));
    b->ball_starts[in_run + 1] = (uint32_t)b->member_count;
    for (size_t m = b->ball_starts[in_run]; m < b->member_count && counts; m++) {
      counts[b->members[m]]++;
    }
    TRY(write_difference(b, in_run, s, k));
  }
  return EXM_OK;
}

/* Entries were written in the order of the runs; rows are read by set. */
static exm_status sort_entries(arena *owner, const builder *b, set_sums *s)
{
  size_t const lists = 2 * s->count;
  s->rows.entries = ARENA_NEW(owner, uint32_t, b->entry_count);
  if (!s->rows.entries) {
    return status_no_memory("the neighbourhoods of all vertices");
  }
  for (size_t list = 0; list < lists; list++) {
    s->rows.starts[list + 1] += s->rows.starts[list];
  }
  const uint32_t *from = b->entries;
  for (size_t t = 0; t < s->count && from; t++) {
    const uint32_t *starts = s->rows.starts + 2 * (size_t)s->order[t];
    memcpy(s->rows.entries + starts[0], from, (starts[2] - starts[0]) * sizeof *from);
    from += starts[2] - starts[0];
  }
  return EXM_OK;
}

static exm_status build(arena *owner, builder *b, const progress *report, double *counts, set_sums *s)
{
  find_runs(b->around, s);
  for (size_t run = 0; run < s->run_count; run++) {
    if (run % 16 == 0) {
      TRY(progress_report(report, (double)run / (double)s->run_count, "collecting neighbourhoods"));
    }
    TRY(write_run(b, run, s, counts));
  }
  TRY(sort_entries(owner, b, s));
  return set_sums_transpose(owner, s);
}

exm_status balls_create(arena *owner, const rings *around, const int32_t *radii, const progress *report, double *counts,
                        set_sums *out)
{
  size_t const V = around->vertex_count;
  set_sums s = {.count = V, .is_identity = 1};
  for (size_t v = 0; v < V; v++) {
    s.is_identity &= radii[v] == 1;
  }
  for (size_t v = 0; v < V && counts; v++) {
    counts[v] = s.is_identity;
  }
  if (s.is_identity) {
    *out = s;
    return EXM_OK;
  }
  arena scratch = {0};
  builder b = {.around = around,
               .radii = radii,
               .marks = ARENA_NEW(&scratch, uint32_t, V),
               .ball_starts = ARENA_NEW(&scratch, uint32_t, RUN + 1),
               .place = ARENA_NEW(&scratch, uint32_t, V)};
  s.run_starts = ARENA_NEW(owner, uint32_t, V + 1);
  s.order = ARENA_NEW(owner, uint32_t, V);
  s.bases = ARENA_NEW(owner, uint32_t, V);
  s.rows.starts = ARENA_NEW(owner, uint32_t, 2 * V + 1);
  int const is_there = b.marks && b.ball_starts && b.place && s.run_starts && s.order && s.bases && s.rows.starts;
  exm_status const status =
      is_there ? build(owner, &b, report, counts, &s) : status_no_memory("the neighbourhoods of all vertices");
  free(b.members);
  free(b.entries);
  arena_release(&scratch);
  *out = s;
  return status;
}
