//! Measured recovery of planted effects; run with --ignored --nocapture to see the table.

#[path = "common/planted.rs"]
mod planted;

use planted::{Noise, motions, planted as plant, rms, trials};
use wade::gap::{self, Config, Predicted};

const NOISE: [f64; 6] = [8.0, 8.0, 12.0, 4.0, 4.0, 4.0];

fn scaled(names: &str, strength: f64, motions: &[Vec<planted::State>]) -> (Vec<Vec<[f64; 6]>>, f64) {
    let mut sum: Vec<Vec<[f64; 6]>> = motions.iter().map(|m| vec![[0.0; 6]; m.len()]).collect();
    let mut last = 0.0;
    for name in names.split('+') {
        let (one, factor) = scaled_one(name, strength, motions);
        last = factor;
        for (sum, one) in sum.iter_mut().flatten().zip(one.iter().flatten()) {
            (0..6).for_each(|c| sum[c] += one[c]);
        }
    }
    (sum, last)
}

fn scaled_one(name: &str, strength: f64, motions: &[Vec<planted::State>]) -> (Vec<Vec<[f64; 6]>>, f64) {
    let unit: Vec<Vec<[f64; 6]>> = motions.iter().map(|m| plant(name, m)).collect();
    let size = rms(&unit);
    // the strongest measured component is `strength` times its noise
    let ratio = [0, 2, 4, 5].map(|c| size[c] / NOISE[c]).into_iter().fold(0.0, f64::max);
    let factor = if name == "none" {
        0.0
    } else if name == "sensor_delay" || name == "current" {
        1.0
    } else {
        strength / ratio
    };
    let scaled = unit.into_iter().map(|t| t.into_iter().map(|w| w.map(|v| v * factor)).collect()).collect();
    (scaled, factor)
}

#[test]
#[ignore = "a survey for people, not a promise"]
fn survey() {
    let names = std::env::var("NAMES").unwrap_or_else(|_| {
        "none added_mass linear_damping drag_coefficient_error rotation current water_level_offset density_error hull_flooding water_entry_slamming wave_memory squat sensor_delay sensor_bias sensor_drift sensor_gain axis_misalignment outside_sine outside_vibration".into()
    });
    let count: usize = std::env::var("TRIALS").ok().and_then(|v| v.parse().ok()).unwrap_or(24);
    for name in names.split_whitespace() {
        for strength in [1.0, 3.0] {
            let seed = 7;
            let motions = motions(count, 900, seed);
            let (added, factor) = scaled(name, strength, &motions);
            let trials = trials(&motions, &added, &Noise::white(NOISE), seed);
            let body = gap::body_of(&trials).expect("a body");
            let start = std::time::Instant::now();
            let report =
                gap::run(&trials, &body, &mut |_| Predicted::default(), &Config::default()).expect("runs");
            let effects: Vec<String> = report
                .effects
                .iter()
                .map(|e| {
                    let p: Vec<String> = e
                        .parameters
                        .iter()
                        .map(|(n, p)| format!("{n}={:.4}±{:.4}", p.value, p.std))
                        .collect();
                    format!("{}[{}] {:.2}", e.name, p.join(" "), e.share_of_gap)
                })
                .collect();
            println!(
                "{name:24} x{strength} factor {factor:.4} -> {:?} {} | alt {:?} | closure {:.2?} | shares {:.2?} | {:.1?}",
                report.verdict,
                effects.join(", "),
                report.alternatives,
                report.gap.held_out["all"].closure,
                report.gap.shares,
                start.elapsed()
            );
            if report.effects.is_empty() || std::env::var("VERBOSE").is_ok() {
                for r in report.rejected.iter().take(4) {
                    println!("      {} {:?} {:.2} alone {:.2}", r.name, r.why, r.share_of_gap, r.share_alone);
                }
                println!("      {:?}", report.gap.unexplained);
            }
        }
    }
}

