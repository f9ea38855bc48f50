//! Added mass, and the waves that a moving hull makes, as functions of the immersion and of the clearance over the bed.
//!
//! Cummins (1962): `F = -A nu_dot - int K(s) nu(t - s) ds` with the added mass `A` of infinite frequency. `K` is a sum of
//! damped oscillators, in the frequency domain `H(s) = sum_m G_m s / (s^2 + 2 zeta_m w_m s + w_m^2)` with gains `G_m` that are
//! symmetric and not negative: each term is positive real, so the memory only takes energy, and none in steady motion.
//! At one frequency `w` the same is an added mass `A + Im H(iw) / w` and a damping `Re H(iw)`; a state without a session is
//! answered with these at the natural frequency of heave.
//!
//! All matrices are over the density, about the body origin, in body axes, and of the upright hull under water to the same share of its height.

use nalgebra::{Matrix6, SymmetricEigen};

use super::elements::elements;
use super::immersion::Ellipsoid;
use super::panel::{Basin, damping, impulse, wet_panels};
use crate::frame::{GRAVITY, WaterPlane};
use crate::geometry::hydrostatics::hydrostatics;
use crate::vehicle::Vehicle;

/// Oscillators of the memory.
pub const POLES: usize = 2;
/// Step of a table, over the height of the hull's ellipsoid [-]. A longer one would blur the level at which a bottom gets
/// wet; a shorter one would let a flat bottom that slams change the load by more than a hundredth of the dynamic pressure a
/// millimeter.
pub const STEP: f64 = 0.3;
/// Rows of a table: dry, and one for the middle of each step but the first, as far below covered as above.
pub const NODES: usize = 7;

/// Elements of the estimate; `docs/src/concepts/physics.md` has its error.
const PANELS: usize = 600;
/// What of the hull looks out of the water where it counts as covered, over its height [-].
const DECK: f64 = 0.002;
/// Clearance of a hull that stands on the bed, over its height [-]: treads and stones.
const STANDING: f64 = 0.1;
/// Clearance at which the reach of the bed is measured, over the height of the hull [-].
const RAISED: f64 = 0.25;
/// Largest damping ratio of heave [-]: panel codes give 0.17 to 0.38 for the shipped hulls afloat, the latter over shallow water.
const MOST_DAMPED: f64 = 0.4;
/// Frequencies at which the waves are computed, over `sqrt(g / sqrt(L W))` [-].
pub const FREQUENCIES: [f64; 8] = [0.4, 0.6, 0.8, 1.0, 1.3, 1.6, 2.0, 2.5];
/// Frequencies that an oscillator may have, in the same unit, and its damping ratios.
const POLE_FREQUENCIES: [f64; 7] = [0.7, 0.9, 1.1, 1.4, 1.7, 2.1, 2.6];
const POLE_DAMPINGS: [f64; 3] = [0.3, 0.5, 0.8];

/// One oscillator of the memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pole {
    /// Natural frequency [rad/s].
    pub frequency: f64,
    /// Damping ratio [-].
    pub damping: f64,
}

impl Pole {
    /// Added mass and damping of a gain of one at a frequency [rad/s]: `Im H(iw) / w` [s2] and `Re H(iw)` [s].
    pub fn response(&self, frequency: f64) -> [f64; 2] {
        let (w2, n2) = (frequency * frequency, self.frequency * self.frequency);
        let twice = 2.0 * self.damping * self.frequency;
        let size = (n2 - w2).powi(2) + twice * twice * w2;
        [(n2 - w2) / size, twice * w2 / size]
    }
}

/// A row of the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Added mass at infinite frequency [m3, m4, m5].
    pub mass: Matrix6<f64>,
    /// Gains of the oscillators, the same over a square second.
    pub gains: [Matrix6<f64>; POLES],
}

