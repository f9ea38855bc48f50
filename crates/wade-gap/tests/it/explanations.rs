//! Promise: a report says how probable each explanation of the gap is, with `nothing` and `outside_library` among them, and names
//! none that is not the most probable.

use crate::planted::{Noise, gaussian, motions, planted as plant, rms, run_with, trials};
use wade_gap::{Config, Explanation, NOTHING, OUTSIDE_LIBRARY, Report, Verdict};
use wade_learn::random::Random;
use wade_learn::trials::Trials;

const NOISE: [f64; 6] = [8.0, 8.0, 12.0, 4.0, 4.0, 4.0];
const TRIALS: usize = 20;
const SAMPLES: usize = 800;

fn run(trials: &Trials) -> Report {
    run_with(trials, &Config::default())
}

/// Trials with an effect of so many noises.
fn with(name: &str, strength: f64, seed: u64) -> Trials {
    let motions = motions(TRIALS, SAMPLES, seed);
    let mut loads: Vec<Vec<[f64; 6]>> = motions.iter().map(|motion| plant(name, motion)).collect();
    let size = rms(&loads);
    let factor = strength / [0, 2, 4, 5].map(|c| size[c] / NOISE[c]).into_iter().fold(0.0, f64::max);
    loads.iter_mut().flatten().flatten().for_each(|value| *value *= factor);
    trials(&motions, &loads, &Noise::white(NOISE), seed)
}

fn probability(report: &Report, names: &[&str]) -> f64 {
    report.explanations.iter().find(|e| e.effects == names).map_or(0.0, |e| e.probability)
}

#[test]
fn the_named_effect_is_the_most_probable_explanation_and_the_next_one_is_told() {
    for name in ["added_mass", "current", "hull_flooding"] {
        let report = run(&with(name, 3.0, 11));
        assert!(probability(&report, &[name]) > 0.9, "{name}: {:?}", report.explanations);
        let next = report.explanations[1].effects.join(" and ").replace('_', " ");
        assert!(report.summary.contains("nearest other explanation"), "{}", report.summary);
        let is_told = ["a load outside the library", "nothing missing", next.as_str()];
        assert!(is_told.iter().any(|words| report.summary.contains(words)), "{}", report.summary);
    }
}

#[test]
fn without_an_effect_nothing_is_the_most_probable_and_faint_ones_become_more_probable_as_they_grow() {
    let of = |strength: f64| run(&with("added_mass", strength, 5));
    let none = of(1e-6);
    assert_eq!(none.verdict, Verdict::NothingMissing);
    assert_eq!(none.explanations[0].effects, [NOTHING], "{:?}", none.explanations);
    assert!(none.suspected.is_empty());
    let faint: Vec<f64> = [1e-6, 0.05, 0.1, 0.3].map(|s| probability(&of(s), &["added_mass"])).into();
    assert!(faint.is_sorted() && faint[0] < 0.1 && faint[3] > 0.9, "{faint:?}");
}

#[test]
fn an_effect_that_is_probable_and_too_small_to_matter_is_suspected_with_the_reason() {
    let report = run(&with("added_mass", 0.06, 5));
    if report.effects.is_empty() && probability(&report, &["added_mass"]) > 0.5 {
        assert_eq!(report.suspected, ["added_mass"]);
        assert!(report.summary.contains("added mass is suspected"), "{}", report.summary);
        assert!(report.summary.contains("but not named: "), "{}", report.summary);
    }
    let named = run(&with("added_mass", 3.0, 5));
    assert!(named.suspected.is_empty() && !named.summary.contains("suspected"), "{}", named.summary);
}

#[test]
fn a_force_that_follows_no_law_of_the_library_is_outside_it() {
    // a wave of the depth, which no law has
    let motions = motions(TRIALS, SAMPLES, 12);
    let mut random = Random::new(12);
    let mut load = |depth: f64, v: f64| {
        let wave = 60.0 * (40.0 * depth).sin() * (3.0 * v).cos();
        [wave + 0.1 * gaussian(&mut random), 0.0, -wave, 0.0, 0.0, 0.0]
    };
    let loads: Vec<Vec<[f64; 6]>> =
        motions.iter().map(|motion| motion.iter().map(|s| load(s.depth, s.v.x)).collect()).collect();
    let report = run(&trials(&motions, &loads, &Noise::white(NOISE), 12));
    assert_ne!(report.verdict, Verdict::Named, "{}", report.summary);
    assert_ne!(report.explanations[0].effects, [NOTHING], "{:?}", report.explanations);
}

#[test]
fn nothing_and_a_load_outside_the_library_are_no_effects() {
    let of = |name| Explanation { effects: vec![name], probability: 0.5 };
    assert!(!of(NOTHING).is_of_library() && !of(OUTSIDE_LIBRARY).is_of_library());
    assert!(of("current").is_of_library());
}
