//! Pages of shared memory that hold anything: a query for the server, an answer for a client. Every bit pattern is a value of
//! these types, so no check is passed by.
#![allow(unsafe_code, reason = "bytes become a page, as they do in shared memory")]

use std::mem::{MaybeUninit, size_of};

use iceoryx2::prelude::ZeroCopySend;
use wade_wire::shm::in_place;
use wade_wire::shm::layout::{Answer, BatchAnswer, JacobianAnswer, Query, VehicleAnswer};
use wade_wire::{Evaluator, State};

use crate::state::{answered, with_vehicle};

/// The kind of page, the vehicle, and the largest page that is looked at whole.
pub const LONGEST: usize = 2 + size_of::<Query>() + size_of::<JacobianAnswer>();

/// A page that begins with these bytes; the rest is zero, as in a new segment.
fn page<T: Copy + ZeroCopySend>(bytes: &[u8]) -> Box<T> {
    let mut page = Box::new(MaybeUninit::<T>::zeroed());
    let len = bytes.len().min(size_of::<T>());
    // SAFETY: `len` bytes are readable at the one place and fit at the other, which nothing else refers to. The shared types
    // hold numbers, for which every bit pattern is a value.
    unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), page.as_mut_ptr().cast::<u8>(), len) };
    Box::new(*in_place(&mut page))
}

/// What the server does with a query, or a client with each of its answers.
pub fn run(bytes: &[u8]) {
    let [kind, number, bytes @ ..] = bytes else { return };
    match kind % 4 {
        0 => {
            let query = page::<Query>(bytes);
            with_vehicle(*number, |vehicle| {
                let Ok(state) = query.state() else { return };
                answered(vehicle, &state);
                let mut answer = page::<Answer>(bytes.get(size_of::<Query>()..).unwrap_or_default());
                match state.check_for(vehicle) {
                    Ok(checked) => {
                        answer.fill(vehicle, &Evaluator::default().evaluate(vehicle, &checked, None))
                    }
                    Err(invalid) => answer.refuse(&invalid, vehicle),
                }
                read(&answer, &state);
                // what a client writes of a state is that state; a wave of no height has no length either
                let again = Query::from(&state).state().expect("a state that was read");
                assert!(state.check_for(vehicle).is_err() || again.check_for(vehicle).is_ok(), "{state:?}");
            });
        }
        1 => read(&page::<JacobianAnswer>(bytes).copied().answer, &State::default()),
        2 => {
            let _ = page::<VehicleAnswer>(bytes).decoded();
        }
        _ => {
            let answer = page::<BatchAnswer>(bytes);
            let _ = answer.refusal_of(&[State::default(); 3]);
            read(&answer.answers[0], &State::default());
        }
    }
}

fn read(answer: &Answer, state: &State) {
    let copy = answer.copied();
    assert_eq!(copy.surfaces().len(), answer.surfaces().len());
    assert_eq!(copy.effects().len(), answer.effects().len());
    let _ = copy.refusal_of(state).map(|invalid| invalid.to_string());
    let _ =
        (copy.provenance(), copy.outside(), copy.effects_outside(), copy.shaft_power(), copy.is_outside());
}

/// A query of a full state and of a plain one, and empty pages of the others.
pub fn seeds() -> Vec<Vec<u8>> {
    let mut seeds: Vec<Vec<u8>> = (0..4).map(|kind| vec![kind, 0]).collect();
    for number in 0..2 {
        with_vehicle(number, |vehicle| {
            let state = wade_wire::state(&crate::state::message(), vehicle).expect("a sound state");
            let query = Query::from(&state);
            // SAFETY: the query is readable for its size, and has no padding: its layout is a contract.
            let bytes = unsafe {
                std::slice::from_raw_parts(std::ptr::from_ref(&query).cast::<u8>(), size_of::<Query>())
            };
            seeds.push([&[0, number], bytes].concat());
        });
    }
    seeds
}
