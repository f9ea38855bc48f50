//! What Ctrl-C and SIGTERM do to a command that writes.

use std::process::exit;
use std::sync::{Mutex, PoisonError};

use anyhow::Result;
use tokio::signal::unix::{SignalKind, signal};

/// Exit status of a command that was interrupted: 128 and the number of SIGINT.
pub const INTERRUPTED: u8 = 130;

static WRITING: Mutex<()> = Mutex::new(());

/// Calls `act` at each Ctrl-C and each SIGTERM, on a thread of its own.
pub fn at_interrupts(mut act: impl FnMut() + Send + 'static) -> Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let (mut interrupt, mut terminate) = {
        let _context = runtime.enter();
        (signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?)
    };
    std::thread::Builder::new().name("wade-signals".into()).spawn(move || {
        runtime.block_on(async {
            loop {
                tokio::select! { _ = interrupt.recv() => {} _ = terminate.recv() => {} };
                act();
            }
        });
    })?;
    Ok(())
}

/// From here on an interrupt ends the program, but not in the middle of [`whole`].
pub fn end_between_writes() -> Result<()> {
    at_interrupts(|| {
        let _between = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
        exit(i32::from(INTERRUPTED));
    })
}

/// Writes something that takes milliseconds and must not stay half-written.
pub fn whole<T>(write: impl FnOnce() -> T) -> T {
    let _writing = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    write()
}
