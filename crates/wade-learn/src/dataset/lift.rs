//! Is the vertical force of CFD that of a hull of this size in this water, and does it act near the hull? A wrong unit,
//! density or depth is a plausible number to everything else.

use std::collections::BTreeMap;
use std::fmt;

use super::{Dataset, Sample};
use wade_core::frame::Vec3;
use wade_core::vehicle::Vehicle;

/// Lift at rest below which a sample says nothing [N].
const LEAST_LIFT: f64 = 1.0;

/// Vertical force over the lift at rest that motion explains: suction under the hull takes up to a third, a bow wave adds
/// as much.
const USUAL_RATIO: [f64; 2] = [0.62, 1.6];

/// The same for half a hull: half of what motion explains would reach into the usual, so it is the middle of that.
const HALF_RATIO: [f64; 2] = [0.4, USUAL_RATIO[0]];

/// Factor by which a ratio may differ from a power that a wrong unit makes.
const UNIT_FACTOR: f64 = 3.0;

/// Vertical force over the lift at rest of one case that hardly moves. The slowest of the shipped campaigns reach 1.63, and a
/// test keeps all of them inside what motion adds.
const USUAL_CASE_RATIO: [f64; 2] = [0.6, 1.7];

/// What motion adds to either end of that, over dynamic pressure times length times width of the vehicle. The shipped
/// campaigns need 0.23.
const MOTION_LIFT: f64 = 0.25;

/// Depth of the water over the height of the hull above which a depth is questioned: three times covers a vehicle that is
/// under water, and a depth in centimeters is beyond it from 3 % of the height on.
const MAX_DEPTH_HEIGHTS: f64 = 3.0;

/// Distance of the line along which the net force acts from the body origin, over the length of the vehicle, above which the
/// origin of moments is questioned. A force on the hull acts within it; the shipped campaigns reach 0.24. This judges what
/// came of origin_m and the moment center together: a mesh may lie anywhere if both say so.
const MAX_ARM_LENGTHS: f64 = 1.0;

/// Names of cases that a question gives.
const NAMED_CASES: usize = 3;

/// What may be wrong with the vertical force of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Cause {
    /// The force was not multiplied by the density.
    OverDensity,
    /// A symmetry plane cut the hull.
    HalfDomain,
    /// Kilonewtons, or millimeters.
    Unit,
    /// It points down.
    Axis,
    /// The pressure was without its hydrostatic part.
    NoHydrostaticPressure,
    /// Something else.
    Unknown,
}

/// What is questionable about the cases of a vehicle.
#[derive(Debug, Clone, PartialEq)]
pub enum Question {
    /// A vertical force that no motion explains.
    Lift(Lift),
    /// Water that is far deeper than the hull is high.
    Depth(Depth),
    /// Moments about a point far from the vehicle.
    Arm(Arm),
}

/// The cases of a vehicle whose vertical force is not the lift of its hull, with one likely cause.
#[derive(Debug, Clone, PartialEq)]
pub struct Lift {
    /// The vehicle, the cases and how many were compared.
    pub cases: Cases,
    /// Vertical force of the case with the median ratio [N].
    pub force: f64,
    /// Lift of the hull at rest in the same state, by Archimedes [N].
    pub at_rest: f64,
    /// What may be wrong.
    pub cause: Cause,
}

/// The cases of a vehicle in very deep water.
#[derive(Debug, Clone, PartialEq)]
pub struct Depth {
    /// The vehicle, the cases and how many were compared.
    pub cases: Cases,
    /// Depth of the deepest [m].
    pub depth: f64,
    /// Height of the vehicle [m].
    pub height: f64,
}

/// The cases of a vehicle whose net force acts far from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// The vehicle, the cases and how many were compared.
    pub cases: Cases,
    /// Distance of the net force from the body origin in the worst of them [m].
    pub arm: f64,
    /// Length of the vehicle [m].
    pub length: f64,
}

/// The cases of a vehicle that a question is about.
#[derive(Debug, Clone, PartialEq)]
pub struct Cases {
    /// The vehicle.
    pub vehicle: String,
    /// Names of the cases, the one whose numbers are stated first.
    pub names: Vec<String>,
    /// Number of cases that were compared.
    pub compared: usize,
}

impl fmt::Display for Cases {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { vehicle, names, compared } = self;
        let first: Vec<String> = names.iter().take(NAMED_CASES).map(|name| format!("`{name}`")).collect();
        let more = if names.len() > first.len() { ", ..." } else { "" };
        let cases = if *compared == 1 { "case" } else { "cases" };
        write!(f, "{vehicle}: in {} of {compared} {cases} ({}{more})", names.len(), first.join(", "))
    }
}

