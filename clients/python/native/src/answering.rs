//! From checked states to rows, with what the effects remember of each session.

use wade_core::served::ServedVehicle;
use wade_core::served::Session;
use wade_wire::{Evaluator, InvalidState, Sessions, State};

use crate::columns::push;

/// A number of a session, which means another one in a batch than in single calls, as over shared memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Run {
    Single(u64),
    Batch(u64),
}

/// A state of a batch that is wrong.
pub struct Invalid {
    /// What is wrong with it.
    pub invalid: InvalidState,
    /// Which it is.
    pub index: usize,
}

/// What it takes to answer for one vehicle.
#[derive(Debug)]
pub struct Answering {
    evaluator: Evaluator,
    sessions: Sessions<Run>,
    row: Vec<u8>,
}

impl Default for Answering {
    fn default() -> Self {
        let sessions = Sessions::new(Sessions::<Run>::CAPACITY);
        Self { evaluator: Evaluator::default(), sessions, row: Vec::new() }
    }
}

impl Answering {
    /// What evaluates, without a session.
    pub fn evaluator(&mut self) -> &mut Evaluator {
        &mut self.evaluator
    }

    /// The row of one state; session 0 is none.
    pub fn one(
        &mut self,
        vehicle: &ServedVehicle,
        state: &State,
        session: u64,
    ) -> Result<&[u8], InvalidState> {
        let Self { evaluator, sessions, row } = self;
        // a state that is refused begins no session
        let state = state.check_for(vehicle)?;
        let (session, begins) = found(sessions, (session != 0).then_some(Run::Single(session)));
        row.clear();
        push(row, &evaluator.evaluate(vehicle, &state, session), begins, true);
        Ok(row)
    }

    /// The rows of a batch. One that is refused moves no session.
    pub fn batch(
        &mut self,
        vehicle: &ServedVehicle,
        states: &[State],
        numbered: &[u64],
        with_surfaces: bool,
    ) -> Result<Vec<u8>, Invalid> {
        let Self { evaluator, sessions, .. } = self;
        let check = |(index, state): (usize, &State)| {
            state.check_for(vehicle).map_err(|invalid| Invalid { invalid, index })
        };
        let states = states.iter().enumerate().map(check).collect::<Result<Vec<_>, _>>()?;
        let mut rows = Vec::new();
        for (index, state) in states.iter().enumerate() {
            let run = numbered.get(index).filter(|&&number| number != 0).map(|&number| Run::Batch(number));
            let (session, begins) = found(sessions, run);
            let evaluated = evaluator.evaluate(vehicle, state, session);
            push(&mut rows, &evaluated, begins, with_surfaces);
            if index == 0 {
                rows.reserve_exact(rows.len() * (states.len() - 1));
            }
        }
        Ok(rows)
    }
}

/// The session of a run, and whether it begins.
fn found(sessions: &mut Sessions<Run>, run: Option<Run>) -> (Option<&mut Session>, bool) {
    match run.map(|run| sessions.get(run)) {
        Some((session, begins)) => (Some(session), begins),
        None => (None, false),
    }
}
