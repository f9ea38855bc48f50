//! What is hidden where, and what a tool should say of it.

use serde::Serialize;

use super::hidden::{Effect, Hidden, Kind, LIBRARY, OUTSIDE};
use super::schedule::Maneuver::{self, *};
use super::{Feature, NoiseKind, Plan, Region};
use wade_learn::random::Random;

wade_core::named_enum! {
    /// Sort of a case.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Family {
        /// Nothing is hidden: nothing may be named.
        Null => "null",
        /// One effect of the library at 0.3, 1 or 3 times the floor.
        Single => "single",
        /// Two or three effects, each at 3 times the floor.
        Set => "set",
        /// One of two effects that the trials cannot tell apart; where a further trial can, a second case holds it.
        Confounded => "confounded",
        /// One effect that acts in a region only.
        Gated => "gated",
        /// An effect that no library has.
        Outside => "outside",
        /// Trials that do not excite some effects.
        NotExcited => "not_excited",
        /// 65 trials of 1,000 samples, for the time that a tool takes.
        Timing => "timing",
    }
}

/// A case: all that is needed to generate its trials again.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Unique name.
    pub name: String,
    /// Sort.
    pub family: Family,
    /// Of all that is random in its trials.
    pub seed: u64,
    /// What is hidden, before it is scaled to its strength.
    pub hidden: Vec<Hidden>,
    /// Strength of each, in floors.
    pub strength: f64,
    /// Noise of the wrench.
    pub noise: NoiseKind,
    /// Where the effects act; everywhere without it.
    pub gate: Option<Region>,
    /// The trials.
    pub plan: Plan,
    /// The effect that no trial, or none of these, can tell from the hidden one.
    pub twin: Option<Effect>,
    /// True where further trials of the plan tell the two apart.
    pub resolved: bool,
    /// Effects that the trials do not excite.
    pub unexcited: &'static [Effect],
    /// True where the wrench is inferred from motion and drive force: fx, fy and mz only.
    pub inferred: bool,
}

/// Two effects that some trials cannot tell apart.
struct Pair {
    hidden: Effect,
    twin: Effect,
    /// Component of a sensor's fault.
    component: f64,
    inferred: bool,
    plan: &'static [(Maneuver, usize)],
    resolving: &'static [(Maneuver, usize)],
}

/// Drag and damping at one speed; a mass and the water that moves with it at one depth; a zero and a level that is never
/// left; a gain and a density; a current and drag at one speed and heading; rolling resistance and a zero at one depth,
/// forward.
const PAIRS: [Pair; 6] = [
    Pair {
        hidden: Effect::DragCoefficientError,
        twin: Effect::LinearDamping,
        component: 0.0,
        inferred: false,
        plan: &[(OneSpeed, 9)],
        // other speeds tell the two apart; a basin, a channel from either; headings, a current; weights, a gain
        resolving: &[(OneSpeed, 9), (Steady, 7), (Shallow, 7), (Basin, 7), (Heading, 6), (Weights, 3)],
    },
    Pair {
        hidden: Effect::AddedMass,
        twin: Effect::MassError,
        component: 0.0,
        inferred: true,
        plan: &[(StepsOneDepth, 9)],
        resolving: &[(StepsOneDepth, 9), (Dry, 5)],
    },
    Pair {
        hidden: Effect::WaterLevelOffset,
        twin: Effect::SensorBias,
        component: 2.0,
        inferred: false,
        plan: &[(Parked, 9)],
        resolving: &[(Parked, 9), (Dry, 5)],
    },
    Pair {
        hidden: Effect::DensityError,
        twin: Effect::SensorGain,
        component: 0.0,
        inferred: false,
        plan: &[(Steps, 6), (Turn, 3)],
        resolving: &[(Steps, 6), (Turn, 3), (Weights, 3)],
    },
    Pair {
        hidden: Effect::Current,
        twin: Effect::DragCoefficientError,
        component: 0.0,
        inferred: false,
        plan: &[(OneSpeed, 9)],
        resolving: &[(OneSpeed, 9), (Steady, 7), (Basin, 7), (Heading, 6), (Parked, 3), (Weights, 3)],
    },
    Pair {
        hidden: Effect::RollingResistance,
        twin: Effect::SensorBias,
        component: 0.0,
        inferred: true,
        // where it floats nothing rolls
        plan: &[(Shallow, 9)],
        resolving: &[(Shallow, 9), (Reverse, 4), (Parked, 2)],
    },
];