/// The table of a vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct Radiation {
    /// How it was computed: [`ESTIMATE`] or the name of a panel code.
    pub source: String,
    /// The oscillators.
    pub poles: [Pole; POLES],
    /// Clearance at which a quarter of what the bed adds is left [m].
    pub bed_reach: f64,
    /// Frequency at which a state without a session is answered [rad/s].
    pub frequency: f64,
    /// Rows over deep water.
    pub deep: Vec<Node>,
    /// Rows of a hull on the bed.
    pub standing: Vec<Node>,
}

/// Source of a table from [`Radiation::estimate`].
pub const ESTIMATE: &str = "estimate";

/// Why a table of waves was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RadiationError {
    /// A number that must be positive.
    #[error("{quantity} is {value}: it must be greater than zero")]
    NotPositive {
        /// Which one.
        quantity: &'static str,
        /// What it is.
        value: f64,
    },
    /// An oscillator that does not swing.
    #[error("the damping ratio of oscillator {pole} is {value}: it must lie between 0 and 1")]
    Damping {
        /// Index of the oscillator.
        pole: usize,
        /// What it is.
        value: f64,
    },
    /// A matrix that no water has.
    #[error(
        "row {row} of table {table}: {matrix} is not symmetric or has a negative eigenvalue: an added mass or a gain cannot be negative"
    )]
    Matrix {
        /// deep or standing.
        table: &'static str,
        /// Index of the row.
        row: usize,
        /// Which matrix.
        matrix: String,
    },
}

/// What a panel code answers for one draft of the upright hull; about the body origin, over the density.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// Added mass at infinite frequency.
    pub mass: Matrix6<f64>,
    /// What the waves do at each of the frequencies of [`frequencies`].
    pub waves: Vec<SolvedWaves>,
}

/// The same at one frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct SolvedWaves {
    /// Added mass; `None` where the code has the damping alone, from which it follows (Kramers and Kronig).
    pub mass: Option<Matrix6<f64>>,
    /// Damping.
    pub damping: Matrix6<f64>,
}

impl Solved {
    /// Without what couples motion in the plane of symmetry to motion out of it: panels are not mirror images to the bit.
    fn of_mirrored_hull(self) -> Self {
        let mirrored = |matrix: Matrix6<f64>| {
            Matrix6::from_fn(|i, j| if (i + j) % 2 == 0 { matrix[(i, j)] } else { 0.0 })
        };
        let waves = self
            .waves
            .into_iter()
            .map(|waves| SolvedWaves { mass: waves.mass.map(mirrored), damping: mirrored(waves.damping) });
        Self { mass: mirrored(self.mass), waves: waves.collect() }
    }
}

impl SolvedWaves {
    /// Damping alone.
    pub fn damped(damping: Matrix6<f64>) -> Self {
        Self { mass: None, damping }
    }
}

/// Frequencies at which a table wants the damping [rad/s].
pub fn frequencies(vehicle: &Vehicle) -> [f64; FREQUENCIES.len()] {
    FREQUENCIES.map(|x| x * unit_frequency(vehicle))
}

fn unit_frequency(vehicle: &Vehicle) -> f64 {
    (GRAVITY / (vehicle.dimensions.length * vehicle.dimensions.width).sqrt()).sqrt()
}

/// Water levels of the rows of a table over the body origin [m], upright.
pub fn levels(vehicle: &Vehicle) -> Vec<f64> {
    let ellipsoid = Ellipsoid::within(&vehicle.hull.mesh);
    let top = vehicle.hull.mesh.bounds().map_or(0.0, |bounds| bounds.max.z);
    let room = DECK * vehicle.dimensions.height;
    // a deck that is awash is no deck under water and none above it
    let aside = |level: f64| if (level - top).abs() < room { top - room } else { level };
    (0..NODES).map(|row| aside(ellipsoid.level_at((row as f64 + 0.5) * STEP))).collect()
}

