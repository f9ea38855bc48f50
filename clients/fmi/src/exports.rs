//! The functions of the standard (FMI 3.0.2, fmi3FunctionTypes.h). Each checks its pointers, and none lets a panic out.
//!
//! # Safety
//! Of all of them: a pointer is null or valid for what its type, its name and its length say, a text has its end, and an instance
//! is null or was made by `fmi3InstantiateCoSimulation` and not freed.
#![allow(unsafe_code, clippy::missing_safety_doc, reason = "a C ABI, whose contract is said once")]
#![allow(
    non_snake_case,
    missing_docs,
    reason = "the names are those of the standard, which says what they do"
)]

use std::ffi::{CStr, CString, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::slice;

use crate::instance::{Fault, Instance, Kept, Mode, Status};
use crate::variables::{Kind, Variable};

type Environment = *mut c_void;
type LogMessage = unsafe extern "C" fn(Environment, Status, *const c_char, *const c_char);

/// A run with the simulator's log.
pub struct Run {
    instance: Instance,
    environment: Environment,
    log: Option<LogMessage>,
}

/// Tells the simulator's log what went wrong.
fn tell(log: Option<LogMessage>, environment: Environment, fault: &Fault) {
    let Some(log) = log else { return };
    let category = if fault.status == Status::Warning { c"logStatusWarning" } else { c"logStatusError" };
    let message = CString::new(fault.message.replace('\0', " ")).unwrap_or_default();
    // SAFETY: the simulator's function with its own environment, and texts that live until it returns.
    unsafe { log(environment, fault.status, category.as_ptr(), message.as_ptr()) };
}

/// Does something with a run; its log gets a fault, and a panic is one.
fn with(run: *mut Run, act: impl FnOnce(&mut Instance) -> Result<(), Fault>) -> Status {
    // SAFETY: null or of this library.
    let Some(run) = (unsafe { run.as_mut() }) else { return Status::Error };
    let outcome = catch_unwind(AssertUnwindSafe(|| act(&mut run.instance)));
    let outcome = outcome.unwrap_or_else(|_| Err(Fault::error("a fault in this library; please report it")));
    match outcome {
        Ok(()) => Status::Ok,
        Err(fault) => {
            tell(run.log, run.environment, &fault);
            fault.status
        }
    }
}

/// Values at a pointer; empty where there are none.
///
/// # Safety
/// The pointer is null or valid for as many values.
unsafe fn values<'v, T>(pointer: *const T, count: usize) -> &'v [T] {
    // SAFETY: as above.
    if pointer.is_null() || count == 0 { &[] } else { unsafe { slice::from_raw_parts(pointer, count) } }
}

/// Places at a pointer.
///
/// # Safety
/// As of [`values`], and nobody else reads them.
unsafe fn places<'v, T>(pointer: *mut T, count: usize) -> &'v mut [T] {
    // SAFETY: as above.
    if pointer.is_null() || count == 0 {
        &mut []
    } else {
        unsafe { slice::from_raw_parts_mut(pointer, count) }
    }
}

fn variable(reference: u32) -> Result<Variable, Fault> {
    Variable::from_reference(reference).ok_or_else(|| {
        Fault::error(format!("this unit has no variable with the value reference {reference}"))
    })
}

fn of_kind(reference: u32, kind: Kind) -> Result<Variable, Fault> {
    let variable = variable(reference)?;
    if variable.row().kind == kind {
        return Ok(variable);
    }
    Err(Fault::error(format!("{} is {:?}, not {kind:?}", variable.row().name, variable.row().kind)))
}

fn other_count(variable: Variable, expected: usize) -> Fault {
    Fault::error(format!("{} has {expected} values, and fewer or more were passed", variable.row().name))
}

/// Reads variables of one type into places.
fn get<T>(
    instance: &mut Instance,
    (references, kind): (&[u32], Kind),
    mut places: &mut [T],
    shown: impl Fn(f64) -> T,
) -> Result<(), Fault> {
    for reference in references {
        let variable = of_kind(*reference, kind)?;
        let found = instance.get(variable)?;
        let count = found.len();
        let (own, rest) = std::mem::take(&mut places)
            .split_at_mut_checked(count)
            .ok_or_else(|| other_count(variable, count))?;
        own.iter_mut().zip(found).for_each(|(place, value)| *place = shown(*value));
        places = rest;
    }
    if places.is_empty() {
        Ok(())
    } else {
        Err(Fault::error("more values were passed than the variables have"))
    }
}

/// Sets variables of one type: all of them, or none.
fn set<T: Copy>(
    instance: &mut Instance,
    (references, kind): (&[u32], Kind),
    values: &[T],
    read: impl Fn(T) -> f64,
) -> Result<(), Fault> {
    let mut rest = values;
    let mut all = Vec::with_capacity(references.len());
    for reference in references {
        let variable = of_kind(*reference, kind)?;
        let count = instance.count(variable)?;
        let (own, left) = rest.split_at_checked(count).ok_or_else(|| other_count(variable, count))?;
        all.push((variable, own));
        rest = left;
    }
    if !rest.is_empty() {
        return Err(Fault::error("more values were passed than the variables have"));
    }
    for (variable, own) in all {
        let own: Vec<f64> = own.iter().map(|value| read(*value)).collect();
        instance.set(variable, &own)?;
    }
    Ok(())
}

/// Getter and setter of a type that variables have.
macro_rules! of_type {
    ($get:ident $set:ident $type:ty, $kind:ident, $shown:expr, $read:expr) => {
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(
            run: *mut Run,
            references: *const u32,
            count: usize,
            to: *mut $type,
            size: usize,
        ) -> Status {
            // SAFETY: valid for their lengths.
            let (references, to) = unsafe { (values(references, count), places(to, size)) };
            with(run, |instance| get(instance, (references, Kind::$kind), to, $shown))
        }

        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set(
            run: *mut Run,
            references: *const u32,
            count: usize,
            from: *const $type,
            size: usize,
        ) -> Status {
            // SAFETY: valid for their lengths.
            let (references, from) = unsafe { (values(references, count), values(from, size)) };
            with(run, |instance| set(instance, (references, Kind::$kind), from, $read))
        }
    };
}

of_type!(fmi3GetFloat64 fmi3SetFloat64 f64, Real, |value| value, |value| value);
// a Boolean is read as a byte, whatever a simulator put there
of_type!(fmi3GetBoolean fmi3SetBoolean u8, Boolean, |value| u8::from(value != 0.0), |value| f64::from(u8::from(value != 0)));
of_type!(fmi3GetUInt32 fmi3SetUInt32 u32, Count, |value| value as u32, f64::from);
// numbers of an enumeration are few
of_type!(fmi3GetInt64 fmi3SetInt64 i64, Physics, |value| value as i64, |value| value as f64);

/// Functions for types that no variable has, which succeed where nothing is asked.
macro_rules! of_no_type {
    ($($name:ident($($argument:ty),*);)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(run: *mut Run, _: *const u32, count: usize $(, _: $argument)*) -> Status {
            with(run, |_| match count {
                0 => Ok(()),
                _ => Err(Fault::error(concat!(stringify!($name), ": this unit has no variable of that type"))),
            })
        }
    )*};
}

