//! One trial in the terms of the body frame.

use std::collections::BTreeMap;
use std::path::Path;

use super::acceleration::{acceleration, derivative};
use super::glitch::{Glitch, glitches};
use super::manifest::{Manifest, Measured};
use super::table::Table;
use super::units::{check_accelerometer, check_angles, check_limits, check_vertical};
use super::{Fault, Remark, TrialError, stem};
use crate::signal::{median_step, pieces};
use wade_core::at::At;
use wade_core::condition::{Condition, FRESH_WATER, GroundContact, LEAST_UPRIGHT};
use wade_core::frame::{Vec3, up_from_roll_pitch};

/// Components of a measured wrench.
pub const WRENCH: [&str; 6] = ["fx", "fy", "fz", "mx", "my", "mz"];
/// Wheel speeds.
pub const WHEELS: [&str; 4] = ["wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"];

/// Components of another simulator's wrench.
pub const SIMULATED: [&str; 6] = ["sim_fx", "sim_fy", "sim_fz", "sim_mx", "sim_my", "sim_mz"];
/// Columns that every trial has, beside one of [`DEPTH`] and [`WATER_LEVEL`].
pub(super) const REQUIRED: [&str; 7] = ["t", "vx", "vy", "vz", "wx", "wy", "wz"];
/// The two columns of which one says where the still water stands.
pub(super) const DEPTH: &str = "depth";
pub(super) const WATER_LEVEL: &str = "water_level";
pub(super) const BED_CLEARANCE: &str = "bed_clearance";
pub(super) const BED: &str = "bed";
const OPTIONAL: [&str; 17] = [
    DEPTH,
    WATER_LEVEL,
    BED_CLEARANCE,
    BED,
    "cx",
    "cy",
    "cz",
    "roll",
    "pitch",
    "yaw",
    "ax",
    "ay",
    "az",
    "alx",
    "aly",
    "alz",
    "rho",
];

/// A median step from this on is no second's fraction any more [s]: the numbers of frames have a step of 1.
const LONG_STEP: f64 = 1.0;

/// Share of the samples that lie no deeper than the flat ground: a few may be damaged. They may by a wave or a pitch [m].
const DEEPEST_SHARE: f64 = 0.95;
const DEPTH_TOLERANCE: f64 = 0.05;
/// Share of that depth that some samples reach: feet, the unit nearest to a meter, make a third of it.
const SHALLOWEST: f64 = 0.5;

/// A hole in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Line of the file after the hole.
    pub row: u64,
    /// Length [s].
    pub seconds: f64,
}

/// Where the still water stands, a value a sample, as one of two columns states it.
#[derive(Debug, Clone, PartialEq)]
pub enum StillWater {
    /// Undisturbed water surface above the ground-contact plane at the body origin [m]; negative on dry ground.
    Depth(Vec<f64>),
    /// Signed height of the still-water plane above the body origin along up [m].
    Level(Vec<f64>),
}

impl StillWater {
    /// Name of the column, and its values.
    pub fn column(&self) -> (&'static str, &Vec<f64>) {
        match self {
            Self::Depth(values) => (DEPTH, values),
            Self::Level(values) => (WATER_LEVEL, values),
        }
    }
}

