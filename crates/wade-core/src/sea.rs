//! How water moves that is neither still nor in uniform flow: a regular wave, a surface that was sampled at the wheels, a current
//! with a profile over the depth.
//!
//! The wave is Airy's, in water of finite depth `h` (Newman, Marine Hydrodynamics, section 6.3): with `theta = phase + k . r`
//!
//! `eta = a cos(theta)`, `w^2 = g k tanh(k h)`, `p = -rho g z + rho g eta cosh(k (z + h)) / cosh(k h)`,
//! `u = a w cosh(k (z + h)) / sinh(k h) cos(theta)` along `k`, `w_z = a w sinh(k (z + h)) / sinh(k h) sin(theta)`
//!
//! at the height `z` over still water. Above still water the pressure is that of the surface over it, and velocities are those at
//! `z = 0`.
//!
//! The profile of a current of the mean `U` is a power of the height `s h` over the bed, `U (1 + n) s^n`: open channels have an
//! `n` of 1/7 to 1/6 (Chow, Open-Channel Hydraulics, 1959, section 8-3).

use nalgebra::{Matrix2, Vector2};

use crate::condition::Condition;
use crate::frame::{GRAVITY, Vec3};
use crate::vehicle::{MAX_SURFACES, PerWheel};

/// Least depth of the water under the wave [m]: below it there is nothing to wade in.
const LEAST_DEPTH: f64 = 1e-3;
/// Product of the variances of the wheels' places along and across a line, over the square of their sum, below which they lie on
/// it [-].
const ON_A_LINE: f64 = 1e-6;

/// A regular wave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    /// Wave number along the direction in which the wave travels, body frame [rad/m]; its part along up is left out.
    pub vector: Vec3,
    /// Half the height from trough to crest [m].
    pub amplitude: f64,
    /// `k . x - w t` at the body origin [rad]: a crest at 0, and after it the water falls.
    pub phase: f64,
}

/// What the water does beside lying still or flowing evenly.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sea {
    /// A wave about the level of the state.
    pub wave: Option<Wave>,
    /// Height of the water surface above the body origin along up at each wheel [m]; the level of the state is then that at the
    /// body origin.
    pub wheel_levels: Option<PerWheel<f64>>,
    /// Exponent of the profile of the current [-]; 0 of one that is even.
    pub current_exponent: f64,
}

/// Where a hull is in the water, along up from its lowest wet point to its highest.
#[derive(Debug, Clone, Copy)]
pub struct Draft {
    /// The middle of the hull [m].
    pub center: Vec3,
    /// Half its length, width and height [m].
    pub half: Vec3,
    /// Lowest point over still water [m].
    pub low: f64,
    /// Highest wet point over still water [m].
    pub high: f64,
    /// Depth of the water [m].
    pub water: f64,
}

/// The sea about a hull in a state; body frame.
#[derive(Debug, Clone, Copy)]
pub struct Waters {
    up: Vec3,
    /// Height of still water over the body origin [m].
    level: f64,
    depth: f64,
    /// Height of the plane that stands for the surface over the body origin [m], and its slope.
    plane: (f64, Vec3),
    wave: Option<Train>,
    /// How much higher the water stands at a surface than the plane [m].
    rises: Option<[f64; MAX_SURFACES]>,
    /// Mean current, its exponent, and the share of it that the state already has.
    current: Option<(Vec3, f64, f64)>,
    /// Velocity of the wave that the state already has [m/s].
    orbit: Vec3,
    /// Acceleration of the water about the hull [m/s2].
    pub acceleration: Vec3,
    /// Pressure of water at rest under the plane, over that with the plane's slope left out [-].
    pub steepness: f64,
}

/// Water at a point.
#[derive(Debug, Clone, Copy)]
pub struct Water {
    /// Its velocity, less the one that the state has [m/s].
    pub velocity: Vec3,
    /// Heads of its pressure [m]: under the plane, and of this sea.
    pub heads: [f64; 2],
}

/// A wave in water of a depth.
#[derive(Debug, Clone, Copy)]
struct Train {
    vector: Vec3,
    number: f64,
    frequency: f64,
    amplitude: f64,
    phase: f64,
    /// `1 - exp(-2 k h)`
    narrow: f64,
}