of_no_type! {
    fmi3GetFloat32(*mut f32, usize);
    fmi3SetFloat32(*const f32, usize);
    fmi3GetInt8(*mut i8, usize);
    fmi3SetInt8(*const i8, usize);
    fmi3GetUInt8(*mut u8, usize);
    fmi3SetUInt8(*const u8, usize);
    fmi3GetInt16(*mut i16, usize);
    fmi3SetInt16(*const i16, usize);
    fmi3GetUInt16(*mut u16, usize);
    fmi3SetUInt16(*const u16, usize);
    fmi3GetInt32(*mut i32, usize);
    fmi3SetInt32(*const i32, usize);
    fmi3GetUInt64(*mut u64, usize);
    fmi3SetUInt64(*const u64, usize);
    fmi3GetString(*mut *const c_char, usize);
    fmi3SetString(*const *const c_char, usize);
    fmi3GetBinary(*mut usize, *mut *const u8, usize);
    fmi3SetBinary(*const usize, *const *const u8, usize);
    fmi3GetClock(*mut bool);
    fmi3SetClock(*const bool);
    fmi3GetIntervalDecimal(*mut f64, *mut i32);
    fmi3GetIntervalFraction(*mut u64, *mut u64, *mut i32);
    fmi3GetShiftDecimal(*mut f64);
    fmi3GetShiftFraction(*mut u64, *mut u64);
    fmi3SetIntervalDecimal(*const f64);
    fmi3SetIntervalFraction(*const u64, *const u64);
    fmi3SetShiftDecimal(*const f64);
    fmi3SetShiftFraction(*const u64, *const u64);
    fmi3GetOutputDerivatives(*const i32, *mut f64, usize);
}

