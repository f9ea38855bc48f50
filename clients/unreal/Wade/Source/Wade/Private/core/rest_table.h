// What a vehicle at rest feels in the water, asked of the server once: what keeps it afloat while no answer comes.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "water.h"

namespace wade {

// What a table needs to know of a hull, hull frame [m].
struct Hull {
  Vec3 center_of_mass;
  // z of the ground-contact plane.
  double z0 = 0.0;
  // No point of the hull is further from its origin.
  double radius = std::numeric_limits<double>::infinity();
};

class RestTable {
 public:
  // Water levels above the origin from minus to plus the hull's radius, or this where it is not known [m]; beyond, the first
  // and the last row hold.
  static constexpr double usual_reach = 1.6;
  static constexpr int rows = 81;

  // States at rest. Per row: level, rolled and pitched by a little, on its back, on its rear, its nose and both sides.
  static std::vector<wade_state> questions(const Hull& hull);

  // From the answers to `questions()`, in their order. Of a bundle without the physical base only upright answers within the
  // depths of the training domain are believed: from no water to the first depth within, and from the last one on, the table
  // goes straight, and the other attitudes lift as much at a level above the origin as that depth does.
  RestTable(const std::vector<wade_forces>& answers, const Hull& hull);

  // The bundle that answered.
  std::uint32_t bundle_version() const { return bundle_version_; }

  // Force along the normal in fresh water [N]. The surface cuts each axis of the hull at a level; the lift of the hull that
  // stands on that axis in that level counts with the fourth power of the normal's component, of a sum of one: near level it
  // is that of the level hull. In a fixed attitude it is a function of height alone, so that a body that only heaves gets its
  // work back.
  double lift(const Immersion& immersion) const;

  // Force and moment about the center of mass, hull axes. The moment is that of an upright hull, linear in the tilt, and counts
  // with the same share: none on its side.
  Vec6 load(const Immersion& immersion, double density) const;

 private:
  static constexpr std::size_t attitudes = 5;  // those in which a row has a lift alone

  struct Row {
    double lift = 0.0;      // level [N]
    Vec3 moment;            // [N m]
    Vec3 moment_per_roll;   // [N m/rad]
    Vec3 moment_per_pitch;  // [N m/rad]
    std::array<double, attitudes> lifts{};
  };
  // Between two rows.
  struct Place {
    const Row &low, &high;
    double share;

    double lift() const { return (1.0 - share) * low.lift + share * high.lift; }
    double lift(std::size_t attitude) const { return (1.0 - share) * low.lifts[attitude] + share * high.lifts[attitude]; }
    Vec3 mean(Vec3 Row::* moment) const { return (1.0 - share) * (low.*moment) + share * (high.*moment); }
  };

  Place at(double level) const;
  double level_of(std::size_t row) const;
  void go_straight_outside(const std::vector<bool>& within, double z0);

  std::vector<Row> rows_;
  double reach_;
  std::uint32_t bundle_version_ = 0;
};

}  // namespace wade
