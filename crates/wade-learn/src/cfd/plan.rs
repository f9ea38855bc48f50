//! Which cases to compute: a folder with `campaign.toml` (vehicle and settings) and `plan.csv` (a row a case).

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Path, PathBuf};

use nalgebra::{Rotation3, UnitVector3};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::case::{SECTIONS_BEFORE_S, Settings};
use crate::files::write_whole;
use crate::parameter_table::ParameterTable;
use wade_core::condition::{Condition, GroundContact};
use wade_core::digest::hexadecimal;
use wade_core::frame::{Vec3, up_from_roll_pitch};
use wade_core::vehicle::Vehicle;

/// File of the settings.
pub const CAMPAIGN_FILE: &str = "campaign.toml";
/// File of the cases.
pub const PLAN_FILE: &str = "plan.csv";

/// What a case is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Set {
    /// The source paper's parameter table.
    Paper,
    /// Any heading, from standstill, tilted, up to floating depth.
    Wide,
    /// The states of the paper set once more with moving bed and turning wheels.
    Driving,
    /// Surge accelerations.
    Unsteady,
    /// Cases that others know the answer of: at rest, head-on at the paper's depths, three meshes.
    Check,
    /// The state of the three meshes on a fourth, a million cells, an hour of a core; and in a larger channel. Weights do not
    /// learn from it; it says how far meshes and channel that they learn from are off.
    Mesh,
    /// Straight ahead over the depths and speeds of the table: how a vehicle is driven most, and an edge of the
    /// hypercube that holds next to no case.
    Ahead,
    /// Rounds of any course, attitude, water level, bed share, clearance and ramp, see [`super::drive`].
    Drive,
}

impl Set {
    /// Sets of which a driving twin is taken: steady, over a parked bed, level.
    pub(super) const TWINNED: [Self; 3] = [Self::Paper, Self::Check, Self::Ahead];
}

impl fmt::Display for Set {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Paper => "paper",
            Self::Wide => "wide",
            Self::Driving => "driving",
            Self::Unsteady => "unsteady",
            Self::Check => "check",
            Self::Mesh => "mesh",
            Self::Ahead => "ahead",
            Self::Drive => "drive",
        })
    }
}

/// What the bed does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Bed {
    /// Bed and wheels at rest relative to the vehicle: a vehicle parked in a current.
    #[default]
    Parked,
    /// The bed moves with the water and the wheels roll on it: a vehicle that drives through still water.
    Driving,
}

/// Form of the bed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ground {
    /// A horizontal plane.
    #[default]
    Flat,
    /// Parallel to the wheels under the vehicle, in a channel that is deeper below it and shallower above it.
    Ramp,
}

/// One case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Unique name, `<vehicle>-<set>-<number>`; the name of its folder.
    pub id: String,
    /// What it is for.
    pub set: Set,
    /// Speed through the water at the start [m/s].
    pub speed_mps: f64,
    /// Direction of the velocity in the body frame seen from above: 0 forward, 90 to the left [degrees].
    pub heading_deg: f64,
    /// Depth at the body origin [m].
    pub depth_m: f64,
    /// Density of the fluid [kg/m3].
    pub density_kgpm3: f64,
    /// Roll, positive lowers the right side [degrees].
    pub roll_deg: f64,
    /// Pitch, positive lowers the nose [degrees].
    pub pitch_deg: f64,
    /// What the bed does.
    pub bed: Bed,
    /// Size of the cells relative to the settings.
    pub cell_scale: f64,
    /// Speed after the ramp of an unsteady case [m/s]; the same as `speed_mps` for a steady one.
    pub end_speed_mps: f64,
    /// Duration of the ramp [s]; 0 for a steady case.
    pub ramp_s: f64,
    /// Length, width and height of the channel relative to the settings.
    #[serde(default = "as_set")]
    pub channel_scale: f64,
    /// Velocity of the bed over that of the water far away, both relative to the vehicle; by default that of `bed`.
    #[serde(default)]
    pub bed_share: Option<f64>,
    /// Distance of the lowest point of the hull from a flat bed [m].
    #[serde(default)]
    pub clearance_m: f64,
    /// Form of the bed.
    #[serde(default)]
    pub ground: Ground,
    /// Round of the set `drive`, from 1; 0 for other sets.
    #[serde(default)]
    pub round: u32,
}

/// The channel of the settings, where a plan or an outcome of before says nothing of it.
pub(super) fn as_set() -> f64 {
    1.0
}

