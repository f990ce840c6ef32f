/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Structs that grow: programs compiled against an older or a newer header. */
#include "api/structs.h"

#include "harness.h"

/* A settings struct as we know it, as an old header had it, and as a new one will. */
typedef struct ours {
  size_t struct_size;
  double first;
  int32_t second;
} ours;

typedef struct old {
  size_t struct_size;
  double first;
} old;

typedef struct newer {
  ours known;
  double third;
} newer;

TEST(settings_may_be_left_out)
{
  ours settings = {sizeof settings, 1, 2};
  CHECK_STATUS(settings_read(&settings, sizeof settings, NULL, "settings"), EXM_OK);
  CHECK(settings.first == 1 && settings.second == 2);
}

TEST(settings_of_an_old_program_keep_new_defaults)
{
  ours settings = {sizeof settings, 1, 2};
  old const theirs = {sizeof theirs, 10};
  CHECK_STATUS(settings_read(&settings, sizeof settings, &theirs, "settings"), EXM_OK);
  CHECK(settings.first == 10 && settings.second == 2 && settings.struct_size == sizeof settings);
}

TEST(settings_of_a_newer_program_are_read_as_far_as_known)
{
  struct {
    ours settings;
    double guard;
  } mine = {{sizeof(ours), 1, 2}, 7};
  newer const theirs = {{sizeof theirs, 10, 20}, 30};
  CHECK_STATUS(settings_read(&mine.settings, sizeof mine.settings, &theirs, "settings"), EXM_OK);
  CHECK(mine.settings.first == 10 && mine.settings.second == 20 && mine.settings.struct_size == sizeof(ours));
  CHECK(mine.guard == 7);
}

TEST(structs_without_a_size_are_refused)
{
  ours settings = {sizeof settings, 1, 2};
  ours theirs = {0, 10, 20};
  CHECK_STATUS(settings_read(&settings, sizeof settings, &theirs, "settings"), EXM_ERROR_ARGUMENT,
               "settings->struct_size is 0", "_init");
  CHECK_STATUS(report_write(&theirs, &settings, sizeof settings, "report"), EXM_ERROR_ARGUMENT,
               "report->struct_size is 0");
  theirs.struct_size = 1 << 20;
  CHECK_STATUS(report_check(&theirs, "report"), EXM_ERROR_ARGUMENT, "report->struct_size is 1048576");
  CHECK(settings.first == 1 && theirs.first == 10);
}

TEST(reports_may_be_left_out)
{
  ours const found = {sizeof found, 1, 2};
  CHECK_STATUS(report_write(NULL, &found, sizeof found, "report"), EXM_OK);
  CHECK_STATUS(report_check(NULL, "report"), EXM_OK);
}

TEST(pointers_that_are_needed)
{
  CHECK_STATUS(check_pointer(NULL, "mesh"), EXM_ERROR_ARGUMENT, "mesh is NULL");
  CHECK_STATUS(check_pointer("", "mesh"), EXM_OK);
}
