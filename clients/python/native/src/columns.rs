//! An answer as a row of bytes: little-endian words without gaps, which numpy reads by the list of their columns.

use wade_core::domain::Quantity;
use wade_core::effects::{ActiveEffect, BoxQuantity, Effect};
use wade_core::frame::Vec3;
use wade_core::model::COLUMNS;
use wade_core::served::ServedVehicle;
use wade_core::wrench::Wrench;
use wade_wire::{Evaluated, added_mass, by_rows, derivatives, single};

/// One column of a row.
pub struct Column {
    /// As `Forces` of the client names it.
    pub name: &'static str,
    /// As numpy writes its type.
    pub kind: &'static str,
    /// Numbers along each axis.
    pub shape: Vec<usize>,
}

const FLOAT: &str = "<f4";
const WORD: &str = "<u4";
const LONG: &str = "<u8";

/// The effects of a vehicle.
pub fn effects(vehicle: &ServedVehicle) -> &[ActiveEffect] {
    vehicle.effects().map_or(&[], |file| &file.effects)
}

/// The columns of a row, in the order of [`push`].
pub fn columns(vehicle: &ServedVehicle, with_surfaces: bool, with_jacobian: bool) -> Vec<Column> {
    let surfaces = if with_surfaces { vehicle.model().vehicle().surfaces.len() } else { 0 };
    let effects = effects(vehicle);
    let (count, effect_surfaces) = (effects.len(), if effects.is_empty() { 0 } else { surfaces });
    let has_base = vehicle.model().base().is_some();
    let couples = if has_base { surfaces } else { 0 };
    let column = |name, kind, shape: &[usize]| Column { name, kind, shape: shape.to_vec() };
    let mut columns = vec![
        column("compute_ns", LONG, &[]),
        column("session_begins", WORD, &[]),
        column("force_n", FLOAT, &[3]),
        column("moment_nm", FLOAT, &[3]),
        column("uncertainty_n", FLOAT, &[3]),
        column("moment_uncertainty_nm", FLOAT, &[3]),
        column("outside", FLOAT, &[Quantity::ALL.len()]),
        column("surface_force_n", FLOAT, &[surfaces, 3]),
        column("surface_point_m", FLOAT, &[surfaces, 3]),
        column("surface_couple_nm", FLOAT, &[couples, 3]),
        column("wetted_fraction", FLOAT, &[surfaces]),
        column("effect_force_n", FLOAT, &[count, 3]),
        column("effect_moment_nm", FLOAT, &[count, 3]),
        column("effect_left_out", WORD, &[count]),
        column("effect_surface_force_n", FLOAT, &[effect_surfaces, 3]),
        column("effects_outside", FLOAT, &[BoxQuantity::ALL.len()]),
    ];
    let moves_water = effects.iter().any(|effect| effect.effect() == Effect::AddedMass);
    if moves_water || has_base {
        columns.push(column("added_mass", FLOAT, &[6, 6]));
    }
    if has_base {
        columns.push(column("damping", FLOAT, &[6, 6]));
        columns.extend(
            ["water_level_m", "bed_clearance_m", "bed", "shaft_power_w"].map(|name| column(name, FLOAT, &[])),
        );
    }
    if with_jacobian {
        columns.push(column("jacobian", FLOAT, &[6, COLUMNS]));
    }
    columns
}

/// Adds a row to others.
pub fn push(rows: &mut Vec<u8>, evaluated: &Evaluated<'_>, begins: bool, with_surfaces: bool) {
    let Evaluated { forces, effects, jacobian, compute_ns } = evaluated;
    let surfaces = if with_surfaces { &forces.surfaces[..] } else { &[] };
    rows.extend(compute_ns.to_le_bytes());
    rows.extend(u32::from(begins).to_le_bytes());
    let Wrench { force, moment } = &forces.wrench;
    for vector in [force, moment, &forces.uncertainty, &forces.moment_uncertainty] {
        push_vector(rows, vector);
    }
    push_floats(rows, forces.outside.excess.map(|excess| excess as f32));
    for load in surfaces {
        push_vector(rows, &load.force);
    }
    for load in surfaces {
        push_vector(rows, &load.point);
    }
    if forces.base.is_some() {
        for load in surfaces {
            push_vector(rows, &load.couple);
        }
    }
    push_floats(rows, surfaces.iter().map(|load| load.wetted_fraction as f32));
    for load in &effects.loads {
        push_vector(rows, &load.wrench.force);
    }
    for load in &effects.loads {
        push_vector(rows, &load.wrench.moment);
    }
    for load in &effects.loads {
        rows.extend(load.left_out.map_or(0, |reason| reason as u32).to_le_bytes());
    }
    if with_surfaces {
        for force in &effects.surface_forces {
            push_vector(rows, force);
        }
    }
    push_floats(rows, effects.outside.map(|excess| excess as f32));
    push_floats(rows, added_mass(effects).into_iter().flatten());
    if let Some(base) = &forces.base {
        push_floats(rows, by_rows(&base.damping));
        push_floats(
            rows,
            [base.water_level, base.bed_clearance, base.bed, base.shaft_power].map(|x| x as f32),
        );
    }
    push_floats(rows, jacobian.iter().flat_map(|jacobian| derivatives(jacobian)));
}

fn push_vector(rows: &mut Vec<u8>, vector: &Vec3) {
    push_floats(rows, single(vector));
}

fn push_floats(rows: &mut Vec<u8>, floats: impl IntoIterator<Item = f32>) {
    for float in floats {
        rows.extend(float.to_le_bytes());
    }
}
