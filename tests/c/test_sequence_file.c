/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Files of sequences: what comes back, and what does not. */
#include "sequence_fixture.h"

#include "base/crc.h"

#if !defined(_WIN32)
#  include <signal.h>
#  include <sys/resource.h>
#endif

static size_t read_bytes(const char *path, unsigned char **bytes)
{
  FILE *file = fopen(path, "rb");
  *bytes = test_array(1 << 20, 1);
  size_t const size = file ? fread(*bytes, 1, 1 << 20, file) : 0;
  if (file) {
    fclose(file);
  }
  return size;
}

static exm_sequence *fitted(walk *w, int cyclic)
{
  exm_sequence *sequence = walk_sequence(w, EXM_SHAPE_POSITIONS);
  exm_sequence_fit_settings settings = walk_settings(8, 6, 4);
  settings.cyclic = cyclic;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
  return sequence;
}

static void check_same(const walk *w, exm_sequence *a, exm_sequence *b)
{
  float *here = test_array(w->size, sizeof(float)), *there = test_array(w->size, sizeof(float));
  for (int step = 0; step < 32; step++) {
    double const t = 0.37 * step;
    CHECK_STATUS(exm_sequence_evaluate(a, t, here), EXM_OK);
    CHECK_STATUS(exm_sequence_evaluate(b, t, there), EXM_OK);
    CHECK(memcmp(here, there, w->size * sizeof(float)) == 0);
  }
  free(here);
  free(there);
}

