/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "harness.h"

#include <dirent.h>
#include <stdarg.h>
#include <unistd.h>

enum { FAILURES_SHOWN = 10 };

static test_case *first_case;
static test_case **last_case = &first_case;
static char subject[256];
static const char *skipped;
static int failures;

void test_register(test_case *test)
{
  *last_case = test;
  last_case = &test->next;
}

void test_about(const char *format, ...)
{
  subject[0] = 0;
  if (format) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(subject, sizeof subject, format, arguments);
    va_end(arguments);
  }
}

void test_fail(const char *file, int line, const char *format, ...)
{
  if (failures++ >= FAILURES_SHOWN) {
    return;
  }
  va_list arguments;
  va_start(arguments, format);
  printf("  %s:%d: ", file, line);
  if (subject[0]) {
    printf("[%s] ", subject);
  }
  vprintf(format, arguments);
  putchar('\n');
  va_end(arguments);
}

void test_skip(const char *why)
{
  skipped = why;
}

bool test_near(const char *file, int line, const char *text, double value, double expected, double tolerance)
{
  bool const near = fabs(value - expected) <= tolerance; /* false for NaN */
  if (!near) {
    test_fail(file, line, "%s is %.17g, not %.17g within %g", text, value, expected, tolerance);
  }
  return near;
}

bool test_status(const char *file, int line, const char *text, exm_status status, exm_status expected,
                 const char *const *fragments)
{
  const char *message = exm_last_error();
  if (status != expected) {
    test_fail(file, line, "%s returned %d (\"%s\"), not %d", text, status, status ? message : "", expected);
    return false;
  }
  for (size_t i = 0; fragments[i]; ++i) {
    if (!strstr(message, fragments[i])) {
      test_fail(file, line, "%s: the message \"%s\" does not say \"%s\"", text, message, fragments[i]);
      return false;
    }
  }
  return true;
}

double test_uniform(test_random *random)
{
  /* Knuth's linear congruential generator; its upper bits are good enough to shake a mesh. */
  random->state = random->state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
  return (double)(random->state >> 11) * 0x1p-53;
}

void *test_array(size_t count, size_t size)
{
  void *array = calloc(count ? count : 1, size ? size : 1);
  if (!array) {
    puts("  the test itself is out of memory");
    exit(1);
  }
  return array;
}

/* ------------------------------------------------------------------------------------------------------------ files */

static char folder[256];

static void remove_folder(void)
{
  DIR *entries = opendir(folder);
  for (struct dirent *entry = entries ? readdir(entries) : NULL; entry; entry = readdir(entries)) {
    char path[1024];
    snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
    if (entry->d_name[0] != '.') {
      unlink(path);
    }
  }
  if (entries) {
    closedir(entries);
  }
  rmdir(folder);
}

const char *test_file(const char *name, const void *bytes, size_t size)
{
  static char path[512];
  if (!folder[0]) {
    const char *parent = getenv("TMPDIR");
    snprintf(folder, sizeof folder, "%s/exemplar-XXXXXX", parent ? parent : "/tmp");
    if (!mkdtemp(folder)) {
      perror(folder);
      exit(1);
    }
    atexit(remove_folder);
  }
  snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE *stream = fopen(path, "wb");
  if (!stream || fwrite(bytes, 1, size, stream) != size || fclose(stream) != 0) {
    perror(path);
    exit(1);
  }
  return path;
}

const char *test_data(const char *name)
{
  static char path[1024];
  const char *root = getenv("EXEMPLAR_DATA");
  snprintf(path, sizeof path, "%s/%s", root ? root : "../shared/data", name);
  return access(path, R_OK) == 0 ? path : NULL;
}

/* ----------------------------------------------------------------------------------------------------------- running
 */

/* "/some/where/test_mesh" -> "mesh" */
static const char *program_name(const char *path)
{
  const char *slash = strrchr(path, '/');
  const char *name = slash ? slash + 1 : path;
  return strncmp(name, "test_", 5) == 0 ? name + 5 : name;
}

static bool run_case(const test_case *test, const char *full_name)
{
  failures = 0;
  skipped = NULL;
  test_about(NULL);
  test->run();
  if (failures > FAILURES_SHOWN) {
    printf("  ... and %d more\n", failures - FAILURES_SHOWN);
  }
  if (failures) {
    printf("FAIL %s\n", full_name);
  } else if (skipped) {
    printf("skip %s: %s\n", full_name, skipped);
  } else {
    printf("ok %s\n", full_name);
  }
  fflush(stdout);
  return failures == 0;
}

static const char *variable(const char *name)
{
  const char *value = getenv(name);
  return value ? value : "";
}

/* test_mesh [-k PATTERN]: only the tests whose name contains PATTERN. */
int main(int argc, char **argv)
{
  const char *pattern = argc == 3 && strcmp(argv[1], "-k") == 0 ? argv[2] : variable("EXM_TEST_PATTERN");
  int failed = 0;
  for (const test_case *test = first_case; test; test = test->next) {
    char full_name[256];
    snprintf(full_name, sizeof full_name, "%s%s.%s", variable("EXM_TEST_PREFIX"), program_name(argv[0]), test->name);
    if (strstr(full_name, pattern)) {
      failed += !run_case(test, full_name);
    }
  }
  puts("end");
  return failed != 0;
}
