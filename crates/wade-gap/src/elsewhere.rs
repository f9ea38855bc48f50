//! What the model answers in other states than those of the trials: in water that moves, at another level, at rest.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use super::series::{Series, all_wheels};
use super::{Asked, Predicted};
use wade_core::effects::{Body, Effect, Elsewhere, Numbers, Shape};
use wade_core::frame::Vec3;
use wade_core::wrench::Wrench;

/// The change of the wrench of each sample of a trial, or the wrench.
pub(super) type Changes = Rc<Vec<Wrench>>;

/// [`Questions::changes`] of some model.
pub(super) type Asking<'a> = dyn Fn(&Shape, &Series) -> Option<Changes> + 'a;

/// A trial by name, an effect, and the form of its law.
type Place = (String, Effect, u64);

/// A model that can be asked, with what it answered last at the estimate of each law: columns are wanted again and again.
pub(super) struct Questions<'a> {
    body: &'a Body,
    predict: RefCell<&'a mut dyn FnMut(&Asked<'_>) -> Predicted>,
    last: RefCell<HashMap<Place, (Numbers, Changes)>>,
    alone: RefCell<HashMap<String, Changes>>,
}

impl<'a> Questions<'a> {
    pub fn new(body: &'a Body, predict: &'a mut dyn FnMut(&Asked<'_>) -> Predicted) -> Self {
        Self { body, predict: RefCell::new(predict), last: RefCell::default(), alone: RefCell::default() }
    }

    /// How much the model's wrench is another in the states of a shape; none of a shape that needs no other state.
    pub fn changes(&self, shape: &Shape, series: &Series) -> Option<Changes> {
        let there = |sample: usize| shape.elsewhere(&series.input(sample, self.body, Vec3::zeros()));
        // a trial may begin dry
        (0..series.t.len()).find_map(there)?;
        let numbers = shape.to_numbers();
        let place = (series.name.clone(), shape.effect(), numbers[2].to_bits());
        if let Some((_, changes)) = self.last.borrow().get(&place).filter(|(last, _)| *last == numbers) {
            return Some(Rc::clone(changes));
        }
        let alone = self.alone(series);
        let mut changes = vec![Wrench::default(); series.t.len()];
        for piece in series.pieces() {
            for sample in piece.clone() {
                let Some(there) = there(sample) else { continue };
                let is_first = sample == piece.start;
                let time_step = if is_first { 0.0 } else { series.t[sample] - series.t[sample - 1] };
                changes[sample] = match there.with_waves {
                    true => {
                        self.ask(series, sample, &there, time_step) + series.predicted_wrench(sample) * -1.0
                    }
                    false => self.ask(series, sample, &there, 0.0) + alone[sample] * -1.0,
                };
            }
        }
        let changes = Rc::new(changes);
        self.last.borrow_mut().insert(place, (numbers, Rc::clone(&changes)));
        Some(changes)
    }

    /// The wrench of each sample's state alone, as it was the first time: what is smoothed is smoothed before.
    fn alone(&self, series: &Series) -> Changes {
        let asked = || {
            let ask = |sample| self.ask(series, sample, &Elsewhere::of(series.conditions[sample]), 0.0);
            Rc::new((0..series.t.len()).map(ask).collect())
        };
        Rc::clone(self.alone.borrow_mut().entry(series.name.clone()).or_insert_with(asked))
    }

    fn ask(&self, series: &Series, sample: usize, there: &Elsewhere, time_step: f64) -> Wrench {
        // where none are said they roll
        let wheel_speeds = all_wheels(series.wheels[sample]).filter(|_| !there.wheels_at_rest);
        let mut predict = self.predict.borrow_mut();
        predict(&Asked { condition: &there.condition, wheel_speeds, time_step }).wrench
    }
}
