//! Promise: what a report states as a probability is one, and its intervals hold the truth as often as they say, where trials are drawn
//! from what the workflow believes before it sees any (simulation-based calibration; Talts, Betancourt, Simpson, Vehtari and Gelman,
//! "Validating Bayesian Inference Algorithms with Simulation-Based Calibration", 2018).

use crate::planted::{Noise, RATE, RHO, State, gaussian, motions, simulate, trials};
use wade_core::condition::Condition;
use wade_core::effects::{Body, Effect, Immersion, Input, Memory};
use wade_core::frame::Vec3;
use wade_core::wrench::Wrench;
use wade_gap::{Config, NOTHING, Predicted, Report, Verdict};
use wade_learn::random::Random;

const DRAWS: u64 = 500;
/// Standard deviation of a sample of each component [N, N m].
const NOISE: [f64; 6] = [8.0, 8.0, 12.0, 4.0, 4.0, 4.0];
/// Components that are measured.
const MEASURED: [usize; 4] = [0, 2, 4, 5];
/// Share by which a law is off as a whole, and by a standard deviation of depth and of speed where it acts.
const FORMULA: f64 = 0.05;

/// Effects that say different things, each with the coefficient that is drawn and its possible signs.
const LIBRARY: [(Effect, usize, [f64; 2]); 5] = [
    (Effect::AddedMass, 0, [1.0, 1.0]),
    (Effect::LinearDamping, 0, [1.0, 1.0]),
    (Effect::Squat, 0, [1.0, 1.0]),
    (Effect::HullLift, 1, [-1.0, -1.0]),
    (Effect::DensityError, 0, [-1.0, 1.0]),
];

type Load = Vec<Vec<[f64; 6]>>;

/// What was hidden, and what was said of it.
struct Draw {
    hidden: Vec<(&'static str, f64)>,
    report: Report,
}

/// The library's own law with a coefficient of 1.
fn law(body: &Body, effect: Effect, coefficient: usize, motions: &[Vec<State>]) -> Load {
    let mut immersion = Immersion::default();
    let mut at = |s: &State| {
        let condition = Condition {
            angular_velocity: s.w,
            acceleration: s.a,
            angular_acceleration: s.al,
            density: RHO,
            ..Condition::level(s.v, s.depth)
        };
        body.immerse(&condition, &mut immersion);
        let [fx, fy, fz, mx, my, mz] = simulate(s);
        let input = Input {
            body,
            condition: &condition,
            immersion: &immersion,
            predicted: Wrench { force: Vec3::new(fx, fy, fz), moment: Vec3::new(mx, my, mz) },
            elsewhere: None,
            base_drag: Vec3::zeros(),
            yaw: s.yaw,
            wetting_rate: s.depth_rate,
            channel_width: None,
            wheel_speeds: [None; 4].into(),
        };
        let mut sum = [0.0; 6];
        effect.plain().basis(&Memory::default(), &input, |k, _, load| {
            if k == coefficient {
                (0..3).for_each(|axis| {
                    sum[axis] += load.force[axis];
                    sum[axis + 3] += load.moment[axis];
                });
            }
        });
        sum
    };
    motions.iter().map(|motion| motion.iter().map(&mut at).collect()).collect()
}

/// Square of a load in noises of a bin, all measured components together.
fn square(load: &[f64; 6]) -> f64 {
    let of = |&c: &usize| (load[c] / NOISE[c]).powi(2) * 0.1 * RATE;
    MEASURED.iter().map(of).sum::<f64>() / MEASURED.len() as f64
}

/// The load with its law's own error.
fn bent(load: &Load, motions: &[Vec<State>], random: &mut Random) -> Load {
    let states = || motions.iter().flatten().zip(load.iter().flatten());
    let whole = states().map(|(_, load)| square(load)).sum::<f64>();
    let spread = |of: &dyn Fn(&State) -> f64| {
        let mean = states().map(|(s, load)| of(s) * square(load)).sum::<f64>() / whole;
        let variance = states().map(|(s, load)| (of(s) - mean).powi(2) * square(load)).sum::<f64>() / whole;
        [mean, variance.sqrt().max(1e-9)]
    };
    let features: [&dyn Fn(&State) -> f64; 2] = [&|s| s.depth, &|s| s.v.norm()];
    let spreads = features.map(spread);
    let off: [f64; 3] = std::array::from_fn(|_| FORMULA * gaussian(random));
    let factor = |s: &State| {
        let bends = (0..2).map(|i| off[1 + i] * (features[i](s) - spreads[i][0]) / spreads[i][1]);
        1.0 + off[0] + bends.sum::<f64>()
    };
    let of = |(motion, load): (&Vec<State>, &Vec<[f64; 6]>)| {
        motion.iter().zip(load).map(|(s, load)| load.map(|x| x * factor(s))).collect()
    };
    motions.iter().zip(load).map(of).collect()
}

/// Nothing, one effect or two, each as large as the noise of a row times a standard normal number: the unit of information that
/// Schwarz's price of a number takes for its prior (Kass and Wasserman, J. Am. Stat. Assoc. 90, 1995).
fn draw(seed: u64) -> Draw {
    let mut random = Random::new(0x5bc_0000 + seed);
    let motions = motions(10, 400, 7000 + seed);
    // the motion is known: its noise is not what is looked at here
    let noise = Noise { velocity: 1e-4, depth: 1e-6, acceleration: 1e-3, ..Noise::white(NOISE) };
    let body = wade_gap::body_of(&trials(&[], &[], &noise, seed)).unwrap();
    let mut sum: Load = motions.iter().map(|motion| vec![[0.0; 6]; motion.len()]).collect();
    let mut left = LIBRARY.to_vec();
    let mut hidden = Vec::new();
    for _ in 0..(3.0 * random.unit()) as usize {
        let (effect, coefficient, signs) = left.remove((random.unit() * left.len() as f64) as usize);
        let load = law(&body, effect, coefficient, &motions);
        let count = load.iter().map(Vec::len).sum::<usize>() as f64;
        let size = (load.iter().flatten().map(square).sum::<f64>() / count).sqrt();
        let sign = signs[usize::from(random.unit() < 0.5)];
        let value = sign * gaussian(&mut random).abs() / size;
        let of = bent(&load, &motions, &mut random);
        for (sum, load) in sum.iter_mut().flatten().zip(of.iter().flatten()) {
            (0..6).for_each(|c| sum[c] += value * load[c]);
        }
        hidden.push((effect.name(), value));
    }
    let trials = trials(&motions, &sum, &noise, seed);
    let config =
        Config { library: LIBRARY.map(|(effect, ..)| effect).to_vec(), bootstrap: 100, ..Config::default() };
    let report = wade_gap::run(&trials, &body, &mut |_| Predicted::default(), &config).unwrap();
    Draw { hidden, report }
}

/// Stated probabilities, and how many of them belong to what was hidden.
#[derive(Debug, Default)]
struct Stated {
    count: f64,
    sum: f64,
    right: f64,
}

impl Stated {
    fn add(&mut self, probability: f64, is_right: bool) {
        self.count += 1.0;
        self.sum += probability;
        self.right += f64::from(u8::from(is_right));
    }

