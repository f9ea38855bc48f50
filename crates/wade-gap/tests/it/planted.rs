//! Generated trials of a box with an effect planted by a formula of its own, written apart from `src/effects`.

use std::collections::BTreeMap;

use wade_core::frame::Vec3;
use wade_gap::{Config, NOTHING, OUTSIDE_LIBRARY, Predicted, Report, Verdict};
use wade_learn::random::Random;
use wade_learn::trials::{Body, Manifest, Measured, Method, StillWater, Trial, Trials};

pub const LENGTH: f64 = 1.5;
pub const WIDTH: f64 = 1.4;
pub const DRAFT: f64 = 0.2;
pub const MASS: f64 = 280.0;
pub const VOLUME: f64 = 0.3;
pub const RATE: f64 = 100.0;
const G: f64 = 9.81;
pub const RHO: f64 = 1000.0;

/// One instant of the true motion.
#[derive(Debug, Clone, Copy)]
pub struct State {
    pub t: f64,
    pub v: Vec3,
    pub w: Vec3,
    pub a: Vec3,
    pub al: Vec3,
    pub depth: f64,
    pub depth_rate: f64,
    pub yaw: f64,
}

/// What the simulator predicts: buoyancy and quadratic drag of a box, components fx fy fz mx my mz.
pub fn simulate(s: &State) -> [f64; 6] {
    simulate_at(s.v, s.depth)
}

pub fn simulate_at(v: Vec3, depth: f64) -> [f64; 6] {
    let d = depth.max(0.0);
    let speed = v.norm();
    let drag = |area: f64, u: f64| -0.5 * RHO * 1.1 * area * speed * u;
    let fx = drag(WIDTH * d, v.x);
    let fy = drag(LENGTH * d, v.y);
    let fz = RHO * G * VOLUME / DRAFT * d;
    // the center of mass lies 0.1 m above the bottom, drag acts at half the depth
    let arm = 0.5 * d - 0.1;
    [fx, fy, fz, -arm * fy, arm * fx, 0.0]
}

pub fn gaussian(random: &mut Random) -> f64 {
    (-2.0 * (1.0 - random.unit()).ln()).sqrt() * (std::f64::consts::TAU * random.unit()).cos()
}

/// A run of trials: speeds in steps and ramps at three depths, some that turn, some that enter by a ramp.
pub fn motions(count: usize, samples: usize, seed: u64) -> Vec<Vec<State>> {
    motions_at(RATE, count, samples, seed)
}

/// The same motions at another rate [Hz].
pub fn motions_at(rate: f64, count: usize, samples: usize, seed: u64) -> Vec<Vec<State>> {
    (0..count)
        .map(|index| {
            let mut random = Random::new(seed * 1000 + index as u64);
            motion(index, rate, samples, &mut random)
        })
        .collect()
}

fn motion(index: usize, sampled_at: f64, samples: usize, random: &mut Random) -> Vec<State> {
    let level = [0.1, 0.2, 0.25][index % 3];
    let turns = index % 4 == 1;
    let enters = index.is_multiple_of(2);
    let top = 0.6 + 2.2 * random.unit();
    let heading = if index % 5 < 3 { 0.0 } else { std::f64::consts::PI } + 0.2 * (random.unit() - 0.5);
    let (rise, fall) = (0.8 + 0.7 * random.unit(), 6.0 + random.unit());
    let (wobble, phase) = (0.25 * random.unit(), 6.0 * random.unit());
    let rate = if turns { 0.3 + 0.5 * random.unit() } else { 0.0 };
    let step = |t: f64, at: f64, width: f64| 0.5 * (1.0 + ((t - at) / width).tanh());
    let speed = |t: f64| {
        top * (step(t, rise, 0.5) - 0.7 * step(t, fall, 0.5)) * (1.0 + wobble * (1.1 * t + phase).sin())
    };
    let side = |t: f64| if turns { 0.15 * (0.9 * t + phase).sin() } else { 0.02 * (0.7 * t).sin() };
    let yaw_rate = |t: f64| rate * (0.6 * t + phase).sin();
    let depth = |t: f64| if enters { level * step(t, 1.8, 0.4) } else { level };
    let diff = |f: &dyn Fn(f64) -> f64, t: f64| (f(t + 1e-4) - f(t - 1e-4)) / 2e-4;
    let mut yaw = heading;
    (0..samples)
        .map(|i| {
            let t = i as f64 / sampled_at;
            let w = Vec3::new(0.0, 0.0, yaw_rate(t));
            let v = Vec3::new(speed(t), side(t), -diff(&depth, t));
            let vd = Vec3::new(diff(&speed, t), diff(&side, t), 0.0);
            yaw += w.z / sampled_at;
            let al = Vec3::new(0.0, 0.0, diff(&yaw_rate, t));
            State { t, v, w, a: vd + w.cross(&v), al, depth: depth(t), depth_rate: diff(&depth, t), yaw }
        })
        .collect()
}

