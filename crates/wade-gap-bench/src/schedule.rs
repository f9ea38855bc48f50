//! Which trials are run: the paper's, and others that excite what straight runs do not.

use super::profile::Profile;
use super::track::{Motion, Track, of_run};
use wade_core::vehicle::Vehicle;
use wade_learn::random::Random;
use wade_learn::recordings::generated::{self, Run};

/// One way of moving.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Maneuver {
    /// Repeated changes of speed, forward.
    Steps,
    /// Forward, a stop, and backward.
    Reverse,
    /// A turn one way and the other at speed.
    Turn,
    /// Crabwise oscillation at rest.
    Sway,
    /// The changes of speed of `Steps` at one depth.
    StepsOneDepth,
    /// Turning on the spot.
    Spin,
    /// Standing still, headed anywhere.
    Parked,
    /// Wheels that spin faster than they roll, standing and driving.
    Slip,
    /// Lowered into the water and moved up and down.
    Heave,
    /// Roll and pitch.
    Rock,
    /// Straight, headed anywhere.
    Heading,
    /// A steady speed, the same in every trial, headed one way, at one depth.
    OneSpeed,
    /// Steady speeds, headed one way, at one depth.
    Steady,
    /// The changes of speed of `Steps` on dry ground.
    Dry,
    /// Steady speeds, headed one way, so shallow that the wheels carry much of the weight.
    Shallow,
    /// Steady speeds, headed one way, in a basin so wide that its walls do nothing.
    Basin,
    /// Standing on dry ground with known weights hung on the sensor, one direction after the other.
    Weights,
}

/// Trials of one experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// True where the paper's schedule is part of it.
    pub paper: bool,
    /// Ways of moving, each with its number of trials.
    pub maneuvers: &'static [(Maneuver, usize)],
}

impl Plan {
    /// The paper's schedule and all that excites the library.
    pub const RICH: Self = {
        use Maneuver::*;
        let maneuvers = &[
            (Steps, 2),
            (Reverse, 2),
            (Turn, 2),
            (Sway, 1),
            (Spin, 1),
            (Parked, 2),
            (Slip, 2),
            (Heave, 2),
            (Rock, 1),
            (Heading, 3),
        ];
        Self { paper: true, maneuvers }
    };

    /// Sixty-five trials of the other kinds, for timing.
    pub const SIXTY_FIVE: Self = {
        use Maneuver::*;
        let maneuvers = &[
            (Steps, 13),
            (Reverse, 8),
            (Turn, 10),
            (Sway, 4),
            (Spin, 4),
            (Parked, 4),
            (Slip, 5),
            (Heave, 6),
            (Rock, 3),
            (Heading, 8),
        ];
        Self { paper: false, maneuvers }
    };

    /// Only some ways of moving.
    pub const fn only(maneuvers: &'static [(Maneuver, usize)]) -> Self {
        Self { paper: false, maneuvers }
    }
}

/// The paper's runs, planned once, and how finely all trials are sampled.
#[derive(Debug, Clone)]
pub struct Schedule {
    runs: Vec<(String, Run)>,
    /// Samples a second [Hz].
    pub rate: f64,
    /// Length of the trials that are not the paper's [s].
    pub duration: f64,
}

/// Depths of the other trials [m]: the paper's.
const DEPTHS: [f64; 3] = [0.1016, 0.2032, 0.254];
/// Depth of trials on dry ground [m].
const DRY: f64 = -0.5;
/// Least of the known weights [N]: 10 kg.
const WEIGHT: f64 = 98.1;
/// Width of a basin [m].
const BASIN: f64 = 30.0;
/// Time between the ends and beginnings of trials of a session [s].
const PAUSE: f64 = 60.0;

impl Schedule {
    /// All 71 trials of the paper for a vehicle at its rate of 111 Hz, the others 9 s long.
    pub fn full(vehicle: &Vehicle, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let run = |planned: generated::Planned| {
            let run = Run::new(&planned, vehicle, &mut random.fork());
            (planned.name, run)
        };
        let runs = generated::schedule().into_iter().map(run).collect();
        Self { runs, rate: 111.0, duration: 9.0 }
    }