impl Case {
    /// A steady level case on the standard mesh over a parked bed; `number` counts within vehicle and set.
    pub(super) fn steady(vehicle: &str, set: Set, number: usize, speed_mps: f64, depth_m: f64) -> Self {
        Self {
            id: format!("{vehicle}-{set}-{number:04}"),
            set,
            speed_mps,
            heading_deg: 0.0,
            depth_m,
            density_kgpm3: wade_core::condition::FRESH_WATER,
            roll_deg: 0.0,
            pitch_deg: 0.0,
            bed: Bed::Parked,
            cell_scale: 1.0,
            end_speed_mps: speed_mps,
            ramp_s: 0.0,
            channel_scale: as_set(),
            bed_share: None,
            clearance_m: 0.0,
            ground: Ground::Flat,
            round: 0,
        }
    }

    /// True when the speed changes.
    pub fn is_unsteady(&self) -> bool {
        self.ramp_s > 0.0
    }

    /// True where both are the same flow on the same mesh.
    pub(super) fn is_same_state(&self, other: &Self) -> bool {
        let other = Self { id: self.id.clone(), set: self.set, round: self.round, ..other.clone() };
        *self == other
    }

    /// True without roll and pitch.
    pub fn is_level(&self) -> bool {
        self.roll_deg == 0.0 && self.pitch_deg == 0.0
    }

    /// True when all wheels stand on the bed.
    pub fn stands(&self) -> bool {
        self.clearance_m == 0.0 && (self.is_level() || self.ground == Ground::Ramp)
    }

    /// Velocity of the bed over that of the water far away, both relative to the vehicle.
    pub fn share_of_bed(&self) -> f64 {
        self.bed_share.unwrap_or(match self.bed {
            Bed::Parked => 0.0,
            Bed::Driving => 1.0,
        })
    }

    /// World up in the body frame.
    pub fn up(&self) -> UnitVector3<f64> {
        up_from_roll_pitch(self.roll_deg.to_radians(), self.pitch_deg.to_radians())
    }

    /// Rotation from the body frame to the frame of the case.
    pub fn cfd_from_body(&self) -> Rotation3<f64> {
        let [roll, pitch, yaw] = [self.roll_deg, self.pitch_deg, -self.heading_deg].map(f64::to_radians);
        Rotation3::from_euler_angles(roll, pitch, yaw)
    }

    /// The state that the case computes at a given speed and acceleration along the velocity, body frame.
    pub fn condition(&self, speed: f64, acceleration: f64) -> Condition {
        let forward = self.cfd_from_body().inverse() * Vec3::x();
        let velocity = forward * speed;
        Condition {
            velocity,
            ground_velocity: velocity * self.share_of_bed(),
            acceleration: forward * acceleration,
            density: self.density_kgpm3,
            up: self.up(),
            // no water reaches under what stands on the bed of a mesh
            ground_contact: GroundContact::Dry,
            ..Condition::level(velocity, self.depth_m)
        }
    }
}

/// What a campaign is about; the file `campaign.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Campaign {
    /// Format of the folder.
    pub format: u32,
    /// Name of the vehicle's bundle.
    pub vehicle: String,
    /// SHA-256 of its hull and surfaces, so that a vehicle that changed since is noticed.
    pub hull_sha256: String,
    /// The table that the plan covers.
    pub table: ParameterTable,
    /// How every case is computed.
    #[serde(default)]
    pub settings: Settings,
}

impl Campaign {
    /// Refuses a table or settings of the campaign file at `path` that nothing can be computed with.
    fn check(&self, path: &Path) -> Result<(), PlanError> {
        if !self.table.is_valid() {
            return Err(PlanError::Table { path: path.to_owned() });
        }
        match self.settings.fault() {
            Some((field, value, expected)) => {
                Err(PlanError::Setting { path: path.to_owned(), field, value, expected })
            }
            None => Ok(()),
        }
    }
}

/// The format this version writes and reads.
pub const FORMAT: u32 = 1;