/// Straight runs whose speed changes again and again within half a second, at three depths.
pub fn pushes(count: usize, samples: usize, seed: u64) -> Vec<Vec<State>> {
    (0..count)
        .map(|index| {
            let mut random = Random::new(seed * 1000 + index as u64);
            let changes: Vec<(f64, f64, f64)> = (0..5)
                .map(|k| (0.4 + 1.5 * f64::from(k), 0.5 + 0.2 * random.unit(), 0.3 + 1.7 * random.unit()))
                .collect();
            let smooth = |u: f64| u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
            let speed = |t: f64| {
                let step = |(sum, last): (f64, f64), &(at, length, to): &(f64, f64, f64)| {
                    (sum + (to - last) * smooth(((t - at) / length).clamp(0.0, 1.0)), to)
                };
                changes.iter().fold((0.0, 0.0), step).0
            };
            let at = |i: usize| {
                let t = i as f64 / RATE;
                let rate = (speed(t + 1e-4) - speed(t - 1e-4)) / 2e-4;
                State {
                    t,
                    v: Vec3::new(speed(t), 0.0, 0.0),
                    w: Vec3::zeros(),
                    a: Vec3::new(rate, 0.0, 0.0),
                    al: Vec3::zeros(),
                    depth: [0.1, 0.2, 0.25][index % 3],
                    depth_rate: 0.0,
                    yaw: 0.0,
                }
            };
            (0..samples).map(at).collect()
        })
        .collect()
}

/// Root mean square of each component of planted wrenches.
pub fn rms(planted: &[Vec<[f64; 6]>]) -> [f64; 6] {
    let count = planted.iter().map(Vec::len).sum::<usize>() as f64;
    std::array::from_fn(|c| (planted.iter().flatten().map(|w| w[c].powi(2)).sum::<f64>() / count).sqrt())
}

/// Scatter of what is recorded.
#[derive(Debug, Clone, Copy)]
pub struct Noise {
    /// Of each measured component [N, N m].
    pub wrench: [f64; 6],
    /// Correlation time of the wrench's noise [s]; 0 for white.
    pub colored: f64,
    pub velocity: f64,
    pub depth: f64,
    pub acceleration: f64,
    /// Of the zero of a trial, in wrench noises.
    pub offset: f64,
}

impl Noise {
    pub fn white(wrench: [f64; 6]) -> Self {
        Self { wrench, colored: 0.0, velocity: 0.01, depth: 0.0005, acceleration: 0.15, offset: 0.0 }
    }
}

/// Trials in memory, with `added` on the measured wrench.
pub fn trials(motions: &[Vec<State>], added: &[Vec<[f64; 6]>], noise: &Noise, seed: u64) -> Trials {
    let mut random = Random::new(seed ^ 0xabcdef);
    let trials = motions
        .iter()
        .zip(added)
        .enumerate()
        .map(|(index, (motion, added))| {
            let mut random = random.fork();
            trial(&format!("run{index:02}"), motion, added, noise, &mut random)
        })
        .collect();
    let manifest = Manifest {
        vehicle: "box".into(),
        generated: Some("planted effect, for tests".into()),
        fluid_density: Some(RHO),
        measured: Measured { method: Some(Method::LoadCell), ..Measured::default() },
        body: Some(Body {
            length: LENGTH,
            width: WIDTH,
            draft: DRAFT,
            mass: MASS,
            displaced_volume: VOLUME,
            center_of_mass: [0.0; 3],
        }),
        ..Manifest::default()
    };
    Trials { manifest, trials, accelerations_were_rates: false }
}

