#include "water.h"

#include <algorithm>

namespace wade {
namespace {

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
  // a hull on its side keeps finite numbers; `askable` says that they mean nothing
  const double up_z = std::max(immersion.up.z, least_up_z);
  immersion.depth = -immersion.height / up_z - z0;
  const double rise = dot(water.normal, hull_velocity(body, motion));
  // d/dt (R^T n) = -omega x (R^T n), omega in hull axes
  const double up_z_rate = -cross(rotate(hull_from_world, motion.angular_velocity), immersion.up).z;
  immersion.depth_rate = -rise / up_z + immersion.height * up_z_rate / (up_z * up_z);
  return immersion;
}

wade_state question(const Body& body, const Motion& motion, const Water& water, const Immersion& immersion,
                    const Accelerations& accelerations) {
  const Quat hull_from_world = inverse(motion.attitude);
  wade_state state = wade_default_state();
  state.flags = WADE_IMPLICIT_ADDED_MASS | WADE_HAS_HEADING | WADE_HAS_DEPTH_RATE;
  state.depth_m = static_cast<float>(immersion.depth);
  state.depth_rate_mps = static_cast<float>(immersion.depth_rate);
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
