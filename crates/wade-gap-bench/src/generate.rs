//! Trials of a case: an exact motion, a measured wrench with something hidden in it, and what instruments make of both.

use std::collections::BTreeMap;

use super::case::Case;
use super::hidden::{Hidden, Parameter, Setting, parameters, strength};
use super::noise::{CELL, QUANTUM, SmoothError, left_by_dropouts, of_wrench, recorded, rounded};
use super::simulator::Modeled;
use super::track::{CHANNEL, DENSITY};
use super::{NoiseKind, Prediction, Region, Schedule, Simulator, State, Track, Wrench6};
use wade_core::frame::Vec3;
use wade_learn::random::Random;
use wade_learn::signal::pieces;
use wade_learn::trials::{
    Body, Gap, Manifest, Measured, Method, StillWater, Trial, Trials, WRENCH, acceleration, component_of,
    derivative,
};

/// How much better or worse than the stated load cell that of a case may be.
const INSTRUMENTS: [f64; 2] = [0.1, 20.0];
/// How much worse than stated the cameras may be: they do not get as bad as an inferred wrench.
const CAMERAS: f64 = 3.0;
/// Column of the drive force where the wrench is inferred.
pub const DRIVE: &str = "drive_fx";
/// Columns of known weights hung on the sensor.
const HUNG: [&str; 3] = ["hung_fx", "hung_fy", "hung_fz"];
/// Draft that the body's table states for the generated box [m].
const DRAFT: f64 = 0.2032;

/// What is true of generated trials and not told.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The effects as they were hidden.
    pub effects: Vec<Hidden>,
    /// Parameters of each.
    pub parameters: Vec<Vec<Parameter>>,
    /// Strength of each, in floors.
    pub strengths: Vec<f64>,
    /// Root mean square of the gap with nothing hidden, by component [N, N m].
    pub floor: Wrench6,
    /// The exact change of the measured wrench, by trial and sample.
    pub change: Vec<Vec<Wrench6>>,
    /// The exact states, by trial and sample.
    pub states: Vec<Vec<State>>,
    /// Rate of the depth, by trial and sample [m/s].
    pub depth_rate: Vec<Vec<f64>>,
    /// Share of the gap above the floor that the true change, scaled to fit half the samples, closes in the other half;
    /// `None` where nothing is hidden.
    pub closure: Option<f64>,
}

/// Trials with their truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Generated {
    /// What a tool may see.
    pub trials: Trials,
    /// What it may not.
    pub truth: Truth,
}

/// Generates the trials of a case; the same case gives the same bits.
pub fn generate(case: &Case, schedule: &Schedule, simulator: Simulator) -> Generated {
    let mut random = Random::new(case.seed);
    let tracks = schedule.tracks(&case.plan, simulator.hull.wheel[0], &mut random.fork());
    let session = tracks.last().map_or(1.0, |track| track.session_time + 10.0);
    let setting = Setting { simulator, session };
    let measured = if case.inferred { [true, true, false, false, false, true] } else { [true; 6] };
    let modeled: Vec<Vec<Modeled>> =
        tracks.iter().map(|track| simulator.predict_run(&track.states)).collect();
    let exact = |(track, modeled): (&Track, &Vec<Modeled>)| {
        track.states.iter().zip(modeled).map(|(state, modeled)| modeled.wrench + state.known_load).collect()
    };
    let exact: Vec<Vec<Wrench6>> = tracks.iter().zip(&modeled).map(exact).collect();
    let (instruments, noise_seed) = (random.fork(), random.fork());
    let scene = Scene { case, setting, tracks: &tracks, modeled: &modeled, exact: &exact, measured };
    let at = |scale: f64| scene.instruments(scale, &mut noise_seed.clone());
    let scale = scene.scale(&at(1.0).floor, &mut instruments.clone());
    let seen = at(scale);
    let hidden = scene.hide(&seen.floor);
    let changes = scene.changes(&hidden);
    scene.trials(seen, hidden, changes, &mut noise_seed.clone())
}

/// All that does not depend on the instruments.
struct Scene<'a> {
    case: &'a Case,
    setting: Setting<'a>,
    tracks: &'a [Track],
    /// The model's answer to the exact motion.
    modeled: &'a [Vec<Modeled>],
    /// What would be measured with nothing hidden.
    exact: &'a [Vec<Wrench6>],
    measured: [bool; 6],
}

