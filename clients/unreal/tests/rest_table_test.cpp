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

TEST(a_table_fits_one_batch_over_shared_memory) { EXPECT(RestTable::questions().size() <= 256); }
