//! Form drag: pressure on the windward wet faces and the wake behind them.
//!
//! `F_s = -1/2 rho Cd0 w_s A_s |v| v` with `A_s = sum over wet faces of max(n . v_hat, 0) dA`.
//!
//! Source of `Cd0`: Qi, Eames, Johnson, JFM 2014, square cylinders in subcritical open-channel flow, in water without
//! side walls (their blockage factor `(1 + Cd0 b / 2w)^2` is 1 in a wide channel). Valid while the flow is subcritical;
//! FEMA P-646 and ASCE 7-16 take 2.0 for structures. The force is exactly quadratic in speed, linear in density and
//! opposed to the velocity.
//!
//! The sheltering weight `w_s` is ours and no law: a surface at the front meets the full stream, one at the rear the
//! wake of what is before it. `w = (1 + s xi) / 2` with `xi` in -1..1, the centroid's place along the motion between
//! the rear and the front end of the hull. `s = 1/2` was set to one CFD trial of our own, a Warthog-like body at 2 m/s
//! in 0.203 m of fresh water: 126.5 N on a front wheel and 63.3 N on a rear one, where this with skin friction gives 119.5 and
//! 65.2 N.

use crate::condition::Condition;
use crate::features::direction;
use crate::frame::{Vec3, WaterPlane};
use crate::geometry::immersion::wet_triangles;
use crate::vehicle::Vehicle;

/// Drag coefficient on the windward area [-].
pub const CD0: f64 = 1.9;

/// Strength of the sheltering [-]: the foremost surface weighs `(1 + s) / 2`, the rearmost `(1 - s) / 2`.
pub const SHELTERING: f64 = 0.5;

/// Adds the form drag of each surface [N]; nothing at rest.
pub fn add(vehicle: &Vehicle, condition: &Condition, forces: &mut [Vec3]) {
    let ahead = direction(&condition.velocity);
    if ahead == Vec3::zeros() {
        return;
    }
    let plane = condition.water_plane(vehicle.z0);
    let extent = Extent::of(vehicle, &ahead);
    let pressure = 0.5 * condition.density * condition.velocity.norm_squared() * CD0;
    for (face, &surface) in vehicle.hull.face_surface.iter().enumerate() {
        let area = windward_area(vehicle, face, &plane, &ahead);
        if area > 0.0 {
            let weight = extent.weight(&vehicle.surfaces[surface as usize].centroid);
            forces[surface as usize] -= ahead * (pressure * weight * area);
        }
    }
}

/// Wet area of a face as seen from ahead [m2]; zero for a face that looks back.
fn windward_area(vehicle: &Vehicle, face: usize, plane: &WaterPlane, ahead: &Vec3) -> f64 {
    if vehicle.hull.mesh.area_vector(face).dot(ahead) <= 0.0 {
        return 0.0;
    }
    wet_triangles(&vehicle.hull.mesh, face, plane).iter().map(|t| t.area_vector().dot(ahead)).sum()
}

/// The hull along the motion.
struct Extent {
    ahead: Vec3,
    rear: f64,
    front: f64,
}

impl Extent {
    fn of(vehicle: &Vehicle, ahead: &Vec3) -> Self {
        let along = vehicle.hull.mesh.vertices.iter().map(|v| v.dot(ahead));
        let (rear, front) = along.fold((f64::MAX, f64::MIN), |(lo, hi), x| (lo.min(x), hi.max(x)));
        Self { ahead: *ahead, rear, front }
    }

    /// Sheltering weight of a surface with this centroid.
    fn weight(&self, centroid: &Vec3) -> f64 {
        let middle = 0.5 * (self.front + self.rear);
        let half = 0.5 * (self.front - self.rear);
        let xi = ((centroid.dot(&self.ahead) - middle) / half).clamp(-1.0, 1.0);
        0.5 * (1.0 + SHELTERING * xi)
    }
}
