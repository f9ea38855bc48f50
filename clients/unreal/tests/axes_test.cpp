// Unreal's frame and wade's: what a rotation, a force, a moment is called in each.

#include "core/axes.h"
#include "core/water.h"
#include "expect.h"

using namespace wade;

namespace {
// plain numbers without a pattern
const Vec3 p{1.3, -2.1, 0.7}, q{-0.4, 0.9, 2.2};
const Quat turn_q = turn(Vec3{0.3, -1.1, 0.5});
}  // namespace

TEST(a_point_to_the_right_in_centimeters_is_one_to_the_left_below_zero_in_meters) {
  EXPECT_VECTOR(axes::from_unreal({250.0, 80.0, -30.0}), (Vec3{2.5, -0.8, -0.3}), 1e-15);
}

TEST(every_quantity_comes_back) {
  EXPECT_VECTOR(axes::to_unreal(axes::from_unreal(p)), p, 1e-12);
  EXPECT_VECTOR(axes::angular_to_unreal(axes::angular_from_unreal(p)), p, 1e-15);
  EXPECT_VECTOR(axes::force_from_unreal(axes::force_to_unreal(p)), p, 1e-12);
  EXPECT_VECTOR(axes::moment_from_unreal(axes::moment_to_unreal(p)), p, 1e-12);
  const Quat back = axes::rotation(axes::rotation(turn_q));
  EXPECT_NEAR(back.w * turn_q.w + back.x * turn_q.x + back.y * turn_q.y + back.z * turn_q.z, 1.0, 1e-15);
}

// A yaw of +90 degrees in Unreal, about z, turns forward to the right; in wade's frame that is a yaw of -90.
TEST(a_yaw_to_the_right_is_a_negative_yaw) {
  const double half = std::sqrt(0.5);
  const Quat unreal{half, 0.0, 0.0, half};
  EXPECT_VECTOR(rotate(unreal, Vec3{1.0, 0.0, 0.0}), (Vec3{0.0, 1.0, 0.0}), 1e-15);
  const Quat ours = axes::rotation(unreal);
  EXPECT_VECTOR(rotate(ours, Vec3{1.0, 0.0, 0.0}), (Vec3{0.0, -1.0, 0.0}), 1e-15);
  EXPECT_NEAR(ours.z, -half, 1e-15);
}

// About y, Unreal's components turn z to x, which is nose down with x forward; so does a positive pitch in wade's frame, whose
// y points the other way: an angular velocity about y keeps its sign.
TEST(a_nose_that_dips_dips_in_both) {
  const Vec3 unreal{0.0, 2.0, 0.0};
  EXPECT(cross(unreal, Vec3{1.0, 0.0, 0.0}).z < 0.0);
  EXPECT_VECTOR(axes::angular_from_unreal(unreal), (Vec3{0.0, 2.0, 0.0}), 0.0);
}

TEST(a_rotation_turns_the_mirrored_vector_to_the_mirrored_image) {
  EXPECT_VECTOR(axes::from_unreal(rotate(turn_q, p)), rotate(axes::rotation(turn_q), axes::from_unreal(p)), 1e-15);
}

TEST(rotations_one_after_the_other_stay_so) {
  const Quat other = turn(Vec3{-0.8, 0.2, 1.9});
  const Quat both = axes::rotation(turn_q * other), each = axes::rotation(turn_q) * axes::rotation(other);
  EXPECT_NEAR(both.w * each.w + both.x * each.x + both.y * each.y + both.z * each.z, 1.0, 1e-15);
}

// The velocity that a body's spin gives to a point of it, in cm/s there and in m/s here.
TEST(the_velocity_of_a_point_is_the_same) {
  EXPECT_VECTOR(axes::from_unreal(cross(q, p)), cross(axes::angular_from_unreal(q), axes::from_unreal(p)), 1e-15);
}

// The moment of a force at a point, computed by Unreal in its units and by us in ours.
TEST(the_moment_of_a_force_is_the_same) {
  const Vec3 force{12.0, -5.0, 31.0}, arm{0.4, 0.3, -0.2};
  EXPECT_VECTOR(cross(axes::to_unreal(arm), axes::force_to_unreal(force)), axes::moment_to_unreal(cross(arm, force)), 1e-9);
}