impl Wave {
    /// Angular frequency in water of this depth [rad/s], `w^2 = g k tanh(k h)`.
    pub fn frequency(number: f64, depth: f64) -> f64 {
        (GRAVITY * number * (number * depth).tanh()).sqrt()
    }
}

impl Train {
    /// `cosh(k (z + h)) / cosh(k h)`, and cosh and sinh of `k (z + h)` over `sinh(k h)`; finite for any length and depth.
    fn decay(&self, z: f64, depth: f64) -> [f64; 3] {
        let k = self.number;
        let z = z.clamp(-depth, 0.0);
        let (down, mirrored) = ((k * z).exp(), (-2.0 * k * (z + depth)).exp_m1());
        let [sum, difference] = [down * (2.0 + mirrored), -down * mirrored];
        [sum / (2.0 - self.narrow), sum / self.narrow, difference / self.narrow]
    }

    fn angle(&self, point: &Vec3) -> f64 {
        self.phase + self.vector.dot(point)
    }

    /// Share of the pressure at a height that is left [-], and the horizontal and vertical size of the velocity there [m/s], without
    /// the phase.
    fn sizes(&self, z: f64, depth: f64) -> (f64, [f64; 2]) {
        let [pressure, level, upright] = self.decay(z, depth);
        (pressure, [level, upright].map(|share| self.amplitude * self.frequency * share))
    }

    /// Velocity of the water [m/s].
    fn velocity(&self, up: &Vec3, (sine, cosine): (f64, f64), [level, upright]: [f64; 2]) -> Vec3 {
        self.vector * (level * cosine / self.number) + up * (upright * sine)
    }

    /// And its acceleration [m/s2].
    fn acceleration(&self, up: &Vec3, (sine, cosine): (f64, f64), [level, upright]: [f64; 2]) -> Vec3 {
        (self.vector * (level * sine / self.number) - up * (upright * cosine)) * self.frequency
    }
}

impl Sea {
    /// True where the water lies still or flows evenly.
    pub fn is_calm(&self) -> bool {
        *self == Self::default()
    }

    /// The state of a hull in the plane and the flow that stand for this sea about it, and what the sea is beside them. `wheels`
    /// are the places of the wheels with their surfaces; `condition` has a water level.
    pub fn about(
        &self,
        condition: &Condition,
        draft: &Draft,
        wheels: &[(usize, Vec3)],
    ) -> (Condition, Waters) {
        let up = condition.up.into_inner();
        let level = condition.water_level.unwrap_or(0.0);
        let depth = draft.water.max(LEAST_DEPTH);
        let wave = self.wave.and_then(|wave| {
            let vector = wave.vector - up * up.dot(&wave.vector);
            let number = vector.norm();
            let frequency = Wave::frequency(number, depth);
            // one without length, and one that is flat, is no wave
            (number > 0.0 && wave.amplitude != 0.0).then_some(Train {
                vector,
                number,
                frequency,
                amplitude: wave.amplitude,
                phase: wave.phase,
                narrow: -(-2.0 * number * depth).exp_m1(),
            })
        });
        let mut rises = None;
        let plane = match (&wave, &self.wheel_levels) {
            (Some(train), _) => {
                let (sine, cosine) = train.phase.sin_cos();
                (level + train.amplitude * cosine, train.vector * (-train.amplitude * sine))
            }
            (None, Some(levels)) => {
                let samples = wheels.iter().zip(levels.iter());
                let plane = fitted(&up, level, samples.clone().map(|((_, at), height)| (*at, *height)));
                let mut rise = [0.0; MAX_SURFACES];
                for ((surface, at), height) in samples {
                    rise[*surface] = height - (plane.0 + plane.1.dot(at));
                }
                rises = Some(rise);
                plane
            }
            (None, None) => (level, Vec3::zeros()),
        };
        let (orbit, acceleration) = wave.map_or_else(Default::default, |train| {
            // sections answer to the water at their mean depth along the hull, and at their lowest point up and down
            // (Salvesen, Tuck, Faltinsen 1970); the hull to the mean over its sections
            let along =
                train.vector.component_mul(&draft.half).map(|x| if x == 0.0 { 1.0 } else { x.sin() / x });
            let mean = along.product();
            let (_, [middle, _]) = train.sizes(0.5 * (draft.low + draft.high), depth);
            let (_, [_, lowest]) = train.sizes(draft.low, depth);
            let angle = train.angle(&draft.center).sin_cos();
            let speeds = [mean * middle, mean * lowest];
            (train.velocity(&up, angle, speeds), train.acceleration(&up, angle, speeds))
        });
        let current = (self.current_exponent > 0.0).then(|| {
            let current = condition.ground_velocity - condition.velocity;
            let n = self.current_exponent;
            let [low, high] = [draft.low, draft.high].map(|z| (1.0 + z / depth).clamp(0.0, 1.0));
            // the mean over the draft
            let share = match high - low {
                draft if draft > 1e-6 => (high.powf(n + 1.0) - low.powf(n + 1.0)) / draft,
                _ => (1.0 + n) * high.powf(n),
            };
            (current, n, share)
        });
        let flow = current.map_or_else(Vec3::zeros, |(mean, _, share)| mean * (share - 1.0));
        let (height, slope) = plane;
        let steepness = (1.0 + slope.norm_squared()).sqrt();
        let state = Condition {
            velocity: condition.velocity - flow - orbit,
            up: nalgebra::UnitVector3::new_normalize(up - slope),
            water_level: Some(height / steepness),
            ..*condition
        };
        (state, Waters { up, level, depth, plane, wave, rises, current, orbit, acceleration, steepness })
    }
}

