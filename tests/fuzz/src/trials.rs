//! A folder of trials: refused with the place, or trials with numbers.

use std::fs;

use tempfile::TempDir;
use wade_core::condition::GroundContact;
use wade_learn::trials::{Manifest, Trials};

thread_local! {
    static FOLDER: TempDir = TempDir::new_in("/dev/shm").expect("a temporary folder");
}

/// What stands between the description and the table.
const BETWEEN: &[u8] = b"\n===\n";

/// The description, a line of `===`, and the table.
pub fn run(bytes: &[u8]) {
    let at = bytes.windows(BETWEEN.len()).position(|window| window == BETWEEN);
    let (manifest, table) = match at {
        Some(at) => (&bytes[..at], &bytes[at + BETWEEN.len()..]),
        None => (&b"vehicle = \"husky\""[..], bytes),
    };
    FOLDER.with(|folder| {
        let path = folder.path();
        fs::write(path.join("trials.toml"), manifest).expect("written");
        fs::write(path.join("run.csv"), table).expect("written");
        match Trials::read(path) {
            Err(error) => assert!(error.to_string().contains(&*path.to_string_lossy()), "{error}"),
            Ok(trials) => {
                let _ = trials.remarks().iter().map(ToString::to_string).collect::<Vec<_>>();
                for trial in &trials.trials {
                    for sample in 0..trial.len() {
                        let condition = trial.condition(sample, GroundContact::default(), -0.2);
                        assert!(condition.velocity.iter().all(|value| value.is_finite()));
                        assert!(condition.up.iter().all(|value| value.is_finite()));
                    }
                }
                let again: Manifest =
                    toml::from_str(&trials.manifest.to_toml()).expect("what was read can be written");
                assert_eq!(format!("{:?}", trials.manifest), format!("{again:?}"));
            }
        }
    });
}

/// A short drive with a measured force, and one with an attitude.
pub fn seeds() -> Vec<Vec<u8>> {
    let manifest = "vehicle = \"husky\"\nfluid_density = 1000.0\n[measured]\ncolumns = [\"fx\"]\nmethod = \"load_cell\"\n[sensor_noise]\nfx = 1.5\n";
    let rows =
        |row: &dyn Fn(f64) -> String| (0..20).map(|i| row(0.02 * f64::from(i)) + "\n").collect::<String>();
    let forces = rows(&|t| format!("{t:.2},{:.4},0,0,0,0,0,0.1,{:.3}", 0.5 + t.sin(), -10.0 * t));
    let first = format!("{manifest}\n===\nt,vx,vy,vz,wx,wy,wz,depth,fx\n{forces}");
    let attitude = rows(&|t| format!("{t:.2},0.5,0,0,0,0,0.1,0.2,1,0,0,0,{t:.3}"));
    let second = format!("vehicle = \"husky\"\n===\nt,vx,vy,vz,wx,wy,wz,depth,qw,qx,qy,qz,ax\n{attitude}");
    vec![first.into(), second.into()]
}
