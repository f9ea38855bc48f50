//! Effects in the request path: the loads of a file's effects in one state, by the functions that they were fitted with.
//!
//! The surfaces of an answer keep the model's own loads. An effect's whole load about the center of mass stands beside them,
//! so that surfaces and effects sum to the net wrench; what an effect puts on single surfaces is told as well.

use nalgebra::Matrix6;

use super::body::Body;
use super::file::EffectsFile;
use super::immersion::Immersion;
use super::input::{BaseDrag, Elsewhere, Input, Memory, Part};
use super::library::{Effect, MAX_COEFFICIENTS, MEMORIES, PHYSICS, Shape};
use super::region::EffectRegion;
use super::spec::Quantity;
use super::validity::OutsideBox;
use crate::condition::Condition;
use crate::forces::SurfaceForce;
use crate::frame::{Vec3, WaterPlane};
use crate::physics::Physics;
use crate::sea::Sea;
use crate::vehicle::{MAX_SURFACES, PerWheel, Vehicle};
use crate::wrench::Wrench;

/// What effects need to know beside the state; absent where the caller did not say.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Circumstances {
    /// Angle from the world's x to the body's x [rad], in the world of the trials.
    pub heading: Option<f64>,
    /// Rate at which the water rises at the body origin [m/s]; in a session, by default, that of the depth.
    pub depth_rate: Option<f64>,
    /// Speed of each wheel, in the order of the vehicle's wheels [rad/s].
    pub wheel_speeds: Option<PerWheel<f64>>,
    /// Time since the state before it in the session [s]; 0 leaves the session's memory as it is.
    pub time_step: f64,
    /// The caller integrates added mass himself with the matrix: forces leave `-M_A nu_dot` out.
    pub implicit_added_mass: bool,
    /// How much of the physical base answers; by default as the vehicle is served.
    pub physics: Option<Physics>,
    /// The derivatives of the wrench are asked for; in calm water alone.
    pub jacobian: bool,
    /// What the water does beside lying still or flowing evenly.
    pub sea: Sea,
}

/// What effects remember from state to state: waves and flooding. Starts at rest and dry.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EffectsSession {
    /// One an effect that remembers, in the order of the library.
    memories: [Memory; MEMORIES],
    depth: Option<f64>,
    depth_rate: Option<f64>,
}

/// Largest rate of the depth that is taken from its change [m/s], and the largest that may be stated: what exceeds it is the
/// rounding of a depth over a step of no length.
const MOST_DEPTH_RATE: f64 = 1e3;

impl EffectsSession {
    /// Takes the rate of the depth from its change.
    fn follow(&mut self, depth: f64, time_step: f64) {
        if let Some(before) = self.depth.filter(|_| time_step > 0.0) {
            self.depth_rate = Some(((depth - before) / time_step).clamp(-MOST_DEPTH_RATE, MOST_DEPTH_RATE));
        }
        self.depth = Some(depth);
    }
}

crate::named_enum! {
    /// Why an effect gave no load. The discriminants are the wire's.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[repr(u32)]
    pub enum LeftOut {
        /// It remembers, and the state belongs to no session: as at rest and dry.
        NoSession = 1 => "no_session",
        /// The heading was not given.
        NoHeading = 2 => "no_heading",
        /// The wheel speeds were not given.
        NoWheelSpeeds = 3 => "no_wheel_speeds",
        /// The rate of the depth was not given.
        NoDepthRate = 4 => "no_depth_rate",
        /// The caller stated a current himself.
        CurrentStated = 5 => "current_stated",
    }
}

impl LeftOut {
    /// The reason of a code of the wire.
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|&reason| reason as u32 == code)
    }
}

/// The load of one effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectLoad {
    /// Which.
    pub effect: Effect,
    /// About the center of mass, body frame [N, N m].
    pub wrench: Wrench,
    /// Why it is zero, where the effect could not be told.
    pub left_out: Option<LeftOut>,
}

/// The loads of all effects. Reused from query to query without allocating.
#[derive(Debug, Clone)]
pub struct EffectLoads {
    /// One load an effect, in the order of the file.
    pub loads: Vec<EffectLoad>,
    /// Share of the effects' forces that acts on each surface [N]: a part of `loads`, not to be added to them.
    pub surface_forces: Vec<Vec3>,
    /// How far the state lies outside the box in which the effects were seen.
    pub outside: OutsideBox,
    /// Added mass and inertia about the center of mass, forces first [kg, kg m, kg m2], of base and effects together.
    pub added_mass: Option<Matrix6<f64>>,
    immersion: Immersion,
    /// The water surface that the immersion is of.
    plane: Option<WaterPlane>,
}

