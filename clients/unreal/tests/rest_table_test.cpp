// The table of a box, whose hydrostatics are known.

#include <algorithm>

#include "box.h"
#include "expect.h"

using namespace wade;

namespace {

// A hull whose origin is at a height above the surface [m].
Immersion at(const Vec3& up, double height, double z0) {
  Immersion immersion;
  immersion.up = (1.0 / norm(up)) * up;
  immersion.height = height;
  immersion.depth = -height / std::max(immersion.up.z, least_up_z) - z0;
  return immersion;
}

Immersion level(const Box& box, double depth) { return at({0.0, 0.0, 1.0}, -(box.z0() + depth), box.z0()); }

// Volume of a box that stands on one of its sides [m3].
double displaced(double side, double height, double above) { return side * std::clamp(0.5 * height - above, 0.0, height); }

}  // namespace

TEST(the_table_lifts_as_archimedes_does) {
  const Box box;
  const auto table = Planted(box).table();
  for (const double depth : {0.0, 0.05, 0.1, 0.333, 0.38}) {
    EXPECT_NEAR(table->load(level(box, depth), 1025.0).linear.z, 1025.0 * 9.81 * box.area() * depth, 5.0);
  }
  EXPECT_NEAR(table->load(level(box, 9.0), 1000.0).linear.z, 9810.0 * box.area() * box.height, 0.1);
  EXPECT_NEAR(table->load(level(box, -0.1), 1000.0).linear.z, 0.0, 0.0);
  EXPECT(table->bundle_version() == 7);
}

// Pitch: rho g (I - V BG) about the center of mass, which is the middle of the box; its grid of
// columns has 2 % less.
TEST(the_table_rights_a_pitched_box) {
  const Box box;
  const double pitch = 0.03;
  const Immersion immersion = at({-std::sin(pitch), 0.0, std::cos(pitch)}, -(box.z0() + 0.2), box.z0());
  const double inertia = box.width * std::pow(box.length, 3) / 12.0, volume = box.area() * 0.2;
  const double righting = 9810.0 * (inertia - volume * 0.1) * pitch;
  EXPECT_NEAR(Planted(box).table()->load(immersion, 1000.0).angular.y, -righting, 0.03 * righting);
}

// On end, on its side and on its back, also where the middle of the box is above the water and its depth is negative.
TEST(the_table_lifts_as_archimedes_does_in_every_attitude) {
  Box box;
  box.mass = 80.0;
  const auto table = Planted(box).table();
  const double x = box.length, y = box.width, z = box.height;
  for (const double above : {0.45, 0.25, 0.1, 0.0, -0.15, -0.45, -3.0}) {
    for (const double sign : {1.0, -1.0}) {
      const auto lift = [&](const Vec3& up) { return table->load(at(sign * up, above, box.z0()), 1000.0); };
      EXPECT_VECTOR(lift({1.0, 0.0, 0.0}).linear, (Vec3{sign * 9810.0 * displaced(y * z, x, above), 0.0, 0.0}), 15.0);
      EXPECT_VECTOR(lift({0.0, 1.0, 0.0}).linear, (Vec3{0.0, sign * 9810.0 * displaced(x * z, y, above), 0.0}), 25.0);
      EXPECT_VECTOR(lift({0.0, 0.0, 1.0}).linear, (Vec3{0.0, 0.0, sign * 9810.0 * displaced(x * y, z, above)}), 35.0);
    }
  }
}

// A hull that is another one at each of its ends.
TEST(the_table_has_a_lift_for_each_end_of_the_hull) {
  const auto of_end = [](const Vec3& up) { return 100.0 + dot(Vec3{10.0, 20.0, 5.0}, up); };
  std::vector<wade_forces> answers;
  for (const wade_state& state : RestTable::questions({})) {
    const Vec3 up{-state.gravity_direction[0], -state.gravity_direction[1], -state.gravity_direction[2]};
    wade_forces forces{};
    forces.flags = WADE_HAS_BASE;
    const Vec3 lift = of_end(up) * up;
    forces.force_n[0] = static_cast<float>(lift.x);
    forces.force_n[1] = static_cast<float>(lift.y);
    forces.force_n[2] = static_cast<float>(lift.z);
    answers.push_back(forces);
  }
  const RestTable table(answers, {});
  for (const Vec3& end : {Vec3{1.0, 0.0, 0.0}, Vec3{0.0, 1.0, 0.0}, Vec3{0.0, 0.0, 1.0}}) {
    for (const Vec3& up : {end, -end}) EXPECT_NEAR(table.lift(at(up, 0.1, -0.2)), of_end(up), 1e-4);
  }
}

// From upright to its nose and on to its back: no jump, none above the water, all of it deep under.
TEST(the_table_has_no_jump_between_attitudes) {
  const Box box;
  const auto table = Planted(box).table();
  for (const double above : {0.3, 0.05, -0.1, -0.3}) {
    double before = table->lift(at({0.0, 0.0, 1.0}, above, box.z0()));
    for (double pitch = 0.0; pitch < 3.14; pitch += 0.01) {
      const Vec3 up{-std::sin(pitch), 0.0, std::cos(pitch)};
      const double now = table->lift(at(up, above, box.z0()));
      EXPECT(std::fabs(now - before) < 0.03 * 9810.0 * box.area() * box.height);
      before = now;
      EXPECT_NEAR(table->lift(at(up, box.radius(), box.z0())), 0.0, 1e-3);
      EXPECT_NEAR(table->lift(at(up, -box.radius(), box.z0())), 9810.0 * box.area() * box.height, 0.1);
    }
  }
}

// A server that knows depths from 0.1 to 0.3 m and answers nonsense elsewhere, as a network may.
TEST(the_table_goes_straight_where_the_server_does_not_know) {
  Box box;
  box.height = 2.0;
  const Hull hull{{}, box.z0(), 2.0};
  std::vector<wade_forces> answers;
  for (const wade_state& state : RestTable::questions(hull)) {
    answers.push_back(box.answer(state));
    answers.back().flags = 0;
    const double depth = static_cast<double>(state.water_level_m) - box.z0();
    if (state.gravity_direction[2] < -0.9F && depth >= 0.1 && depth <= 0.3) continue;
    answers.back().outside[WADE_QUANTITY_DEPTH] = depth < 0.1 ? -0.01F : 0.01F;
    answers.back().force_n[2] = 5e5F;
    answers.back().moment_nm[0] = -7e4F;
  }
  const RestTable table(answers, hull);
  for (const double depth : {-0.3, 0.0, 0.01, 0.09, 0.2, 0.31, 0.9}) {
    const Vec6 load = table.load(level(box, depth), 1000.0);
    EXPECT_NEAR(load.linear.z, 9810.0 * box.area() * std::max(depth, 0.0), 1.0);
    EXPECT_NEAR(load.angular.x, 0.0, 0.1);
  }
  // on its side it knows nothing better than the depth of its middle
  EXPECT_NEAR(table.lift(at({0.0, 1.0, 0.0}, -0.2, box.z0())), 9810.0 * box.area() * 0.2, 1.0);
}

TEST(a_table_of_a_hull_of_unknown_size_reaches_as_far_as_the_usual_one) {
  Hull hull;
  const std::vector<wade_state> states = RestTable::questions(hull);
  EXPECT_NEAR(states.front().water_level_m, -RestTable::usual_reach, 1e-6);
  EXPECT_NEAR(states.back().water_level_m, RestTable::usual_reach, 1e-6);
  EXPECT(states.size() <= WADE_MAX_BATCH);
}
