#include "rest_table.h"

#include <algorithm>
#include <cstddef>

namespace wade {
namespace {

constexpr double asked_tilt = 0.02;       // [rad]
constexpr double largest_tilt = 0.5;      // the stiffness is that of small angles [rad]
constexpr double asked_density = 1000.0;  // [kg/m3]

wade_state at_rest(double depth, float roll, float pitch) {
  wade_state state = wade_default_state();
  state.depth_m = static_cast<float>(depth);
  state.density_kgpm3 = static_cast<float>(asked_density);
  // up = (-sin pitch, sin roll cos pitch, cos roll cos pitch), see docs/src/developer/conventions.md
  state.gravity_direction[0] = std::sin(pitch);
  state.gravity_direction[1] = -std::sin(roll) * std::cos(pitch);
  state.gravity_direction[2] = -std::cos(roll) * std::cos(pitch);
  return state;
}

Vec3 moment_about(const wade_forces& forces, const Vec3& center_of_mass) {
  const Vec3 force{forces.force_n[0], forces.force_n[1], forces.force_n[2]};
  const Vec3 moment{forces.moment_nm[0], forces.moment_nm[1], forces.moment_nm[2]};
  const Vec3 about{forces.about_m[0], forces.about_m[1], forces.about_m[2]};
  return moment + cross(about - center_of_mass, force);
}

}  // namespace

std::vector<wade_state> RestTable::questions() {
  std::vector<wade_state> states;
  for (int row = 0; row < rows; ++row) {
    const double depth = deepest * row / (rows - 1);
    states.push_back(at_rest(depth, 0.0F, 0.0F));
    states.push_back(at_rest(depth, static_cast<float>(asked_tilt), 0.0F));
    states.push_back(at_rest(depth, 0.0F, static_cast<float>(asked_tilt)));
  }
  return states;
}

RestTable::RestTable(const std::vector<wade_forces>& answers, const Vec3& center_of_mass) {
  std::vector<bool> within;
  for (std::size_t i = 0; i + 2 < answers.size(); i += 3) {
    Row row;
    within.push_back(!(std::fabs(answers[i].outside[WADE_QUANTITY_DEPTH]) > 0.0F));
    row.lift = std::max(0.0, static_cast<double>(answers[i].force_n[2]));
    row.moment = moment_about(answers[i], center_of_mass);
    row.moment_per_roll = (1.0 / asked_tilt) * (moment_about(answers[i + 1], center_of_mass) - row.moment);
    row.moment_per_pitch = (1.0 / asked_tilt) * (moment_about(answers[i + 2], center_of_mass) - row.moment);
    rows_.push_back(row);
    bundle_version_ = answers[i].bundle_version;
  }
  go_straight_outside(within);
}

void RestTable::go_straight_outside(const std::vector<bool>& within) {
  const auto first = static_cast<std::size_t>(std::find(within.begin(), within.end(), true) - within.begin());
  if (first == within.size()) return;
  for (std::size_t i = 0; i < first; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(first);
    const Row& edge = rows_[first];
    rows_[i] = {share * edge.lift, share * edge.moment, share * edge.moment_per_roll, share * edge.moment_per_pitch};
  }
  std::size_t last = within.size() - 1;
  while (!within[last]) --last;
  const double rise = last > first ? std::max(0.0, rows_[last].lift - rows_[last - 1].lift) : 0.0;
  for (std::size_t i = last + 1; i < rows_.size(); ++i) {
    rows_[i] = rows_[last];
    rows_[i].lift += rise * static_cast<double>(i - last);
  }
}

Vec6 RestTable::load(const Immersion& immersion, double density) const {
  // on its side a hull is told by how far its origin is under water alone
  const bool upright = immersion.up.z >= least_up_z;
  const double depth = upright ? immersion.depth : -immersion.height;
  if (rows_.empty() || depth <= 0.0) return {};
  const double place = std::min(depth / deepest, 1.0) * static_cast<double>(rows_.size() - 1);
  const std::size_t low = std::min(static_cast<std::size_t>(place), rows_.size() - 2);
  const double share = place - static_cast<double>(low);
  const auto between = [share](const Vec3& a, const Vec3& b) { return (1.0 - share) * a + share * b; };
  const Row &a = rows_[low], &b = rows_[low + 1];
  Vec6 load;
  load.linear = ((1.0 - share) * a.lift + share * b.lift) * immersion.up;
  if (upright) {
    const double roll = std::clamp(immersion.up.y, -largest_tilt, largest_tilt);
    const double pitch = std::clamp(-immersion.up.x, -largest_tilt, largest_tilt);
    load.angular = between(a.moment, b.moment) + roll * between(a.moment_per_roll, b.moment_per_roll) +
                   pitch * between(a.moment_per_pitch, b.moment_per_pitch);
  }
  return (density / asked_density) * load;
}

}  // namespace wade
