//! What is hidden in which motion.

use serde::Serialize;

use super::cause::{Cause, Planted};
use super::command::Plan;
use super::hull;
use wade_learn::random::Random;

wade_core::named_enum! {
    /// Sort of a case.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Group {
        /// One effect.
        Effect => "effect",
        /// Nothing is hidden.
        Null => "null",
        /// One fault of what is stated or recorded of drive, mass or pose.
        Fault => "fault",
        /// A wrong mass and a wrong drive force: what is inferred is linear in both, and the prediction is what they infer.
        Identity => "identity",
        /// Each trial has a dry twin.
        DryTwins => "dry_twins",
        /// Released, with dry twins: wheel speeds, but no drive force.
        Wheels => "wheels",
    }
}

wade_core::named_enum! {
    /// Standard deviation of a coordinate in a picture, and of an angle in as many thousandths of a radian.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
    pub enum MarkerNoise {
        /// 0.1 mm.
        Tenth => "0.1mm",
        /// 0.5 mm.
        Half => "0.5mm",
        /// 2 mm.
        Two => "2mm",
    }
}

impl MarkerNoise {
    /// Standard deviation [m], and [rad].
    pub fn std(self) -> f64 {
        match self {
            Self::Tenth => 1e-4,
            Self::Half => 5e-4,
            Self::Two => 2e-3,
        }
    }
}

wade_core::named_enum! {
    /// Error of the instruments besides white noise.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Flaw {
        /// None.
        White => "white",
        /// The drive's noise has a memory, and is larger.
        ColoredDrive => "colored_drive",
        /// The drive's force is rounded.
        QuantizedDrive => "quantized_drive",
        /// The stamps of the pictures jitter.
        JitteredClock => "jittered_clock",
        /// Pictures are lost, some in holes.
        LostRows => "lost_rows",
    }
}

/// A case: all that is needed to generate its trials again.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Unique name.
    pub name: String,
    /// Sort.
    pub group: Group,
    /// Of all that is random in its trials.
    pub seed: u64,
    /// What is hidden.
    pub planted: Vec<Planted>,
    /// Noise of the cameras.
    pub marker: MarkerNoise,
    /// Error of the instruments besides white noise.
    pub flaw: Flaw,
    /// The trials.
    pub plan: Plan,
}

/// The effects; rolling resistance stands in the place of the blockage in every other round.
const EFFECTS: [Cause; 8] = [
    Cause::AddedMass,
    Cause::DrivetrainInertia,
    Cause::DragCoefficientError,
    Cause::LinearDamping,
    Cause::Current,
    Cause::WaveMemory,
    Cause::ChannelBlockage,
    Cause::DriveLag,
];
const FAULTS: [Cause; 5] =
    [Cause::DriveGain, Cause::MassError, Cause::DriveOffset, Cause::DriveDelay, Cause::PoseDelay];
/// Nulls, and faults, of a copy.
const OF_A_COPY: usize = 8;
/// What is hidden beside dry twins, and where there are wheel speeds only.
const WITH_TWINS: [Option<Cause>; 4] =
    [None, Some(Cause::AddedMass), Some(Cause::RollingResistance), Some(Cause::MassError)];
const WITH_WHEELS: [Option<Cause>; 4] =
    [None, Some(Cause::AddedMass), Some(Cause::DragCoefficientError), Some(Cause::LinearDamping)];
/// Errors of mass and of recorded drive force of the identities [1]: equal, so that the inferred force is too large by the
/// same share, and unequal.
const IDENTITIES: [[f64; 2]; 2] = [[0.1, 0.1], [0.12, -0.06]];

/// Each effect at each noise, 8 nulls and 8 faults, `copies` times, and ten others: 210 cases at 5 copies.
pub fn cases(seed: u64, copies: usize) -> Vec<Case> {
    let mut random = Random::new(seed);
    let mut cases = Vec::new();
    for group in Group::ALL {
        let mut random = random.fork();
        let mut add =
            |planted: Vec<Planted>, marker: MarkerNoise, flaw: Flaw, plan: Plan, random: &mut Random| {
                let causes: Vec<&str> = planted.iter().map(|planted| planted.cause.name()).collect();
                let detail = if causes.is_empty() { flaw.name().to_owned() } else { causes.join("+") };
                let name = format!("{}-{:03}-{detail}-{}", group.name(), cases.len() + 1, marker.name());
                let seed = (random.unit() * 9e15) as u64;
                cases.push(Case { name, group, seed, planted, marker, flaw, plan });
            };
        match group {
            Group::Effect => {
                for copy in 0..copies {
                    for (noise, marker) in MarkerNoise::ALL.into_iter().enumerate() {
                        for effect in EFFECTS {
                            let of_wheels = effect == Cause::ChannelBlockage && (copy + noise) % 2 == 1;
                            let cause = if of_wheels { Cause::RollingResistance } else { effect };
                            let is_inertia = matches!(cause, Cause::AddedMass | Cause::DrivetrainInertia);
                            let at_one_depth = is_inertia && (copy + noise) % 5 == 1;
                            let plan = if at_one_depth { Plan::OneDepth } else { Plan::Rich };
                            let planted = Planted::draw(cause, &mut random);
                            add(vec![planted], marker, Flaw::White, plan, &mut random);
                        }
                    }
                }
            }
            Group::Null => {
                for index in 0..OF_A_COPY * copies {
                    let flaw = Flaw::ALL[index / 3 % Flaw::ALL.len()];
                    add(Vec::new(), MarkerNoise::ALL[index % 3], flaw, Plan::Rich, &mut random);
                }
            }
            Group::Fault => {
                for index in 0..OF_A_COPY * copies {
                    let planted = Planted::draw(FAULTS[index % FAULTS.len()], &mut random);
                    let marker = MarkerNoise::ALL[index / FAULTS.len() % 3];
                    add(vec![planted], marker, Flaw::White, Plan::Rich, &mut random);
                }
            }
            Group::Identity => {
                for [mass, drive] in IDENTITIES {
                    let of = |cause, size| Planted { cause, size, shape: [0.0; 3] };
                    let mass = of(Cause::MassError, mass * hull().mass);
                    // a gain of the drive divides what is recorded
                    let drive = of(Cause::DriveGain, 1.0 / (1.0 + drive) - 1.0);
                    add(vec![mass, drive], MarkerNoise::Tenth, Flaw::White, Plan::Rich, &mut random);
                }
            }
            Group::DryTwins | Group::Wheels => {
                let (causes, plan) = match group {
                    Group::DryTwins => (WITH_TWINS, Plan::DryTwins),
                    _ => (WITH_WHEELS, Plan::Wheels),
                };
                for cause in causes {
                    let planted = cause.map(|cause| Planted::draw(cause, &mut random)).into_iter().collect();
                    add(planted, MarkerNoise::Tenth, Flaw::White, plan, &mut random);
                }
            }
        }
    }
    cases
}
