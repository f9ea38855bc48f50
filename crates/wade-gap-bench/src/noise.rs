//! What instruments make of a motion and a wrench.

use super::{Track, Wrench6};
use wade_core::frame::Vec3;
use wade_learn::random::Random;
use wade_learn::signal::SavitzkyGolay;

/// Gaussian numbers with mean 0 and variance 1, by the polar method (Marsaglia and Bray, 1964).
#[derive(Debug, Clone)]
pub struct Gaussian {
    random: Random,
    spare: Option<f64>,
}

impl Gaussian {
    /// From a stream of uniform numbers.
    pub fn new(random: Random) -> Self {
        Self { random, spare: None }
    }

    /// The next number.
    pub fn draw(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let (a, b) = (2.0 * self.random.unit() - 1.0, 2.0 * self.random.unit() - 1.0);
            let s = a * a + b * b;
            if s > 0.0 && s < 1.0 {
                let factor = (-2.0 * s.ln() / s).sqrt();
                self.spare = Some(b * factor);
                return a * factor;
            }
        }
    }
}

wade_core::named_enum! {
    /// How the noise of the wrench behaves.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum NoiseKind {
        /// Independent from sample to sample.
        White => "white",
        /// An autoregression of order 1 with a time constant of 0.1 s.
        Colored => "colored",
        /// White, rounded to two standard deviations.
        Quantized => "quantized",
        /// White; one sample in thirty is missing, in holes of up to half a second.
        Dropouts => "dropouts",
        /// White, and a smooth function of depth, velocity and yaw rate of half its size: a surrogate's own error.
        SurrogateError => "surrogate_error",
        /// White, and a zero that differs from trial to trial by as much.
        Offsets => "offsets",
    }
}

/// Standard deviation of one sample of a load cell [N, N m]: chosen, 0.5 % of a range of 600 N and 150 N m.
pub(super) const CELL: [f64; 6] = [3.0, 3.0, 4.0, 0.8, 0.8, 0.8];
/// Standard deviation of a place solved from four markers of 0.6 mm [m]; see `recordings::generated::cameras`.
const PLACE: f64 = 0.3e-3;
/// Standard deviation of an attitude solved from them, roll, pitch, yaw [rad].
const ATTITUDE: [f64; 3] = [2.0e-3, 1.5e-3, 1.2e-3];
/// Standard deviation of a wheel's speed [rad/s].
const WHEEL: f64 = 0.05;
/// Time constant of colored noise [s].
const MEMORY: f64 = 0.1;
/// Quantum of a rounded channel in standard deviations.
pub(super) const QUANTUM: f64 = 2.0;
/// Rate at which cameras take pictures, whatever the rate of the trial [Hz].
const CAMERA_RATE: f64 = 111.0;

/// What is recorded of a track, with errors `scale` times as large as stated above. The velocity is differentiated from
/// places by the paper's filter, so that its errors are correlated over nine frames.
pub(super) fn recorded(track: &Track, scale: f64, random: &mut Random) -> Track {
    let mut gaussian = Gaussian::new(random.fork());
    let count = track.states.len();
    let ratio = (CAMERA_RATE * track.step).round().max(1.0) as usize;
    let mut channel = |std: f64| {
        let white: Vec<f64> = (0..count * ratio).map(|_| std * scale * gaussian.draw()).collect();
        let step = track.step / ratio as f64;
        let filter = SavitzkyGolay::new(9, 2);
        let of = |order| filter.as_ref().ok().and_then(|f| f.derivative(&white, order, step).ok());
        let every = |values: Option<Vec<f64>>| -> Vec<f64> {
            values.unwrap_or_else(|| vec![0.0; white.len()]).into_iter().step_by(ratio).collect()
        };
        [every(of(0)), every(of(1))]
    };
    let place = [0; 3].map(|_| channel(PLACE));
    let angle = ATTITUDE.map(&mut channel);
    let mut wheels = Gaussian::new(random.fork());
    let mut recorded = track.clone();
    for (i, state) in recorded.states.iter_mut().enumerate() {
        state.velocity += Vec3::from_fn(|axis, _| place[axis][1][i]);
        state.angular_velocity += Vec3::from_fn(|axis, _| angle[axis][1][i]);
        state.depth -= place[2][0][i];
        (0..3).for_each(|axis| state.attitude[axis] += angle[axis][0][i]);
        state.wheels.iter_mut().for_each(|speed| *speed += WHEEL * scale * wheels.draw());
    }
    recorded
}

/// Errors of the wrench of one trial, before rounding.
pub(super) fn of_wrench(kind: NoiseKind, track: &Track, scale: f64, random: &mut Random) -> Vec<Wrench6> {
    let mut gaussian = Gaussian::new(random.fork());
    let std = Wrench6::from(CELL) * scale;
    let mut next = || Wrench6::from_fn(|_, _| gaussian.draw()).component_mul(&std);
    let offset = next() * if kind == NoiseKind::Offsets { 1.0 } else { 0.0 };
    let kept = if kind == NoiseKind::Colored { (-track.step / MEMORY).exp() } else { 0.0 };
    let fresh = (1.0 - kept * kept).sqrt();
    let mut last = next();
    let noise = track.states.iter().map(|_| {
        last = last * kept + next() * fresh;
        last + offset
    });
    noise.collect()
}

/// Rounds as an analog-to-digital converter does.
pub(super) fn rounded(value: f64, quantum: f64) -> f64 {
    (value / quantum).round() * quantum
}

