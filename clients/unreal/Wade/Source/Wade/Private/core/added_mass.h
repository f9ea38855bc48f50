// Added mass in an engine whose mass matrix is its own.
//
// Water that a hull drags along makes (M + A) a = F + E of M a = F + E: M the body's mass matrix, A the served added mass, F
// what the server answers without its part -A a, E everything else that acts on the body (gravity, tires, drive). An engine
// can be given a force, not a mass. The force that makes it move so is
//
//     G = F - A a,    a = (M + A)^-1 (F + E).
//
// E is not known in the step to come, but what it was in the one before is: E = M (change of velocity) / dt - G. That is exact
// for gravity and a drive, and never unstable: where the ground holds the body (E = -G, a = 0), G goes to F as
// G' = (1 - B) F + B G with B = A (M + A)^-1, whose eigenvalues lie in [0, 1); on a spring of an explicit engine the largest
// stable step shrinks by less than the square root of two. The naive -A a of the last step diverges as soon as A exceeds M.

#pragma once

#include "body.h"
#include "wade_client.h"

namespace wade {

// The served added mass moved from the server's reference point to the body's center of mass; zero where there is none.
Mat6 added_mass(const wade_forces& forces, const Vec3& center_of_mass);

// What a body does under a load and the water that it carries, hull axes, at the center of mass.
struct Response {
  // Acceleration in an inertial frame [m/s2, rad/s2].
  Vec6 acceleration;
  // The load that makes an engine which knows of no added mass do the same [N, N m].
  Vec6 load;
};

// `water` without its part from acceleration, `external` everything else, `twist` the velocity over ground.
Response respond(const Body& body, const Mat6& added, const Vec6& water, const Vec6& external, const Vec6& twist);

}  // namespace wade
