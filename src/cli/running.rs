//! A server that runs on this machine, for commands that change a bundle.

use std::time::Duration;

use clap::Args;
use wade::client::{ClientError, reload};

/// Longest wait for a server that may not be there.
const TIMEOUT: Duration = Duration::from_secs(10);

/// Who is told that a bundle has changed.
#[derive(Debug, Args)]
pub struct Running {
    /// Server that is asked to serve the bundle at once, where one runs: http://HOST:PORT or unix:PATH
    #[arg(long, value_name = "URL", default_value = "unix:/tmp/wade.sock")]
    server: String,
}

impl Running {
    /// Asks the server to read a vehicle's bundle again, and says what came of it. A server that is not there is no failure.
    pub fn reload(&self, vehicle: &str) {
        if let Err(error) = self.ask(vehicle) {
            eprintln!("no running server was told ({error}); one reads the bundle at its start");
        }
    }

    /// The same of a server that must be there, and of every vehicle where none is named; false where it refused a bundle.
    pub fn ask(&self, vehicle: &str) -> Result<bool, ClientError> {
        let reloaded = reload(&self.server, vehicle, TIMEOUT)?;
        for one in &reloaded {
            let (server, name, version) = (&self.server, &one.vehicle, one.bundle_version);
            match one.refusal.as_str() {
                "" => eprintln!("{server} serves {name}, version {version}, now"),
                refusal => eprintln!("{server} keeps {name}, version {version}: {refusal}"),
            }
        }
        Ok(reloaded.iter().all(|one| one.refusal.is_empty()))
    }
}
