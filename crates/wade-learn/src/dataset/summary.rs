//! What is in a data set: counts, ranges, coverage, scatter between sections, and which surfaces carry the force.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{DIRECTION_SPEED, Dataset, Image, Sample};
use wade_core::condition::GroundContact;
use wade_core::domain::Range;
use wade_core::frame::{GRAVITY, Vec3};

/// Parts of the range of speed and of depth in the table of coverage.
pub const COVERAGE: usize = 5;

/// What is in a data set.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Where the loads come from.
    pub provenance: String,
    /// Convention of the static part.
    pub ground_contact: GroundContact,
    /// What the meta data say besides.
    pub notes: BTreeMap<String, String>,
    /// Number of cases.
    pub cases: usize,
    /// Number of samples.
    pub samples: usize,
    /// By vehicle.
    pub vehicles: Vec<VehicleSummary>,
}

/// What is in it of one vehicle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VehicleSummary {
    /// Its name.
    pub name: String,
    /// Its surfaces, in the order of the loads.
    pub surfaces: Vec<String>,
    /// Number of cases.
    pub cases: usize,
    /// Number of samples.
    pub samples: usize,
    /// Cases and samples of each set.
    pub sets: BTreeMap<String, Count>,
    /// Samples that are an image of each kind.
    pub images: BTreeMap<Image, usize>,
    /// Share of the loads that have a moment, a viscous part, and a load at rest.
    pub parts: Parts,
    /// Range of each quantity over the samples, by its name with the unit.
    pub ranges: BTreeMap<&'static str, Range>,
    /// Cases by speed and depth.
    pub coverage: Coverage,
    /// Cases, as they were computed, by direction of the motion: twelve parts of 30 degrees from behind over the right
    /// side, ahead and the left side.
    pub headings: [usize; 12],
    /// Scatter of the net force, x, y and z; `None` where no case has two sections.
    pub scatter: Option<[Scatter; 3]>,
    /// Share of the force by kind of surface, or by surface where kinds are not known.
    pub shares: BTreeMap<String, Share>,
    /// The means of the cases.
    #[serde(skip)]
    pub case_means: Vec<CaseMean>,
}

/// How many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Count {
    /// Cases.
    pub cases: usize,
    /// Samples.
    pub samples: usize,
}

/// Shares from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Parts {
    /// With a moment.
    pub moment: f64,
    /// With a viscous part.
    pub viscous: f64,
    /// With a load at rest.
    pub rest: f64,
}

/// Cases in equal parts of the range of speed and of depth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    /// Speeds between the parts [m/s].
    pub speed_edges_mps: Vec<f64>,
    /// Depths between the parts [m].
    pub depth_edges_m: Vec<f64>,
    /// Cases, a row a part of the depths, a column a part of the speeds.
    pub cases: [[usize; COVERAGE]; COVERAGE],
}

/// Standard deviations of a component of the net force [N].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Scatter {
    /// Between the sections of one case, root mean square over the cases: what no steady model can predict.
    pub between_sections_n: f64,
    /// Between the means of the cases.
    pub between_cases_n: f64,
}

/// What a group of surfaces carries.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Share {
    /// Of the sum of the magnitudes of the forces on all surfaces.
    pub of_force: f64,
    /// Of the force against the motion, without the load at rest where that is known.
    pub of_drag: f64,
}

/// Mean of a case as it was computed.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseMean {
    /// Its set.
    pub set: String,
    /// Velocity through the water [m/s].
    pub velocity: Vec3,
    /// Depth [m].
    pub depth: f64,
    /// Net force [N].
    pub net_force: Vec3,
    /// Standard deviation of the net force between sections [N]; `None` for a single one.
    pub deviation: Option<Vec3>,
}

