//! A panic on any thread is a finding, also where a runtime would catch it.

use std::io::Write;
use std::panic;
use std::sync::Once;

/// Ends the process at the first panic from now on that wade does not expect.
pub fn forbid() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        panic::set_hook(Box::new(|info| {
            if wade_core::caught::is_expected() {
                return;
            }
            let _ = writeln!(std::io::stderr(), "{info}\n{}", std::backtrace::Backtrace::force_capture());
            std::process::abort();
        }));
    });
}