impl Radiation {
    /// An estimate from the hull alone, by [`super::panel`].
    pub fn estimate(vehicle: &Vehicle) -> Self {
        let elements = elements(vehicle, PANELS);
        let frequencies = frequencies(vehicle);
        let solve = |level: f64, clearance: Option<f64>| {
            let basin = Basin { level, bed: clearance.map(|clearance| vehicle.z0 - clearance) };
            let panels = wet_panels(&elements, level);
            let impulse = impulse(&panels, &basin);
            let waves = |w: &f64| SolvedWaves::damped(damping(&panels, &basin, &impulse, *w));
            Solved { mass: impulse.mass, waves: frequencies.iter().map(waves).collect() }
        };
        Self::from_solved(vehicle, ESTIMATE, solve)
    }

    /// The table of what `solve` answers for a water level over the body origin and a clearance, `None` over deep water.
    pub fn from_solved(
        vehicle: &Vehicle,
        source: &str,
        mut solve: impl FnMut(f64, Option<f64>) -> Solved,
    ) -> Self {
        let height = vehicle.dimensions.height;
        let levels = levels(vehicle);
        let still = SolvedWaves::damped(Matrix6::zeros());
        let dry = Solved { mass: Matrix6::zeros(), waves: vec![still; FREQUENCIES.len()] };
        let mut solve = |level: f64, clearance: Option<f64>| {
            let solved = solve(level, clearance);
            if vehicle.symmetric_left_right { solved.of_mirrored_hull() } else { solved }
        };
        let mut table = |clearance: Option<f64>| {
            let wet: Vec<Solved> = levels[1..].iter().map(|level| solve(*level, clearance)).collect();
            std::iter::once(dry.clone()).chain(wet).collect::<Vec<_>>()
        };
        let deep = table(None);
        let standing = table(Some(STANDING * height));
        let mesh = &vehicle.hull.mesh;
        let origin = crate::frame::Vec3::zeros();
        let afloat = crate::geometry::hydrostatics::float_depth(mesh, vehicle.z0, vehicle.mass);
        let float_level = vehicle.z0 + afloat;
        let off = |row: &usize| (levels[*row] - float_level).abs();
        let row = (1..NODES).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(1);
        // what the bed adds falls as 1 / (1 + c / l)^2; measured a row below afloat, where every bottom is wet. The levels that are
        // asked for must not depend on the answers
        let heave = |solved: &Solved| solved.mass[(2, 2)];
        let under = (row + 1).min(NODES - 1);
        let raised = solve(levels[under], Some(RAISED * height));
        let added = (heave(&standing[under]) - heave(&deep[under])).max(1e-12);
        let left = (heave(&raised) - heave(&deep[under])).clamp(0.01 * added, 0.9 * added);
        let bed_reach = RAISED * height / ((added / left).sqrt() - 1.0);
        let scale = unit_frequency(vehicle);
        let frequencies = frequencies(vehicle);
        let poles = best_poles(&deep[row], &frequencies, scale);
        let mut table = Self {
            source: source.to_owned(),
            poles,
            bed_reach,
            frequency: scale,
            deep: nodes(&deep, &poles, &frequencies),
            standing: nodes(&standing, &poles, &frequencies),
        };
        let masses = [&table.deep, &table.standing].map(|rows| rows.iter().map(|row| row.mass).collect());
        let [deep, standing] = rising(masses);
        table.deep.iter_mut().zip(deep).for_each(|(row, mass)| row.mass = mass);
        table.standing.iter_mut().zip(standing).for_each(|(row, mass)| row.mass = mass);
        let float = hydrostatics(mesh, &WaterPlane::level(float_level, 0.0), 1.0, &origin);
        table.frequency = table.natural_heave(row, float.waterplane_area, float.displaced_volume);
        table.limit_waves(float.waterplane_area, float.displaced_volume);
        table
    }