fn trial(name: &str, motion: &[State], added: &[[f64; 6]], noise: &Noise, random: &mut Random) -> Trial {
    let count = motion.len();
    let mut seen: Vec<State> = Vec::with_capacity(count);
    for s in motion {
        let mut jitter = |size: f64| Vec3::from_fn(|_, _| size * gaussian(random));
        let (dv, da) = (jitter(noise.velocity), jitter(noise.acceleration));
        seen.push(State { v: s.v + dv, a: s.a + da, depth: s.depth + noise.depth * gaussian(random), ..*s });
    }
    let offset: Vec<f64> = (0..6).map(|c| noise.offset * noise.wrench[c] * gaussian(random)).collect();
    let keep = if noise.colored > 0.0 { (-1.0 / (RATE * noise.colored)).exp() } else { 0.0 };
    let mut state = [0.0; 6];
    (0..6).for_each(|c| state[c] = gaussian(random));
    let mut measured = vec![vec![0.0; count]; 6];
    for (i, s) in motion.iter().enumerate() {
        let truth = simulate(s);
        for c in 0..6 {
            state[c] = keep * state[c] + (1.0 - keep * keep).sqrt() * gaussian(random);
            measured[c][i] = truth[c] + added[i][c] + offset[c] + noise.wrench[c] * state[c];
        }
    }
    let sim: Vec<[f64; 6]> = seen.iter().map(simulate).collect();
    let column = |of: &dyn Fn(&State) -> f64| seen.iter().map(of).collect::<Vec<f64>>();
    // fx, fz, my and mz are measured
    let present = [true, true, true, false, true, true];
    let mut measured = measured.into_iter();
    Trial {
        name: name.into(),
        rows: (2..).take(count).collect(),
        t: column(&|s| s.t),
        velocity: seen.iter().map(|s| s.v).collect(),
        current: vec![Vec3::zeros(); count],
        angular_velocity: seen.iter().map(|s| s.w).collect(),
        roll: vec![0.0; count],
        pitch: vec![0.0; count],
        yaw: column(&|s| s.yaw),
        still_water: StillWater::Depth(column(&|s| s.depth)),
        bed_clearance: None,
        bed: None,
        acceleration: seen.iter().map(|s| s.a).collect(),
        angular_acceleration: seen.iter().map(|s| s.al).collect(),
        acceleration_is_measured: true,
        density: vec![RHO; count],
        wheel_speeds: [None, None, None, None],
        measured: present.map(|p| measured.next().filter(|_| p)),
        simulated: std::array::from_fn(|c| Some(sim.iter().map(|w| w[c]).collect())),
        other_forces: BTreeMap::new(),
        known_loads: BTreeMap::new(),
        unknown_columns: Vec::new(),
        glitches: Vec::new(),
        gaps: Vec::new(),
    }
}

