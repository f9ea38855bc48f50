//! Libraries that panic over some damaged files, where they should return an error.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    static EXPECTED: Cell<bool> = const { Cell::new(false) };
}

/// Whether a panic on this thread comes back as an error, which a program's panic hook need not print too.
pub fn is_expected() -> bool {
    EXPECTED.get()
}

/// What the work returns, or what it says in a panic. Nothing that it changes may outlive the panic.
pub fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    let before = EXPECTED.replace(true);
    let outcome = catch_unwind(AssertUnwindSafe(work));
    EXPECTED.set(before);
    outcome.map_err(|payload| {
        let literal = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
        let message = literal.or_else(|| payload.downcast_ref::<String>().cloned());
        message.unwrap_or_else(|| "its reader panicked".to_owned())
    })
}