impl Summary {
    /// Looks through a data set; `kind` names the group of a surface: vehicle, surface.
    pub fn of(dataset: &Dataset, kind: &dyn Fn(&str, &str) -> Option<String>) -> Self {
        let vehicle = |(name, surfaces): (&String, &Vec<String>)| {
            let samples: Vec<&Sample> = dataset.samples.iter().filter(|s| s.vehicle == *name).collect();
            let group = |surface: &String| kind(name, surface).unwrap_or_else(|| surface.clone());
            (!samples.is_empty()).then(|| {
                let groups: Vec<String> = surfaces.iter().map(group).collect();
                VehicleSummary::of(name, surfaces, &groups, &samples)
            })
        };
        let vehicles: Vec<_> = dataset.meta.vehicles.iter().filter_map(vehicle).collect();
        Self {
            provenance: dataset.meta.provenance.clone(),
            ground_contact: dataset.meta.ground_contact,
            notes: dataset.meta.notes.clone(),
            cases: vehicles.iter().map(|vehicle| vehicle.cases).sum(),
            samples: dataset.samples.len(),
            vehicles,
        }
    }
}

impl VehicleSummary {
    fn of(name: &str, surfaces: &[String], groups: &[String], samples: &[&Sample]) -> Self {
        let mut cases: BTreeMap<&str, Vec<&Sample>> = BTreeMap::new();
        let (mut sets, mut images) = (BTreeMap::<String, Count>::new(), BTreeMap::new());
        for sample in samples {
            cases.entry(&sample.case).or_default().push(sample);
            sets.entry(sample.set.clone()).or_default().samples += 1;
            *images.entry(sample.image).or_default() += 1;
        }
        for samples in cases.values() {
            sets.entry(samples[0].set.clone()).or_default().cases += 1;
        }
        let case_means: Vec<CaseMean> = cases.values().map(|samples| CaseMean::of(samples)).collect();
        Self {
            name: name.to_owned(),
            surfaces: surfaces.to_vec(),
            cases: cases.len(),
            samples: samples.len(),
            sets,
            images,
            parts: parts(samples),
            ranges: ranges(samples),
            coverage: coverage(&case_means),
            headings: headings(&case_means),
            scatter: scatter(&case_means),
            shares: shares(groups, samples),
            case_means,
        }
    }
}

impl CaseMean {
    /// Of the sections as they were computed, or of the first image where only images are there.
    fn of(samples: &[&Sample]) -> Self {
        let image = samples.iter().map(|sample| sample.image).min();
        let sections: Vec<&&Sample> = samples.iter().filter(|s| Some(s.image) == image).collect();
        let count = sections.len() as f64;
        let mean = |of: &dyn Fn(&Sample) -> Vec3| sections.iter().map(|s| of(s)).sum::<Vec3>() / count;
        let net_force = mean(&Sample::net_force);
        let square = |s: &Sample| (s.net_force() - net_force).map(|x| x * x);
        let deviation = || (mean(&square) * (count / (count - 1.0))).map(f64::sqrt);
        Self {
            set: samples[0].set.clone(),
            velocity: mean(&|s| s.condition.velocity),
            depth: sections.iter().map(|s| s.condition.depth).sum::<f64>() / count,
            net_force,
            deviation: (sections.len() > 1).then(deviation),
        }
    }

    /// Direction of the motion, from ahead to the left [degrees]; `None` at rest.
    pub fn heading_deg(&self) -> Option<f64> {
        let v = &self.velocity;
        (v.x.hypot(v.y) > DIRECTION_SPEED).then(|| v.y.atan2(v.x).to_degrees())
    }
}

fn parts(samples: &[&Sample]) -> Parts {
    let loads = || samples.iter().flat_map(|sample| &sample.surfaces);
    let count = loads().count() as f64;
    let share = |count_of: usize| count_of as f64 / count;
    Parts {
        moment: share(loads().filter(|load| load.moment.is_some()).count()),
        viscous: share(loads().filter(|load| load.viscous.is_some()).count()),
        rest: share(loads().filter(|load| load.rest.is_some()).count()),
    }
}

