//! Promise: bytes that were found by libFuzzer, and bytes that are sound, break nothing.

use std::path::Path;

use wade_fuzz::{TARGETS, panics};

#[test]
fn what_was_found_breaks_nothing() {
    panics::forbid();
    wade_fuzz::pause_by(|| {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
        runtime.expect("a runtime")
    });
    for target in TARGETS {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target.name);
        let mut files: Vec<_> = std::fs::read_dir(&folder)
            .into_iter()
            .flatten()
            .map(|entry| entry.expect("readable").path())
            .collect();
        files.sort();
        let kept = files.iter().map(|file| std::fs::read(file).expect("readable"));
        let inputs: Vec<_> = (target.seeds)().into_iter().chain(kept).collect();
        println!("{}: {} inputs", target.name, inputs.len());
        inputs.iter().for_each(|input| (target.run)(input));
    }
}
