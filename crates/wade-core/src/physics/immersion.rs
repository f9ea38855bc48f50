//! How far a hull is under water in any attitude, as one number that changes smoothly.

use nalgebra::Vector3;

use crate::condition::Condition;
use crate::frame::{Vec3, WaterPlane};
use crate::geometry::mesh::Mesh;
use crate::real::{Real, norm};

/// Directions in which the ellipsoid is compared with the hull.
const DIRECTIONS: usize = 500;
/// What the ellipsoid keeps clear of the hull between two of them [-].
const ROOM: f64 = 0.99;

/// An ellipsoid with the axes of the box around a hull that reaches nowhere beyond the lowest point of the hull, whatever the
/// attitude: where the ellipsoid is wet, the hull is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipsoid {
    /// Its center, that of the box [m].
    center: Vec3,
    /// Its half axes [m].
    half: Vec3,
}

impl Ellipsoid {
    /// The largest one within the convex hull of a mesh that has the shape of the box around it.
    pub fn within(mesh: &Mesh) -> Self {
        let Some(bounds) = mesh.bounds() else { return Self { center: Vec3::zeros(), half: Vec3::zeros() } };
        let (center, half) = (bounds.center(), bounds.extent() * 0.5);
        let box_around = Self { center, half };
        let reach =
            |direction: &Vec3| mesh.vertices.iter().map(|v| direction.dot(&(v - center))).fold(0.0, f64::max);
        let share = directions().map(|n| reach(&n) / box_around.reach(&n)).fold(1.0, f64::min);
        Self { center, half: half * (share * ROOM) }
    }

    /// Half its height along an upward direction [m].
    fn reach<T: Real>(&self, up: &Vector3<T>) -> T {
        norm(&up.component_mul(&self.half.map(T::from))).max(f64::MIN_POSITIVE.into())
    }

    /// Its center [m].
    pub fn center(&self) -> Vec3 {
        self.center
    }

    /// Half its axes [m].
    pub fn half_axes(&self) -> Vec3 {
        self.half
    }

    /// Heights of its lowest and its highest point over a plane [m].
    pub fn span(&self, plane: &WaterPlane) -> [f64; 2] {
        let (reach, depth) = (self.reach(&plane.normal), plane.depth_below(&self.center));
        [-depth - reach, reach - depth]
    }

    /// Height over the body origin, upright, at which a share of it is under water [m].
    pub fn level_at(&self, share: f64) -> f64 {
        self.center.z + self.half.z * (2.0 * share - 1.0)
    }

    /// Share of its height that is under water [-]: below 0 above the water, over 1 where it is covered.
    pub fn share_under<T: Real>(&self, plane: &WaterPlane<T>) -> T {
        plane.depth_below(&self.center.map(T::from)) * 0.5 / self.reach(&plane.normal) + 0.5
    }

    /// [`Self::share_under`] and its rate [-, 1/s].
    pub fn immersion<T: Real>(&self, condition: &Condition<T>, plane: &WaterPlane<T>) -> [T; 2] {
        let up = plane.normal.into_inner();
        let (reach, share) = (self.reach(&up), self.share_under(plane));
        // in body axes up turns against the body
        let turning = up.cross(&condition.angular_velocity);
        let [center, half] = [self.center, self.half].map(|vector| vector.map(T::from));
        let reach_rate = up.component_mul(&half).dot(&turning.component_mul(&half)) / reach;
        let sinking = -up.dot(&(condition.velocity + condition.angular_velocity.cross(&center)));
        [share, (sinking * 0.5 - (share - 0.5) * reach_rate) / reach]
    }
}

/// Directions spread evenly over the sphere, with the axes, and with the mirror image of each in y.
fn directions() -> impl Iterator<Item = Vec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let spread = (0..DIRECTIONS).map(move |i| {
        let z = 1.0 - 2.0 * (i as f64 + 0.5) / DIRECTIONS as f64;
        let (sine, cosine) = (golden * i as f64).sin_cos();
        let level = (1.0 - z * z).sqrt();
        Vec3::new(level * cosine, level * sine, z)
    });
    let axes = (0..3).flat_map(|axis| [Vec3::ith(axis, 1.0), Vec3::ith(axis, -1.0)]);
    spread.chain(axes).flat_map(|n| [n, Vec3::new(n.x, -n.y, n.z)])
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitVector3;

    use super::*;

    fn tetrahedron() -> Mesh {
        let vertices = [[-1.0, -1.0, -1.0], [1.0, -1.0, -1.0], [0.0, 1.0, -1.0], [0.0, 0.0, 1.0]];
        Mesh {
            vertices: vertices.map(Vec3::from).to_vec(),
            faces: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        }
    }

    #[test]
    fn where_the_ellipsoid_is_wet_the_hull_is() {
        let mesh = tetrahedron();
        let ellipsoid = Ellipsoid::within(&mesh);
        for n in directions() {
            let up = UnitVector3::new_normalize(n + Vec3::new(0.013, 0.021, 0.017));
            let lowest = mesh.vertices.iter().map(|v| up.dot(v)).fold(f64::INFINITY, f64::min);
            assert!(ellipsoid.share_under(&WaterPlane { normal: up, offset: lowest }) <= 0.0, "{up:?}");
        }
    }

    #[test]
    fn the_rate_is_the_change_of_the_share() {
        let ellipsoid = Ellipsoid { center: Vec3::new(0.1, 0.0, -0.2), half: Vec3::new(0.8, 0.5, 0.3) };
        let state = Condition {
            up: UnitVector3::new_normalize(Vec3::new(0.3, -0.2, 0.9)),
            water_level: Some(0.1),
            angular_velocity: Vec3::new(0.4, -0.7, 0.3),
            ..Condition::level(Vec3::new(0.5, 0.2, -0.6), 0.0)
        };
        let at = |time: f64| {
            let turned = nalgebra::UnitQuaternion::from_scaled_axis(state.angular_velocity * time);
            let up = UnitVector3::new_normalize(turned.inverse() * state.up.into_inner());
            let risen = state.up.dot(&state.velocity) * time;
            ellipsoid.share_under(&WaterPlane { normal: up, offset: 0.1 - risen })
        };
        let [share, rate] = ellipsoid.immersion(&state, &state.water_plane(0.0));
        assert!((share - at(0.0)).abs() < 1e-12);
        assert!((rate - (at(1e-5) - at(-1e-5)) / 2e-5).abs() < 1e-6);
    }
}
