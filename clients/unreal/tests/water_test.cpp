// Level, depth, tilt, bed and what the server is asked.

#include "core/water.h"
#include "expect.h"

using namespace wade;

namespace {

// A body whose center of mass is off the hull's origin, tilted, moving and turning, over a sloping surface.
struct Case {
  Body body;
  Motion motion;
  Water water;
  double z0 = -0.2;
  Case() {
    body.center_of_mass = {0.1, -0.05, 0.03};
    motion.position = {3.0, -1.0, 0.4};
    motion.attitude = turn(Vec3{0.2, -0.15, 0.9});
    motion.velocity = {1.2, 0.3, -0.4};
    motion.angular_velocity = {0.3, -0.5, 0.2};
    water.point = {0.0, 0.0, 0.5};
    const Vec3 n{0.1, -0.05, 1.0};
    water.normal = (1.0 / norm(n)) * n;
  }
};

}  // namespace

TEST(a_level_hull_is_as_deep_as_the_water_over_its_wheels) {
  Motion motion;
  motion.position = {0.0, 0.0, 0.6};
  Water water;
  water.point = {9.0, 9.0, 0.65};
  const Immersion immersion = immerse(Body{}, motion, water, -0.18);
  EXPECT_NEAR(immersion.depth, 0.65 - (0.6 - 0.18), 1e-12);
  EXPECT_VECTOR(immersion.up, (Vec3{0.0, 0.0, 1.0}), 1e-15);
}

// The server cuts the hull's z axis at z0 + depth: that point, taken to the world, must lie on the surface.
TEST(the_depth_of_a_tilted_hull_cuts_its_axis_at_the_surface) {
  const Case c;
  const Immersion immersion = immerse(c.body, c.motion, c.water, c.z0);
  const Vec3 cut = hull_origin(c.body, c.motion) + rotate(c.motion.attitude, Vec3{0.0, 0.0, c.z0 + immersion.depth});
  EXPECT_NEAR(dot(c.water.normal, cut - c.water.point), 0.0, 1e-12);
}

TEST(the_depth_rate_is_the_rate_of_the_depth) {
  const Case c;
  const double h = 1e-5;
  const double before = immerse(c.body, drifted(c.motion, -h), c.water, c.z0).depth;
  const double after = immerse(c.body, drifted(c.motion, h), c.water, c.z0).depth;
  EXPECT_NEAR(immerse(c.body, c.motion, c.water, c.z0).depth_rate, (after - before) / (2.0 * h), 1e-8);
}

// Roll of 0.1 rad to the right, then none: up = (-sin pitch, sin roll cos pitch, cos roll cos pitch), docs/src/developer/conventions.md.
TEST(gravity_leans_as_the_conventions_say) {
  Motion motion;
  motion.attitude = turn(Vec3{0.0, 0.2, 0.0}) * turn(Vec3{0.1, 0.0, 0.0});
  const Immersion immersion = immerse(Body{}, motion, Water{}, -0.2);
  const wade_state state = question(Body{}, motion, Water{}, immersion, {});
  EXPECT_NEAR(state.gravity_direction[0], std::sin(0.2), 1e-6);
  EXPECT_NEAR(state.gravity_direction[1], -std::sin(0.1) * std::cos(0.2), 1e-6);
  EXPECT_NEAR(state.gravity_direction[2], -std::cos(0.1) * std::cos(0.2), 1e-6);
}

// Turned by 90 degrees to the left and driving north with 2 m/s against a current of 0.5 m/s to the south.
TEST(velocities_are_told_in_the_hull_frame) {
  Motion motion;
  motion.attitude = turn(Vec3{0.0, 0.0, std::acos(0.0)});
  motion.velocity = {0.0, 2.0, 0.0};
  Water water;
  water.current = {0.0, -0.5, 0.0};
  water.density = 1025.0;
  const wade_state state = question(Body{}, motion, water, immerse(Body{}, motion, water, -0.2), {});
  EXPECT_NEAR(state.velocity_mps[0], 2.0, 1e-6);
  EXPECT_NEAR(state.current_mps[0], -0.5, 1e-6);
  EXPECT_NEAR(state.heading_rad, std::acos(0.0), 1e-6);
  EXPECT_NEAR(state.density_kgpm3, 1025.0, 0.0);
  EXPECT_NEAR(twist_through_water(motion, water).linear.x, 2.5, 1e-12);
}