/// Why a campaign folder was refused.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// A file that cannot be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file that does not parse.
    #[error("{path}: {message}")]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Where and what.
        message: String,
    },
    /// A folder of a newer format.
    #[error("{path}: format {found}, this version of wade reads {FORMAT}")]
    Format {
        /// The file.
        path: PathBuf,
        /// Its format.
        found: u32,
    },
    /// Two rows of one name.
    #[error("{path}: case `{id}` stands there twice")]
    Twice {
        /// The file.
        path: PathBuf,
        /// The name.
        id: String,
    },
    /// A name that is no name of a folder.
    #[error(
        "{path}: `{id}` names no case: letters, digits, `-` and `_`, and none of `outcomes`, `failed` and `locks`"
    )]
    Name {
        /// The file.
        path: PathBuf,
        /// The name.
        id: String,
    },
    /// Settings that nothing can be computed with.
    #[error("{path}: settings: {field} is {value}, which is not {expected}")]
    Setting {
        /// The file.
        path: PathBuf,
        /// The field.
        field: &'static str,
        /// What it is.
        value: String,
        /// What it must be.
        expected: &'static str,
    },
    /// Ranges that are none.
    #[error("{path}: table: a range is upside down or not finite, or a speed or density is not positive")]
    Table {
        /// The file.
        path: PathBuf,
    },
    /// Columns that contradict one another.
    #[error("{path}: case `{id}`: {fault}")]
    Ramp {
        /// The file.
        path: PathBuf,
        /// The case.
        id: String,
        /// What is wrong.
        fault: &'static str,
    },
    /// A number out of its range.
    #[error("{path}: case `{id}`: {field} is {value}, which is not {expected}")]
    Value {
        /// The file.
        path: PathBuf,
        /// The case.
        id: String,
        /// The column.
        field: &'static str,
        /// What it is.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// Driving twins need steady cases over a parked bed.
    #[error(
        "there are {available} steady cases without a driving twin, {wanted} are required: plan more of the paper set first"
    )]
    NoTwin {
        /// Cases to take a twin of.
        available: usize,
        /// Twins asked for.
        wanted: usize,
    },
    /// The plan of another vehicle, or of this one before it changed.
    #[error(
        "{path}: the plan was made for a `{vehicle}` with another hull: make a new plan, or bring that bundle back"
    )]
    Changed {
        /// The file.
        path: PathBuf,
        /// Name of the vehicle.
        vehicle: String,
    },
}

/// A campaign and its cases.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The settings.
    pub campaign: Campaign,
    /// The cases in the order of their planning.
    pub cases: Vec<Case>,
}

impl Plan {
    /// Reads a campaign folder.
    pub fn read(folder: &Path) -> Result<Self, PlanError> {
        let path = folder.join(CAMPAIGN_FILE);
        let text = std::fs::read_to_string(&path).map_err(|source| io(&path, source))?;
        let campaign: Campaign = toml::from_str(&text).map_err(|e| syntax(&path, &e))?;
        if campaign.format != FORMAT {
            return Err(PlanError::Format { path, found: campaign.format });
        }
        campaign.check(&path)?;
        let path = folder.join(PLAN_FILE);
        let mut reader = csv::Reader::from_path(&path).map_err(|e| syntax(&path, &e))?;
        let cases: Vec<Case> =
            reader.deserialize().collect::<Result<_, _>>().map_err(|e| syntax(&path, &e))?;
        let plan = Self { campaign, cases };
        plan.check_cases(&path)?;
        Ok(plan)
    }

    fn check_cases(&self, path: &Path) -> Result<(), PlanError> {
        let mut seen = BTreeSet::new();
        for case in &self.cases {
            if !seen.insert(&case.id) {
                return Err(PlanError::Twice { path: path.to_owned(), id: case.id.clone() });
            }
            check(path, case)?;
            check_ramp(path, case, &self.campaign.settings)?;
        }
        Ok(())
    }

    /// Begins a campaign folder. Nothing is written that would be refused when it is read.
    pub fn write(&self, folder: &Path) -> Result<(), PlanError> {
        let path = folder.join(CAMPAIGN_FILE);
        self.campaign.check(&path)?;
        self.check_cases(&folder.join(PLAN_FILE))?;
        self.put(folder)
    }

    fn put(&self, folder: &Path) -> Result<(), PlanError> {
        let path = folder.join(CAMPAIGN_FILE);
        std::fs::create_dir_all(folder).map_err(|source| io(folder, source))?;
        let text = toml::to_string(&self.campaign).map_err(|e| syntax(&path, &e))?;
        write_whole(&path, text.as_bytes()).map_err(|source| io(&path, source))?;
        self.put_cases(folder)
    }

    /// Writes the cases of a folder whose settings stand as they are.
    pub fn write_cases(&self, folder: &Path) -> Result<(), PlanError> {
        self.check_cases(&folder.join(PLAN_FILE))?;
        self.put_cases(folder)
    }

    fn put_cases(&self, folder: &Path) -> Result<(), PlanError> {
        let path = folder.join(PLAN_FILE);
        let mut writer = csv::Writer::from_writer(Vec::new());
        for case in &self.cases {
            writer.serialize(case).map_err(|e| syntax(&path, &e))?;
        }
        let bytes = writer.into_inner().map_err(|e| syntax(&path, &e))?;
        write_whole(&path, &bytes).map_err(|source| io(&path, source))
    }