/// What instruments of a quality record of the scene.
struct Seen {
    tracks: Vec<Track>,
    /// Prediction for what was recorded.
    predicted: Vec<Vec<Wrench6>>,
    noise: Vec<Vec<Wrench6>>,
    floor: Wrench6,
    /// Of the instruments to those of the noise's standard.
    scale: f64,
}

/// What the instruments say of the samples of a trial that are kept.
struct Readings {
    kept: Vec<usize>,
    wrench: Vec<Wrench6>,
    /// Force of the drive [N], where the wrench is inferred.
    drive: Option<Vec<f64>>,
}

impl Scene<'_> {
    fn instruments(&self, scale: f64, random: &mut Random) -> Seen {
        let kind = self.case.noise;
        let error = SmoothError::new(&mut random.fork());
        let own = if kind == NoiseKind::SurrogateError { 0.5 * scale } else { 0.0 };
        // what is served errs by what it states, whatever the instruments
        let stated = match self.setting.simulator.prediction {
            Prediction::Analytic => None,
            Prediction::Model(_) => Some(SmoothError::new(&mut random.fork())),
        };
        let (mut tracks, mut predicted, mut noise) = (Vec::new(), Vec::new(), Vec::new());
        for (track, modeled) in self.tracks.iter().zip(self.modeled) {
            let mut random = random.fork();
            let recorded = recorded(track, scale.min(CAMERAS), &mut random);
            let answers = self.setting.simulator.predict_run(&recorded.states);
            predicted.push(answers.iter().map(|answer| answer.wrench).collect::<Vec<_>>());
            let mut cell = of_wrench(kind, track, scale, &mut random);
            if own > 0.0 {
                for (sum, state) in cell.iter_mut().zip(&track.states) {
                    *sum += error.at(state).component_mul(&Wrench6::from(CELL)) * own;
                }
            }
            if let Some(error) = &stated {
                for ((sum, state), modeled) in cell.iter_mut().zip(&track.states).zip(modeled) {
                    *sum += error.at(state).component_mul(&modeled.deviation);
                }
            }
            noise.push(cell);
            tracks.push(recorded);
        }
        let gaps = self.exact.iter().zip(&predicted).zip(self.tracks).zip(&noise);
        let gaps = gaps.flat_map(|(((exact, predicted), track), noise)| {
            let known = track.states.iter().map(|state| state.known_load);
            exact.iter().zip(predicted).zip(known).zip(noise).map(|(((e, p), k), n)| e - p - k + n)
        });
        let floor = root_mean_square(gaps);
        Seen { tracks, predicted, noise, floor, scale }
    }

    /// How much better or worse than stated the instruments are, so that the hidden effects are about as strong as they
    /// should be with plausible parameters; with nothing hidden it is random.
    fn scale(&self, floor: &Wrench6, random: &mut Random) -> f64 {
        if self.case.hidden.is_empty() {
            return 0.5 + 1.5 * random.unit();
        }
        let strengths = self.case.hidden.iter().map(|hidden| self.strength(hidden, floor));
        let mean =
            strengths.map(|strength| strength.max(1e-9).ln()).sum::<f64>() / self.case.hidden.len() as f64;
        (mean.exp() / self.case.strength).clamp(INSTRUMENTS[0], INSTRUMENTS[1])
    }

    fn alone(&self, hidden: &Hidden) -> Vec<Vec<Wrench6>> {
        let tracks = self.tracks.iter().zip(self.exact);
        tracks.map(|(track, exact)| self.gated(hidden.change(&self.setting, track, exact), track)).collect()
    }

    fn strength(&self, hidden: &Hidden, floor: &Wrench6) -> f64 {
        strength(&self.alone(hidden), floor, &self.measured)
    }

    fn gated(&self, mut change: Vec<Wrench6>, track: &Track) -> Vec<Wrench6> {
        if let Some(gate) = &self.case.gate {
            for ((change, state), rate) in change.iter_mut().zip(&track.states).zip(depth_rate(track)) {
                if !gate.holds(state, rate) {
                    *change = Wrench6::zeros();
                }
            }
        }
        change
    }

    /// The effects at the strength of the case: by secants on the logarithm of the size, which is exact at once for those
    /// that are proportional to it.
    fn hide(&self, floor: &Wrench6) -> Vec<Hidden> {
        let scaled = |hidden: &Hidden| {
            let mut hidden = *hidden;
            for _ in 0..12 {
                let ratio = self.case.strength / self.strength(&hidden, floor).max(1e-9);
                if (ratio - 1.0).abs() < 1e-6 {
                    break;
                }
                hidden = hidden.scaled(ratio.clamp(0.2, 5.0));
            }
            hidden
        };
        self.case.hidden.iter().map(scaled).collect()
    }

    /// The change by each effect; each sees the wrench that those before it left.
    fn changes(&self, hidden: &[Hidden]) -> Vec<Vec<Vec<Wrench6>>> {
        let mut wrench = self.exact.to_vec();
        let mut by = |hidden: &Hidden| {
            let tracks = self.tracks.iter().zip(&mut wrench);
            let change = tracks.map(|(track, wrench)| {
                let change = self.gated(hidden.change(&self.setting, track, wrench), track);
                wrench.iter_mut().zip(&change).for_each(|(wrench, change)| *wrench += change);
                change
            });
            change.collect::<Vec<_>>()
        };
        hidden.iter().map(&mut by).collect()
    }

    fn trials(
        &self,
        seen: Seen,
        hidden: Vec<Hidden>,
        changes: Vec<Vec<Vec<Wrench6>>>,
        random: &mut Random,
    ) -> Generated {
        let scale = seen.scale;
        let strengths = changes.iter().map(|change| strength(change, &seen.floor, &self.measured)).collect();
        let manifest = self.manifest(scale);
        let mut trials = Vec::new();
        let mut truth = Truth {
            parameters: hidden.iter().map(|h| parameters(h, &self.setting, self.tracks)).collect(),
            effects: hidden,
            strengths,
            floor: seen.floor,
            change: Vec::new(),
            states: Vec::new(),
            depth_rate: Vec::new(),
            closure: None,
        };
        for (index, track) in self.tracks.iter().enumerate() {
            let kept = match self.case.noise {
                NoiseKind::Dropouts => left_by_dropouts(track, &mut random.fork()),
                _ => (0..track.states.len()).collect(),
            };
            let clean = |i: usize| -> Wrench6 {
                self.exact[index][i] + changes.iter().map(|change| change[index][i]).sum::<Wrench6>()
            };
            let wrench: Vec<Wrench6> =
                kept.iter().map(|&i| self.reading(clean(i) + seen.noise[index][i], scale)).collect();
            let drive = self.case.inferred.then(|| {
                let mass = self.setting.simulator.hull.mass;
                kept.iter().map(|&i| mass * track.states[i].acceleration.x - clean(i)[0]).collect()
            });
            let (recorded, predicted) = (&seen.tracks[index], &seen.predicted[index]);
            let rates = depth_rate(track);
            truth.depth_rate.push(kept.iter().map(|&i| rates[i]).collect());
            truth.states.push(kept.iter().map(|&i| track.states[i]).collect());
            let change = |i: usize| changes.iter().map(|change| change[index][i]).sum();
            truth.change.push(kept.iter().map(|&i| change(i)).collect());
            trials.push(self.trial(recorded, predicted, Readings { kept, wrench, drive }));
        }
        truth.closure = closure(&trials, &truth, &self.setting.simulator);
        Generated { trials: Trials { manifest, trials, accelerations_were_rates: false }, truth }
    }

    fn reading(&self, wrench: Wrench6, scale: f64) -> Wrench6 {
        if self.case.noise != NoiseKind::Quantized {
            return wrench;
        }
        Wrench6::from_fn(|c, _| rounded(wrench[c], QUANTUM * CELL[c] * scale))
    }

    fn manifest(&self, scale: f64) -> Manifest {
        let simulator = &self.setting.simulator;
        let hull = simulator.hull;
        let components = WRENCH.into_iter().zip(CELL).zip(self.measured).filter(|(_, measured)| *measured);
        let by_component = |std: f64| -> BTreeMap<String, f64> {
            components.clone().map(|((name, cell), _)| (name.to_owned(), cell * scale * std)).collect()
        };
        let stated = self.case.seed.is_multiple_of(2);
        let others = self.tracks.iter().filter(|track| track.channel_width != CHANNEL);
        let states = || self.tracks.iter().flat_map(|track| &track.states);
        let known_loads =
            HUNG.iter().enumerate().filter(|(axis, _)| states().any(|state| state.known_load[*axis] != 0.0));
        let is_analytic = matches!(simulator.prediction, Prediction::Analytic);
        Manifest {
            vehicle: simulator.vehicle.to_owned(),
            generated: Some(format!(
                "generated by the gap benchmark, seed {}: motion, noise and wrench; nothing of it was measured",
                self.case.seed
            )),
            fluid_density: Some(DENSITY),
            channel_width: Some(CHANNEL),
            channel_widths: others.map(|track| (track.name.clone(), track.channel_width)).collect(),
            mass: Some(hull.mass),
            measured: Measured {
                method: Some(if self.case.inferred { Method::InverseDynamics } else { Method::LoadCell }),
                other_forces: if self.case.inferred { vec![DRIVE.to_owned()] } else { Vec::new() },
                known_loads: known_loads.map(|(_, name)| (*name).to_owned()).collect(),
                ..Measured::default()
            },
            sensor_noise: if stated { by_component(1.0) } else { BTreeMap::new() },
            trial_offset: match self.case.noise {
                NoiseKind::Offsets => by_component(1.0),
                _ => BTreeMap::new(),
            },
            body: is_analytic.then(|| Body {
                length: hull.length,
                width: hull.width,
                draft: DRAFT,
                mass: hull.mass,
                displaced_volume: hull.volume(DRAFT),
                center_of_mass: (hull.center_of_mass - Vec3::z() * (hull.z0 + 0.5 * DRAFT)).into(),
            }),
            ..Manifest::default()
        }
    }

    fn trial(&self, track: &Track, predicted: &[Wrench6], readings: Readings) -> Trial {
        let Readings { kept, wrench, drive } = readings;
        let of = |value: &dyn Fn(&State) -> f64| -> Vec<f64> {
            kept.iter().map(|&i| value(&track.states[i])).collect()
        };
        // as the file will have it
        let t = of(&|state| (state.t * 1e7).round() / 1e7);
        let velocity: Vec<Vec3> = kept.iter().map(|&i| track.states[i].velocity).collect();
        let angular_velocity: Vec<Vec3> = kept.iter().map(|&i| track.states[i].angular_velocity).collect();
        let rows: Vec<u64> = (2..).take(kept.len()).collect();
        let starts = pieces(&t).into_iter().skip(1).map(|piece| piece.start);
        let gaps = starts.map(|start| Gap { row: rows[start], seconds: t[start] - t[start - 1] }).collect();
        let simulated: [Option<Vec<f64>>; 6] = std::array::from_fn(|c| {
            let analytic = matches!(self.setting.simulator.prediction, Prediction::Analytic);
            analytic.then(|| kept.iter().map(|&i| predicted[i][c]).collect())
        });
        let known_loads = (0..3).map(|axis| (HUNG[axis], of(&|state| state.known_load[axis])));
        let known_loads = known_loads.filter(|(_, load)| load.iter().any(|load| *load != 0.0));
        Trial {
            name: track.name.clone(),
            gaps,
            acceleration: acceleration(&t, &velocity, &angular_velocity),
            acceleration_is_measured: false,
            angular_acceleration: derivative(&t, &angular_velocity),
            velocity,
            current: vec![Vec3::zeros(); kept.len()],
            angular_velocity,
            roll: of(&|state| state.attitude[0]),
            pitch: of(&|state| state.attitude[1]),
            yaw: of(&|state| state.attitude[2]),
            still_water: StillWater::Depth(of(&|state| state.depth)),
            bed_clearance: None,
            bed: None,
            density: vec![DENSITY; kept.len()],
            wheel_speeds: std::array::from_fn(|wheel| Some(of(&|state| state.wheels[wheel]))),
            measured: std::array::from_fn(|c| {
                self.measured[c].then(|| wrench.iter().map(|wrench| wrench[c]).collect())
            }),
            simulated,
            other_forces: drive.map(|drive| (DRIVE.to_owned(), drive)).into_iter().collect(),
            known_loads: known_loads.into_iter().map(|(name, load)| (name.to_owned(), load)).collect(),
            unknown_columns: Vec::new(),
            glitches: Vec::new(),
            rows,
            t,
        }
    }
}

