//! The time of the states of a session that were not asked, for want of time: it goes with the next one that is, so that what
//! effects remember moves on as the caller's clock does.

/// Longest time step that the server takes [s].
const LONGEST_S: f32 = 1e3;

/// Time of one session.
#[derive(Default)]
pub struct Skipped {
    session: u64,
    step_s: f32,
}

impl Skipped {
    /// The time since the last state of the session that was asked. This state counts as not asked until [`Skipped::asked`].
    pub fn step(&mut self, session: u64, step_s: f32) -> f32 {
        if session == 0 || session != self.session {
            *self = Self { session, step_s: 0.0 };
        }
        self.step_s = (self.step_s + step_s).min(LONGEST_S);
        self.step_s
    }

    /// The state was asked.
    pub fn asked(&mut self) {
        self.step_s = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_steps_of_states_that_were_not_asked_are_added_to_the_next() {
        let mut skipped = Skipped::default();
        assert_eq!(skipped.step(1, 0.25), 0.25);
        assert_eq!(skipped.step(1, 0.5), 0.75);
        skipped.asked();
        assert_eq!(skipped.step(1, 0.125), 0.125);
        assert_eq!(skipped.step(2, 0.5), 0.5, "another session has a time of its own");
        assert_eq!(skipped.step(0, 0.5), 0.5);
        assert_eq!(skipped.step(0, 0.5), 0.5, "without a session nothing is remembered");
    }
}
