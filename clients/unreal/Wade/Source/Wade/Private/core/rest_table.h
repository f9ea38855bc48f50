// What a vehicle at rest feels at every depth, asked of the server once: what keeps it afloat while no answer comes.

#pragma once

#include <cstdint>
#include <vector>

#include "water.h"

namespace wade {

class RestTable {
 public:
  // Depth of the last row [m]; deeper, the last row holds.
  static constexpr double deepest = 1.6;
  static constexpr int rows = 80;

  // States at rest: per row level, rolled and pitched by a little.
  static std::vector<wade_state> questions();

  // From the answers to `questions()`, in their order; `center_of_mass` as in `Body`. Answers from outside the depths of the
  // training domain are not believed: from no water to the first depth within, and from the last one on, the table goes straight.
  RestTable(const std::vector<wade_forces>& answers, const Vec3& center_of_mass);

  // The bundle that answered.
  std::uint32_t bundle_version() const { return bundle_version_; }

  // Force and moment about the center of mass, hull axes. The force is along the normal, a function of depth alone, so that
  // a body that only heaves gets its work back; the moment is linear in the tilt.
  Vec6 load(const Immersion& immersion, double density) const;

 private:
  struct Row {
    double lift = 0.0;         // [N]
    Vec3 moment;               // level [N m]
    Vec3 moment_per_roll;      // [N m/rad]
    Vec3 moment_per_pitch;     // [N m/rad]
  };

  void go_straight_outside(const std::vector<bool>& within);

  std::vector<Row> rows_;
  std::uint32_t bundle_version_ = 0;
};

}  // namespace wade
