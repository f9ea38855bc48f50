// Added mass through a force: the motion must be that of the heavier body.

#include "core/added_mass.h"
#include "box.h"
#include "expect.h"

using namespace wade;

namespace {

Mat6 diagonal(double mass, double inertia) {
  Mat6 matrix{};
  for (std::size_t i = 0; i < 3; ++i) matrix[i][i] = mass, matrix[i + 3][i + 3] = inertia;
  return matrix;
}

}  // namespace

// A sphere that displaces its own mass twice, released: a = (m - rho V) g / (m + rho V / 2) = -g/2 (Newman, Marine
// Hydrodynamics).
TEST(a_light_sphere_rises_with_the_textbook_acceleration) {
  Body body;
  body.mass = 1.0;
  body.inertia.rows = {Vec3{1.0, 0.0, 0.0}, Vec3{0.0, 1.0, 0.0}, Vec3{0.0, 0.0, 1.0}};
  const Response response =
      respond(body, diagonal(1.0, 0.0), {{0.0, 0.0, 2.0 * 9.81}, {}}, {{0.0, 0.0, -9.81}, {}}, {});
  EXPECT_NEAR(response.acceleration.linear.z, 9.81 / 2.0, 1e-12);
  // what the engine is given makes it do the same with the mass that it knows
  EXPECT_NEAR((response.load.linear.z - 9.81) / body.mass, 9.81 / 2.0, 1e-12);
}

// The matrix goes with the rate of the components in hull axes. A body of 1 kg that turns to the left with 1 rad/s while it goes
// forward with 1 m/s, on which nothing acts but 2 kg of water that lie on its y axis: (1 + 2) nu_dot_y = -1 (omega x v)_y.
TEST(a_turning_body_leaves_the_water_behind) {
  Body body;
  body.inertia.rows = {Vec3{1.0, 0.0, 0.0}, Vec3{0.0, 1.0, 0.0}, Vec3{0.0, 0.0, 1.0}};
  Mat6 added{};
  added[1][1] = 2.0;
  const Response response = respond(body, added, {}, {}, {{1.0, 0.0, 0.0}, {0.0, 0.0, 1.0}});
  EXPECT_NEAR(response.acceleration.linear.y, 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(response.load.linear.y, 2.0 / 3.0, 1e-12);
}

// An engine step by step: from the second step on the other forces are measured, and gravity is exact from the first.
TEST(a_box_with_added_mass_sinks_as_the_heavier_body) {
  Box box;
  box.mass = 480.0;
  box.added_share = 2.5;
  Run run(box, 1.0 / 60.0, 2.0);
  for (int i = 0; i < 60; ++i) run.step();
  const double displaced = 1000.0 * box.area() * box.height;
  const double acceleration = (displaced - box.mass) * 9.81 / (box.mass + 2.5 * displaced);
  EXPECT_NEAR(run.motion.velocity.z, acceleration * 1.0, 1e-5);
}

// The ground holds the body: whatever the load, it does not move. The load must become what the water does, undiminished:
// geometrically, by B = A / (M + A) a step.
TEST(a_body_that_is_held_feels_the_water_undiminished) {
  Box box;
  box.mass = 500.0;
  box.added_share = 1.0;
  Run run(box, 1.0 / 60.0, 0.2);
  const Motion held = run.motion;
  const double lift = 1000.0 * 9.81 * box.area() * 0.2, added = 1000.0 * box.area() * 0.2;
  const double share = added / (box.mass + added);
  double error = 0.0;
  for (int i = 0; i < 12; ++i) {
    run.step();
    run.motion = held;
    if (i > 0) EXPECT_NEAR(lift - run.last.force.z, share * error, 1e-3 * lift * std::pow(share, i) + 2e-3);
    error = lift - run.last.force.z;
  }
  EXPECT_NEAR(run.last.force.z, lift, 1e-3 * lift);
}

// A blow of the engine's own (a collision) on a body in the water: dv = J / (m + a), a step late.
TEST(a_blow_moves_the_water_too) {
  Box box;
  box.mass = 240.0;  // neutral where it is
  box.added_share = 1.0;
  Run run(box, 1.0 / 60.0, 1.0);
  run.step();
  const double blow = 120.0;
  run.motion.velocity.x += blow / box.mass;
  run.step();
  run.step();
  EXPECT_NEAR(run.motion.velocity.x, blow / (240.0 + 240.0), 1e-5);
}

// Twelve times the mass of the body: an explicit force -A a of the last step grows by 12 a step.
TEST(added_mass_far_over_the_bodys_own_is_stable) {
  Box box;
  box.mass = 20.0;
  box.added_share = 1.0;
  Run run(box, 1.0 / 60.0, 0.5);
  double fastest = 0.0;
  for (int i = 0; i < 600; ++i) {
    run.step();
    fastest = std::fmax(fastest, std::fabs(run.motion.velocity.z));
  }
  // the work of the lift down to the float's depth bounds every speed of the heavier body
  EXPECT(std::isfinite(run.motion.velocity.z) && fastest < std::sqrt(2.0 * 9.81 * 0.5 * 240.0 / 20.0));
}

// The matrix at another point does the same work: for any twist, W = -A nu_dot moved as force and moment.
TEST(added_mass_moves_with_the_reference_point) {
  wade_forces forces{};
  forces.flags = WADE_HAS_ADDED_MASS;
  for (std::size_t i = 0; i < 6; ++i) forces.added_mass[7 * i] = static_cast<float>(i + 1);
  forces.about_m[0] = 0.25F;
  forces.about_m[2] = -0.5F;
  const Vec3 center{0.05, 0.1, 0.2};
  const Mat6 moved = added_mass(forces, center);
  const Vec6 rate{{0.3, -0.7, 1.1}, {0.9, 0.2, -0.4}};
  const Vec3 arm = Vec3{0.25, 0.0, -0.5} - center;
  const Vec3 there = rate.linear + cross(rate.angular, arm);
  const Vec3 force{1.0 * there.x, 2.0 * there.y, 3.0 * there.z};
  const Vec3 moment = Vec3{4.0 * rate.angular.x, 5.0 * rate.angular.y, 6.0 * rate.angular.z} + cross(arm, force);
  EXPECT_VECTOR((moved * rate).linear, force, 1e-12);
  EXPECT_VECTOR((moved * rate).angular, moment, 1e-12);
}
