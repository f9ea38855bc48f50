#include "rest_table.h"

#include <algorithm>

namespace wade {
namespace {

constexpr double asked_tilt = 0.02;       // [rad]
constexpr double largest_tilt = 0.5;      // the stiffness is that of small angles [rad]
constexpr double asked_density = 1000.0;  // [kg/m3]

// Up in the hull frame: level, rolled, pitched (see docs/src/developer/conventions.md), then what `Row::lifts` has.
const std::array<Vec3, 8> asked_up{{{0.0, 0.0, 1.0},
                                    {0.0, std::sin(asked_tilt), std::cos(asked_tilt)},
                                    {-std::sin(asked_tilt), 0.0, std::cos(asked_tilt)},
                                    {0.0, 0.0, -1.0},
                                    {1.0, 0.0, 0.0},
                                    {-1.0, 0.0, 0.0},
                                    {0.0, 1.0, 0.0},
                                    {0.0, -1.0, 0.0}}};
constexpr std::size_t first_lift = 3;

wade_state at_rest(double level, const Vec3& up) {
  wade_state state = wade_default_state();
  state.flags = WADE_HAS_WATER_LEVEL;
  state.water_level_m = static_cast<float>(level);
  state.density_kgpm3 = static_cast<float>(asked_density);
  state.gravity_direction[0] = static_cast<float>(-up.x);
  state.gravity_direction[1] = static_cast<float>(-up.y);
  state.gravity_direction[2] = static_cast<float>(-up.z);
  return state;
}

double reach_of(const Hull& hull) { return std::isfinite(hull.radius) ? hull.radius : RestTable::usual_reach; }

// Shares of the axes in what a hull feels between the attitudes of the table.
Vec3 shares(const Vec3& up) {
  const auto fourth = [](double x) { return x * x * x * x; };
  const Vec3 power{fourth(up.x), fourth(up.y), fourth(up.z)};
  return (1.0 / (power.x + power.y + power.z)) * power;
}

double level_in(double reach, std::size_t row) {
  return reach * (2.0 * static_cast<double>(row) / (RestTable::rows - 1) - 1.0);
}

Vec3 force_of(const wade_forces& forces) { return {forces.force_n[0], forces.force_n[1], forces.force_n[2]}; }

Vec3 moment_about(const wade_forces& forces, const Vec3& center_of_mass) {
  const Vec3 moment{forces.moment_nm[0], forces.moment_nm[1], forces.moment_nm[2]};
  const Vec3 about{forces.about_m[0], forces.about_m[1], forces.about_m[2]};
  return moment + cross(about - center_of_mass, force_of(forces));
}

}  // namespace

std::vector<wade_state> RestTable::questions(const Hull& hull) {
  std::vector<wade_state> states;
  for (std::size_t row = 0; row < rows; ++row) {
    for (const Vec3& up : asked_up) states.push_back(at_rest(level_in(reach_of(hull), row), up));
  }
  return states;
}

RestTable::RestTable(const std::vector<wade_forces>& answers, const Hull& hull) : reach_(reach_of(hull)) {
  std::vector<bool> within;
  bool has_base = true;
  for (std::size_t i = 0; i + asked_up.size() <= answers.size(); i += asked_up.size()) {
    const wade_forces* const answer = &answers[i];
    const auto moment = [&](std::size_t attitude) { return moment_about(answer[attitude], hull.center_of_mass); };
    Row row;
    row.lift = std::max(0.0, force_of(answer[0]).z);
    row.moment = moment(0);
    row.moment_per_roll = (1.0 / asked_tilt) * (moment(1) - row.moment);
    row.moment_per_pitch = (1.0 / asked_tilt) * (moment(2) - row.moment);
    for (std::size_t k = 0; k < attitudes; ++k) {
      row.lifts[k] = std::max(0.0, dot(force_of(answer[first_lift + k]), asked_up[first_lift + k]));
    }
    rows_.push_back(row);
    within.push_back(!(std::fabs(answer->outside[WADE_QUANTITY_DEPTH]) > 0.0F));
    has_base = has_base && (answer->flags & WADE_HAS_BASE) != 0;
    bundle_version_ = answer->bundle_version;
  }
  if (!has_base) go_straight_outside(within, hull.z0);
}

void RestTable::go_straight_outside(const std::vector<bool>& within, double z0) {
  const auto first = static_cast<std::size_t>(std::find(within.begin(), within.end(), true) - within.begin());
  if (first == within.size()) return;
  for (std::size_t i = 0; i < first; ++i) {
    const double depth = level_of(i) - z0;
    const double share = depth > 0.0 ? depth / (level_of(first) - z0) : 0.0;
    const Row& edge = rows_[first];
    rows_[i] = {share * edge.lift, share * edge.moment, share * edge.moment_per_roll, share * edge.moment_per_pitch, {}};
  }
  std::size_t last = within.size() - 1;
  while (!within[last]) --last;
  const double rise = last > first ? std::max(0.0, rows_[last].lift - rows_[last - 1].lift) : 0.0;
  for (std::size_t i = last + 1; i < rows_.size(); ++i) {
    rows_[i] = rows_[last];
    rows_[i].lift += rise * static_cast<double>(i - last);
  }
  for (std::size_t i = 0; i < rows_.size(); ++i) rows_[i].lifts.fill(at(level_of(i) + z0).lift());
}

double RestTable::level_of(std::size_t row) const { return level_in(reach_, row); }

RestTable::Place RestTable::at(double level) const {
  const double place = 0.5 * (std::clamp(level / reach_, -1.0, 1.0) + 1.0) * static_cast<double>(rows_.size() - 1);
  const std::size_t low = std::min(static_cast<std::size_t>(place), rows_.size() - 2);
  return {rows_[low], rows_[low + 1], place - static_cast<double>(low)};
}

double RestTable::lift(const Immersion& immersion) const {
  if (rows_.size() < 2) return 0.0;
  const Vec3 part = shares(immersion.up);
  const std::array<double, 3> up{immersion.up.z, immersion.up.x, immersion.up.y}, share{part.z, part.x, part.y};
  double sum = 0.0;
  for (std::size_t axis = 0; axis < up.size(); ++axis) {
    // an axis that lies in the surface is cut nowhere, and counts for nothing
    if (std::fabs(up[axis]) < 1e-6) continue;
    const Place place = at(-immersion.height / std::fabs(up[axis]));
    const bool standing = axis == 0 && up[axis] > 0.0;
    // on its back, then the positive and the negative end of x and y
    const std::size_t attitude = axis == 0 ? 0 : 2 * axis - (up[axis] > 0.0 ? 1 : 0);
    sum += share[axis] * (standing ? place.lift() : place.lift(attitude));
  }
  return sum;
}

Vec6 RestTable::load(const Immersion& immersion, double density) const {
  if (rows_.size() < 2) return {};
  const Vec3& up = immersion.up;
  Vec6 load;
  load.linear = lift(immersion) * up;
  if (up.z > 1e-6) {
    const Place place = at(-immersion.height / up.z);
    const double roll = std::clamp(up.y, -largest_tilt, largest_tilt);
    const double pitch = std::clamp(-up.x, -largest_tilt, largest_tilt);
    load.angular = shares(up).z * (place.mean(&Row::moment) + roll * place.mean(&Row::moment_per_roll) +
                                   pitch * place.mean(&Row::moment_per_pitch));
  }
  return (density / asked_density) * load;
}

}  // namespace wade
