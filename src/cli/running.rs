//! A server that runs on this machine, for commands that change a bundle.

use std::time::Duration;

use clap::Args;
use wade::client::reload;

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
        match reload(&self.server, vehicle, TIMEOUT) {
            Ok(reloaded) => {
                for one in reloaded {
                    match one.refusal.as_str() {
                        "" => eprintln!("{} serves version {} now", self.server, one.bundle_version),
                        refusal => {
                            eprintln!("{} keeps version {}: {refusal}", self.server, one.bundle_version)
                        }
                    }
                }
            }
            Err(error) => {
                eprintln!("no running server was told ({error}); one reads the bundle at its start")
            }
        }
    }
}
