//! Skin friction: the drag of the water that slides along the wet area.
//!
//! `dF = -1/2 rho Cf |v_t| v_t dA` with the tangential velocity `v_t = v - (v . n) n` and
//! `Cf = 0.075 / (log10 Re - 2)^2`, `Re = rho |v| L / mu`, `L` the length of the vehicle.
//!
//! Source: ITTC 1957 line, as UFC 4-159-03 takes it for moored ships. Meant for a turbulent boundary layer, Re above
//! about 1e6; below `RE_FLOOR` the coefficient is held, so that the force goes to zero with the square of the speed
//! where the line itself would run into its pole at Re = 100. A few per cent of the form drag on our vehicles. Since
//! `Cf` falls with `Re`, it grows a little less than in proportion to density.

use crate::condition::Condition;
use crate::frame::{VISCOSITY, Vec3};
use crate::geometry::immersion::{WetTriangle, wet_triangles};
use crate::vehicle::Vehicle;

/// Reynolds number below which the coefficient is held [-].
pub const RE_FLOOR: f64 = 1e5;

/// Friction coefficient on the wet area [-] at a Reynolds number [-].
pub fn coefficient(reynolds: f64) -> f64 {
    0.075 / (reynolds.max(RE_FLOOR).log10() - 2.0).powi(2)
}

/// Adds the skin friction of each surface [N]; nothing at rest.
pub fn add(vehicle: &Vehicle, condition: &Condition, forces: &mut [Vec3]) {
    let (velocity, density) = (&condition.velocity, condition.density);
    let plane = condition.water_plane(vehicle.z0);
    let reynolds = density * velocity.norm() * vehicle.dimensions.length / VISCOSITY;
    let factor = 0.5 * density * coefficient(reynolds);
    for (face, &surface) in vehicle.hull.face_surface.iter().enumerate() {
        for triangle in wet_triangles(&vehicle.hull.mesh, face, &plane).iter() {
            forces[surface as usize] -= sliding(triangle, velocity) * factor;
        }
    }
}

/// `|v_t| v_t dA` of a triangle [m4/s2].
fn sliding(triangle: &WetTriangle, velocity: &Vec3) -> Vec3 {
    let vector = triangle.area_vector();
    let area = vector.norm();
    // a sliver left by the clipping may have no area and no normal
    let Some(normal) = vector.try_normalize(0.0) else { return Vec3::zeros() };
    let tangential = velocity - normal * velocity.dot(&normal);
    tangential * (tangential.norm() * area)
}
