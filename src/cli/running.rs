//! A server that runs on this machine, for commands that change a bundle.

use std::time::Duration;

use clap::Args;
use wade::client::{Address, AddressError, ClientError, reload};

/// Longest wait for a server that may not be there.
const TIMEOUT: Duration = Duration::from_secs(10);

/// Who is told that a bundle has changed.
#[derive(Debug, Args)]
pub struct Running {
    /// Server that is asked to serve the bundle at once, where one runs: host:port, http://host:port or unix:PATH
    #[arg(long, value_name = "ADDR", default_value = "unix:/tmp/wade.sock", value_parser = of_grpc)]
    server: Address,
}

/// An address at which a server can be asked to read bundles.
fn of_grpc(text: &str) -> Result<Address, String> {
    let address: Address = text.parse().map_err(|error: AddressError| error.to_string())?;
    match address.url() {
        Some(_) => Ok(address),
        None => {
            Err("shared memory carries queries alone; write host:port, http://host:port or unix:PATH".into())
        }
    }
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
        let reloaded = reload(&self.server.url().unwrap_or_default(), vehicle, TIMEOUT)?;
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