    /// Keeps the damping of heave of every row below [`MOST_DAMPED`]: a deck awash would make waves without end in a theory
    /// in which they do not break.
    fn limit_waves(&mut self, waterplane: f64, volume: f64) {
        let responses = self.poles.map(|pole| pole.response(self.frequency)[1]);
        for node in self.deep.iter_mut().chain(&mut self.standing) {
            let most = 2.0 * MOST_DAMPED * (GRAVITY * waterplane * (volume + node.mass[(2, 2)])).sqrt();
            let heave: f64 = node.gains.iter().zip(&responses).map(|(gain, r)| gain[(2, 2)] * r).sum();
            if heave > most {
                node.gains.iter_mut().for_each(|gain| *gain *= most / heave);
            }
        }
    }

    /// The same table, whose numbers water can have.
    pub fn checked(self) -> Result<Self, RadiationError> {
        for (quantity, value) in [
            ("bed_reach_m", self.bed_reach),
            ("frequency_radps", self.frequency),
            ("frequency of oscillator 0", self.poles[0].frequency),
            ("frequency of oscillator 1", self.poles[1].frequency),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(RadiationError::NotPositive { quantity, value });
            }
        }
        for (pole, value) in self.poles.iter().map(|pole| pole.damping).enumerate() {
            if !(value > 0.0 && value < 1.0) {
                return Err(RadiationError::Damping { pole, value });
            }
        }
        for (table, rows) in [("deep", &self.deep), ("standing", &self.standing)] {
            for (row, node) in rows.iter().enumerate() {
                let gains = node.gains.iter().enumerate().map(|(m, gain)| (format!("gain {m}"), gain));
                for (matrix, values) in std::iter::once(("added mass".to_owned(), &node.mass)).chain(gains) {
                    let size = values.norm();
                    let skew = (values - values.transpose()).norm();
                    if skew > 1e-9 * size || values.symmetric_eigenvalues().min() < -1e-9 * size {
                        return Err(RadiationError::Matrix { table, row, matrix });
                    }
                }
            }
        }
        Ok(self)
    }

    /// Natural frequency of heave of a hull afloat in deep water at a row [rad/s].
    fn natural_heave(&self, row: usize, waterplane: f64, volume: f64) -> f64 {
        let node = &self.deep[row];
        let mut frequency = self.frequency;
        for _ in 0..50 {
            let waves: f64 =
                (0..POLES).map(|m| node.gains[m][(2, 2)] * self.poles[m].response(frequency)[0]).sum();
            let moved = (volume + node.mass[(2, 2)] + waves).max(0.2 * volume);
            // half steps: the added mass depends on the answer
            frequency = 0.5 * (frequency + (GRAVITY * waterplane / moved).sqrt());
        }
        frequency
    }
}

fn nodes(solved: &[Solved], poles: &[Pole; POLES], frequencies: &[f64]) -> Vec<Node> {
    solved
        .iter()
        .map(|row| Node { mass: not_negative(row.mass), gains: gains(&samples(row, poles, frequencies)) })
        .collect()
}

/// One equation of the fit: what a gain of one of each oscillator gives, and what was solved [N s/m over the density, and so on].
///
/// The damping is the real part of the memory at a frequency, the frequency times the added mass above that of infinite
/// frequency its imaginary part.
struct Sample {
    response: [f64; POLES],
    solved: Matrix6<f64>,
}

fn samples(solved: &Solved, poles: &[Pole; POLES], frequencies: &[f64]) -> Vec<Sample> {
    let at = |(w, waves): (&f64, &SolvedWaves)| {
        let response = poles.map(|pole| pole.response(*w));
        let damping = Sample { response: response.map(|[_, damping]| damping), solved: waves.damping };
        let mass = waves.mass.map(|mass| Sample {
            response: response.map(|[mass, _]| mass * w),
            solved: (mass - solved.mass) * *w,
        });
        std::iter::once(damping).chain(mass)
    };
    frequencies.iter().zip(&solved.waves).flat_map(at).collect()
}