impl Default for EffectLoads {
    fn default() -> Self {
        let panels = Vec::with_capacity(MAX_SURFACES);
        Self {
            loads: Vec::with_capacity(PHYSICS),
            surface_forces: Vec::with_capacity(MAX_SURFACES),
            outside: OutsideBox::default(),
            added_mass: None,
            immersion: Immersion { panels, ..Immersion::default() },
            plane: None,
        }
    }
}

impl EffectLoads {
    /// Forgets the answer before.
    pub fn clear(&mut self) {
        self.empty();
        self.plane = None;
    }

    /// Forgets the loads, and knows where the water reached.
    fn empty(&mut self) {
        self.loads.clear();
        self.surface_forces.clear();
        self.outside = OutsideBox::default();
        self.added_mass = None;
    }

    /// Sum over the effects.
    pub fn sum(&self) -> Wrench {
        self.loads.iter().fold(Wrench::default(), |sum, load| sum + load.wrench)
    }
}

#[derive(Debug, Clone)]
struct Entry {
    effect: Effect,
    shape: Shape,
    values: [f64; MAX_COEFFICIENTS],
    base_drag: BaseDrag,
    channel_width: Option<f64>,
    region: EffectRegion,
    /// What the caller may have left unsaid.
    inputs: &'static [Quantity],
    acts_on_own_drag: bool,
    /// Place of its memory in a session.
    memory: Option<usize>,
}

/// What the model says of a state.
#[derive(Clone, Copy)]
pub struct Answer<'a> {
    /// The state.
    pub condition: &'a Condition,
    /// Its forces on the surfaces.
    pub surfaces: &'a [SurfaceForce],
    /// Its net wrench about the center of mass.
    pub wrench: Wrench,
    /// True where wetted fractions and points are those of the hull's samples.
    pub wet_parts_known: bool,
    /// The wrench is that of calm water.
    pub is_calm: bool,
    /// The model's wrench in another state, in calm water and alone, or as one of a run in which no waves are left: that at the
    /// edge of the box in which effects are held, or that of [`Shape::elsewhere`].
    pub elsewhere: &'a dyn Fn(&Elsewhere) -> Wrench,
}

/// The effects of a vehicle, ready to be evaluated.
#[derive(Debug, Clone)]
pub struct ActiveEffects {
    file: EffectsFile,
    body: Body,
    entries: Vec<Entry>,
}

impl ActiveEffects {
    /// Prepares the hull, which takes a tenth of a second.
    pub fn new(file: EffectsFile, vehicle: &Vehicle) -> Self {
        let entries = file.effects.iter().map(|effect| Entry {
            effect: effect.effect(),
            shape: effect.shape,
            values: effect.values(),
            base_drag: effect.base_drag(),
            channel_width: effect.channel_width,
            region: effect.region.clone(),
            inputs: effect.effect().spec().inputs,
            acts_on_own_drag: effect.effect().spec().acts_on_own_drag,
            memory: effect.effect().memory_place(),
        });
        Self { entries: entries.collect(), body: Body::of_vehicle(vehicle), file }
    }

    /// The file that they came from.
    pub fn file(&self) -> &EffectsFile {
        &self.file
    }

    /// True where the model is asked in other states as well.
    pub fn ask_elsewhere(&self) -> bool {
        self.entries.iter().any(|entry| entry.acts_on_own_drag)
    }

    /// The loads in a state for which the model gave an answer. Allocates nothing.
    ///
    /// The memory of a session moves on by the time step with the state at its end, as it does along a trial in fitting.
    pub fn evaluate(
        &self,
        circumstances: &Circumstances,
        answer: &Answer,
        session: Option<&mut EffectsSession>,
        out: &mut EffectLoads,
    ) {
        out.plane = None;
        self.evaluate_again(circumstances, answer, session, out);
    }