TEST(a_file_gives_the_same_bits_back)
{
  for (int cyclic = 0; cyclic < 2; cyclic++) {
    walk w;
    walk_begin(&w, 12, 9.3);
    exm_sequence *sequence = fitted(&w, cyclic), *loaded = NULL;
    const char *path = test_file("walk.exmseq", "", 0);
    exm_sequence_file_report saved, read;
    exm_sequence_file_report_init(&saved);
    exm_sequence_file_report_init(&read);
    CHECK_STATUS(exm_sequence_insert_control_point(sequence, 0, 3, NULL), EXM_OK);
    CHECK_STATUS(exm_sequence_save(sequence, path, &saved), EXM_OK);
    CHECK_STATUS(exm_sequence_load(path, &read, &loaded), EXM_OK);
    REQUIRE(loaded != NULL);
    unsigned char *bytes;
    CHECK(read_bytes(path, &bytes) == saved.file_size && saved.file_size == read.file_size);
    free(bytes);
    CHECK(saved.frames_size == 12 * w.size * sizeof(float) && read.frames_size == saved.frames_size);
    CHECK_NEAR(saved.ratio, (double)saved.frames_size / (double)saved.file_size, 1e-12);
    check_same(&w, sequence, loaded);
    /* It can still be edited and placed. */
    uint32_t const frame = 2;
    double const point[2] = {0.3, 0.4};
    exm_pins const pins = {1, &frame, point};
    CHECK_STATUS(exm_sequence_place(sequence, &pins, 0, NULL), EXM_OK);
    CHECK_STATUS(exm_sequence_place(loaded, &pins, 0, NULL), EXM_OK);
    check_same(&w, sequence, loaded);
    CHECK_STATUS(exm_sequence_fit(loaded, NULL, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "0 frames");
    CHECK_STATUS(exm_sequence_measure(loaded, NULL, NULL), EXM_ERROR_ARGUMENT, "holds 0 frames");
    exm_sequence_destroy(sequence);
    exm_sequence_destroy(loaded);
    walk_end(&w);
  }
}

/** The status of loading these bytes, which must not be a success unless told so. */
static exm_status load_bytes(const unsigned char *bytes, size_t size)
{
  exm_sequence *loaded = (exm_sequence *)(uintptr_t)1;
  exm_status const status = exm_sequence_load(test_file("hostile.exmseq", bytes, size), NULL, &loaded);
  CHECK((status < 0) == (loaded == NULL));
  exm_sequence_destroy(status < 0 ? NULL : loaded);
  return status;
}

static void put_check_sum(unsigned char *bytes, size_t size)
{
  uint32_t const sum = crc_add(0, bytes, size - 4);
  for (size_t i = 0; i < 4; i++) {
    bytes[size - 4 + i] = (unsigned char)(sum >> (8 * i));
  }
}

TEST(damaged_files_are_refused)
{
  walk w;
  unsigned char *bytes;
  walk_begin(&w, 12, 9.3);
  exm_sequence *sequence = fitted(&w, 0);
  const char *path = test_file("walk.exmseq", "", 0);
  CHECK_STATUS(exm_sequence_save(sequence, path, NULL), EXM_OK);
  size_t const size = read_bytes(path, &bytes);
  CHECK(load_bytes(bytes, size) == EXM_OK);
  for (size_t cut = 0; cut < size; cut += cut < 200 ? 1 : 97) {
    test_about("cut to %zu bytes", cut);
    CHECK(load_bytes(bytes, cut) == EXM_ERROR_IO);
  }
  for (size_t i = 0; i < size; i += i < 200 ? 1 : 89) {
    test_about("byte %zu", i);
    bytes[i] ^= 0x40;
    CHECK(load_bytes(bytes, size) == EXM_ERROR_IO);
    bytes[i] ^= 0x40;
  }
  bytes[8] = 2;
  CHECK(load_bytes(bytes, size) == EXM_ERROR_IO);
  CHECK(strstr(exm_last_error(), "version 2"));
  exm_sequence *loaded = NULL;
  CHECK_STATUS(exm_sequence_load("/nowhere/at/all", NULL, &loaded), EXM_ERROR_IO, "/nowhere/at/all");
  exm_sequence_destroy(sequence);
  free(bytes);
  walk_end(&w);
}

/* With a check sum that fits, whatever is in it: an error or a sequence that can be used, and no crash. */
TEST(hostile_files_do_no_harm)
{
  walk w;
  unsigned char *bytes;
  float *positions;
  test_random random = {7};
  walk_begin(&w, 12, 9.3);
  positions = test_array(w.size, sizeof(float));
  exm_sequence *sequence = fitted(&w, 1);
  const char *path = test_file("walk.exmseq", "", 0);
  CHECK_STATUS(exm_sequence_save(sequence, path, NULL), EXM_OK);
  size_t const size = read_bytes(path, &bytes);
  unsigned char *changed = test_array(size, 1);
  size_t refused = 0, rounds = 3000;
  for (size_t round = 0; round < rounds; round++) {
    size_t const length = round % 3 ? size : (size_t)(test_uniform(&random) * (double)size);
    memcpy(changed, bytes, size);
    for (int i = 0; i < 1 + (int)(round % 4); i++) {
      /* Counts and small sections stand at the front and at the back; the components in between are mere numbers. */
      double const spot = test_uniform(&random);
      size_t const at = round % 2 ? (size_t)(spot * 200) : size - 1 - (size_t)(spot * (double)(size / 4));
      changed[at] = (unsigned char)(256 * test_uniform(&random));
    }
    if (length < 20) {
      continue;
    }
    put_check_sum(changed, length);
    exm_sequence *loaded = NULL;
    test_about("round %zu", round);
    exm_status const status = exm_sequence_load(test_file("hostile.exmseq", changed, length), NULL, &loaded);
    CHECK(status == EXM_OK || status == EXM_ERROR_IO || status == EXM_ERROR_OUT_OF_MEMORY);
    refused += status < 0;
    if (loaded) {
      exm_sequence_info info;
      exm_sequence_info_init(&info);
      exm_sequence_get_info(loaded, &info);
      if (info.vertex_count == w.shape.vertex_count) {
        exm_sequence_evaluate(loaded, 3.3, positions);
        exm_sequence_evaluate(loaded, 1e12, positions);
      }
      exm_sequence_delete_control_point(loaded, 0, 0);
      exm_sequence_insert_control_point(loaded, 0, 1, NULL);
      exm_pins const pins = {0};
      exm_sequence_place(loaded, &pins, 3, NULL);
    }
    exm_sequence_destroy(loaded);
  }
  CHECK(refused > rounds / 10 && refused < rounds);
  exm_sequence_destroy(sequence);
  free(bytes);
  free(changed);
  free(positions);
  walk_end(&w);
}

TEST(a_full_disk_leaves_the_old_file)
{
#if defined(_WIN32) || defined(EXM_SANITIZED)
  SKIP("no limit of file sizes here");
#else
  walk w;
  unsigned char *before;
  walk_begin(&w, 12, 9.3);
  exm_sequence *sequence = fitted(&w, 0);
  char path[512];
  snprintf(path, sizeof path, "%s", test_file("walk.exmseq", "what was here", 13));
  struct rlimit old, little = {1000, RLIM_INFINITY};
  getrlimit(RLIMIT_FSIZE, &old);
  little.rlim_max = old.rlim_max;
  signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &little);
  exm_status const status = exm_sequence_save(sequence, path, NULL);
  setrlimit(RLIMIT_FSIZE, &old);
  CHECK_STATUS(status, EXM_ERROR_IO, "walk.exmseq", "cannot be written");
  size_t const size = read_bytes(path, &before);
  CHECK(size == 13 && memcmp(before, "what was here", 13) == 0);
  strcat(path, ".part0");
  FILE *rest = fopen(path, "rb");
  CHECK(rest == NULL);
  CHECK_STATUS(exm_sequence_save(sequence, "/nowhere/at/all", NULL), EXM_ERROR_IO, "/nowhere/at/all");
  free(before);
  exm_sequence_destroy(sequence);
  walk_end(&w);
#endif
}