#[test]
#[ignore = "a survey for people, not a promise"]
fn nulls() {
    let seeds: u64 = std::env::var("SEEDS").ok().and_then(|v| v.parse().ok()).unwrap_or(8);
    let (mut named, mut structured, mut all) = (0, 0, 0);
    for seed in 0..seeds {
        for kind in [
            "white",
            "colored 0.3 s",
            "colored 1 s",
            "offset stated",
            "offset not stated",
            "quantized",
            "dropouts",
            "still air of a mocap",
        ] {
            let motions = motions(24, 900, 100 + seed);
            let (added, _) = scaled("none", 1.0, &motions);
            let mut noise = Noise::white(NOISE);
            match kind {
                "colored 0.3 s" => noise.colored = 0.3,
                "colored 1 s" => noise.colored = 1.0,
                "offset stated" | "offset not stated" => noise.offset = 1.0,
                "still air of a mocap" => (noise.velocity, noise.depth) = (0.03, 0.002),
                _ => {}
            }
            let mut trials = trials(&motions, &added, &noise, seed);
            if kind == "offset stated" {
                trials.manifest.trial_offset = [("fx", 8.0), ("fz", 12.0), ("my", 4.0), ("mz", 4.0)]
                    .map(|(n, v)| (n.to_owned(), v))
                    .into();
            }
            for trial in &mut trials.trials {
                if kind == "quantized" {
                    for column in trial.measured.iter_mut().flatten() {
                        column.iter_mut().for_each(|v| *v = (*v / 10.0).round() * 10.0);
                    }
                }
                if kind == "dropouts" {
                    let keep = |i: usize| !(200..260).contains(&i) && i % 97 != 3;
                    let cut = |column: &mut Vec<f64>| {
                        let mut i = 0;
                        column.retain(|_| {
                            i += 1;
                            keep(i - 1)
                        });
                    };
                    let cut3 = |column: &mut Vec<wade::frame::Vec3>| {
                        let mut i = 0;
                        column.retain(|_| {
                            i += 1;
                            keep(i - 1)
                        });
                    };
                    for c in [
                        &mut trial.t,
                        &mut trial.roll,
                        &mut trial.pitch,
                        &mut trial.yaw,
                        &mut trial.depth,
                        &mut trial.density,
                    ] {
                        cut(c);
                    }
                    for c in [
                        &mut trial.velocity,
                        &mut trial.angular_velocity,
                        &mut trial.acceleration,
                        &mut trial.angular_acceleration,
                    ] {
                        cut3(c);
                    }
                    trial.measured.iter_mut().flatten().for_each(cut);
                    trial.simulated.iter_mut().flatten().for_each(cut);
                    let count = trial.t.len();
                    trial.rows.truncate(count);
                }
            }
            let body = gap::body_of(&trials).expect("a body");
            let report =
                gap::run(&trials, &body, &mut |_| Predicted::default(), &Config::default()).expect("runs");
            all += 1;
            if !report.effects.is_empty() {
                named += 1;
            }
            if report.verdict == gap::Verdict::NoCandidateFits {
                structured += 1;
            }
            if report.verdict != gap::Verdict::NothingMissing {
                println!(
                    "{kind} seed {seed}: {:?} {:?} {:?}",
                    report.verdict,
                    report.effects.iter().map(|e| (e.name, &e.parameters)).collect::<Vec<_>>(),
                    report.gap.unexplained
                );
            }
        }
    }
    println!("{all} nulls, {named} named, {structured} called structure ->");
}

#[test]
#[ignore = "a survey for people, not a promise"]
fn coverage() {
    let seeds: u64 = std::env::var("SEEDS").ok().and_then(|v| v.parse().ok()).unwrap_or(10);
    for (name, parameter) in [
        ("added_mass", "surge"),
        ("linear_damping", "surge"),
        ("drag_coefficient_error", "surge"),
        ("rotation", "drag_coefficient"),
        ("water_level_offset", "offset"),
        ("squat", "sinkage"),
        ("wave_memory", "surge"),
        ("water_entry_slamming", "vertical"),
        ("sensor_bias", "fz"),
        ("density_error", "relative_error"),
    ] {
        for strength in [1.0, 3.0] {
            let (mut right, mut wrong, mut covered, mut errors) = (0, 0, 0, Vec::new());
            for seed in 0..seeds {
                let motions = motions(24, 900, 300 + seed);
                let (added, factor) = scaled(name, strength, &motions);
                let trials = trials(&motions, &added, &Noise::white(NOISE), seed);
                let body = gap::body_of(&trials).expect("a body");
                let report = gap::run(&trials, &body, &mut |_| Predicted::default(), &Config::default())
                    .expect("runs");
                let names: Vec<&str> = report.effects.iter().map(|e| e.name).collect();
                if report.verdict == gap::Verdict::Named && names == [name] {
                    right += 1;
                } else if report.verdict == gap::Verdict::Named {
                    wrong += 1;
                    println!("  {name} x{strength} seed {seed}: {names:?} seed");
                } else {
                    println!(
                        "  {name} x{strength} seed {seed}: {:?} {names:?} {:?}",
                        report.verdict, report.alternatives
                    );
                }
                if let Some(p) =
                    report.effects.iter().find(|e| e.name == name).and_then(|e| e.parameters.get(parameter))
                {
                    covered += usize::from((p.interval[0]..=p.interval[1]).contains(&factor));
                    errors.push((p.value / factor - 1.0).abs());
                }
            }
            errors.sort_by(f64::total_cmp);
            println!(
                "{name:24} x{strength} right {right}/{seeds} wrong {wrong} covered {covered}/{} median error {:.3} ->",
                errors.len(),
                errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN)
            );
        }
    }
}