impl Waters {
    /// Height of still water over the body origin [m].
    pub fn level(&self) -> f64 {
        self.level
    }

    /// Whether the pressure differs from that under the plane anywhere.
    pub fn has_heads(&self) -> bool {
        self.wave.is_some() || self.rises.is_some()
    }

    /// Water at a point of a surface.
    pub fn at(&self, surface: usize, point: &Vec3) -> Water {
        let height = self.up.dot(point);
        let z = height - self.level;
        let under = self.plane.0 + self.plane.1.dot(point) - height;
        let mut water = Water { velocity: Vec3::zeros(), heads: [under; 2] };
        if let Some(train) = &self.wave {
            let angle = train.angle(point).sin_cos();
            let (pressure, speeds) = train.sizes(z, self.depth);
            water.heads[1] = train.amplitude * angle.1 * pressure - z;
            water.velocity += train.velocity(&self.up, angle, speeds) - self.orbit;
        }
        if let Some(rises) = &self.rises {
            water.heads[1] += rises[surface];
        }
        if let Some((mean, n, share)) = &self.current {
            let s = (1.0 + z / self.depth).clamp(0.0, 1.0);
            water.velocity += mean * ((1.0 + n) * s.powf(*n) - share);
        }
        water
    }
}

/// The plane next to the samples by least squares: its height over the body origin, where it was sampled too, and its slope, which
/// is level in directions in which nothing was sampled.
fn fitted(up: &Vec3, level: f64, samples: impl Iterator<Item = (Vec3, f64)> + Clone) -> (f64, Vec3) {
    let ahead =
        (Vec3::x() - up * up.x).try_normalize(0.1).unwrap_or_else(|| up.cross(&Vec3::y()).normalize());
    let left = up.cross(&ahead);
    let flat = samples.map(|(at, height)| (Vector2::new(ahead.dot(&at), left.dot(&at)), height));
    let all = std::iter::once((Vector2::zeros(), level)).chain(flat);
    let (mut count, mut place, mut mean) = (0.0, Vector2::zeros(), 0.0);
    for (at, height) in all.clone() {
        (count, place, mean) = (count + 1.0, place + at, mean + height);
    }
    (place, mean) = (place / count, mean / count);
    let (mut spread, mut tilt) = (Matrix2::zeros(), Vector2::zeros());
    for (at, height) in all {
        let from = at - place;
        spread += from * from.transpose();
        tilt += from * (height - mean);
    }
    let wide = spread.trace();
    let slope = match spread.try_inverse() {
        Some(inverse) if spread.determinant() > ON_A_LINE * wide * wide => inverse * tilt,
        // places on a line know the slope along it
        _ if wide > 0.0 => tilt / wide,
        _ => Vector2::zeros(),
    };
    (mean - slope.dot(&place), ahead * slope.x + left * slope.y)
}
