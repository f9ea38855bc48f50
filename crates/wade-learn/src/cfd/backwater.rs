//! Backwater: how far a vehicle in a channel raises the water ahead of it, for cases without gauges.
//!
//! What the hull takes from the momentum of a subcritical stream, the stream upstream has more of, and it has it as depth. With
//! q = h u, the same everywhere, in a channel of width B (Chow, Open-Channel Hydraulics, McGraw-Hill 1959, chapters 3 and 17):
//!
//! `g h1^2 / 2 + q^2 / h1 = g h0^2 / 2 + q^2 / h0 + (D / B + f) / rho`
//!
//! h0 is the depth that the case plans, at the outlet; D is the computed force on the hull along the stream; f is the friction
//! of the bed per width from the gauges to the outlet, where it moves other than the water: `Cf rho w^2 / 2` over the distance,
//! with `Cf = 0.074 Re^(-1/5)` of a plate (Schlichting, Boundary-Layer Theory, 7th edition, equation 21.11).
//!
//! Nothing here is fitted. In 28 cases of `drive` whose planned flow is that of a case of `paper`, the depth is off by 0.8 % (Husky) and
//! 1.9 % (Warthog) of the measured one, root mean square, where the plan's is off by 7.7 and 16.4 %.
//!
//! A stream that is supercritical as planned carries no news upstream, and keeps the planned flow.

use super::case::GAUGES_AHEAD;
use super::mesh::MeshSettings;
use super::plan::{Case, Plan};
use crate::dataset::{Dataset, Rest, Sample, label};
use wade_core::condition::Condition;
use wade_core::frame::{GRAVITY, VISCOSITY, Vec3};
use wade_core::vehicle::Vehicle;
use wade_core::wrench::Wrench;

/// A uniform flow between an inlet and an outlet.
#[derive(Debug, Clone, Copy)]
pub struct Stream {
    /// Depth at the outlet [m].
    pub depth: f64,
    /// Speed at the outlet, relative to the vehicle [m/s].
    pub speed: f64,
    /// Speed at the outlet, relative to the bed [m/s].
    pub over_bed: f64,
    /// Density [kg/m3].
    pub density: f64,
    /// Width of the channel [m].
    pub width: f64,
    /// Distance over which the bed brakes the water [m].
    pub length: f64,
}

impl Stream {
    /// Depth ahead of a hull of this drag [N], in place of the depth at the outlet; `None` where the flow there is not subcritical.
    pub fn depth_ahead(&self, drag: f64) -> Option<f64> {
        let Self { depth, speed, over_bed, density, width, length } = *self;
        let subcritical = depth > 0.0 && speed * speed < GRAVITY * depth;
        let reynolds = over_bed.abs() * length * density / VISCOSITY;
        let friction =
            if reynolds > 1.0 { 0.074 * reynolds.powf(-0.2) * over_bed * over_bed / 2.0 } else { 0.0 };
        let momentum = |h: f64| GRAVITY * h * h / 2.0 + (depth * speed).powi(2) / h;
        let wanted = momentum(depth) + drag.max(0.0) / (width * density) + friction * length;
        // above the critical depth the momentum grows with the depth, so that there is one such depth; as pure pressure it is below this
        let mut range = [depth, (2.0 * wanted / GRAVITY).sqrt()];
        for _ in 0..60 {
            let middle = f64::midpoint(range[0], range[1]);
            range[usize::from(momentum(middle) > wanted)] = middle;
        }
        subcritical.then_some(range[0])
    }
}

/// States the flow ahead of the vehicle in every steady case of a campaign without gauges.
///
/// The load at rest becomes that of the water ahead, by the difference between the hull's exact loads at both levels, so that
/// what the motion adds is counted from there. Surfaces of other names than the vehicle's are refused.
pub fn state_ahead(data: &mut Dataset, plan: &Plan, vehicle: &Vehicle) -> Result<(), label::OtherSurfaces> {
    let Some(surfaces) = data.meta.vehicles.get(&vehicle.name) else { return Ok(()) };
    let order = label::order(vehicle, surfaces)?;
    let mesh = &plan.campaign.settings.mesh;
    for case in plan.cases.iter().filter(|case| !case.is_unsteady()) {
        let mut sections: Vec<&mut Sample> = data.samples.iter_mut().filter(|s| s.case == case.id).collect();
        let Some(planned) = sections.first().map(|section| section.condition) else { continue };
        let force = sections.iter().map(|section| section.net_force()).sum::<Vec3>() / sections.len() as f64;
        let Some(ahead) = ahead(&planned, &force, (case, mesh), vehicle) else { continue };
        let (before, after) = (vehicle.at_rest(&planned), vehicle.at_rest(&ahead));
        for section in &mut sections {
            section.condition = ahead;
            for ((&index, before), after) in order.iter().zip(&before).zip(&after) {
                if let Some(rest) = &mut section.surfaces[index].rest {
                    *rest = raised(rest, before, after);
                }
            }
        }
    }
    data.meta.notes.insert("water".to_owned(), NOTE.to_owned());
    Ok(())
}