    fn mean(&self) -> f64 {
        self.sum / self.count.max(1.0)
    }

    fn share_right(&self) -> f64 {
        self.right / self.count.max(1.0)
    }
}

fn draws() -> Vec<Draw> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from) as u64;
    std::thread::scope(|scope| {
        let every = |first: u64| (first..DRAWS).step_by(threads as usize).map(draw).collect::<Vec<_>>();
        let running: Vec<_> = (0..threads).map(|first| scope.spawn(move || every(first))).collect();
        running.into_iter().flat_map(|one| one.join().unwrap()).collect()
    })
}

#[test]
fn probabilities_and_intervals_are_calibrated_on_draws_of_the_prior() {
    let draws = draws();
    // by tenths: of the most probable explanation, and of each effect over all explanations
    let [mut first, mut each]: [[Stated; 10]; 2] = Default::default();
    let tenth = |probability: f64| ((10.0 * probability) as usize).min(9);
    for Draw { hidden, report } in &draws {
        let is_hidden = |name: &str| hidden.iter().any(|(hidden, _)| *hidden == name);
        let most = &report.explanations[0];
        let is_right = match most.effects[..] {
            [NOTHING] => hidden.is_empty(),
            _ => most.effects.len() == hidden.len() && most.effects.iter().all(|name| is_hidden(name)),
        };
        first[tenth(most.probability)].add(most.probability, is_right);
        for name in LIBRARY.map(|(effect, ..)| effect.name()) {
            let of = report.explanations.iter().filter(|e| e.effects.contains(&name));
            let probability = of.map(|e| e.probability).sum();
            each[tenth(probability)].add(probability, is_hidden(name));
        }
    }
    let named = |draw: &&Draw| draw.report.verdict == Verdict::Named;
    let (mut ranks, mut held, mut absent) = ([0.0; 10], Stated::default(), 0);
    for Draw { hidden, report } in draws.iter().filter(named) {
        for effect in &report.effects {
            let Some((_, value)) = hidden.iter().find(|(name, _)| *name == effect.name) else {
                absent += 1;
                continue;
            };
            let (of, coefficient, _) = LIBRARY.iter().find(|(of, ..)| of.name() == effect.name).unwrap();
            let Some(p) = effect.parameters.get(of.coefficients()[*coefficient].name) else { continue };
            held.add(0.9, p.interval[0] <= *value && *value <= p.interval[1]);
            ranks[tenth(0.5 * libm::erfc((p.value - value) / p.std * std::f64::consts::FRAC_1_SQRT_2))] +=
                1.0;
        }
    }
    let count = held.count;
    let chi2 = ranks.iter().map(|in_bin| (in_bin - count / 10.0).powi(2) / (count / 10.0)).sum::<f64>();
    println!("| stated | most probable explanation | right | effect over all | right |");
    for (first, each) in first.iter().zip(&each).filter(|(first, each)| first.count + each.count > 0.0) {
        let row = |of: &Stated| format!("{:.3} ({}) | {:.3}", of.mean(), of.count, of.share_right());
        println!("| {} | {} |", row(first), row(each));
    }
    let covers = held.share_right();
    println!(
        "{absent} absent; {count} values, 90 % intervals cover {covers:.3}; ranks {ranks:?}, chi2 {chi2:.1}"
    );
    let nulls = || draws.iter().filter(|draw| draw.hidden.is_empty());
    assert_eq!(nulls().filter(|draw| !draw.report.effects.is_empty()).count(), 0, "of {}", nulls().count());
    assert!(count > 250.0 && absent <= 3, "{count} named, {absent} absent");
    assert!((0.85..=0.95).contains(&covers), "90 % intervals cover {covers}");
    assert!((0.85..=1.0).contains(&first[9].share_right()), "{:?}", first[9]);
    assert!(each[9].share_right() > 0.97 && each[0].share_right() < 0.05, "{each:?}");
    // of nine degrees of freedom, one in a thousand
    assert!(chi2 < 27.9, "ranks {ranks:?}");
}