/// One trial, a value a sample; body frame, SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Name of the file without `.csv`.
    pub name: String,
    /// Line of the file of each sample.
    pub rows: Vec<u64>,
    /// Time [s], increasing, not always uniform.
    pub t: Vec<f64>,
    /// Velocity over ground [m/s].
    pub velocity: Vec<Vec3>,
    /// Known velocity of the water over ground [m/s]; 0 where no column states it.
    pub current: Vec<Vec3>,
    /// Angular velocity [rad/s].
    pub angular_velocity: Vec<Vec3>,
    /// Roll [rad]; positive lowers the right side.
    pub roll: Vec<f64>,
    /// Pitch [rad]; positive lowers the nose.
    pub pitch: Vec<f64>,
    /// Yaw [rad].
    pub yaw: Vec<f64>,
    /// Depth or level of the water.
    pub still_water: StillWater,
    /// Distance of the bed below the ground-contact plane [m], where a column states it.
    pub bed_clearance: Option<Vec<f64>>,
    /// Share of the motion through the water that is motion over the bed [-], where a column states it.
    pub bed: Option<Vec<f64>>,
    /// Acceleration without gravity [m/s2]: as measured, else the derivative of the velocity in an inertial frame,
    /// `dv/dt + omega x v`.
    pub acceleration: Vec<Vec3>,
    /// Angular acceleration [rad/s2]: as measured, else the derivative of the angular velocity.
    pub angular_acceleration: Vec<Vec3>,
    /// True where the file has accelerations.
    pub acceleration_is_measured: bool,
    /// Density [kg/m3].
    pub density: Vec<f64>,
    /// Wheel speeds [rad/s] in the order of [`WHEELS`].
    pub wheel_speeds: [Option<Vec<f64>>; 4],
    /// Measured wrench about the center of mass [N, N m] in the order of [`WRENCH`].
    pub measured: [Option<Vec<f64>>; 6],
    /// Another simulator's wrench about the center of mass [N, N m].
    pub simulated: [Option<Vec<f64>>; 6],
    /// Known other forces by column.
    pub other_forces: BTreeMap<String, Vec<f64>>,
    /// Known loads that the load cell bears besides the water's, by column.
    pub known_loads: BTreeMap<String, Vec<f64>>,
    /// Columns that no trial has.
    pub unknown_columns: Vec<String>,
    /// Holes in time.
    pub gaps: Vec<Gap>,
    /// Samples that were left out, since they are none of the water's.
    pub glitches: Vec<Glitch>,
}

impl Trial {
    /// True where a simulator's forces stand beside the measured ones.
    pub fn is_simulated(&self) -> bool {
        self.simulated.iter().any(Option::is_some)
    }

    /// Reads and checks one file.
    pub(super) fn read(path: &Path, manifest: &Manifest) -> Result<Self, TrialError> {
        let Measured { other_forces, known_loads, .. } = &manifest.measured;
        let stated = other_forces.iter().chain(known_loads).map(String::as_str);
        let optional: Vec<&str> =
            OPTIONAL.into_iter().chain(WHEELS).chain(WRENCH).chain(SIMULATED).chain(stated).collect();
        let mut table = Table::read(path, &REQUIRED, &optional)?;
        check_vehicle(&table, manifest)?;
        check_presence(&table, manifest)?;
        table.check_time(2)?;
        // what contradicts another column is told more precisely than what lies beyond a limit
        check_angles(&table)?;
        check_vertical(&table)?;
        check_limits(&table)?;
        check_bed(&table)?;
        check_upright(&table)?;
        let glitches = without_glitches(&mut table, manifest)?;
        let trial = Self { glitches, ..Self::from_table(&table, manifest) };
        match vectors(&table, ["ax", "ay", "az"]) {
            Some(measured) => {
                check_accelerometer(&table, &trial.acceleration)?;
                Ok(Self { acceleration: measured, acceleration_is_measured: true, ..trial })
            }
            None => Ok(trial),
        }
    }

    /// Refuses a depth over the flat ground that the depths of the samples contradict. A water level says nothing without a hull, and
    /// a depth beside a bed clearance is a hull's draft.
    pub(super) fn check_depth(&self, manifest: &Manifest) -> Result<(), Fault> {
        let stated = manifest.nominal_depth.get(&self.name).filter(|_| self.bed_clearance.is_none());
        let (Some(&stated), StillWater::Depth(depths)) = (stated, &self.still_water) else { return Ok(()) };
        let mut depths = depths.clone();
        depths.sort_unstable_by(f64::total_cmp);
        let deepest = depths[(DEEPEST_SHARE * (depths.len() - 1) as f64) as usize];
        match (SHALLOWEST * stated..=stated + DEPTH_TOLERANCE).contains(&deepest) {
            true => Ok(()),
            false => Err(Fault::NominalDepth { trial: self.name.clone(), stated, deepest }),
        }
    }

