//! A vehicle as it is served: its model and the effects that were added to it.

use std::cell::RefCell;

use crate::condition::Condition;
use crate::effects::{
    ActiveEffects, Answer, Circumstances, EffectLoads, EffectsFile, EffectsSession, Elsewhere,
};
use crate::forces::Forces;
use crate::model::{COLUMNS, Form, Jacobian, JacobianWorkspace, Model, Workspace, stepped};
use crate::physics::{Memory, Motion, Physics};
use crate::wrench::Wrench;

/// Step of the differences of effects in the unit of each column: in double precision their rounding is below 1e-9 of a load, and
/// their curvature below 1e-8.
const STEP: f64 = 1e-5;
/// The same where they ask a network in other states, which is of single precision: shorter where a switch of the network is near,
/// at another level or attitude, and longest for the density, of which a step of one is a thousandth.
const STEPS_OF_NETWORK: [f64; COLUMNS] = [1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-4, 1e-4, 1e-4, 1e-4, 1.0];

/// What a served vehicle answers. Reused from query to query.
#[derive(Debug, Clone, Default)]
pub struct Loads {
    /// The model's forces on every surface; the net wrench is the sum of these and of the effects.
    pub forces: Forces,
    /// The loads of the effects.
    pub effects: EffectLoads,
    /// Derivatives of the net wrench where they were asked for; none of a vehicle that has none ([`ServedVehicle::has_jacobian`]).
    pub jacobian: Option<Jacobian>,
    /// The model in other states.
    elsewhere: Forces,
    /// Buffers of the model.
    workspace: Workspace,
    /// Buffers of its derivatives.
    slopes: JacobianWorkspace,
    /// The effects in a state a step away.
    stepped: EffectLoads,
}

/// What lasts from state to state: waves of the base, and the memory of effects. Starts at rest and dry.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Session {
    base: Memory,
    effects: EffectsSession,
}

impl Session {
    /// Along a recording: its accelerations are those that the body had, not those that a loop goes on from.
    pub fn of_recording() -> Self {
        Self { base: Memory::of_recording(), ..Self::default() }
    }

    fn split(&mut self) -> (&mut Memory, &mut EffectsSession) {
        (&mut self.base, &mut self.effects)
    }
}

/// One version of a bundle, ready to answer.
#[derive(Debug)]
pub struct ServedVehicle {
    model: Model,
    effects: Option<ActiveEffects>,
    origin: String,
    physics: Physics,
}

impl ServedVehicle {
    /// A model with the effects of its bundle, where it has any.
    pub fn new(model: Model, effects: Option<EffectsFile>) -> Self {
        let effects = effects.map(|file| ActiveEffects::new(file, model.vehicle()));
        Self { model, effects, origin: String::new(), physics: Physics::Full }
    }

    /// The same, which knows where it is from.
    pub fn with_origin(self, origin: String) -> Self {
        Self { origin, ..self }
    }

    /// The same, which answers with so much of the physical base where a caller states nothing else.
    pub fn with_physics(self, physics: Physics) -> Self {
        Self { physics, ..self }
    }

    /// Where the bundle is: its folder, or "carried by the binary"; empty of one made in memory.
    pub fn origin(&self) -> &str {
        &self.origin
    }

    /// The model without its effects.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// What was added to the model.
    pub fn effects(&self) -> Option<&EffectsFile> {
        self.effects.as_ref().map(ActiveEffects::file)
    }

    /// Whether the derivatives of its wrench are known, which are of the physical base and of what stands on it.
    pub fn has_jacobian(&self) -> bool {
        self.model.base().is_some()
    }