impl fmt::Display for Question {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lift(lift) => lift.fmt(f),
            Self::Depth(depth) => depth.fmt(f),
            Self::Arm(arm) => arm.fmt(f),
        }
    }
}

impl fmt::Display for Lift {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cases, force, at_rest, cause } = self;
        let ratio = force / at_rest;
        write!(
            f,
            "{cases} the vertical force is not the lift that Archimedes gives the hull at rest: it is {ratio:.4} of it in the \
             first, {force:.4} N of {at_rest:.1} N: {}",
            match cause {
                Cause::OverDensity => "are the forces over the density (rhoInf 1)?",
                Cause::HalfDomain => "is it half a hull, cut by a symmetry plane?",
                Cause::Unit => "are the forces in another unit than newtons?",
                Cause::Axis => "does z of [frame] in case.toml point up?",
                Cause::NoHydrostaticPressure =>
                    "are the forces without hydrostatic pressure (p_rgh), or is depth_m of case.toml wrong?",
                Cause::Unknown => "are depth_m, origin_m and density_kgpm3 of case.toml right?",
            }
        )
    }
}

impl fmt::Display for Depth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cases, depth, height } = self;
        write!(
            f,
            "{cases} the water is more than {MAX_DEPTH_HEIGHTS} times as deep as the vehicle is high: {depth} m in the first, and \
             the vehicle is {height:.3} m high: is depth_m of case.toml in meters?"
        )
    }
}

impl fmt::Display for Arm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cases, arm, length } = self;
        write!(
            f,
            "{cases} the net force acts outside the vehicle: its moment puts it {arm:.1} m from the body origin in the first, \
             and the vehicle is {length:.2} m long: are origin_m and the point of the moments (CofR, moment_center_m) \
             in meters and right?"
        )
    }
}

/// What no motion explains about the cases of each vehicle.
pub fn questions(dataset: &Dataset, vehicles: &BTreeMap<String, Vehicle>) -> Vec<Question> {
    let mut questions = Vec::new();
    for (name, vehicle) in vehicles {
        let mut cases: BTreeMap<&str, Vec<&Sample>> = BTreeMap::new();
        for sample in dataset.samples.iter().filter(|sample| sample.vehicle == *name) {
            cases.entry(&sample.case).or_default().push(sample);
        }
        let cases: Vec<(&str, Vec<&Sample>)> = cases.into_iter().collect();
        questions.extend(lifts(vehicle, &cases).into_iter().map(Question::Lift));
        questions.extend(depth(vehicle, &cases).map(Question::Depth));
        questions.extend(arm(vehicle, &cases).map(Question::Arm));
    }
    questions
}

/// The samples of each case by its name.
type Samples<'a> = [(&'a str, Vec<&'a Sample>)];

/// The sample of a case with the median ratio of vertical force and lift.
#[derive(Clone, Copy)]
struct CaseLift<'a> {
    case: &'a str,
    density: f64,
    force: f64,
    at_rest: f64,
    /// Dynamic pressure times length and width of the vehicle [N].
    dynamic: f64,
}

/// Where the median of a vehicle's cases is off, all of them were computed in one way and get one question. Else each
/// case is judged by what its own motion explains.
fn lifts(vehicle: &Vehicle, cases: &Samples) -> Vec<Lift> {
    let mut compared: Vec<CaseLift> =
        cases.iter().filter_map(|(case, samples)| CaseLift::median(vehicle, case, samples)).collect();
    compared.sort_by(|a, b| a.ratio().total_cmp(&b.ratio()));
    let Some(median) = compared.get(compared.len() / 2) else { return Vec::new() };
    let mut off: BTreeMap<Cause, Vec<CaseLift>> = BTreeMap::new();
    for lift in &compared {
        let cause = match median.cause(USUAL_RATIO) {
            Some(cause) => lift.cause(USUAL_RATIO).and(Some(cause)),
            None => lift.cause_beyond_motion(),
        };
        if let Some(cause) = cause {
            off.entry(cause).or_default().push(*lift);
        }
    }
    let question = |(cause, off): (Cause, Vec<CaseLift>)| {
        let stated = off[off.len() / 2];
        let mut names: Vec<String> = off.iter().map(|lift| lift.case.to_owned()).collect();
        names.sort_by_key(|name| (name != stated.case, name.clone()));
        let cases = Cases { vehicle: vehicle.name.clone(), names, compared: compared.len() };
        Lift { cases, force: stated.force, at_rest: stated.at_rest, cause }
    };
    off.into_iter().map(question).collect()
}

