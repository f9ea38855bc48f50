//! The states that a soak asks about.

use std::{
    f32::consts::{FRAC_PI_2, TAU},
    io::Read,
};

use super::trace::{Trace, TraceError};
use wade_wire::State;

/// The range of states that a vehicle's model was trained on, each as lowest and highest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    /// Speed through the water [m/s].
    pub speed: [f32; 2],
    /// Direction of motion from the lateral axis [rad]; pi/2 is head-on.
    pub angle: [f32; 2],
    /// Water depth [m].
    pub depth: [f32; 2],
    /// Fluid density [kg/m3].
    pub density: [f32; 2],
}

/// Periods of the sweeps over speed, angle, depth and density [s]: no small ratios, so that a soak of minutes
/// does not repeat a combination.
const PERIODS: [f32; 4] = [7.3, 11.9, 17.1, 29.3];

/// States of one request follow each other by this on the sweeps [s].
const BATCH_STEP: f64 = 0.1;

/// Where the states come from.
#[derive(Debug, Clone)]
pub struct Input(Source);

#[derive(Debug, Clone)]
enum Source {
    Constant(State),
    Varying(Domain),
    Trace(Trace),
}

impl Input {
    /// Always the same state: half the highest speed, as near to head-on as the domain has, at the greatest
    /// depth, where the most surfaces are wet and the answer costs most.
    pub fn constant(domain: &Domain) -> Self {
        let [low, high] = domain.speed;
        let angle = FRAC_PI_2.clamp(domain.angle[0], domain.angle[1]);
        let density = 1000_f32.clamp(domain.density[0], domain.density[1]);
        Self(Source::Constant(state((high / 2.0).max(low), angle, domain.depth[1], density)))
    }

    /// Smooth sweeps over the whole domain, the same in every run.
    pub fn varying(domain: &Domain) -> Self {
        Self(Source::Varying(*domain))
    }

    /// A recorded trace with the columns of a trial, played at its own pace and from the start again at its end.
    pub fn from_csv(reader: impl Read) -> Result<Self, TraceError> {
        Trace::read(reader).map(|trace| Self(Source::Trace(trace)))
    }

    /// Columns of the trace that no trial has; they were ignored.
    pub fn unknown_columns(&self) -> &[String] {
        match &self.0 {
            Source::Trace(trace) => &trace.unknown_columns,
            _ => &[],
        }
    }

    /// What it is, for the report.
    pub fn name(&self) -> &'static str {
        match self.0 {
            Source::Constant(_) => "constant",
            Source::Varying(_) => "varying",
            Source::Trace(_) => "recorded",
        }
    }

    /// Fills a request that is due `at` seconds after the start. Allocates nothing.
    pub(super) fn fill(&self, at: f64, states: &mut [State]) {
        match &self.0 {
            Source::Constant(state) => states.fill(*state),
            Source::Varying(domain) => {
                for (index, slot) in states.iter_mut().enumerate() {
                    *slot = sweep(domain, at + index as f64 * BATCH_STEP);
                }
            }
            Source::Trace(trace) => {
                for (index, slot) in states.iter_mut().enumerate() {
                    *slot = trace.at(at + index as f64 * BATCH_STEP);
                }
            }
        }
    }
}

fn state(speed: f32, angle: f32, depth: f32, density: f32) -> State {
    let velocity = [speed * angle.sin(), speed * angle.cos(), 0.0];
    State { velocity, depth, density, ..State::default() }
}

fn sweep(domain: &Domain, at: f64) -> State {
    let ranges = [domain.speed, domain.angle, domain.depth, domain.density];
    let [speed, angle, depth, density] = std::array::from_fn(|i| {
        let [low, high] = ranges[i];
        let turn = (at / f64::from(PERIODS[i])).fract() as f32 * TAU;
        (low + (high - low) * (0.5 - 0.5 * turn.cos())).clamp(low, high)
    });
    state(speed, angle, depth, density)
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOMAIN: Domain = Domain {
        speed: [0.0, 2.0],
        angle: [-FRAC_PI_2, FRAC_PI_2],
        depth: [0.1, 0.5],
        density: [990.0, 1030.0],
    };

    fn at(input: &Input, at: f64) -> State {
        let mut states = [State::default()];
        input.fill(at, &mut states);
        states[0]
    }

    #[test]
    fn the_constant_state_is_head_on_and_deep() {
        let state = at(&Input::constant(&DOMAIN), 12.3);
        assert!((state.velocity[0] - 1.0).abs() < 1e-6 && state.velocity[1].abs() < 1e-6);
        assert_eq!((state.depth, state.density), (0.5, 1000.0));
    }

    #[test]
    fn sweeps_stay_inside_reach_both_ends_and_are_smooth() {
        let input = Input::varying(&DOMAIN);
        let states: Vec<_> = (0..60_000).map(|ms| at(&input, f64::from(ms) * 1e-3)).collect();
        let depths = states.iter().map(|s| s.depth);
        assert!(depths.clone().fold(f32::MAX, f32::min) < 0.101 && depths.fold(0.0, f32::max) > 0.499);
        for pair in states.windows(2) {
            let speed = pair[1].velocity[0].hypot(pair[1].velocity[1]);
            assert!(speed <= 2.0001 && DOMAIN.depth[0] <= pair[1].depth && pair[1].depth <= DOMAIN.depth[1]);
            assert!((pair[1].depth - pair[0].depth).abs() < 1e-3);
            assert!((pair[1].velocity[0] - pair[0].velocity[0]).abs() < 5e-3);
        }
    }

    #[test]
    fn sweeps_repeat_exactly_from_run_to_run_and_differ_within_a_batch() {
        let (mut first, mut second) = ([State::default(); 4], [State::default(); 4]);
        Input::varying(&DOMAIN).fill(77.7, &mut first);
        Input::varying(&DOMAIN).fill(77.7, &mut second);
        assert_eq!(first, second);
        assert_ne!(first[0], first[3]);
    }
}