    /// The trial of a table that was checked, accelerating as its velocity says.
    fn from_table(table: &Table, manifest: &Manifest) -> Self {
        let t = table.column("t").to_vec();
        let column = |name: &str| table.columns.get(name).cloned();
        let or_constant = |name: &str, value: f64| column(name).unwrap_or_else(|| vec![value; t.len()]);
        let velocity = vectors(table, ["vx", "vy", "vz"]).unwrap_or_default();
        let angular_velocity = vectors(table, ["wx", "wy", "wz"]).unwrap_or_default();
        let angular_acceleration = vectors(table, ["alx", "aly", "alz"]);
        let current = vectors(table, ["cx", "cy", "cz"]);
        let named = |names: &[String]| -> BTreeMap<String, Vec<f64>> {
            names.iter().filter_map(|name| Some((name.clone(), column(name)?))).collect()
        };
        Self {
            name: stem(&table.path),
            acceleration: acceleration(&t, &velocity, &angular_velocity),
            acceleration_is_measured: false,
            angular_acceleration: angular_acceleration.unwrap_or_else(|| derivative(&t, &angular_velocity)),
            velocity,
            current: current.unwrap_or_else(|| vec![Vec3::zeros(); t.len()]),
            angular_velocity,
            roll: or_constant("roll", 0.0),
            pitch: or_constant("pitch", 0.0),
            yaw: or_constant("yaw", 0.0),
            still_water: match column(WATER_LEVEL) {
                Some(level) => StillWater::Level(level),
                None => StillWater::Depth(table.column(DEPTH).to_vec()),
            },
            bed_clearance: column(BED_CLEARANCE),
            bed: column(BED),
            density: or_constant("rho", manifest.fluid_density.unwrap_or(FRESH_WATER)),
            wheel_speeds: WHEELS.map(column),
            measured: WRENCH.map(|name| column(name).filter(|_| manifest.measured.is_compared(name))),
            simulated: SIMULATED.map(column),
            other_forces: named(&manifest.measured.other_forces),
            known_loads: named(&manifest.measured.known_loads),
            unknown_columns: table.unknown_columns.clone(),
            gaps: gaps(table),
            glitches: Vec::new(),
            rows: table.rows.clone(),
            t,
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// True where there is no sample; none that was read is.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// World up in the body frame at a sample.
    pub fn up(&self, sample: usize) -> nalgebra::UnitVector3<f64> {
        up_from_roll_pitch(self.roll[sample], self.pitch[sample])
    }

    /// The state at a sample, with the depth that belongs to its water level above a ground-contact plane at `z0` [m].
    pub fn condition(&self, sample: usize, ground_contact: GroundContact, z0: f64) -> Condition {
        let velocity = self.velocity[sample] - self.current[sample];
        let (depth, water_level) = match &self.still_water {
            StillWater::Depth(depth) => (depth[sample], None),
            StillWater::Level(level) => (0.0, Some(level[sample])),
        };
        let stated = |column: &Option<Vec<f64>>| column.as_ref().map(|values| values[sample]);
        let state = Condition {
            ground_velocity: self.velocity[sample],
            angular_velocity: self.angular_velocity[sample],
            acceleration: self.acceleration[sample],
            angular_acceleration: self.angular_acceleration[sample],
            density: self.density[sample],
            up: self.up(sample),
            ground_contact,
            water_level,
            bed_clearance: stated(&self.bed_clearance),
            stated_bed: stated(&self.bed),
            ..Condition::level(velocity, depth)
        };
        state.resolved(z0)
    }

    /// The depth at a sample above a ground-contact plane at `z0` [m].
    pub fn depth(&self, sample: usize, z0: f64) -> f64 {
        self.condition(sample, GroundContact::default(), z0).depth
    }

    pub(super) fn remarks(&self) -> Vec<Remark> {
        let trial = || self.name.clone();
        let unknown = self.unknown_columns.iter();
        let unknown = unknown.map(|column| Remark::UnknownColumn { trial: trial(), column: column.clone() });
        let gaps = self.gaps.iter();
        let gaps = gaps.map(|gap| Remark::Gap { trial: trial(), row: gap.row, seconds: gap.seconds });
        let glitches = self.glitches.iter();
        let glitches = glitches.map(|glitch| Remark::Glitch { trial: trial(), glitch: *glitch });
        let clock = long_step(&self.t).map(|step| Remark::Clock { trial: trial(), step });
        unknown.chain(gaps).chain(glitches).chain(clock).collect()
    }
}

/// The median step of stamps that are hardly seconds.
pub fn long_step(times: &[f64]) -> Option<f64> {
    median_step(times).filter(|&step| step >= LONG_STEP)
}

/// Refuses rows of another vehicle than the manifest's.
fn check_vehicle(table: &Table, manifest: &Manifest) -> Result<(), TrialError> {
    let other = table.vehicles.iter().zip(&table.rows).find(|(name, _)| **name != manifest.vehicle);
    other.map_or(Ok(()), |(name, row)| {
        let (row, found, expected) = (*row, name.clone(), manifest.vehicle.clone());
        Err(At::path(&table.path)(Fault::Vehicle { row, found, expected }))
    })
}

/// Columns that come together, or that the manifest promises.
fn check_presence(table: &Table, manifest: &Manifest) -> Result<(), TrialError> {
    for group in [["ax", "ay", "az"], ["alx", "aly", "alz"], ["cx", "cy", "cz"]] {
        let missing = group.into_iter().find(|name| !table.has(name));
        if let Some(missing) = missing.filter(|_| group.iter().any(|name| table.has(name))) {
            return Err(table.missing(missing));
        }
    }
    match (table.has(DEPTH), table.has(WATER_LEVEL)) {
        (false, false) => return Err(At::path(&table.path)(Fault::NoLevel { present: table.present() })),
        (true, true) => return Err(At::path(&table.path)(Fault::TwoLevels)),
        _ => {}
    }
    let promised = manifest.measured.columns.iter().flatten().chain(&manifest.measured.other_forces);
    match promised.into_iter().find(|name| !table.has(name)) {
        Some(missing) => Err(table.missing(missing)),
        None => Ok(()),
    }
}

/// Refuses a bed above the ground-contact plane, and one that moves with more than the whole motion.
fn check_bed(table: &Table) -> Result<(), TrialError> {
    let outside = |column: &'static str, max: f64| {
        let row = table.column(column).iter().position(|value| !(0.0..=max).contains(value))?;
        Some((table.rows[row], column, table.column(column)[row]))
    };
    if let Some((row, column, value)) = outside(BED_CLEARANCE, f64::INFINITY) {
        return Err(At::path(&table.path)(Fault::Negative { row, column, value }));
    }
    match outside(BED, 1.0) {
        Some((row, column, value)) => Err(At::path(&table.path)(Fault::NoShare { row, column, value })),
        None => Ok(()),
    }
}

/// Refuses a depth of a vehicle on its side or its back.
fn check_upright(table: &Table) -> Result<(), TrialError> {
    let angle = |name: &str, row: usize| table.column(name).get(row).copied().unwrap_or(0.0);
    let lies = |row: &usize| up_from_roll_pitch(angle("roll", *row), angle("pitch", *row)).z < LEAST_UPRIGHT;
    match (0..table.rows.len()).find(lies).filter(|_| table.has(DEPTH)) {
        Some(row) => Err(At::path(&table.path)(Fault::NoDepth { row: table.rows[row] })),
        None => Ok(()),
    }
}

fn vectors(table: &Table, names: [&str; 3]) -> Option<Vec<Vec3>> {
    if !table.has(names[0]) {
        return None;
    }
    let [x, y, z] = names.map(|name| table.column(name));
    Some(x.iter().zip(y).zip(z).map(|((x, y), z)| Vec3::new(*x, *y, *z)).collect())
}

/// Leaves out the rows in which a measured component stands alone.
fn without_glitches(table: &mut Table, manifest: &Manifest) -> Result<Vec<Glitch>, TrialError> {
    /// Largest share of rows that are left out: where there are more, the recording is at fault, and not a sample.
    const MOST: f64 = 0.01;
    let compared = WRENCH.into_iter().filter(|name| table.has(name) && manifest.measured.is_compared(name));
    let found: Vec<(usize, Glitch)> = compared
        .flat_map(|column| {
            let of = |(at, ratio)| {
                (at, Glitch { row: table.rows[at], column, value: table.column(column)[at], ratio })
            };
            glitches(table.column(column)).into_iter().map(of).collect::<Vec<_>>()
        })
        .collect();
    let rows = table.rows.len();
    match found.first() {
        Some((_, first)) if found.len() as f64 > f64::max(MOST * rows as f64, 1.0) => {
            Err(At::path(&table.path)(Fault::Glitches { count: found.len(), rows, first: *first }))
        }
        _ => {
            table.leave_out(&found.iter().map(|(at, _)| *at).collect::<Vec<_>>());
            Ok(found.into_iter().map(|(_, glitch)| glitch).collect())
        }
    }
}

fn gaps(table: &Table) -> Vec<Gap> {
    let t = table.column("t");
    let starts = pieces(t).into_iter().skip(1).map(|piece| piece.start);
    starts.map(|start| Gap { row: table.rows[start], seconds: t[start] - t[start - 1] }).collect()
}
