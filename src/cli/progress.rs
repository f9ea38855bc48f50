//! Progress bars, drawn on standard error where that is a terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use wade::soak::Progress;

/// A bar on standard error, drawn only where that is a terminal.
pub fn soak_bar() -> impl Fn(&Progress) {
    let bar = ProgressBar::new(0);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {msg}") {
        bar.set_style(style);
    }
    move |progress| {
        bar.set_length(progress.total.as_millis() as u64);
        bar.set_position(progress.elapsed.as_millis() as u64);
        bar.set_message(message(progress));
        if progress.elapsed >= progress.total {
            bar.finish();
        }
    }
}

fn message(progress: &Progress) -> String {
    let Progress { elapsed, total, sent, errors, lost, p50, p99, warming_up } = progress;
    let microseconds = |time: &Duration| time.as_secs_f64() * 1e6;
    let phase = if *warming_up { "warming up, " } else { "" };
    format!(
        "{phase}{:.0} of {:.0} s, {sent} sent, {errors} refused, {lost} lost, p50 {:.1} us, p99 {:.1} us",
        elapsed.as_secs_f64(),
        total.as_secs_f64(),
        microseconds(p50),
        microseconds(p99),
    )
}