// 1 W is 10^4 kg cm2/s3 (force [kg cm/s2] by velocity [cm/s]), whatever the axes.
TEST(the_power_of_a_load_is_the_same) {
  EXPECT_NEAR(dot(axes::force_to_unreal(p), axes::to_unreal(q)), 1e4 * dot(p, q), 1e-9);
  EXPECT_NEAR(dot(axes::moment_to_unreal(p), axes::angular_to_unreal(q)), 1e4 * dot(p, q), 1e-9);
}

// Angular momentum of an inertia given by principal values and their axes, mapped before or after the product.
TEST(the_inertia_gives_the_same_angular_momentum) {
  const Vec3 principal{2.0e5, 5.0e5, 6.0e5};
  const Vec3 unreal = rotated_diagonal(turn_q, principal) * q;
  const Mat3 ours = rotated_diagonal(axes::rotation(turn_q), axes::inertia_from_unreal(principal));
  EXPECT_VECTOR(ours * axes::angular_from_unreal(q), axes::moment_from_unreal(unreal), 1e-12);
}

TEST(a_rotation_vector_and_its_quaternion_agree) {
  EXPECT_VECTOR(rotate(turn(Vec3{0.0, 0.0, 1e-14}), p), p, 1e-12);
  const Vec3 turned = rotate(turn(Vec3{0.0, 0.0, 0.5}), Vec3{1.0, 0.0, 0.0});
  EXPECT_VECTOR(turned, (Vec3{std::cos(0.5), std::sin(0.5), 0.0}), 1e-15);
}

// A hull that Unreal has yawed, pitched and rolled over a sloping surface and a bed: each corner of it is there, by Unreal's
// arithmetic, as far under the surface as in the question by wade's, and the lift at that corner comes back as the same force
// upward and the same moment. A hull that is mirrored by one axis too few lists to the other side.
TEST(a_hull_that_is_placed_in_unreal_lists_to_the_same_side_here) {
  const Vec3 size{50.0, 30.0, 20.0}, place{120.0, -340.0, 35.0}, point{100.0, -300.0, 20.0};  // [cm]
  const Vec3 slope{0.1, -0.2, 1.0};
  const Vec3 normal = (1.0 / norm(slope)) * slope;
  const double z0_cm = -20.0, bed_cm = -250.0;
  for (const Vec3& tilt : {Vec3{0.4, 0.0, 0.0}, Vec3{0.0, 0.6, 0.0}, Vec3{0.3, -0.9, 2.0}, Vec3{1.4, 0.8, -0.5}}) {
    const Quat unreal = turn(tilt);
    Motion motion;
    motion.position = axes::from_unreal(place);
    motion.attitude = axes::rotation(unreal);
    Water water;
    water.point = axes::from_unreal(point);
    water.normal = axes::mirrored(normal);
    water.bed_height = axes::meters_per_unit * bed_cm;
    const Immersion immersion = immerse(Body{}, motion, water, axes::meters_per_unit * z0_cm);
    const wade_state state = question(Body{}, motion, water, immersion, {});
    const Vec3 up{-state.gravity_direction[0], -state.gravity_direction[1], -state.gravity_direction[2]};

    const Vec3 contact = place + rotate(unreal, Vec3{0.0, 0.0, z0_cm});
    EXPECT_NEAR(state.bed_clearance_m, axes::meters_per_unit * (contact.z - bed_cm), 1e-6);
    for (const double x : {-1.0, 1.0}) {
      for (const double y : {-1.0, 1.0}) {
        const Vec3 corner{x * size.x, y * size.y, -size.z};
        const Vec3 arm = rotate(unreal, corner);
        const double under = axes::meters_per_unit * dot(normal, point - (place + arm));
        const Vec3 ours = axes::from_unreal(corner);
        EXPECT_NEAR(static_cast<double>(state.water_level_m) - dot(up, ours), under, 1e-6);

        const Vec3 lift = 7.0 * up;
        const Vec3 force = axes::force_to_unreal(rotate(motion.attitude, lift));
        EXPECT_VECTOR(force, 700.0 * normal, 1e-4);
        EXPECT_VECTOR(axes::moment_to_unreal(rotate(motion.attitude, cross(ours, lift))), cross(arm, force), 1e-2);
      }
    }
  }
}