/// The samples that are left where one in thirty is missing, in holes of up to half a second.
pub(super) fn left_by_dropouts(track: &Track, random: &mut Random) -> Vec<usize> {
    let longest = 0.5 / track.step;
    let mut missing_until = 0;
    let chance = 1.0 / 30.0 / (0.5 * longest);
    let keep = |index: &usize| {
        if *index >= missing_until && *index > 2 && random.unit() < chance {
            missing_until = index + 1 + (random.unit() * longest) as usize;
        }
        *index >= missing_until
    };
    (0..track.states.len()).filter(keep).collect()
}

/// A smooth random function of depth, velocity and yaw rate with a root mean square of about 1: eight waves a component,
/// whose lengths are about the range of a trial schedule.
#[derive(Debug, Clone)]
pub(super) struct SmoothError(Vec<[f64; 6]>);

const WAVES: usize = 8;

impl SmoothError {
    pub fn new(random: &mut Random) -> Self {
        let mut gaussian = Gaussian::new(random.fork());
        let wave = |_| {
            let mut row = [0; 6].map(|_| gaussian.draw());
            row[4] = std::f64::consts::TAU * random.unit();
            row
        };
        Self((0..6 * WAVES).map(wave).collect())
    }

    pub fn at(&self, state: &super::State) -> Wrench6 {
        let scaled =
            [state.depth / 0.1, state.velocity.x / 1.5, state.velocity.y, state.angular_velocity.z / 0.6];
        Wrench6::from_fn(|component, _| {
            let waves = &self.0[component * WAVES..(component + 1) * WAVES];
            let sum: f64 = waves
                .iter()
                .map(|w| {
                    (w[0] * scaled[0] + w[1] * scaled[1] + w[2] * scaled[2] + w[3] * scaled[3] + w[4]).sin()
                })
                .sum();
            sum * (2.0 / WAVES as f64).sqrt()
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::State;
    use crate::track::CHANNEL;

    fn track(count: usize) -> Track {
        let step = 1.0 / 111.0;
        let state = |i| State { t: i as f64 * step, depth: 0.2, ..State::default() };
        Track {
            name: "generated".into(),
            session_time: 0.0,
            channel_width: CHANNEL,
            step,
            states: (0..count).map(state).collect(),
        }
    }

    fn moments(values: &[f64]) -> (f64, f64) {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let square = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / values.len() as f64;
        (mean, square.sqrt())
    }

    fn autocorrelation(values: &[f64], lag: usize) -> f64 {
        let (mean, std) = moments(values);
        let pairs = values.iter().zip(&values[lag..]);
        pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / values.len() as f64 / (std * std)
    }

    #[test]
    fn noise_has_the_size_and_the_memory_that_are_stated() {
        let track = track(40_000);
        for kind in [NoiseKind::White, NoiseKind::Colored] {
            let noise = of_wrench(kind, &track, 0.5, &mut Random::new(7));
            for (component, stated) in CELL.into_iter().enumerate() {
                let values: Vec<f64> = noise.iter().map(|n| n[component]).collect();
                let (mean, std) = moments(&values);
                assert!(mean.abs() < 0.08 * stated && (std / (0.5 * stated) - 1.0).abs() < 0.06, "{kind:?}");
                let expected = if kind == NoiseKind::White { 0.0 } else { (-1.0 / 111.0 / MEMORY).exp() };
                assert!((autocorrelation(&values, 1) - expected).abs() < 0.03);
            }
        }
    }

    #[test]
    fn velocity_is_as_noisy_as_the_filter_leaves_it() {
        // a slope over nine evenly spaced samples has a variance of sigma^2 / (h^2 sum i^2) = sigma^2 / (60 h^2)
        let recorded = recorded(&track(20_000), 1.0, &mut Random::new(3));
        let vx: Vec<f64> = recorded.states.iter().map(|s| s.velocity.x).collect();
        let (mean, std) = moments(&vx);
        let expected = PLACE * 111.0 / 60f64.sqrt();
        assert!(mean.abs() < 0.1 * expected && (std / expected - 1.0).abs() < 0.03, "{std} {expected}");
        // and has none with the sample nine frames later
        assert!(autocorrelation(&vx, 9).abs() < 0.03 && autocorrelation(&vx, 1) > 0.6);
    }

    #[test]
    fn offsets_and_dropouts_are_what_they_are_called() {
        let (long, mut random) = (track(3000), Random::new(11));
        let means: Vec<f64> = (0..200)
            .map(|_| {
                let noise = of_wrench(NoiseKind::Offsets, &track(300), 1.0, &mut random);
                noise.iter().map(|n| n[0]).sum::<f64>() / 300.0
            })
            .collect();
        assert!((moments(&means).1 / CELL[0] - 1.0).abs() < 0.15);
        let left: usize = (0..50).map(|_| left_by_dropouts(&long, &mut random).len()).sum();
        let share = 1.0 - left as f64 / (50.0 * 3000.0);
        assert!((0.02..0.05).contains(&share), "{share}");
        assert!((rounded(3.3, 2.0) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn a_surrogate_s_error_is_smooth_and_of_size_one() {
        let mut random = Random::new(5);
        let at = |error: &SmoothError, speed: f64, depth: f64| {
            error.at(&State { depth, velocity: Vec3::new(speed, 0.0, 0.0), ..State::default() })[0]
        };
        let values: Vec<f64> = (0..300)
            .map(|i| at(&SmoothError::new(&mut random), 0.01 * f64::from(i), 0.001 * f64::from(i)))
            .collect();
        assert!((moments(&values).1 - 1.0).abs() < 0.15);
        let error = SmoothError::new(&mut random);
        assert!((at(&error, 1.0, 0.2) - at(&error, 1.01, 0.2)).abs() < 0.1);
    }
}