/// Root mean square of each component.
fn root_mean_square(wrenches: impl Iterator<Item = Wrench6>) -> Wrench6 {
    let (sum, count) =
        wrenches.fold((Wrench6::zeros(), 0.0), |(sum, count), w| (sum + w.component_mul(&w), count + 1.0));
    (sum / f64::max(count, 1.0)).map(f64::sqrt)
}

/// Rate of the depth by differences [m/s].
fn depth_rate(track: &Track) -> Vec<f64> {
    let states = &track.states;
    let rate = |i: usize| {
        let (first, last) = (i.saturating_sub(1), (i + 1).min(states.len() - 1));
        (states[last].depth - states[first].depth) / ((last - first).max(1) as f64 * track.step)
    };
    (0..states.len()).map(rate).collect()
}

/// Gap of a sample, measured less predicted, 0 where a component is not measured.
pub fn gap(trial: &Trial, sample: usize, predicted: &Wrench6) -> Wrench6 {
    Wrench6::from_fn(|c, _| trial.measured[c].as_ref().map_or(0.0, |values| values[sample] - predicted[c]))
}

/// What the sensor should read in the samples of a trial: the columns of the simulator, else the simulator's answers to the
/// recorded states, and the known loads.
pub fn predicted(trial: &Trial, simulator: &Simulator) -> Vec<Wrench6> {
    let known = |sample: usize| {
        let mut known = Wrench6::zeros();
        for (name, values) in &trial.known_loads {
            component_of(name).into_iter().for_each(|component| known[component] += values[sample]);
        }
        known
    };
    if trial.simulated[0].is_some() {
        let simulated =
            |sample: usize, c: usize| trial.simulated[c].as_ref().map_or(0.0, |values| values[sample]);
        return (0..trial.len())
            .map(|sample| known(sample) + Wrench6::from_fn(|c, _| simulated(sample, c)))
            .collect();
    }
    let state = |sample: usize| State {
        t: trial.t[sample],
        velocity: trial.velocity[sample],
        angular_velocity: trial.angular_velocity[sample],
        acceleration: trial.acceleration[sample],
        angular_acceleration: trial.angular_acceleration[sample],
        attitude: [trial.roll[sample], trial.pitch[sample], trial.yaw[sample]],
        depth: trial.depth(sample, simulator.hull.z0),
        wheels: trial.wheel_speeds.each_ref().map(|speeds| speeds.as_ref().map_or(0.0, |s| s[sample])),
        ..State::default()
    };
    let of_piece = |piece: std::ops::Range<usize>| {
        let states: Vec<State> = piece.clone().map(state).collect();
        simulator.predict_run(&states).into_iter().zip(piece)
    };
    let pieces = pieces(&trial.t).into_iter();
    pieces.flat_map(of_piece).map(|(answer, sample)| answer.wrench + known(sample)).collect()
}

