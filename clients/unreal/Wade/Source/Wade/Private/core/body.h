// A rigid body as a physics engine has it, with the hull that it carries. SI units, right-handed frames.

#pragma once

#include "vector.h"

namespace wade {

struct Body {
  // [kg]
  double mass = 1.0;
  // About the center of mass, hull axes [kg m2].
  Mat3 inertia;
  // Hull frame [m].
  Vec3 center_of_mass;
};

// Where a body is and how it moves, in the world.
struct Motion {
  // Center of mass [m].
  Vec3 position;
  // World from hull.
  Quat attitude;
  // Of the center of mass [m/s].
  Vec3 velocity;
  // [rad/s]
  Vec3 angular_velocity;
};

// Where a uniform motion leads in a time, which may be negative [s].
inline Motion drifted(const Motion& from, double time) {
  Motion to = from;
  to.position += time * from.velocity;
  to.attitude = normalized(turn(time * from.angular_velocity) * from.attitude);
  return to;
}

// The origin of the hull [m].
inline Vec3 hull_origin(const Body& body, const Motion& motion) {
  return motion.position - rotate(motion.attitude, body.center_of_mass);
}

// Velocity of the origin of the hull [m/s].
inline Vec3 hull_velocity(const Body& body, const Motion& motion) {
  return motion.velocity + cross(motion.angular_velocity, -rotate(motion.attitude, body.center_of_mass));
}

// Linear and angular velocity of the center of mass in hull axes.
inline Vec6 hull_twist(const Motion& motion) {
  return rotate(inverse(motion.attitude), Vec6{motion.velocity, motion.angular_velocity});
}

// Momentum of a twist in hull axes.
inline Vec6 momentum(const Body& body, const Vec6& twist) {
  return {body.mass * twist.linear, body.inertia * twist.angular};
}

}  // namespace wade