    /// Every sixth of the paper's trials at 37 Hz, the others 7 s long: for tests.
    pub fn slice(vehicle: &Vehicle, seed: u64) -> Self {
        let full = Self::full(vehicle, seed);
        Self { runs: full.runs.into_iter().step_by(6).collect(), rate: 37.0, duration: 7.0 }
    }

    /// The same with 1,000 samples in each trial that is not the paper's.
    pub(super) fn of_thousand_samples(&self) -> Self {
        Self { rate: 111.0, duration: 9.0, ..self.clone() }
    }

    /// The motions of a plan in the order of a session, random within each way of moving.
    pub(super) fn tracks(&self, plan: &Plan, wheel_radius: f64, random: &mut Random) -> Vec<Track> {
        let paper = self.runs.iter().filter(|_| plan.paper);
        let paper =
            paper.map(|(name, run)| of_run(&name["generated-".len()..], run, self.rate, wheel_radius));
        let mut tracks: Vec<Track> = paper.collect();
        for &(maneuver, count) in plan.maneuvers {
            for index in 0..count {
                let motion = motion(maneuver, index, self.duration, random);
                let name = format!("{maneuver:?}").to_lowercase();
                let mut track = motion.track(name, self.duration, self.rate, wheel_radius);
                if maneuver == Maneuver::Basin {
                    track.channel_width = BASIN;
                }
                tracks.push(track);
            }
        }
        random.shuffle(&mut tracks);
        let mut session_time = 0.0;
        for (index, track) in tracks.iter_mut().enumerate() {
            track.name = format!("generated-{:03}-{}", index + 1, track.name);
            track.session_time = session_time;
            session_time += track.states.len() as f64 * track.step + PAUSE;
        }
        tracks
    }
}

