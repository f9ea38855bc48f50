//! Measured recovery of planted effects; run with --ignored --nocapture to see the table.

#[path = "common/planted.rs"]
mod planted;

use planted::{Noise, motions, planted as plant, rms, trials};
use wade::gap::{self, Config, Predicted};

const NOISE: [f64; 6] = [8.0, 8.0, 12.0, 4.0, 4.0, 4.0];

fn scaled(name: &str, strength: f64, motions: &[Vec<planted::State>]) -> (Vec<Vec<[f64; 6]>>, f64) {
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