fn ranges(samples: &[&Sample]) -> BTreeMap<&'static str, Range> {
    let mut ranges: BTreeMap<&'static str, Range> = BTreeMap::new();
    for sample in samples {
        let c = &sample.condition;
        let speed = c.velocity.x.hypot(c.velocity.y);
        let values = [
            ("speed_mps", Some(speed)),
            ("ground_speed_mps", Some(c.ground_velocity.norm())),
            ("flow_angle_deg", sample.flow_angle_deg()),
            ("depth_m", Some(c.depth)),
            ("density_kgpm3", Some(c.density)),
            ("froude_depth", (c.depth > 0.0).then(|| speed / (GRAVITY * c.depth).sqrt())),
            ("tilt_deg", Some(c.up.x.hypot(c.up.y).atan2(c.up.z).to_degrees())),
            ("angular_speed_radps", Some(c.angular_velocity.norm())),
        ];
        for (name, value) in values.into_iter().filter_map(|(name, value)| Some((name, value?))) {
            let range = ranges.entry(name).or_insert(Range { min: value, max: value });
            *range = Range { min: range.min.min(value), max: range.max.max(value) };
        }
    }
    ranges
}

fn coverage(cases: &[CaseMean]) -> Coverage {
    let speed = |case: &CaseMean| case.velocity.x.hypot(case.velocity.y);
    let speeds = edges(cases.iter().map(speed));
    let depths = edges(cases.iter().map(|case| case.depth));
    let mut table = [[0; COVERAGE]; COVERAGE];
    for case in cases {
        table[part(&depths, case.depth)][part(&speeds, speed(case))] += 1;
    }
    Coverage { speed_edges_mps: speeds, depth_edges_m: depths, cases: table }
}

fn edges(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let (min, max) = values.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
    (0..=COVERAGE).map(|i| min + (max - min) * i as f64 / COVERAGE as f64).collect()
}

fn part(edges: &[f64], value: f64) -> usize {
    edges[1..COVERAGE].partition_point(|&edge| edge <= value)
}

fn headings(cases: &[CaseMean]) -> [usize; 12] {
    let mut counts = [0; 12];
    for heading in cases.iter().filter_map(CaseMean::heading_deg) {
        counts[(((heading + 180.0) / 30.0) as usize).min(11)] += 1;
    }
    counts
}

fn scatter(cases: &[CaseMean]) -> Option<[Scatter; 3]> {
    let deviations: Vec<Vec3> = cases.iter().filter_map(|case| case.deviation).collect();
    let (sections, count) = (deviations.len() as f64, cases.len() as f64);
    let mean = cases.iter().map(|case| case.net_force).sum::<Vec3>() / count;
    let scatter = |axis: usize| Scatter {
        between_sections_n: (deviations.iter().map(|d| d[axis].powi(2)).sum::<f64>() / sections).sqrt(),
        between_cases_n: (cases.iter().map(|c| (c.net_force - mean)[axis].powi(2)).sum::<f64>() / count)
            .sqrt(),
    };
    (!deviations.is_empty()).then(|| [0, 1, 2].map(scatter))
}

fn shares(groups: &[String], samples: &[&Sample]) -> BTreeMap<String, Share> {
    let mut sums: BTreeMap<String, Share> = BTreeMap::new();
    for sample in samples {
        let direction = sample.condition.velocity.try_normalize(DIRECTION_SPEED).unwrap_or_default();
        for (load, group) in sample.surfaces.iter().zip(groups) {
            let dynamic = load.force - load.rest.map_or(Vec3::zeros(), |rest| rest.force);
            let sum = sums.entry(group.clone()).or_default();
            sum.of_force += load.force.norm();
            sum.of_drag -= dynamic.dot(&direction);
        }
    }
    let total = |of: fn(&Share) -> f64| sums.values().map(of).sum::<f64>();
    let (force, drag) = (total(|s| s.of_force), total(|s| s.of_drag));
    let share = |sum: f64, total: f64| if total == 0.0 { 0.0 } else { sum / total };
    for sum in sums.values_mut() {
        *sum = Share { of_force: share(sum.of_force, force), of_drag: share(sum.of_drag, drag) };
    }
    sums
}
