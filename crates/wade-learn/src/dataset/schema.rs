//! The columns of the file: names, units, and which value each holds. A row is one surface of one sample.

use super::{Dataset, Sample, SurfaceLoad};
use wade_core::condition::GroundContact;
use wade_core::frame::Vec3;

/// A column of text.
pub(super) struct Text {
    pub name: &'static str,
    pub of: fn(&Sample) -> &str,
}

pub(super) const VEHICLE: Text = Text { name: "vehicle", of: |s| &s.vehicle };
pub(super) const CASE: Text = Text { name: "case", of: |s| &s.case };
pub(super) const SET: Text = Text { name: "set", of: |s| &s.set };
pub(super) const IMAGE: Text = Text { name: "image", of: |s| s.image.name() };
pub(super) const GROUND_CONTACT: Text =
    Text { name: "ground_contact", of: |s| contact_name(s.condition.ground_contact) };
pub(super) const TEXTS: [Text; 5] = [VEHICLE, CASE, SET, IMAGE, GROUND_CONTACT];

/// The only text that differs from row to row of a sample.
pub(super) const SURFACE: &str = "surface";

/// The only integer.
pub(super) const SECTION: &str = "section";

/// A column of double precision.
pub(super) struct Scalar {
    pub name: &'static str,
    pub unit: &'static str,
    pub of: fn(&Sample) -> f64,
}

pub(super) const START: Scalar = Scalar { name: "start_s", unit: "s", of: |s| s.start_s };
pub(super) const END: Scalar = Scalar { name: "end_s", unit: "s", of: |s| s.end_s };
pub(super) const DEPTH: Scalar = Scalar { name: "depth_m", unit: "m", of: |s| s.condition.depth };
pub(super) const DENSITY: Scalar =
    Scalar { name: "density_kgpm3", unit: "kg/m3", of: |s| s.condition.density };
pub(super) const SCALARS: [Scalar; 4] = [START, END, DEPTH, DENSITY];

/// A column of double precision that a file has where a sample has a value, with nulls where others have none.
pub(super) struct OptionalScalar {
    pub name: &'static str,
    pub unit: &'static str,
    pub of: fn(&Sample) -> Option<f64>,
}

pub(super) const BED_CLEARANCE: OptionalScalar =
    OptionalScalar { name: "bed_clearance_m", unit: "m", of: |s| s.condition.bed_clearance };

/// True of a data set whose file has the column.
pub(super) fn has_clearance(dataset: &Dataset) -> bool {
    dataset.samples.iter().any(|sample| (BED_CLEARANCE.of)(sample).is_some())
}

/// Three columns of double precision.
pub(super) struct State {
    pub names: [&'static str; 3],
    pub unit: &'static str,
    pub of: fn(&Sample) -> Vec3,
}

pub(super) const VELOCITY: State =
    State { names: ["vx_mps", "vy_mps", "vz_mps"], unit: "m/s", of: |s| s.condition.velocity };
pub(super) const GROUND_VELOCITY: State = State {
    names: ["ground_vx_mps", "ground_vy_mps", "ground_vz_mps"],
    unit: "m/s",
    of: |s| s.condition.ground_velocity,
};
pub(super) const ANGULAR_VELOCITY: State = State {
    names: ["wx_radps", "wy_radps", "wz_radps"],
    unit: "rad/s",
    of: |s| s.condition.angular_velocity,
};
pub(super) const ACCELERATION: State =
    State { names: ["ax_mps2", "ay_mps2", "az_mps2"], unit: "m/s2", of: |s| s.condition.acceleration };
pub(super) const ANGULAR_ACCELERATION: State = State {
    names: ["alx_radps2", "aly_radps2", "alz_radps2"],
    unit: "rad/s2",
    of: |s| s.condition.angular_acceleration,
};
pub(super) const UP: State =
    State { names: ["up_x", "up_y", "up_z"], unit: "1", of: |s| s.condition.up.into_inner() };
pub(super) const STATES: [State; 6] =
    [VELOCITY, GROUND_VELOCITY, ANGULAR_VELOCITY, ACCELERATION, ANGULAR_ACCELERATION, UP];

/// Three columns of single precision, of one surface: 24 bits resolve 0.1 mN in 1 kN, below any solver's residual,
/// and halve the file.
pub(super) struct Load {
    pub names: [&'static str; 3],
    pub unit: &'static str,
    pub nullable: bool,
    pub of: fn(&SurfaceLoad) -> Option<Vec3>,
}

pub(super) const FORCE: Load =
    Load { names: ["fx_n", "fy_n", "fz_n"], unit: "N", nullable: false, of: |l| Some(l.force) };
pub(super) const VISCOUS: Load = Load {
    names: ["viscous_fx_n", "viscous_fy_n", "viscous_fz_n"],
    unit: "N",
    nullable: true,
    of: |l| l.viscous,
};
pub(super) const MOMENT: Load =
    Load { names: ["mx_nm", "my_nm", "mz_nm"], unit: "N m", nullable: true, of: |l| l.moment };
pub(super) const REST_FORCE: Load = Load {
    names: ["rest_fx_n", "rest_fy_n", "rest_fz_n"],
    unit: "N",
    nullable: true,
    of: |l| l.rest.map(|rest| rest.force),
};
pub(super) const REST_MOMENT: Load = Load {
    names: ["rest_mx_nm", "rest_my_nm", "rest_mz_nm"],
    unit: "N m",
    nullable: true,
    of: |l| l.rest.map(|rest| rest.moment),
};
pub(super) const LOADS: [Load; 5] = [FORCE, VISCOUS, MOMENT, REST_FORCE, REST_MOMENT];

pub(super) fn contact_name(contact: GroundContact) -> &'static str {
    match contact {
        GroundContact::Wetted => "wetted",
        GroundContact::Dry => "dry",
    }
}

pub(super) fn contact_from_name(name: &str) -> Option<GroundContact> {
    [GroundContact::Wetted, GroundContact::Dry].into_iter().find(|contact| contact_name(*contact) == name)
}

/// Every number that all files have, with its unit.
pub(super) fn units() -> impl Iterator<Item = (&'static str, &'static str)> {
    let scalars = SCALARS.into_iter().map(|c| (c.name, c.unit));
    let states = STATES.into_iter().flat_map(|c| c.names.map(|name| (name, c.unit)));
    let loads = LOADS.into_iter().flat_map(|c| c.names.map(|name| (name, c.unit)));
    scalars.chain(states).chain(loads)
}