/// The planted wrench of an effect over a motion, by name; coefficient 1 in the units of the report.
pub fn planted(name: &str, motion: &[State]) -> Vec<[f64; 6]> {
    let mut out = vec![[0.0; 6]; motion.len()];
    let area = VOLUME / DRAFT;
    let mut memory = 0.0;
    let mut inside = 0.0;
    for (i, s) in motion.iter().enumerate() {
        let d = s.depth.max(0.0);
        let speed = s.v.norm();
        let dv = s.a - s.w.cross(&s.v);
        let arm = 0.5 * d - 0.1;
        let sim = simulate(s);
        let at_center = |fx: f64| [fx, 0.0, 0.0, 0.0, arm * fx, 0.0];
        let w: [f64; 6] = match name {
            "added_mass" => {
                let m = RHO * area * d;
                let (fx, fy) = (-m * (dv.x - 0.6 * s.w.z * s.v.y), -m * (0.6 * dv.y + s.w.z * s.v.x));
                [fx, fy, 0.0, -arm * fy, arm * fx, -m * (0.6 - 1.0) * s.v.x * s.v.y]
            }
            "linear_damping" => {
                let scale = RHO * (G * LENGTH).sqrt() * d * 2.0;
                let (fx, fy) = (-scale * WIDTH * s.v.x, -scale * LENGTH * s.v.y);
                [
                    fx,
                    fy,
                    0.0,
                    -arm * fy,
                    arm * fx,
                    -scale * s.w.z * LENGTH.powi(3) / 12.0 - scale * s.w.z * WIDTH.powi(3) / 12.0,
                ]
            }
            "drag_coefficient_error" => at_center(-0.5 * RHO * WIDTH * d * speed * s.v.x),
            // of a wing as long as the box and as high as it is wet
            "hull_lift" => [0.0, 0.0, 0.0, 0.0, 0.0, 0.5 * RHO * d * LENGTH * LENGTH * s.v.x * s.v.y],
            "rotation" => {
                // strips along the sides and the ends
                let mut sum = [0.0; 6];
                for k in 0..40 {
                    let x = ((k as f64 + 0.5) / 40.0 - 0.5) * LENGTH;
                    let local = Vec3::new(s.v.x, s.v.y + s.w.z * x, 0.0);
                    let f = -0.5 * RHO * d * LENGTH / 40.0;
                    let fy = f * (local.norm() * local.y - speed * s.v.y);
                    sum[1] += fy;
                    sum[5] += x * fy;
                }
                sum
            }
            "current" => {
                let world = Vec3::new(0.3, 0.0, 0.0);
                let (sy, cy) = s.yaw.sin_cos();
                let u = Vec3::new(cy * world.x, -sy * world.x, 0.0);
                let moved = simulate_at(s.v - u, s.depth);
                std::array::from_fn(|c| moved[c] - sim[c])
            }
            "water_level_offset" => {
                // a level only counts where there is water
                if d < 0.005 {
                    [0.0; 6]
                } else {
                    let up = simulate_at(s.v, d + 0.01);
                    std::array::from_fn(|c| (up[c] - sim[c]) / 0.01)
                }
            }
            "density_error" => sim,
            "hull_flooding" => {
                inside += 0.002 * (2.0 * G * (d - inside).abs()).sqrt() * (d - inside).signum() / RATE;
                inside = f64::min(inside, d);
                [0.0, 0.0, -RHO * G * area * inside, 0.0, 0.0, 0.0]
            }
            "water_entry_slamming" => [0.0, 0.0, RHO * area * s.depth_rate.max(0.0).powi(2), 0.0, 0.0, 0.0],
            "wave_memory" => {
                memory += (dv.x - memory / 1.5) / RATE;
                at_center(-RHO * area * d * (G / LENGTH).sqrt() * memory)
            }
            "squat" => {
                [0.0, 0.0, -0.5 * RHO * speed * speed * area * f64::from(u8::from(d > 0.005)), 0.0, 0.0, 0.0]
            }
            "sensor_delay" => sim,
            "sensor_bias" => [0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
            "sensor_drift" => [s.t, 0.0, 0.0, 0.0, 0.0, 0.0],
            "sensor_gain" => [sim[0], 0.0, 0.0, 0.0, 0.0, 0.0],
            "axis_misalignment" => [-sim[2], 0.0, sim[0], 0.0, 0.0, 0.0],
            "outside_sine" => [0.0, 0.0, (7.0 * s.v.x).sin(), 0.0, 0.0, (5.0 * s.v.x).cos()],
            _ => [0.0; 6],
        };
        out[i] = w;
    }
    if name == "sensor_delay" {
        // 80 ms late
        let late = 8;
        let copy = out.clone();
        for i in 0..out.len() {
            let from = copy[i.saturating_sub(late)];
            out[i] = std::array::from_fn(|c| from[c] - copy[i][c]);
        }
    }
    if name == "outside_vibration" {
        for (i, s) in motion.iter().enumerate() {
            out[i] = [0.0, 0.0, (s.v.x * 6.0 * s.t).sin() * s.v.x, 0.0, 0.0, 0.0];
        }
    }
    out
}

/// The report on trials with another simulator's prediction.
pub fn run_with(trials: &Trials, config: &Config) -> Report {
    let body = wade_gap::body_of(trials).expect("a body");
    let report = wade_gap::run(trials, &body, &mut |_| Predicted::default(), config).expect("runs");
    check(&report);
    report
}

/// What must hold of every report, from the numbers that it states: a verdict that they contradict is none.
pub fn check(report: &Report) {
    let said = &report.summary;
    let (gap, named) = (&report.gap, report.verdict == Verdict::Named);
    if report.verdict == Verdict::NothingMissing {
        assert!(
            gap.size.values().all(|size| size.interval[0] <= size.expected_at_most),
            "{said} {:?}",
            gap.size
        );
    }
    if named {
        let names: Vec<&str> = report.effects.iter().map(|effect| effect.name).collect();
        let with = |name: &str| {
            let of = report.explanations.iter().filter(|e| e.effects.contains(&name));
            of.map(|e| e.probability).sum::<f64>()
        };
        // explanations below a thousandth are not stated
        let is_likely = names.iter().all(|name| with(name) > 0.45);
        assert!(is_likely || report.explanations[0].effects == names, "{said} {:?}", report.explanations);
        assert!(gap.held_out["all"].closure.is_none_or(|closure| closure >= 0.0), "{said}");
        for (name, held) in gap.held_out.iter().filter(|(name, _)| **name != "all") {
            let floor = held.noise_floor.hypot(gap.floors[name].model);
            let acts = (held.before.powi(2) - held.after.powi(2)).abs() > floor.powi(2);
            let is_of_law = held.after.powi(2) <= 0.2 * held.before.powi(2);
            assert!(!acts || is_of_law || held.after <= 2.0 * floor, "{said} {name}: {held:?}, {floor}");
        }
    }
    let all = &report.explanations;
    assert!(all.is_sorted_by(|a, b| a.probability >= b.probability), "{all:?}");
    assert!(all.iter().map(|e| e.probability).sum::<f64>() < 1.0 + 1e-9, "{all:?}");
    for name in [NOTHING, OUTSIDE_LIBRARY] {
        assert_eq!(all.iter().filter(|e| e.effects == [name]).count(), 1, "{name}: {all:?}");
    }
    let holds = matches!(report.verdict, Verdict::Named | Verdict::Ambiguous);
    assert_eq!(report.effects.is_empty(), !holds, "{said}");
    assert!(report.suspected.is_empty() || !holds, "{said}");
    assert!(!said.contains("explains 0 %"), "{said}");
}