// The velocity of the hull's origin, not of the center of mass: a spin of 2 rad/s about z, the center of mass 0.1 m ahead.
TEST(the_question_is_about_the_hulls_origin) {
  Body body;
  body.center_of_mass = {0.1, 0.0, 0.0};
  Motion motion;
  motion.angular_velocity = {0.0, 0.0, 2.0};
  const wade_state state = question(body, motion, Water{}, immerse(body, motion, Water{}, -0.2), {});
  EXPECT_NEAR(state.velocity_mps[1], -0.2, 1e-7);
}

// A hull on a ramp, on its nose, on its side and on its back, its origin above the water and below: what of it is under water
// in the world is under water in the question, up . x < level.
TEST(the_question_has_the_water_level_in_any_attitude) {
  for (const Vec3& tilt : {Vec3{}, Vec3{0.0, 0.5, 0.0}, Vec3{0.1, 1.55, 0.0}, Vec3{1.5, 0.0, 0.4}, Vec3{3.1, 0.0, 0.0}}) {
    for (const double height : {0.3, 0.0, -0.4}) {
      Case c;
      c.motion.attitude = turn(tilt);
      c.motion.position = c.water.point + height * c.water.normal + rotate(c.motion.attitude, c.body.center_of_mass);
      const Immersion immersion = immerse(c.body, c.motion, c.water, c.z0);
      const wade_state state = question(c.body, c.motion, c.water, immersion, {});
      EXPECT((state.flags & WADE_HAS_WATER_LEVEL) != 0);
      EXPECT_NEAR(state.water_level_m, -height, 1e-6);
      const Vec3 bumper{0.43, 0.1, -0.1};
      const Vec3 there = hull_origin(c.body, c.motion) + rotate(c.motion.attitude, bumper);
      const Vec3 down{state.gravity_direction[0], state.gravity_direction[1], state.gravity_direction[2]};
      EXPECT_NEAR(static_cast<double>(state.water_level_m) + dot(down, bumper), dot(c.water.normal, c.water.point - there), 1e-6);
    }
  }
}

// On its side a hull has no depth, whose rate would be a wild number.
TEST(the_question_has_a_depth_rate_where_there_is_a_depth) {
  Case c;
  EXPECT((question(c.body, c.motion, c.water, immerse(c.body, c.motion, c.water, c.z0), {}).flags & WADE_HAS_DEPTH_RATE) != 0);
  c.motion.attitude = turn(Vec3{1.7, 0.0, 0.0});
  const Immersion side = immerse(c.body, c.motion, c.water, c.z0);
  EXPECT(std::isfinite(side.depth) && std::isfinite(side.depth_rate));
  EXPECT((question(c.body, c.motion, c.water, side, {}).flags & WADE_HAS_DEPTH_RATE) == 0);
}

// Straight down from where the ground-contact plane is at the origin, whatever the waves do.
TEST(the_question_has_the_clearance_of_a_bed_that_is_known) {
  Case c;
  Immersion immersion = immerse(c.body, c.motion, c.water, c.z0);
  EXPECT(!immersion.bed_clearance);
  EXPECT((question(c.body, c.motion, c.water, immersion, {}).flags & WADE_HAS_BED_CLEARANCE) == 0);

  c.water.bed_height = -3.0;
  immersion = immerse(c.body, c.motion, c.water, c.z0);
  const wade_state state = question(c.body, c.motion, c.water, immersion, {});
  EXPECT((state.flags & WADE_HAS_BED_CLEARANCE) != 0);
  const Vec3 contact = hull_origin(c.body, c.motion) + rotate(c.motion.attitude, Vec3{0.0, 0.0, c.z0});
  EXPECT_NEAR(state.bed_clearance_m, contact.z + 3.0, 1e-6);

  // wheels that sink into the bed are on it
  c.water.bed_height = contact.z + 0.02;
  EXPECT_NEAR(*immerse(c.body, c.motion, c.water, c.z0).bed_clearance, 0.0, 0.0);
}

// The server refuses what is beyond 1000 m.
TEST(a_hull_in_a_trench_asks_what_the_server_takes) {
  Motion motion;
  motion.position.z = -4000.0;
  Water water;
  water.bed_height = -9000.0;
  const wade_state state = question(Body{}, motion, water, immerse(Body{}, motion, water, -0.2), {});
  EXPECT_NEAR(state.water_level_m, 1000.0, 0.0);
  EXPECT_NEAR(state.bed_clearance_m, 1000.0, 0.0);
}
