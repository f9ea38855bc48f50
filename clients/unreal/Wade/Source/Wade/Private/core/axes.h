// Between Unreal's frame (centimeters, left-handed: x forward, y right, z up) and wade's (meters, right-handed: x forward,
// y left, z up). Both for the world and for bodies: the mirror y -> -y is its own inverse.
//
// Unreal's physics computes the velocity of a point as v + w x r and a moment as r x F with the usual components of a cross
// product. Under the mirror S, S a x S b = -S (a x b): what is born of one cross product (angular velocity, moment, rotation
// vector) changes the signs that a plain vector keeps.

#pragma once

#include "vector.h"

namespace wade::axes {

constexpr double meters_per_unit = 0.01;

// Directions and velocities without a unit.
constexpr Vec3 mirrored(const Vec3& v) { return {v.x, -v.y, v.z}; }
// Axial vectors without a unit.
constexpr Vec3 mirrored_axial(const Vec3& v) { return {-v.x, v.y, -v.z}; }

// Positions [cm], velocities [cm/s], accelerations [cm/s2] to SI and back.
constexpr Vec3 from_unreal(const Vec3& v) { return meters_per_unit * mirrored(v); }
constexpr Vec3 to_unreal(const Vec3& v) { return (1.0 / meters_per_unit) * mirrored(v); }

// Angular velocity [rad/s in both].
constexpr Vec3 angular_from_unreal(const Vec3& v) { return mirrored_axial(v); }
constexpr Vec3 angular_to_unreal(const Vec3& v) { return mirrored_axial(v); }

// Force: [N] to [kg cm/s2] and back.
constexpr Vec3 force_to_unreal(const Vec3& v) { return (1.0 / meters_per_unit) * mirrored(v); }
constexpr Vec3 force_from_unreal(const Vec3& v) { return meters_per_unit * mirrored(v); }

// Moment: [N m] to [kg cm2/s2] and back.
constexpr Vec3 moment_to_unreal(const Vec3& v) {
  return (1.0 / (meters_per_unit * meters_per_unit)) * mirrored_axial(v);
}
constexpr Vec3 moment_from_unreal(const Vec3& v) { return meters_per_unit * meters_per_unit * mirrored_axial(v); }

// Rotations: an axis is an axial vector. The same map goes both ways.
constexpr Quat rotation(const Quat& q) { return {q.w, -q.x, q.y, -q.z}; }

// Moment of inertia: [kg cm2] to [kg m2]. Principal values have no sign to change.
constexpr Vec3 inertia_from_unreal(const Vec3& v) { return meters_per_unit * meters_per_unit * v; }

}  // namespace wade::axes
