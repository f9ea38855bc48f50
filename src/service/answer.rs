//! The answer to a query as JSON: one document for `/v1/query` and `wade query --json`.
//!
//! Vectors stand as `[x, y, z]` beside the names of the quantity, and the surfaces have their names. The packed arrays
//! and the `{x, y, z}` vectors with a unit in their name are those of the proto, for programs that read these.

use serde::Serialize;

use wade_core::domain::Quantity;
use wade_core::effects::{BoxQuantity, Effect, LeftOut};
use wade_core::model::COLUMNS;
use wade_wire::proto;

/// The forces in one state, ready to be written.
#[derive(Debug, Serialize)]
pub struct Answer {
    vehicle: String,
    version: u32,
    provenance: String,
    surfaces: Vec<Surface>,
    wrench: Wrench,
    uncertainty: Uncertainty,
    base: Option<Base>,
    in_domain: bool,
    outside: Vec<Outside>,
    effects: Vec<EffectLoad>,
    effects_outside: Vec<Outside>,
    /// 6 rows of 6, forces first; none where no effect adds mass.
    added_mass: Option<Vec<[f32; 6]>>,
    /// 6 rows of 11, forces first, where asked for: with velocity, angular velocity, water level, attitude and density.
    #[serde(skip_serializing_if = "Option::is_none")]
    jacobian: Option<Vec<[f32; COLUMNS]>>,
    compute_ns: u64,
    bundle_version: u32,
    surface_force_n: Vec<f32>,
    surface_point_m: Vec<f32>,
    wetted_fraction: Vec<f32>,
    effect_surface_force_n: Vec<f32>,
    uncertainty_n: Xyz,
}

#[derive(Debug, Serialize)]
struct Surface {
    name: String,
    force: [f32; 3],
    point: [f32; 3],
    wetted_fraction: f32,
    couple: [f32; 3],
    effects_force: [f32; 3],
}

#[derive(Debug, Serialize)]
struct Wrench {
    force: [f32; 3],
    moment: [f32; 3],
    about: [f32; 3],
    force_n: Xyz,
    moment_nm: Xyz,
    about_m: Xyz,
}

#[derive(Debug, Serialize)]
struct Uncertainty {
    force: [f32; 3],
    moment: [f32; 3],
}

/// What the physical base tells; none of a bundle without one.
#[derive(Debug, Serialize)]
struct Base {
    water_level: f32,
    bed_clearance: f32,
    bed: f32,
    /// 6 rows of 6, forces first.
    damping: Vec<[f32; 6]>,
}

#[derive(Debug, Serialize)]
struct Outside {
    quantity: &'static str,
    excess: f32,
}

#[derive(Debug, Serialize)]
struct EffectLoad {
    name: &'static str,
    force: [f32; 3],
    moment: [f32; 3],
    left_out: Option<&'static str>,
    force_n: Xyz,
    moment_nm: Xyz,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct Xyz {
    x: f32,
    y: f32,
    z: f32,
}

impl From<[f32; 3]> for Xyz {
    fn from([x, y, z]: [f32; 3]) -> Self {
        Self { x, y, z }
    }
}

impl Answer {
    /// The answer of this vehicle, whose surfaces have these names; a surface without one is called `surface_0` and so on.
    pub fn new(vehicle: &str, names: &[String], response: proto::EvaluateResponse) -> Self {
        let wrench = response.wrench.unwrap_or_default();
        let (force, moment, about) = (array(wrench.force_n), array(wrench.moment_nm), array(wrench.about_m));
        let uncertainty = array(response.uncertainty_n);
        let row = |values: &[f32], i: usize| values.as_chunks::<3>().0.get(i).copied().unwrap_or_default();
        let surface = |(i, &wetted_fraction): (usize, &f32)| Surface {
            name: names.get(i).cloned().unwrap_or_else(|| format!("surface_{i}")),
            force: row(&response.surface_force_n, i),
            point: row(&response.surface_point_m, i),
            wetted_fraction,
            couple: row(&response.surface_couple_nm, i),
            effects_force: row(&response.effect_surface_force_n, i),
        };
        let quantity = |code: i32| Quantity::ALL.into_iter().find(|quantity| *quantity as i32 == code);
        let box_quantity = |code: i32| BoxQuantity::ALL.into_iter().find(|quantity| *quantity as i32 == code);
        Self {
            vehicle: vehicle.to_owned(),
            version: response.bundle_version,
            surfaces: response.wetted_fraction.iter().enumerate().map(surface).collect(),
            wrench: Wrench {
                force,
                moment,
                about,
                force_n: force.into(),
                moment_nm: moment.into(),
                about_m: about.into(),
            },
            uncertainty: Uncertainty { force: uncertainty, moment: array(response.moment_uncertainty_nm) },
            base: response.base.as_ref().map(|base| Base {
                water_level: base.water_level_m,
                bed_clearance: base.bed_clearance_m,
                bed: base.bed,
                damping: base.damping.as_chunks::<6>().0.to_vec(),
            }),
            in_domain: response.in_domain,
            outside: response
                .outside
                .iter()
                .filter_map(|o| Some(Outside { quantity: quantity(o.quantity)?.name(), excess: o.excess }))
                .collect(),
            effects: response.effects.iter().filter_map(effect).collect(),
            effects_outside: response
                .effects_outside
                .iter()
                .filter_map(|o| {
                    Some(Outside { quantity: box_quantity(o.quantity)?.name(), excess: o.excess })
                })
                .collect(),
            added_mass: Some(response.added_mass.as_chunks::<6>().0.to_vec()).filter(|rows| rows.len() == 6),
            jacobian: Some(response.jacobian.as_chunks().0.to_vec()).filter(|rows| rows.len() == 6),
            compute_ns: response.compute_ns,
            bundle_version: response.bundle_version,
            uncertainty_n: uncertainty.into(),
            provenance: response.provenance,
            surface_force_n: response.surface_force_n,
            surface_point_m: response.surface_point_m,
            wetted_fraction: response.wetted_fraction,
            effect_surface_force_n: response.effect_surface_force_n,
        }
    }
}

fn array(vector: Option<proto::Vector3>) -> [f32; 3] {
    vector.map_or([0.0; 3], |v| [v.x, v.y, v.z])
}

fn effect(load: &proto::EffectLoad) -> Option<EffectLoad> {
    let (force, moment) = (array(load.force_n), array(load.moment_nm));
    Some(EffectLoad {
        name: Effect::from_code(load.effect as u32)?.name(),
        force,
        moment,
        left_out: LeftOut::from_code(load.left_out as u32).map(LeftOut::name),
        force_n: force.into(),
        moment_nm: moment.into(),
    })
}