/// Straight runs at steady speeds, standing, and straight runs at changing speeds, with what each does not excite.
const UNEXCITING: [(Plan, &[Effect]); 3] = [
    (
        Plan::only(&[(Steady, 9)]),
        &[Effect::AddedMass, Effect::Rotation, Effect::WaterEntrySlamming, Effect::WaveMemory],
    ),
    (
        Plan::only(&[(Parked, 9)]),
        &[
            Effect::AddedMass,
            Effect::Rotation,
            Effect::DragCoefficientError,
            Effect::WaterEntrySlamming,
            Effect::Squat,
        ],
    ),
    (Plan::only(&[(Steps, 9)]), &[Effect::Rotation, Effect::WaterEntrySlamming]),
];

/// Effects that no measured component or nothing else in a set mimics, for sets.
const SETTABLE: [Effect; 16] = [
    Effect::AddedMass,
    Effect::LinearDamping,
    Effect::DragCoefficientError,
    Effect::Rotation,
    Effect::Current,
    Effect::WaterLevelOffset,
    Effect::HullFlooding,
    Effect::WaterEntrySlamming,
    Effect::WaveMemory,
    Effect::Squat,
    Effect::WheelPaddleThrust,
    Effect::SensorDelay,
    Effect::SensorBias,
    Effect::SensorBiasStep,
    Effect::SensorDrift,
    Effect::AxisMisalignment,
];

/// Effects that act in every region of the gated cases.
const GATED: [Effect; 6] = [
    Effect::DragCoefficientError,
    Effect::LinearDamping,
    Effect::SensorBias,
    Effect::Rotation,
    Effect::Current,
    Effect::WaterLevelOffset,
];

/// Cases of some families, `count` of each, but for timing, of which there is one.
pub fn cases(families: &[Family], count: usize, seed: u64) -> Vec<Case> {
    let mut random = Random::new(seed);
    let mut cases = Vec::new();
    for family in Family::ALL {
        // forked for those that nobody asks for as well: cases are the same whichever families are beside them
        let mut random = random.fork();
        if !families.contains(&family) {
            continue;
        }
        let count = if family == Family::Timing { 1 } else { count };
        for index in 0..count {
            cases.push(case(family, index, &mut random));
        }
    }
    cases
}

fn case(family: Family, index: usize, random: &mut Random) -> Case {
    let mut case = Case {
        name: String::new(),
        family,
        seed: (random.unit() * 9e15) as u64,
        hidden: Vec::new(),
        strength: 3.0,
        noise: NoiseKind::White,
        gate: None,
        plan: Plan::RICH,
        twin: None,
        resolved: false,
        unexcited: &[],
        inferred: false,
    };
    match family {
        Family::Null => {
            case.noise = NoiseKind::ALL[index % NoiseKind::ALL.len()];
            case.inferred = index % 13 == 12;
        }
        Family::Single => {
            // every effect at one strength, then every effect at the next
            let effect = LIBRARY[index % LIBRARY.len()];
            case.strength = [3.0, 1.0, 0.3][index / LIBRARY.len() % 3];
            case.hidden = vec![Hidden::draw(effect, random)];
            case.inferred = effect.kind() == Kind::Drive;
            // all that is measured is proportional to the density
            case.twin = (effect == Effect::DensityError).then_some(Effect::SensorGain);
        }
        Family::Set => {
            let mut effects = SETTABLE;
            random.shuffle(&mut effects);
            let members = &effects[..2 + index % 2];
            case.hidden = members.iter().map(|&effect| Hidden::draw(effect, random)).collect();
            // physics first: a fault sees the wrench that the physics left
            case.hidden.sort_by_key(|hidden| hidden.effect);
        }
        Family::Confounded => confound(&mut case, index, random),
        Family::Gated => {
            case.hidden = vec![Hidden::draw(GATED[index % GATED.len()], random)];
            case.gate = Some(match index / GATED.len() % 3 {
                0 => Region::above(Feature::Depth, 0.15),
                1 => Region::above(Feature::Froude, 0.8),
                _ => Region::above(Feature::Speed, 0.4).and_below(Feature::Depth, 0.15),
            });
        }
        Family::Outside => case.hidden = vec![Hidden::draw(OUTSIDE[index % OUTSIDE.len()], random)],
        Family::NotExcited => (case.plan, case.unexcited) = UNEXCITING[index % UNEXCITING.len()],
        Family::Timing => {
            case.plan = Plan::SIXTY_FIVE;
            case.hidden =
                [Effect::AddedMass, Effect::Current].map(|effect| Hidden::draw(effect, random)).to_vec();
        }
    }
    case.name = name(&case, index);
    case
}

