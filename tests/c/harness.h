/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The C test harness: a file of TESTs is a program, main() comes from harness.c. It prints "ok <file>.<test>",
 * "FAIL <file>.<test>" or "skip <file>.<test>: why" a test and "end" at last, so that a crash is noticed.
 *
 *   TEST(grid_has_no_flaws)
 *   {
 *     REQUIRE(grid != NULL);                                        leaves the test
 *     CHECK(edges == 12);                                           goes on
 *     CHECK_NEAR(area, 4.0, 1e-12);                                 absolute
 *     CHECK_STATUS(exm_mesh_create(...), EXM_ERROR_TOPOLOGY, "triangle 3", "vertex 9");  status and message
 *   }
 */
#ifndef EXM_TESTS_HARNESS_H
#define EXM_TESTS_HARNESS_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "exemplar.h"

typedef struct test_case {
  const char *name;
  void (*run)(void);
  struct test_case *next;
} test_case;

void test_register(test_case *test);

#define TEST(id)                                                                                                       \
  static void test_##id(void);                                                                                         \
  static test_case case_##id = {#id, test_##id, NULL};                                                                 \
  __attribute__((constructor)) static void register_##id(void)                                                         \
  {                                                                                                                    \
    test_register(&case_##id);                                                                                         \
  }                                                                                                                    \
  static void test_##id(void)

/** What follows is about this (a mesh of the zoo, a loop's round); printed with failures. NULL: about nothing. */
void test_about(const char *format, ...) __attribute__((format(printf, 1, 2)));

/** Report a failure at a line; the first few of a test are printed. */
void test_fail(const char *file, int line, const char *format, ...) __attribute__((format(printf, 3, 4)));

/** Mark the running test as skipped; return from it. */
void test_skip(const char *why);

bool test_near(const char *file, int line, const char *text, double value, double expected, double tolerance);

/** `fragments` ends with NULL; exm_last_error() must contain every one of them. */
bool test_status(const char *file, int line, const char *text, exm_status status, exm_status expected,
                 const char *const *fragments);

#define CHECK(condition) ((condition) ? (void)0 : test_fail(__FILE__, __LINE__, "%s", #condition))
#define CHECK_NEAR(value, expected, tolerance)                                                                         \
  ((void)test_near(__FILE__, __LINE__, #value, (value), (expected), (tolerance)))
#define CHECK_STATUS(call, ...) CHECK_STATUS_(call, __VA_ARGS__, NULL)
#define CHECK_STATUS_(call, expected, ...)                                                                             \
  ((void)test_status(__FILE__, __LINE__, #call, (call), (expected), (const char *const[]){__VA_ARGS__, NULL}))
#define REQUIRE(condition)                                                                                             \
  do {                                                                                                                 \
    if (!(condition)) {                                                                                                \
      test_fail(__FILE__, __LINE__, "%s", #condition);                                                                 \
      return;                                                                                                          \
    }                                                                                                                  \
  } while (0)
#define SKIP(why)                                                                                                      \
  do {                                                                                                                 \
    test_skip(why);                                                                                                    \
    return;                                                                                                            \
  } while (0)

/** Deterministic numbers in [0, 1): seed it, and a failure can be repeated. */
typedef struct test_random {
  uint64_t state;
} test_random;
double test_uniform(test_random *random);

/** malloc that ends the program with a FAIL line where it fails; free() it. */
void *test_array(size_t count, size_t size);

/** Write a file of that name into a folder that vanishes with the program; returns its path, valid until the next call.
 */
const char *test_file(const char *name, const void *bytes, size_t size);

/** Path of a real mesh (EXEMPLAR_DATA), valid until the next call; NULL where it is not there: SKIP then. */
const char *test_data(const char *name);

#endif
