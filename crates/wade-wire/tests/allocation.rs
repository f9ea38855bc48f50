//! Promise: a query allocates nothing after load.
#![allow(unsafe_code, reason = "a counting allocator is unsafe by its trait")]

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use common::{Numbers, VEHICLES, every_effect, model_on, served_with};
use wade_core::forces::Forces;
use wade_core::model::Workspace;
use wade_core::model::kernel::Isa;
use wade_core::served::Session;
use wade_wire::{Evaluator, State};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, which counts the calls of each thread.
struct Counting;

// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller keeps the contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn a_query_allocates_nothing_after_load() {
    for isa in Isa::available() {
        for vehicle in VEHICLES {
            let model = model_on(vehicle, isa);
            let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
            let mut numbers = Numbers::new(1);
            let conditions: Vec<_> =
                (0..50).map(|_| *numbers.state().check().expect("valid").condition()).collect();
            model.evaluate(&conditions[0], &mut workspace, &mut forces);
            let before = ALLOCATIONS.get();
            for condition in &conditions {
                model.evaluate(condition, &mut workspace, &mut forces);
            }
            assert_eq!(ALLOCATIONS.get() - before, 0, "{} {vehicle}", isa.name());
        }
    }
}

#[test]
fn a_query_with_every_effect_allocates_nothing_after_load() {
    for vehicle in VEHICLES {
        let served = served_with(vehicle, every_effect(vehicle));
        let (mut evaluator, mut session) = (Evaluator::default(), Session::default());
        let mut numbers = Numbers::new(1);
        // a third of them in waves, a third over levels at the wheels and a sheared current
        let moving = |i: usize, state: State| match i % 3 {
            0 => state,
            1 => State { wave_vector: [2.0, 1.0, 0.0], wave_amplitude: 0.05, ..state },
            _ => {
                State { wheel_levels: Some([0.01, 0.0, 0.02, -0.01].into()), current_exponent: 0.2, ..state }
            }
        };
        let mut state = |i: usize| moving(i, numbers.state()).check_for(&served).expect("valid");
        let states: Vec<_> = (0..51).map(&mut state).collect();
        evaluator.evaluate(&served, &states[0], Some(&mut session));
        let before = ALLOCATIONS.get();
        for state in &states {
            evaluator.evaluate(&served, state, Some(&mut session));
        }
        assert_eq!(ALLOCATIONS.get() - before, 0, "{vehicle}");
    }
}

#[test]
fn the_counter_counts() {
    let before = ALLOCATIONS.get();
    std::hint::black_box(vec![0_u8; 64]);
    assert!(ALLOCATIONS.get() > before);
}