/// Closure by the true change: scaled to fit every other second, judged on the rest, in floors. Halves of the trials would
/// leave nothing to fit of an effect that one trial excites.
fn closure(trials: &[Trial], truth: &Truth, simulator: &Simulator) -> Option<f64> {
    if truth.effects.is_empty() {
        return None;
    }
    let predictions: Vec<Vec<Wrench6>> = trials.iter().map(|trial| predicted(trial, simulator)).collect();
    let standardized = |parity: usize| {
        trials.iter().zip(&predictions).zip(&truth.change).flat_map(move |((trial, predictions), change)| {
            let chosen = (0..trial.len()).filter(move |&i| trial.t[i] as usize % 2 == parity);
            chosen.flat_map(move |i| {
                let gap = gap(trial, i, &predictions[i]);
                let on = |c: &usize| trial.measured[*c].is_some() && truth.floor[*c] > 0.0;
                let pair = |c: usize| [gap[c] / truth.floor[c], change[i][c] / truth.floor[c]];
                (0..6).filter(on).map(pair).collect::<Vec<_>>()
            })
        })
    };
    let (gw, ww) = standardized(0).fold((0.0, 0.0), |(gw, ww), [g, w]| (gw + g * w, ww + w * w));
    let scale = if ww > 0.0 { gw / ww } else { 0.0 };
    let (before, after, floor, count) = standardized(1).fold((0.0, 0.0, 0.0, 0.0), |(b, a, f, n), [g, w]| {
        (b + g * g, a + (g - scale * w).powi(2), f + (g - w).powi(2), n + 1.0)
    });
    let [before, after, floor] = [before, after, floor].map(|sum| f64::sqrt(sum / count));
    (before > floor).then(|| (before - after) / (before - floor))
}

/// True for the samples of a trial that lie in a region.
pub fn inside(region: &Region, truth: &Truth, trial: usize) -> Vec<bool> {
    let states = truth.states[trial].iter().zip(&truth.depth_rate[trial]);
    states.map(|(state, &rate)| region.holds(state, rate)).collect()
}