    /// Refuses a vehicle whose hull or surfaces are not those that the plan was made for.
    pub fn check_vehicle(&self, folder: &Path, vehicle: &Vehicle) -> Result<(), PlanError> {
        if vehicle.name == self.campaign.vehicle && hull_hash(vehicle) == self.campaign.hull_sha256 {
            return Ok(());
        }
        Err(PlanError::Changed { path: folder.join(CAMPAIGN_FILE), vehicle: self.campaign.vehicle.clone() })
    }
}

/// SHA-256 of the corners of every face, its surface, and the contact patches.
pub fn hull_hash(vehicle: &Vehicle) -> String {
    let mut sha = Sha256::new();
    let mesh = &vehicle.hull.mesh;
    let mut point = |p: &Vec3| p.iter().for_each(|x| sha.update((*x as f32).to_le_bytes()));
    (0..mesh.faces.len()).flat_map(|face| mesh.triangle(face)).for_each(|corner| point(&corner));
    vehicle.contacts.iter().for_each(|patch| point(&(patch.center + Vec3::z() * patch.area)));
    vehicle.hull.face_surface.iter().for_each(|surface| sha.update(surface.to_le_bytes()));
    vehicle.surfaces.iter().for_each(|surface| sha.update(surface.name.as_bytes()));
    hexadecimal(&sha.finalize())
}

fn io(path: &Path, source: std::io::Error) -> PlanError {
    PlanError::Io { path: path.to_owned(), source }
}

fn syntax(path: &Path, error: &dyn fmt::Display) -> PlanError {
    PlanError::Syntax { path: path.to_owned(), message: error.to_string() }
}

/// Refuses a row that no solver should see. A case is computed in a folder of its name, which is removed afterwards.
fn check(path: &Path, case: &Case) -> Result<(), PlanError> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let is_name = (1..=100).contains(&case.id.len()) && case.id.chars().all(is_plain);
    if !is_name || ["outcomes", "failed", "locks"].contains(&case.id.as_str()) {
        return Err(PlanError::Name { path: path.to_owned(), id: case.id.clone() });
    }
    // tilted, a hull gets wet below the height of its origin
    let least_depth = if case.set == Set::Drive { -50.0 } else { 0.005 };
    let fields = [
        ("speed_mps", case.speed_mps, 0.0, 30.0, "a speed from 0 to 30 m/s"),
        ("end_speed_mps", case.end_speed_mps, 0.0, 30.0, "a speed from 0 to 30 m/s"),
        ("heading_deg", case.heading_deg, -180.0, 180.0, "an angle from -180 to 180 degrees"),
        ("depth_m", case.depth_m, least_depth, 50.0, "a depth from 0.005 to 50 m"),
        ("density_kgpm3", case.density_kgpm3, 100.0, 20_000.0, "a density from 100 to 20000 kg/m3"),
        ("roll_deg", case.roll_deg, -45.0, 45.0, "an angle from -45 to 45 degrees"),
        ("pitch_deg", case.pitch_deg, -45.0, 45.0, "an angle from -45 to 45 degrees"),
        ("cell_scale", case.cell_scale, 0.3, 5.0, "a factor from 0.3 to 5"),
        ("ramp_s", case.ramp_s, 0.0, 60.0, "a time from 0 to 60 s"),
        ("channel_scale", case.channel_scale, 0.5, 3.0, "a factor from 0.5 to 3"),
        ("bed_share", case.share_of_bed(), 0.0, 1.0, "a share from 0 to 1"),
        ("clearance_m", case.clearance_m, 0.0, 20.0, "a distance from 0 to 20 m"),
    ];
    let wrong = fields.into_iter().find(|(_, value, min, max, _)| !(min..=max).contains(&value));
    match wrong {
        Some((field, value, .., expected)) => {
            Err(PlanError::Value { path: path.to_owned(), id: case.id.clone(), field, value, expected })
        }
        None => Ok(()),
    }
}

fn check_ramp(path: &Path, case: &Case, settings: &Settings) -> Result<(), PlanError> {
    let fault = match case.is_unsteady() {
        _ if (case.bed == Bed::Parked) != (case.share_of_bed() == 0.0) => {
            "bed is parked where bed_share is 0, and driving elsewhere"
        }
        _ if case.ground == Ground::Ramp && case.clearance_m > 0.0 => "on a ramp there is no clearance",
        true if case.ground == Ground::Ramp || case.set == Set::Drive => {
            "on a ramp and in rounds the speed is steady"
        }
        true if case.bed == Bed::Driving => "wheels that turn keep their speed: a ramp needs a parked bed",
        true if settings.settle_s[0] < SECTIONS_BEFORE_S => {
            "half a second before the ramp is kept: settle_s is shorter"
        }
        false if case.end_speed_mps != case.speed_mps => {
            "end_speed_mps differs from speed_mps, and ramp_s is 0"
        }
        _ => return Ok(()),
    };
    Err(PlanError::Ramp { path: path.to_owned(), id: case.id.clone(), fault })
}