    /// Forces and moments in a state. Allocates nothing. Effects with a memory live in `session`; without one they are left
    /// out, and their loads say so.
    ///
    /// Derivatives of the model are in closed form ([`Model::evaluate_with_jacobian`]); those of effects, whose hull is a table, are
    /// central differences in double precision, in which the model's own drag changes as its derivatives say.
    pub fn evaluate(
        &self,
        condition: &Condition,
        circumstances: &Circumstances,
        session: Option<&mut Session>,
        loads: &mut Loads,
    ) {
        let Loads { forces, effects: added, jacobian, elsewhere, workspace, slopes, stepped: steps } = loads;
        let condition = &condition.resolved(self.model.vehicle().z0);
        let stirred = Some(&circumstances.sea).filter(|sea| !sea.is_calm());
        let stirred = stirred.and_then(|sea| self.model.in_sea(condition, sea));
        let (condition, waters) = match stirred {
            Some((state, waters)) => (&state.resolved(self.model.vehicle().z0), Some(waters)),
            None => (condition, None),
        };
        let (mut memory, session) = match session {
            Some(session) => {
                let (memory, effects) = session.split();
                (Some(memory), Some(effects))
            }
            None => (None, None),
        };
        let speeds = self.model.wheel_speeds(circumstances.wheel_speeds.as_ref());
        let motion = Motion {
            wheel_speeds: &speeds,
            time_step: circumstances.time_step,
            implicit_added_mass: circumstances.implicit_added_mass,
            physics: circumstances.physics.unwrap_or(self.physics),
            waters: waters.as_ref(),
        };
        *jacobian = None;
        if circumstances.jacobian && waters.is_none() && self.has_jacobian() {
            let room = (&mut *workspace, slopes);
            let memory = memory.as_deref_mut();
            *jacobian = self.model.evaluate_with_jacobian(condition, (&motion, memory), room, forces);
        } else {
            self.model.evaluate_moving(condition, (&motion, memory.as_deref_mut()), workspace, forces);
        }
        if let (Some(waters), Some(base)) = (&waters, &mut forces.base) {
            base.water_level = waters.level();
        }
        match &self.effects {
            Some(effects) => {
                // the wet parts of an anchored model are not those of the samples, with which effects are fitted
                let known =
                    self.model.weights().is_some_and(|weights| matches!(weights.form, Form::Paper(_)));
                let Forces { surfaces, wrench, .. } = &*forces;
                let without_waves = memory.map(|memory| memory.without_waves());
                let at_rest = self.model.wheel_speeds(None);
                let room = RefCell::new((workspace, elsewhere));
                let ask = |there: &Elsewhere| {
                    // in calm water, as the effects were seen
                    let motion = Motion { waters: None, time_step: 0.0, ..motion };
                    let motion = match there.wheels_at_rest {
                        true => Motion { wheel_speeds: &at_rest, ..motion },
                        false => motion,
                    };
                    let (workspace, forces) = &mut *room.borrow_mut();
                    let mut memory = without_waves.filter(|_| there.with_waves);
                    self.model.evaluate_moving(
                        &there.condition,
                        (&motion, memory.as_mut()),
                        workspace,
                        forces,
                    );
                    forces.wrench
                };
                let answer = Answer {
                    condition,
                    surfaces,
                    wrench: *wrench,
                    wet_parts_known: known,
                    is_calm: waters.is_none(),
                    elsewhere: &ask,
                };
                if let Some(jacobian) = jacobian {
                    steps.clear();
                    let before = session.as_deref().copied();
                    let asks_network = self.model.weights().is_some() && effects.ask_elsewhere();
                    for (column, wide) in STEPS_OF_NETWORK.into_iter().enumerate() {
                        let slope = jacobian.column(column).into_owned();
                        let step = if asks_network { wide } else { STEP };
                        let [ahead, behind] = [step, -step].map(|step| {
                            let condition = &stepped(condition, self.model.vehicle().z0, column, step);
                            let wrench = *wrench + Wrench::from_column(&slope) * step;
                            let answer = Answer { condition, wrench, ..answer };
                            let mut session = before;
                            effects.evaluate_again(circumstances, &answer, session.as_mut(), steps);
                            steps.sum().column()
                        });
                        jacobian.set_column(column, &(slope + (ahead - behind) * (0.5 / step)));
                    }
                }
                effects.evaluate(circumstances, &answer, session, added);
                forces.wrench += added.sum();
            }
            None => added.clear(),
        }
        if let Some(base) = &forces.base {
            added.added_mass = Some(added.added_mass.map_or(base.added_mass, |more| base.added_mass + more));
        }
    }
}