impl<'a> CaseLift<'a> {
    fn median(vehicle: &Vehicle, case: &'a str, samples: &[&Sample]) -> Option<Self> {
        let mut lifts: Vec<Self> =
            samples.iter().filter_map(|sample| Self::new(vehicle, case, sample)).collect();
        lifts.sort_by(|a, b| a.ratio().total_cmp(&b.ratio()));
        lifts.get(lifts.len() / 2).copied()
    }

    fn new(vehicle: &Vehicle, case: &'a str, sample: &Sample) -> Option<Self> {
        let condition = &sample.condition;
        let at_rest: Vec3 = vehicle.at_rest(condition).iter().map(|load| load.force).sum();
        let (at_rest, force) = (at_rest.dot(&condition.up), sample.net_force().dot(&condition.up));
        let plan_area = vehicle.dimensions.length * vehicle.dimensions.width;
        let dynamic = 0.5 * condition.density * condition.velocity.norm_squared() * plan_area;
        (at_rest > LEAST_LIFT).then_some(Self { case, density: condition.density, force, at_rest, dynamic })
    }

    fn ratio(&self) -> f64 {
        self.force / self.at_rest
    }

    /// What explains a ratio outside these.
    fn cause(&self, [low, high]: [f64; 2]) -> Option<Cause> {
        let ratio = self.ratio();
        let inside = |[low, high]: [f64; 2]| (low..high).contains(&ratio);
        let near = |value: f64| (value / UNIT_FACTOR..value * UNIT_FACTOR).contains(&ratio);
        Some(match ratio {
            _ if inside([low, high]) => return None,
            _ if inside(HALF_RATIO) => Cause::HalfDomain,
            _ if near(1.0 / self.density) => Cause::OverDensity,
            _ if near(1e3) || near(1e6) || near(1e-6) => Cause::Unit,
            _ if ratio < -USUAL_RATIO[0] => Cause::Axis,
            _ if ratio.abs() < HALF_RATIO[0] => Cause::NoHydrostaticPressure,
            _ => Cause::Unknown,
        })
    }

    /// The same for one case: motion may take it anywhere near the usual ratios, but hardly to where a mistake takes it
    /// that is known by its ratio.
    fn cause_beyond_motion(&self) -> Option<Cause> {
        let motion = MOTION_LIFT * self.dynamic / self.at_rest;
        let [low, high] = USUAL_CASE_RATIO;
        let cause = self.cause(USUAL_CASE_RATIO)?;
        match cause {
            Cause::OverDensity | Cause::Unit | Cause::Axis => Some(cause),
            Cause::HalfDomain | Cause::NoHydrostaticPressure | Cause::Unknown => {
                self.cause([low - motion, high + motion])
            }
        }
    }
}

/// The cases whose samples have a value above `limit`, the highest first, and that value.
fn above(
    vehicle: &Vehicle,
    cases: &Samples,
    limit: f64,
    value: impl Fn(&Sample) -> Option<f64>,
) -> Option<(Cases, f64)> {
    let largest = |(case, samples): &(&str, Vec<&Sample>)| {
        let values = samples.iter().filter_map(|sample| value(sample));
        Some((case.to_string(), values.max_by(f64::total_cmp)?))
    };
    let mut off: Vec<(String, f64)> = cases.iter().filter_map(largest).collect();
    let compared = off.len();
    off.retain(|(_, value)| *value > limit);
    off.sort_by(|a, b| b.1.total_cmp(&a.1));
    let largest = off.first()?.1;
    let names = off.into_iter().map(|(name, _)| name).collect();
    Some((Cases { vehicle: vehicle.name.clone(), names, compared }, largest))
}

fn depth(vehicle: &Vehicle, cases: &Samples) -> Option<Depth> {
    let height = vehicle.dimensions.height;
    let depth = |sample: &Sample| Some(sample.condition.depth);
    let (cases, depth) = above(vehicle, cases, MAX_DEPTH_HEIGHTS * height, depth)?;
    Some(Depth { cases, depth, height })
}

fn arm(vehicle: &Vehicle, cases: &Samples) -> Option<Arm> {
    let length = vehicle.dimensions.length;
    let arm = |sample: &Sample| {
        let lift = CaseLift::new(vehicle, &sample.case, sample)?;
        let force = sample.net_force();
        let moments: Option<Vec<Vec3>> = sample.surfaces.iter().map(|load| load.moment).collect();
        let moment: Vec3 = moments?.into_iter().sum();
        // a small force with a couple acts anywhere
        (force.norm() > HALF_RATIO[0] * lift.at_rest)
            .then(|| force.cross(&moment).norm() / force.norm_squared())
    };
    let (cases, arm) = above(vehicle, cases, MAX_ARM_LENGTHS * length, arm)?;
    Some(Arm { cases, arm, length })
}