/// An empty plan for the Warthog.
#[cfg(test)]
pub(super) fn empty() -> Plan {
    let campaign = Campaign {
        format: FORMAT,
        vehicle: "warthog".into(),
        hull_sha256: String::new(),
        table: ParameterTable::WARTHOG,
        settings: Settings::default(),
    };
    Plan { campaign, cases: Vec::new() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn the_condition_moves_as_the_heading_says_and_is_tilted_as_the_attitude_says() {
        let case = Case { heading_deg: 90.0, ..Case::steady("warthog", Set::Paper, 0, 2.0, 0.2) };
        let condition = case.condition(2.0, 0.5);
        assert!((condition.velocity - Vec3::new(0.0, 2.0, 0.0)).norm() < 1e-12);
        assert!((condition.acceleration - Vec3::new(0.0, 0.5, 0.0)).norm() < 1e-12);
        assert_eq!(condition.ground_velocity, Vec3::zeros());
        let tilted = Case { roll_deg: 5.0, pitch_deg: -8.0, heading_deg: 30.0, ..case };
        let up = tilted.cfd_from_body().inverse() * Vec3::z();
        assert!((up - tilted.up().into_inner()).norm() < 1e-12);
        assert!(tilted.condition(2.0, 0.0).velocity.dot(&up).abs() < 1e-12, "the flow is horizontal");
    }

    #[test]
    fn names_that_lead_elsewhere_and_ramps_that_nothing_follows_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |change: &dyn Fn(&mut Plan)| {
            let mut plan = empty();
            plan.extend(Set::Paper, 2, 1, 0.378).unwrap();
            change(&mut plan);
            let refusal = plan.write(folder.path()).unwrap_err().to_string();
            plan.put(folder.path()).unwrap();
            assert_eq!(Plan::read(folder.path()).unwrap_err().to_string(), refusal);
            refusal
        };
        for id in ["", "outcomes", "../elsewhere", "/tmp/elsewhere", "a/b", "."] {
            let error = refused(&|plan| plan.cases[1].id = id.to_owned());
            assert!(error.contains("names no case"), "{error}");
        }
        let error = refused(&|plan| plan.cases[1].end_speed_mps += 1.0);
        assert!(error.contains("warthog-paper-0001") && error.contains("ramp_s is 0"), "{error}");
        let error = refused(&|plan| (plan.cases[1].ramp_s, plan.cases[1].bed) = (1.0, Bed::Driving));
        assert!(error.contains("parked bed"), "{error}");
        let error = refused(&|plan| {
            plan.cases[1].ramp_s = 1.0;
            plan.campaign.settings.settle_s = [0.2, 2.0];
        });
        assert!(error.contains("settle_s is shorter"), "{error}");
        let error = refused(&|plan| plan.campaign.settings.settle_s = [5.0, 2.0]);
        assert!(error.contains("campaign.toml") && error.contains("settle_s"), "{error}");
        let error = refused(&|plan| plan.campaign.settings.windows = 0);
        assert!(error.contains("windows is 0"), "{error}");
        let error = refused(&|plan| plan.campaign.table.speed_mps.min = -1.0);
        assert!(error.contains("campaign.toml: table"), "{error}");
        let error = refused(&|plan| plan.cases[0].speed_mps = 1e300);
        assert!(error.contains("speed_mps"), "{error}");
    }

    #[test]
    fn a_folder_reads_back_as_written_and_a_bad_row_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let mut plan = empty();
        for set in [Set::Paper, Set::Wide, Set::Unsteady, Set::Check, Set::Mesh, Set::Ahead] {
            plan.extend(set, 5, 1, 0.378).unwrap();
        }
        plan.write(folder.path()).unwrap();
        assert_eq!(Plan::read(folder.path()).unwrap(), plan);
        plan.cases[3].density_kgpm3 = f64::NAN;
        plan.put(folder.path()).unwrap();
        let error = Plan::read(folder.path()).unwrap_err().to_string();
        assert!(error.contains("warthog-paper-0003") && error.contains("density_kgpm3"), "{error}");
    }
}