/// What such a data set says of its states.
const NOTE: &str =
    "ahead of the vehicle: where no gauge measured it, by the balance of momentum in the channel";

/// The state in the water ahead.
fn ahead(
    planned: &Condition,
    force: &Vec3,
    (case, mesh): (&Case, &MeshSettings),
    vehicle: &Vehicle,
) -> Option<Condition> {
    let length = vehicle.dimensions.length;
    let channel = mesh.channel(length, case.channel_scale);
    let (speed, up) = (planned.velocity.norm(), planned.up.z);
    let stream = Stream {
        depth: planned.depth * up,
        speed,
        over_bed: (planned.velocity - planned.ground_velocity).norm(),
        density: planned.density,
        width: channel.y,
        length: channel.x / 2.0 + (0.5 + GAUGES_AHEAD) * length,
    };
    let drag = if speed > 0.0 { -force.dot(&planned.velocity) / speed } else { 0.0 };
    let depth = stream.depth_ahead(drag)?;
    let slower = stream.depth / depth;
    Some(Condition { depth: depth / up, velocity: planned.velocity * slower, ..*planned })
}

/// The load at rest in water that stands higher.
fn raised(rest: &Rest, before: &Wrench, after: &Wrench) -> Rest {
    Rest {
        force: rest.force + after.force - before.force,
        moment: rest.moment + after.moment - before.moment,
    }
}

#[cfg(test)]
mod tests {
    use super::Stream;

    const CHANNEL: Stream =
        Stream { depth: 0.2, speed: 0.7, over_bed: 0.0, density: 1000.0, width: 5.0, length: 4.0 };

    #[test]
    fn the_force_between_two_depths_gives_the_depth_back() {
        let (h1, width) = (0.3_f64, 5.0);
        let q = CHANNEL.depth * CHANNEL.speed;
        let momentum = |h: f64| 9.81 * h * h / 2.0 + q * q / h;
        let drag = 1000.0 * width * (momentum(h1) - momentum(CHANNEL.depth));
        let found = CHANNEL.depth_ahead(drag).expect("subcritical");
        assert!((found - h1).abs() < 1e-9, "{found}");
        assert!((CHANNEL.depth_ahead(0.0).expect("subcritical") - 0.2).abs() < 1e-9);
    }

    #[test]
    fn a_supercritical_stream_keeps_its_depth_and_a_bed_that_does_not_move_raises_the_water() {
        assert_eq!(Stream { speed: 1.5, ..CHANNEL }.depth_ahead(100.0), None);
        let moved = CHANNEL.depth_ahead(20.0).expect("subcritical");
        let braked = Stream { over_bed: 0.7, ..CHANNEL }.depth_ahead(20.0).expect("subcritical");
        assert!(braked > moved && braked < moved + 0.01, "{moved} {braked}");
    }

    /// Planned flow, drag along the stream in the channel of 5.0233 m (Husky) or 6.125 m (Warthog), and the depth that five gauges
    /// measured: campaigns/drive, cases `paper-0000`, `0009`, `0016` of the Husky and `0012`, `0071` of the Warthog.
    #[test]
    fn it_is_what_gauges_measured() {
        let measured = [
            ([0.1489, 0.6778, 1410.0, 5.0233, 4.47], 68.1, 0.1623),
            ([0.1743, 0.9589, 1886.6, 5.0233, 4.47], 176.0, 0.2032),
            ([0.1718, 0.4267, 1229.2, 5.0233, 4.47], 32.0, 0.1762),
            ([0.1323, 0.8120, 1459.4, 6.125, 7.58], 117.0, 0.1556),
            ([0.1480, 0.8889, 1866.1, 6.125, 7.58], 170.0, 0.1746),
        ];
        for ([depth, speed, density, width, length], drag, gauges) in measured {
            let stream = Stream { depth, speed, over_bed: speed, density, width, length };
            let found = stream.depth_ahead(drag).expect("subcritical");
            assert!((found / gauges - 1.0).abs() < 0.03, "{found} against {gauges}");
        }
    }
}
