//! The commands of the drive: accelerate, cruise, brake and coast; straight, in turns and in slaloms.

use serde::Serialize;

use super::super::profile::Profile;
use super::super::simulator::DRAG;
use super::super::track::DENSITY;
use super::{hull, yaw_inertia};
use wade_learn::random::Random;

/// Depths of the trials [m]: the paper's.
const DEPTHS: [f64; 3] = [0.1016, 0.2032, 0.254];
/// Depth of trials on dry ground [m].
const DRY: f64 = -0.5;
/// Time over which the drive changes its force [s].
const RAMP: f64 = 0.3;
/// Time from the start of a change of the yaw rate to its end [s].
const KICK: f64 = 0.5;

/// One way of driving.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Maneuver {
    /// Accelerate, cruise, brake, coast, accelerate.
    Straight,
    /// The same backward.
    Backward,
    /// Accelerate and coast.
    Coast,
    /// Accelerate, and one long turn.
    Turn,
    /// Turns one way and the other.
    Slalom,
    /// Released at a speed, without drive.
    Released,
}

wade_core::named_enum! {
    /// Trials of one case.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Plan {
        /// All ways of driving at all depths, with random headings.
        Rich => "rich",
        /// Straight ahead at one depth, with one heading.
        OneDepth => "one_depth",
        /// Straight, backward and coasting, each with a dry twin.
        DryTwins => "dry_twins",
        /// No drive: released at a speed, each with a dry twin; wheel speeds, but no drive force.
        Wheels => "wheels",
    }
}

impl Plan {
    fn maneuvers(self) -> &'static [(Maneuver, usize)] {
        use Maneuver::*;
        match self {
            Self::Rich => &[(Straight, 5), (Backward, 2), (Coast, 3), (Turn, 3), (Slalom, 3)],
            Self::OneDepth => &[(Straight, 9)],
            Self::DryTwins => &[(Straight, 6), (Backward, 2), (Coast, 3)],
            Self::Wheels => &[(Released, 9)],
        }
    }

    /// True where each trial in water has a dry twin.
    pub(super) fn has_twins(self) -> bool {
        matches!(self, Self::DryTwins | Self::Wheels)
    }

    /// True where no drive force is recorded.
    pub(super) fn is_without_drive(self) -> bool {
        self == Self::Wheels
    }
}

/// The commands of one trial.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Command {
    /// Name of the trial, which says that it is generated.
    pub name: String,
    /// Force along x [N] and moment about z [N m] of the wheels: the sum of the sides, and their difference by half the
    /// track.
    pub drive: [Profile; 2],
    /// [m]
    pub depth: f64,
    /// Yaw at the start [rad].
    pub heading: f64,
    /// Surge velocity at the start [m/s].
    pub speed: f64,
    /// [s]
    pub duration: f64,
}

impl Command {
    /// Force [N] and moment [N m] at an instant.
    pub fn drive_at(&self, t: f64) -> [f64; 2] {
        [self.drive[0].at(t)[0], self.drive[1].at(t)[0]]
    }

    /// The same without water.
    pub fn dry(&self) -> Self {
        Self { name: format!("{}-dry", self.name), depth: DRY, ..self.clone() }
    }

    /// The mirror image.
    #[cfg(test)]
    pub fn mirrored(&self) -> Self {
        let [force, moment] = self.drive.clone();
        Self { drive: [force, moment.scaled(-1.0)], heading: -self.heading, ..self.clone() }
    }
}

/// Commands of the trials in water.
pub(super) fn commands(plan: Plan, random: &mut Random) -> Vec<Command> {
    let mut commands = Vec::new();
    for &(maneuver, count) in plan.maneuvers() {
        for index in 0..count {
            let depth = DEPTHS[if plan == Plan::OneDepth { 1 } else { index % 3 }];
            let mut command = command(maneuver, depth, index, random);
            if plan == Plan::OneDepth {
                command.heading = 0.0;
            }
            command.name =
                format!("generated-{:02}-{}", commands.len() + 1, format!("{maneuver:?}").to_lowercase());
            commands.push(command);
        }
    }
    commands
}

/// One trial of a way of driving at a depth [m]; `index` chooses its side.
fn command(maneuver: Maneuver, depth: f64, index: usize, random: &mut Random) -> Command {
    let mut between = |low: f64, high: f64| low + (high - low) * random.unit();
    let side = if index.is_multiple_of(2) { 1.0 } else { -1.0 };
    let hull = hull();
    let heading = between(-3.0, 3.0);
    let speed = between(0.8, 1.5);
    let rise = between(1.2, 2.2);
    let brake = -hull.mass * speed * between(0.25, 0.4);
    let turning = side * between(0.25, 0.5);
    let released = between(1.0, 1.9);
    let drag = |speed: f64| 0.5 * DENSITY * DRAG[0] * hull.width * depth * speed * speed;
    let (push, hold) = (hull.mass * speed / rise + 0.5 * drag(speed), drag(speed));
    // from one force to the next, each change over the ramp
    let forces = |levels: &[(f64, f64)]| {
        let mut last = 0.0;
        levels.iter().fold(Profile::default(), |profile, &(start, level)| {
            let change = level - last;
            last = level;
            profile.step(start, RAMP, change)
        })
    };
    let driven = |again: f64| {
        forces(&[
            (0.5, push),
            (0.5 + rise, hold),
            (4.0, brake),
            (5.0, 0.0),
            (6.5, again * push),
            (6.5 + 0.8 * rise, again * hold),
            (9.2, 0.5 * brake),
        ])
    };
    let kick = |profile: Profile, start: f64, rate: f64| {
        let moment = yaw_inertia(&hull) * rate / (0.5 * KICK);
        profile.step(start, 0.5 * KICK, moment).step(start + 0.5 * KICK, 0.5 * KICK, -moment)
    };
    let (force, moment) = match maneuver {
        Maneuver::Straight => (driven(0.9), Profile::default()),
        Maneuver::Backward => (driven(0.9).scaled(-1.0), Profile::default()),
        Maneuver::Coast => (forces(&[(0.5, push), (0.5 + rise, 0.0)]), Profile::default()),
        Maneuver::Turn => (driven(1.0), kick(kick(Profile::default(), 2.0, turning), 7.5, -turning)),
        Maneuver::Slalom => {
            let rate = 1.2 * turning;
            let turns = [(1.5, rate), (3.0, -2.0 * rate), (4.5, 2.0 * rate), (6.0, -2.0 * rate), (7.5, rate)];
            (driven(1.1), turns.into_iter().fold(Profile::default(), |profile, (t, by)| kick(profile, t, by)))
        }
        Maneuver::Released => (Profile::default(), Profile::default()),
    };
    let speed = if maneuver == Maneuver::Released { released } else { 0.0 };
    let duration = if maneuver == Maneuver::Released { 6.0 } else { 10.0 };
    Command { name: String::new(), drive: [force, moment], depth, heading, speed, duration }
}
