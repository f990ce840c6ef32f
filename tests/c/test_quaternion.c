/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "linalg/quaternion.h"

#include "harness.h"
#include "linalg/rotation.h"

static void draw(test_random *random, double rotation[9])
{
  for (int i = 0; i < 9; i++) {
    rotation[i] = test_uniform(random) - 0.5;
  }
  rotation_fit3(1, rotation, rotation);
}

TEST(rotations_there_and_back)
{
  test_random random = {4};
  double rotation[9], again[9], q[4];
  for (int round = 0; round < 1000; round++) {
    draw(&random, rotation);
    if (round < 3) { /* half turns, where the real part vanishes */
      for (int i = 0; i < 9; i++) {
        rotation[i] = i % 4 == 0 ? (i / 4 == round ? 1 : -1) : 0;
      }
    }
    quaternion_from_rotation(rotation, q);
    quaternion_to_rotation(q, again);
    for (int i = 0; i < 9; i++) {
      CHECK_NEAR(again[i], rotation[i], 1e-14);
    }
  }
}

TEST(turns_lead_from_one_to_the_other)
{
  test_random random = {5};
  double rotation[9], a[4], b[4], turn[3], found[4];
  for (int round = 0; round < 200; round++) {
    draw(&random, rotation);
    quaternion_from_rotation(rotation, a);
    draw(&random, rotation);
    quaternion_from_rotation(rotation, b);
    quaternion_turn(a, b, turn);
    CHECK(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2] <= M_PI * M_PI * (1 + 1e-12));
    quaternion_turned(a, turn, found);
    double dot = 0;
    for (int i = 0; i < 4; i++) {
      dot += found[i] * b[i];
    }
    CHECK_NEAR(fabs(dot), 1, 1e-14);
  }
}

TEST(curves_meet_their_ends_and_velocities)
{
  test_random random = {6};
  double rotation[9], a[4], b[4], found[4], turn[3], va[3], vb[3];
  for (int round = 0; round < 50; round++) {
    draw(&random, rotation);
    quaternion_from_rotation(rotation, a);
    for (int k = 0; k < 3; k++) {
      va[k] = test_uniform(&random) - 0.5;
      vb[k] = test_uniform(&random) - 0.5;
      turn[k] = 2 * (test_uniform(&random) - 0.5);
    }
    quaternion_turned(a, turn, b);
    double const step = 1e-6;
    quaternion_curve(a, va, vb, b, step, found);
    quaternion_turn(a, found, turn);
    for (int k = 0; k < 3; k++) {
      CHECK_NEAR(turn[k] / step, va[k], 1e-4);
    }
    quaternion_curve(a, va, vb, b, 1 - step, found);
    quaternion_turn(b, found, turn);
    for (int k = 0; k < 3; k++) {
      CHECK_NEAR(-turn[k] / step, vb[k], 1e-4);
    }
  }
}