    /// [`Self::evaluate`] in a state close to the one before, of the same vehicle: where the water surface is the same, it reaches
    /// the same parts.
    pub(crate) fn evaluate_again(
        &self,
        circumstances: &Circumstances,
        answer: &Answer,
        mut session: Option<&mut EffectsSession>,
        out: &mut EffectLoads,
    ) {
        let Answer { condition, surfaces, wrench, wet_parts_known, is_calm, elsewhere } = *answer;
        out.empty();
        out.outside = self.file.validity.outside(condition);
        out.surface_forces.resize(surfaces.len(), Vec3::zeros());
        let state = self.file.validity.clamped(condition);
        let plane = state.water_plane(self.body.z0);
        if out.plane != Some(plane) {
            out.plane = Some(plane);
            if wet_parts_known && state.depth == condition.depth {
                self.body.immerse_as(&state, surfaces, &mut out.immersion);
            } else {
                self.body.immerse(&state, &mut out.immersion);
            }
        }
        let mut rate = circumstances.depth_rate;
        if let Some(session) = session.as_deref_mut() {
            session.follow(condition.depth, circumstances.time_step);
            rate = rate.or(session.depth_rate);
        }
        let without_rate = still(&state);
        // with the drag of one state and an effect of another nothing would fit
        let here = || elsewhere(&Elsewhere::of(state));
        let at_edge = (self.ask_elsewhere() && state != *condition).then(here);
        let mut alone = at_edge;
        let current_stated = condition.velocity != condition.ground_velocity;
        let EffectLoads { loads, surface_forces, immersion, added_mass, .. } = out;
        // set for each effect below
        let mut input = Input {
            body: &self.body,
            condition: &state,
            immersion,
            predicted: wrench,
            elsewhere: None,
            base_drag: BaseDrag::zeros(),
            yaw: circumstances.heading.unwrap_or(0.0),
            wetting_rate: rate.unwrap_or(0.0),
            channel_width: None,
            wheel_speeds: circumstances.wheel_speeds.map_or_else(PerWheel::none, |speeds| speeds.map(Some)),
        };
        for entry in &self.entries {
            let implicit = entry.effect == Effect::AddedMass && circumstances.implicit_added_mass;
            input.condition = if implicit { &without_rate } else { &state };
            input.predicted = match at_edge {
                Some(at_edge) if entry.acts_on_own_drag => at_edge,
                _ => wrench,
            };
            (input.base_drag, input.channel_width) = (entry.base_drag, entry.channel_width);
            let missing = |quantity: &Quantity| match quantity {
                Quantity::Session if session.is_none() => Some(LeftOut::NoSession),
                Quantity::NoStatedCurrent if current_stated => Some(LeftOut::CurrentStated),
                Quantity::Heading if circumstances.heading.is_none() => Some(LeftOut::NoHeading),
                Quantity::WheelSpeeds if circumstances.wheel_speeds.is_none() => Some(LeftOut::NoWheelSpeeds),
                Quantity::DepthRate if rate.is_none() => Some(LeftOut::NoDepthRate),
                _ => None,
            };
            let left_out = entry.inputs.iter().find_map(missing);
            let there = if left_out.is_none() { entry.shape.elsewhere(&input) } else { None };
            input.elsewhere = there.map(|there| {
                let before = match there.with_waves && is_calm {
                    true => input.predicted,
                    false => *alone.get_or_insert_with(here),
                };
                elsewhere(&there) + before * -1.0
            });
            let memory = match (session.as_deref_mut(), entry.memory) {
                (Some(session), Some(place)) => {
                    let memory = &mut session.memories[place];
                    entry.shape.advance(memory, &input, circumstances.time_step);
                    *memory
                }
                _ => Memory::default(),
            };
            let mut wrench = Wrench::default();
            let share = entry.region.share(&state);
            if left_out.is_none() {
                entry.shape.basis(&memory, &input, |coefficient, part, load| {
                    let value = entry.values[coefficient] * share;
                    wrench += load * value;
                    if let Part::Panel(panel) = part {
                        surface_forces[panel] += load.force * value;
                    }
                });
            }
            if let Shape::AddedMass(law) = entry.shape {
                let k = std::array::from_fn(|axis| entry.values[axis] * share);
                *added_mass = Some(law.matrix(&self.body, immersion, state.density, &k));
            }
            loads.push(EffectLoad { effect: entry.effect, wrench, left_out });
        }
    }
}

/// The same state with velocities over ground that do not change in body axes: those are what an integration changes.
fn still(state: &Condition) -> Condition {
    Condition {
        acceleration: state.angular_velocity.cross(&state.ground_velocity),
        angular_acceleration: Vec3::zeros(),
        ..*state
    }
}