fn confound(case: &mut Case, index: usize, random: &mut Random) {
    // each pair twice in turn: as it is, and with the trials that tell the two apart
    let pair = &PAIRS[index / 2 % PAIRS.len()];
    let resolving = (index % 2 == 1).then_some(pair.resolving);
    let mut effects = [pair.hidden, pair.twin];
    random.shuffle(&mut effects);
    let [effect, twin] = effects;
    let mut hidden = Hidden::draw(effect, random);
    match effect {
        Effect::SensorBias => hidden.shape[0] = pair.component,
        Effect::SensorGain => hidden.shape[0] = -1.0,
        // with or against the motion
        Effect::Current => hidden.shape[0] = if random.unit() < 0.5 { 0.0 } else { std::f64::consts::PI },
        _ => {}
    }
    // a twin that can only slow the body down is mimicked by no other sign
    if matches!(pair.twin, Effect::LinearDamping) || matches!(pair.hidden, Effect::DragCoefficientError) {
        hidden.size = hidden.size.abs();
    }
    if effect == Effect::MassError || pair.hidden == Effect::RollingResistance && effect == Effect::SensorBias
    {
        hidden.size = -hidden.size.abs();
    }
    case.hidden = vec![hidden];
    case.twin = Some(twin);
    case.resolved = resolving.is_some();
    case.plan = Plan::only(resolving.unwrap_or(pair.plan));
    case.inferred = pair.inferred;
}

fn name(case: &Case, index: usize) -> String {
    let family = serde_json::to_value(case.family).unwrap_or_default();
    let family = family.as_str().unwrap_or_default().to_owned();
    let hidden: Vec<String> = case.hidden.iter().map(|hidden| hidden.effect.name()).collect();
    let detail = match case.family {
        Family::Null => format!("{:?}", case.noise).to_lowercase(),
        Family::Single => format!("{}-{}", hidden.join("+"), case.strength),
        Family::Confounded if case.resolved => format!("{}-resolved", hidden.join("+")),
        _ => hidden.join("+"),
    };
    format!("{family}-{index:03}-{detail}").trim_end_matches('-').to_owned()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn cases_repeat_by_seed_and_cover_what_they_should() {
        let all = cases(&Family::ALL, 69, 5);
        assert_eq!(all, cases(&Family::ALL, 69, 5));
        assert_ne!(all, cases(&Family::ALL, 69, 6));
        let singles: Vec<_> = all.iter().filter(|case| case.family == Family::Single).collect();
        for effect in LIBRARY {
            for strength in [0.3, 1.0, 3.0] {
                assert!(
                    singles.iter().any(|c| c.hidden[0].effect == effect && c.strength == strength),
                    "{effect:?} {strength}"
                );
            }
        }
        let names: std::collections::BTreeSet<_> = all.iter().map(|case| &case.name).collect();
        assert_eq!(names.len(), all.len());
        for family in Family::ALL {
            let alone = cases(&[family], 3, 5);
            let beside: Vec<_> = all.iter().filter(|case| case.family == family).take(3).cloned().collect();
            assert_eq!(alone, beside);
        }
    }
}
