#include "water.h"

#include <algorithm>

namespace wade {
namespace {

// The server refuses lengths and rates beyond this [m, m/s]. A hull so deep, or so far above the bed, feels no difference.
constexpr float largest_asked = 1000.0F;

float within_limit(double value) { return std::clamp(static_cast<float>(value), -largest_asked, largest_asked); }

void put(float (&out)[3], const Vec3& v) {
  out[0] = static_cast<float>(v.x);
  out[1] = static_cast<float>(v.y);
  out[2] = static_cast<float>(v.z);
}

}  // namespace

Immersion immerse(const Body& body, const Motion& motion, const Water& water, double z0) {
  Immersion immersion;
  const Quat hull_from_world = inverse(motion.attitude);
  immersion.up = rotate(hull_from_world, water.normal);
  immersion.height = dot(water.normal, hull_origin(body, motion) - water.point);
  // a hull on its side keeps finite numbers; `upright` says that they mean nothing
  const double up_z = std::max(immersion.up.z, least_up_z);
  immersion.depth = -immersion.height / up_z - z0;
  const double rise = dot(water.normal, hull_velocity(body, motion));
  // d/dt (R^T n) = -omega x (R^T n), omega in hull axes
  const double up_z_rate = -cross(rotate(hull_from_world, motion.angular_velocity), immersion.up).z;
  immersion.depth_rate = -rise / up_z + immersion.height * up_z_rate / (up_z * up_z);
  if (water.bed_height) {
    const Vec3 contact = hull_origin(body, motion) + rotate(motion.attitude, Vec3{0.0, 0.0, z0});
    immersion.bed_clearance = std::max(contact.z - *water.bed_height, 0.0);
  }
  return immersion;
}

wade_state question(const Body& body, const Motion& motion, const Water& water, const Immersion& immersion,
                    const Accelerations& accelerations) {
  const Quat hull_from_world = inverse(motion.attitude);
  wade_state state = wade_default_state();
  state.flags = WADE_IMPLICIT_ADDED_MASS | WADE_HAS_HEADING | WADE_HAS_WATER_LEVEL;
  state.water_level_m = within_limit(-immersion.height);
  if (upright(immersion)) {
    state.flags |= WADE_HAS_DEPTH_RATE;
    state.depth_rate_mps = within_limit(immersion.depth_rate);
  }
  if (immersion.bed_clearance) {
    state.flags |= WADE_HAS_BED_CLEARANCE;
    state.bed_clearance_m = within_limit(*immersion.bed_clearance);
  }
  state.density_kgpm3 = static_cast<float>(water.density);
  put(state.velocity_mps, rotate(hull_from_world, hull_velocity(body, motion)));
  put(state.current_mps, rotate(hull_from_world, water.current));
  put(state.angular_velocity_radps, rotate(hull_from_world, motion.angular_velocity));
  put(state.acceleration_mps2, accelerations.linear);
  put(state.angular_acceleration_radps2, accelerations.angular);
  put(state.gravity_direction, -immersion.up);
  const Vec3 forward = rotate(motion.attitude, Vec3{1.0, 0.0, 0.0});
  state.heading_rad = static_cast<float>(std::atan2(forward.y, forward.x));
  return state;
}

Vec6 twist_through_water(const Motion& motion, const Water& water) {
  Motion through = motion;
  through.velocity = motion.velocity - water.current;
  return hull_twist(through);
}

}  // namespace wade
