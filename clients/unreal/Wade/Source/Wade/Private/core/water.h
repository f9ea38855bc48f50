// The water around a hull: its surface as a plane, and what the server is asked about it.

#pragma once

#include <optional>

#include "body.h"
#include "wade_client.h"

namespace wade {

// A plane of water, world.
struct Water {
  // Any point of the surface [m].
  Vec3 point;
  // Upward normal of the surface, a unit vector. On long waves the surface is one of equal pressure, so that what a hull feels
  // as down is against this normal.
  Vec3 normal{0.0, 0.0, 1.0};
  // Velocity of the water [m/s].
  Vec3 current;
  // [kg/m3]
  double density = 1000.0;
  // Height of the bed under the hull, world z [m]. Not known: the server takes a hull to stand on the bed until it floats.
  std::optional<double> bed_height;
};

// What of a hull's place in the water the server's question needs.
struct Immersion {
  // The surface's normal in the hull frame.
  Vec3 up;
  // Water surface above the ground-contact plane at the hull's origin, along the hull's z [m]. Negative where it is below. Of a
  // hull that is not upright, that of the largest tilt at which it is.
  double depth = 0.0;
  // Its rate [m/s].
  double depth_rate = 0.0;
  // Height of the hull's origin above the surface [m]; the water level of the question is its negative.
  double height = 0.0;
  // From the ground-contact plane at the hull's origin down to the bed [m], 0 where it is below; where the bed is known.
  std::optional<double> bed_clearance;
};

// Below this cosine of the tilt a depth along the hull's z says nothing of how far the hull is under water. That of the server.
constexpr double least_up_z = 0.1;

inline bool upright(const Immersion& immersion) { return immersion.up.z >= least_up_z; }

// `z0`: z of the ground-contact plane in the hull frame [m]. With n the normal in the hull frame and h the height of the origin,
// the surface is n . x = -h = (z0 + depth) n_z.
Immersion immerse(const Body& body, const Motion& motion, const Water& water, double z0);

// Accelerations of the hull's origin, hull axes.
struct Accelerations {
  Vec3 linear;   // [m/s2]
  Vec3 angular;  // [rad/s2]
};

// The server's question, which has the water level for any attitude and no depth. Added mass is left to the caller
// (WADE_IMPLICIT_ADDED_MASS).
wade_state question(const Body& body, const Motion& motion, const Water& water, const Immersion& immersion,
                    const Accelerations& accelerations);

// Velocity through the water at the center of mass, with the angular velocity, hull axes.
Vec6 twist_through_water(const Motion& motion, const Water& water);

}  // namespace wade