/// Functions that this unit does not have, as its description says.
macro_rules! not_here {
    ($($name:ident($($argument:ty),*);)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(run: *mut Run $(, _: $argument)*) -> Status {
            with(run, |_| Err(Fault::error(concat!(stringify!($name), " is not a function of this unit"))))
        }
    )*};
}

not_here! {
    fmi3GetNumberOfVariableDependencies(u32, *mut usize);
    fmi3GetVariableDependencies(u32, *mut usize, *mut u32, *mut usize, *mut i32, usize);
    fmi3SerializedFMUStateSize(*mut c_void, *mut usize);
    fmi3SerializeFMUState(*mut c_void, *mut u8, usize);
    fmi3DeserializeFMUState(*const u8, usize, *mut *mut c_void);
    fmi3GetAdjointDerivative(*const u32, usize, *const u32, usize, *const f64, usize, *mut f64, usize);
    fmi3EnterConfigurationMode();
    fmi3ExitConfigurationMode();
    fmi3EvaluateDiscreteStates();
    fmi3EnterContinuousTimeMode();
    fmi3CompletedIntegratorStep(bool, *mut bool, *mut bool);
    fmi3SetTime(f64);
    fmi3SetContinuousStates(*const f64, usize);
    fmi3GetContinuousStateDerivatives(*mut f64, usize);
    fmi3GetEventIndicators(*mut f64, usize);
    fmi3GetContinuousStates(*mut f64, usize);
    fmi3GetNominalsOfContinuousStates(*mut f64, usize);
    fmi3GetNumberOfEventIndicators(*mut usize);
    fmi3GetNumberOfContinuousStates(*mut usize);
    fmi3ActivateModelPartition(u32, f64);
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetDebugLogging(
    run: *mut Run,
    _: bool,
    _: usize,
    _: *const *const c_char,
) -> Status {
    with(run, |_| Ok(()))
}

/// Says that this is a unit for co-simulation alone.
fn only_co_simulation(log: Option<LogMessage>, environment: Environment) -> *mut Run {
    tell(log, environment, &Fault::error("this unit is for co-simulation alone"));
    std::ptr::null_mut()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateModelExchange(
    _: *const c_char,
    _: *const c_char,
    _: *const c_char,
    _: bool,
    _: bool,
    environment: Environment,
    log: Option<LogMessage>,
) -> *mut Run {
    only_co_simulation(log, environment)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateScheduledExecution(
    _: *const c_char,
    _: *const c_char,
    _: *const c_char,
    _: bool,
    _: bool,
    environment: Environment,
    log: Option<LogMessage>,
    _: *const c_void,
    _: *const c_void,
    _: *const c_void,
) -> *mut Run {
    only_co_simulation(log, environment)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    _name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: bool,
    _logging: bool,
    _event_mode: bool,
    _early_return: bool,
    _intermediate: *const u32,
    _intermediate_count: usize,
    environment: Environment,
    log: Option<LogMessage>,
    _update: *const c_void,
) -> *mut Run {
    // SAFETY: null or texts with their ends.
    let [token, resources] = [token, resources].map(|text| {
        (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) }).and_then(|text| text.to_str().ok())
    });
    let open = || {
        let resources = resources.ok_or_else(|| Fault::error("the path of the resources is missing"))?;
        Instance::new(Path::new(resources), token)
    };
    let opened = catch_unwind(open).unwrap_or_else(|_| Err(Fault::error("a fault in this library")));
    match opened {
        Ok(instance) => Box::into_raw(Box::new(Run { instance, environment, log })),
        Err(fault) => {
            tell(log, environment, &fault);
            std::ptr::null_mut()
        }
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(run: *mut Run) {
    if !run.is_null() {
        // SAFETY: made by `fmi3InstantiateCoSimulation`, and not used any more.
        let run = unsafe { Box::from_raw(run) };
        let _ = catch_unwind(AssertUnwindSafe(|| drop(run)));
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterInitializationMode(
    run: *mut Run,
    _: bool,
    _: f64,
    start: f64,
    _: bool,
    _: f64,
) -> Status {
    with(run, |instance| instance.initialize(start))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3ExitInitializationMode(run: *mut Run) -> Status {
    with(run, Instance::initialized)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterEventMode(run: *mut Run) -> Status {
    with(run, |instance| instance.enter(&[Mode::Step], Mode::Event))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterStepMode(run: *mut Run) -> Status {
    with(run, |instance| instance.enter(&[Mode::Event, Mode::Step], Mode::Step))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3UpdateDiscreteStates(
    run: *mut Run,
    needs_update: *mut bool,
    terminate: *mut bool,
    nominals_changed: *mut bool,
    values_changed: *mut bool,
    next_event_defined: *mut bool,
    next_event: *mut f64,
) -> Status {
    // SAFETY: null or valid.
    unsafe {
        for flag in [needs_update, terminate, nominals_changed, values_changed, next_event_defined] {
            if let Some(flag) = flag.as_mut() {
                *flag = false;
            }
        }
        if let Some(time) = next_event.as_mut() {
            *time = 0.0;
        }
    }
    with(run, |instance| match instance.mode() {
        Mode::Event => Ok(()),
        mode => Err(Fault::error(format!("there are no discrete states in {mode:?} mode"))),
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Terminate(run: *mut Run) -> Status {
    with(run, |instance| instance.enter(&[Mode::Step, Mode::Event], Mode::Terminated))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Reset(run: *mut Run) -> Status {
    with(run, |instance| {
        instance.reset();
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    run: *mut Run,
    from: f64,
    length: f64,
    _no_state_before: bool,
    event_needed: *mut bool,
    terminate: *mut bool,
    early_return: *mut bool,
    last_time: *mut f64,
) -> Status {
    // SAFETY: null or valid.
    for flag in [event_needed, terminate, early_return] {
        if let Some(flag) = unsafe { flag.as_mut() } {
            *flag = false;
        }
    }
    with(run, |instance| {
        let outcome = instance.step(from, length);
        // SAFETY: null or valid.
        if let Some(last) = unsafe { last_time.as_mut() } {
            *last = instance.time();
        }
        outcome
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetDirectionalDerivative(
    run: *mut Run,
    unknowns: *const u32,
    unknown_count: usize,
    knowns: *const u32,
    known_count: usize,
    seed: *const f64,
    seed_count: usize,
    sensitivity: *mut f64,
    sensitivity_count: usize,
) -> Status {
    // SAFETY: valid for their lengths.
    let (unknowns, knowns, seed, sensitivity) = unsafe {
        let references = (values(unknowns, unknown_count), values(knowns, known_count));
        (references.0, references.1, values(seed, seed_count), places(sensitivity, sensitivity_count))
    };
    with(run, |instance| {
        let of = |references: &[u32]| -> Result<Vec<Variable>, Fault> {
            references.iter().map(|reference| of_kind(*reference, Kind::Real)).collect()
        };
        let (unknowns, knowns) = (of(unknowns)?, of(knowns)?);
        instance.derivative((&unknowns, &knowns), seed, sensitivity)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFMUState(run: *mut Run, state: *mut *mut c_void) -> Status {
    // SAFETY: null or valid; what lies there is null or a state that this instance made.
    let Some(state) = (unsafe { state.as_mut() }) else { return Status::Error };
    with(run, |instance| {
        let kept = instance.keep()?;
        // SAFETY: as above.
        match unsafe { state.cast::<Kept>().as_mut() } {
            Some(place) => *place = kept,
            None => *state = Box::into_raw(Box::new(kept)).cast(),
        }
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFMUState(run: *mut Run, state: *mut c_void) -> Status {
    with(run, |instance| {
        // SAFETY: null or a state that an instance of this unit made.
        let kept = unsafe { state.cast::<Kept>().as_ref() };
        instance.come_back(kept.ok_or_else(|| Fault::error("there is no state to come back to"))?)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(run: *mut Run, state: *mut *mut c_void) -> Status {
    // SAFETY: null or valid.
    let Some(state) = (unsafe { state.as_mut() }) else { return Status::Ok };
    with(run, |_| {
        if !state.is_null() {
            // SAFETY: made by `fmi3GetFMUState`, and not used any more.
            drop(unsafe { Box::from_raw(state.cast::<Kept>()) });
            *state = std::ptr::null_mut();
        }
        Ok(())
    })
}