/// One trial of a way of moving; `index` tells it from the others of its kind.
fn motion(maneuver: Maneuver, index: usize, duration: f64, random: &mut Random) -> Motion {
    let mut between = |low: f64, high: f64| low + (high - low) * random.unit();
    let depth = DEPTHS[index % 3];
    let part = duration / 7.0;
    let still = Motion { depth, ..Motion::default() };
    let (speed, side) = (between(0.8, 1.8), if index.is_multiple_of(2) { 1.0 } else { -1.0 });
    match maneuver {
        Maneuver::Steps | Maneuver::StepsOneDepth | Maneuver::Dry => {
            let (first, second) = (between(0.6, 1.2), between(0.5, 0.9));
            let surge = Profile::default()
                .step(0.5 * part, 0.8, first)
                .step(2.0 * part, 0.6, second)
                .step(3.5 * part, 0.7, -first)
                .step(5.0 * part, 0.5, first)
                .step(6.2 * part, 0.6, -second);
            let depth = match maneuver {
                Maneuver::Dry => DRY,
                Maneuver::StepsOneDepth => DEPTHS[1],
                _ => depth,
            };
            Motion { surge, depth, ..still }
        }
        Maneuver::Reverse => {
            let back = between(0.6, 1.4);
            let surge = Profile::default()
                .step(0.4 * part, 0.9, speed)
                .step(2.5 * part, 0.8, -speed)
                .step(3.7 * part, 0.9, -back)
                .step(5.8 * part, 0.7, back);
            Motion { surge, ..still }
        }
        Maneuver::Turn => {
            let rate = side * between(0.35, 0.7);
            // one way for half the trial, then the other
            let yaw = Profile::default().step(part, 2.5 * part, 2.5 * part * rate).step(
                4.0 * part,
                2.5 * part,
                -2.5 * part * rate,
            );
            Motion { surge: Profile::default().step(0.1, 0.8, speed), yaw, ..still }
        }
        Maneuver::Sway => {
            let (amplitude, rate) = (between(0.25, 0.5), between(1.2, 2.5));
            Motion { sway: Profile::default().wave(amplitude, rate), ..still }
        }
        Maneuver::Spin => {
            let (amplitude, rate) = (between(0.3, 0.6), between(1.0, 2.0));
            Motion { yaw: Profile::default().wave(amplitude, rate), ..still }
        }
        Maneuver::Parked => Motion { yaw: Profile::constant(between(-3.0, 3.0)), ..still },
        Maneuver::Slip => {
            let slip = Profile::default().step(part, 0.6, between(6.0, 14.0)).step(
                4.0 * part,
                0.8,
                -between(3.0, 6.0),
            );
            let surge = Profile::default().step(2.5 * part, 0.9, 0.6 * speed * ((index % 2) as f64));
            Motion { slip, surge, ..still }
        }
        Maneuver::Heave => {
            let lowered = depth + 0.12;
            let heave = Profile::constant(lowered)
                .step(0.8 * part, between(0.4, 0.8), -lowered)
                .step(3.0 * part, 0.9, 0.08)
                .step(4.2 * part, 0.8, -0.06)
                .step(5.5 * part, 0.7, lowered);
            Motion { heave, ..still }
        }
        Maneuver::Rock => {
            let (roll, pitch) = (between(0.04, 0.09), between(0.03, 0.07));
            let (roll_rate, pitch_rate) = (between(1.5, 3.0), between(1.5, 3.0));
            let roll = Profile::default().wave(roll, roll_rate);
            Motion { roll, pitch: Profile::default().wave(pitch, pitch_rate), ..still }
        }
        Maneuver::Heading => {
            let yaw = Profile::constant(between(-3.1, 3.1));
            let surge = Profile::default().step(0.3, 1.0, speed).step(5.5 * part, 0.9, -speed);
            Motion { yaw, surge, ..still }
        }
        Maneuver::OneSpeed => {
            let surge = Profile::constant(1.2);
            Motion { surge, depth: DEPTHS[1], ..Motion::default() }
        }
        Maneuver::Steady | Maneuver::Shallow | Maneuver::Basin => {
            let surge = Profile::constant(0.4 + 0.25 * (index % 7) as f64);
            let depth = DEPTHS[if maneuver == Maneuver::Shallow { 0 } else { 1 }];
            Motion { surge, depth, ..Motion::default() }
        }
        Maneuver::Weights => {
            let start = |axis: usize| (0.5 + 2.1 * axis as f64) * part;
            let hung = [0, 1, 2].map(|axis| {
                let weight = if axis == 2 { -1.0 } else { side } * (1 + index) as f64 * WEIGHT;
                Profile::default().step(start(axis), 0.3 * part, weight).step(
                    start(axis) + 1.5 * part,
                    0.3 * part,
                    -weight,
                )
            });
            Motion { hung, depth: DRY, ..Motion::default() }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use wade_core::vehicle::shipped;

    #[test]
    fn all_of_the_paper_s_trials_and_the_others_are_there_and_move_as_they_say() {
        let vehicle = shipped::warthog().unwrap().vehicle().unwrap();
        let schedule = Schedule::full(&vehicle, 1);
        // a vehicle is over a bend of the ground in a fifth of a second, and its jerk jumps at both ends
        let fine = Schedule { rate: 240.0, ..schedule };
        let tracks = fine.tracks(&Plan::RICH, 0.3, &mut Random::new(2));
        assert_eq!(tracks.len(), 71 + 18);
        assert!(tracks.iter().all(|track| track.name.starts_with("generated-")));
        let fastest = tracks.iter().flat_map(|t| &t.states).map(|s| s.velocity.norm()).fold(0.0, f64::max);
        assert!((3.5..5.1).contains(&fastest), "{fastest}");
        for track in &tracks {
            let h = track.step;
            for window in track.states.windows(3) {
                let difference = (window[2].velocity - window[0].velocity) / (2.0 * h);
                let exact = window[1].acceleration - window[1].angular_velocity.cross(&window[1].velocity);
                assert!((difference - exact).norm() < 0.4, "{}: {difference} {exact}", track.name);
                let turned = (window[2].attitude[1] - window[0].attitude[1]) / (2.0 * h);
                assert!((turned - window[1].angular_velocity.y).abs() < 0.05, "{}", track.name);
            }
        }
    }
}
