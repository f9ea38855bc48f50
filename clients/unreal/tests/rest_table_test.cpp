// The table of a box, whose hydrostatics are known.

#include "box.h"
#include "expect.h"

using namespace wade;

namespace {
Immersion level(double depth) {
  Immersion immersion;
  immersion.up = {0.0, 0.0, 1.0};
  immersion.depth = depth;
  return immersion;
}
}  // namespace

TEST(the_table_lifts_as_archimedes_does) {
  const Box box;
  const auto table = Planted(box).table();
  for (const double depth : {0.0, 0.05, 0.1, 0.333, 0.38}) {
    EXPECT_NEAR(table->load(level(depth), 1025.0).linear.z, 1025.0 * 9.81 * box.area() * depth, 1.0);
  }
  EXPECT_NEAR(table->load(level(9.0), 1000.0).linear.z, 9810.0 * box.area() * box.height, 0.1);
  EXPECT_NEAR(table->load(level(-0.1), 1000.0).linear.z, 0.0, 0.0);
  EXPECT(table->bundle_version() == 7);
}

// Pitch: rho g (I - V BG) about the center of mass, which is the middle of the box; its grid of
// columns has 2 % less.
TEST(the_table_rights_a_pitched_box) {
  const Box box;
  Immersion immersion = level(0.2);
  const double pitch = 0.03;
  immersion.up = {-std::sin(pitch), 0.0, std::cos(pitch)};
  const double inertia = box.width * std::pow(box.length, 3) / 12.0, volume = box.area() * 0.2;
  const double righting = 9810.0 * (inertia - volume * 0.1) * pitch;
  EXPECT_NEAR(Planted(box).table()->load(immersion, 1000.0).angular.y, -righting, 0.03 * righting);
}

// A server that knows depths from 0.1 to 0.3 m and answers nonsense elsewhere, as a network may.
TEST(the_table_goes_straight_where_the_server_does_not_know) {
  Box box;
  box.height = 2.0;
  std::vector<wade_forces> answers;
  for (const wade_state& state : RestTable::questions()) {
    answers.push_back(box.answer(state));
    if (state.depth_m >= 0.1F && state.depth_m <= 0.3F) continue;
    answers.back().outside[WADE_QUANTITY_DEPTH] = state.depth_m < 0.1F ? -0.01F : 0.01F;
    answers.back().force_n[2] = 5e5F;
    answers.back().moment_nm[0] = -7e4F;
  }
  const RestTable table(answers, {});
  for (const double depth : {0.0, 0.01, 0.09, 0.2, 0.31, 0.9}) {
    const Vec6 load = table.load(level(depth), 1000.0);
    EXPECT_NEAR(load.linear.z, 9810.0 * box.area() * depth, 1.0);
    EXPECT_NEAR(load.angular.x, 0.0, 0.1);
  }
}

TEST(a_table_fits_one_batch_over_shared_memory) { EXPECT(RestTable::questions().size() <= 256); }