/// Gains of least squares, made symmetric and not negative.
fn gains(samples: &[Sample]) -> [Matrix6<f64>; POLES] {
    // normal equations of two unknowns, by element
    let [mut aa, mut ab, mut bb] = [0.0; 3];
    for Sample { response: [a, b], .. } in samples {
        aa += a * a;
        ab += a * b;
        bb += b * b;
    }
    let determinant = (aa * bb - ab * ab).max(1e-12 * aa * bb);
    let (mut first, mut second) = (Matrix6::zeros(), Matrix6::zeros());
    for Sample { response: [a, b], solved } in samples {
        first += solved * (a * bb - b * ab) / determinant;
        second += solved * (b * aa - a * ab) / determinant;
    }
    // what one oscillator gives up to stay positive, the other takes over in part: once more with each alone
    let (first, second) = (not_negative(first), not_negative(second));
    let rest = |own: usize, other: &Matrix6<f64>| {
        let (mut sum, mut weight) = (Matrix6::zeros(), 0.0);
        for Sample { response, solved } in samples {
            sum += (solved - other * response[1 - own]) * response[own];
            weight += response[own] * response[own];
        }
        not_negative(sum / weight)
    };
    let first = if second == Matrix6::zeros() { rest(0, &second) } else { first };
    let second = rest(1, &first);
    let first = rest(0, &second);
    [first, second]
}

/// The two oscillators that describe heave, roll and pitch of a row best, each in units of its own largest damping: those modes
/// swing by themselves, where a fit that serves surge, sway and yaw too was a fifth off.
fn best_poles(solved: &Solved, frequencies: &[f64], unit: f64) -> [Pole; POLES] {
    let largest: [f64; 6] = std::array::from_fn(|mode| {
        solved.waves.iter().map(|w| w.damping[(mode, mode)]).fold(1e-12, f64::max)
    });
    let candidates: Vec<Pole> = POLE_FREQUENCIES
        .iter()
        .flat_map(|x| POLE_DAMPINGS.map(|damping| Pole { frequency: x * unit, damping }))
        .collect();
    let mut best = ([candidates[0]; POLES], f64::INFINITY);
    for (index, first) in candidates.iter().enumerate() {
        for second in candidates[index + 1..].iter().filter(|p| p.frequency > first.frequency) {
            let poles = [*first, *second];
            let samples = samples(solved, &poles, frequencies);
            let gains = gains(&samples);
            let miss = |sample: &Sample| {
                let fitted = gains[0] * sample.response[0] + gains[1] * sample.response[1] - sample.solved;
                (2..5).map(|mode| (fitted[(mode, mode)] / largest[mode]).powi(2)).sum::<f64>()
            };
            let error = samples.iter().map(miss).sum();
            if error < best.1 {
                best = (poles, error);
            }
        }
    }
    best.0
}

/// The nearest symmetric matrix without negative eigenvalues.
fn not_negative(matrix: Matrix6<f64>) -> Matrix6<f64> {
    let eigen = SymmetricEigen::new(0.5 * (matrix + matrix.transpose()));
    let clipped = eigen.eigenvalues.map(|value| value.max(0.0));
    let kept = eigen.eigenvectors * Matrix6::from_diagonal(&clipped) * eigen.eigenvectors.transpose();
    0.5 * (kept + kept.transpose())
}

/// Makes the added mass over deep water, and what the bed adds to it, grow from row to row: a hull that enters water never
/// lets go of any, nor one that the bed comes near.
pub(super) fn rising([deep, standing]: [Vec<Matrix6<f64>>; 2]) -> [Vec<Matrix6<f64>>; 2] {
    let (mut below, mut added) = (Matrix6::zeros(), Matrix6::zeros());
    let rows = deep.into_iter().zip(standing).map(|(deep, standing)| {
        below += not_negative(deep - below);
        added += not_negative(standing - below - added);
        (below, below + added)
    });
    let (deep, standing) = rows.unzip();
    [deep, standing]
}
