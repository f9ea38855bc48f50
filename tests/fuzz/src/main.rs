//! What `./run` starts: libFuzzer over the target that `WADE_FUZZ` names; without one, prints the targets and their longest
//! inputs. With `WADE_FUZZ_SEEDS` set to a folder, writes the target's sound inputs there instead.
#![no_main]

use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;
use wade_fuzz::Target;

fn target() -> Target {
    static TARGET: OnceLock<Target> = OnceLock::new();
    *TARGET.get_or_init(|| {
        let name = std::env::var("WADE_FUZZ").unwrap_or_default();
        let target = wade_fuzz::target(&name).unwrap_or_else(|| panic!("WADE_FUZZ={name} is no target"));
        wade_fuzz::panics::forbid();
        wade_fuzz::pause_by(|| {
            let runtime =
                tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
            runtime.expect("a runtime")
        });
        target
    })
}

fuzz_target!(init: {
    if std::env::var_os("WADE_FUZZ").is_none() {
        for target in wade_fuzz::TARGETS {
            println!("{} {}", target.name, target.longest);
        }
        std::process::exit(0);
    }
    let target = target();
    if let Some(folder) = std::env::var_os("WADE_FUZZ_SEEDS") {
        for (number, seed) in (target.seeds)().into_iter().enumerate() {
            let path = std::path::Path::new(&folder).join(format!("seed-{number}"));
            std::fs::write(path, seed).expect("a folder that can be written");
        }
        std::process::exit(0);
    }
}, |data: &[u8]| (target().run)(data));
