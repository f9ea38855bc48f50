//! A server that runs on this machine, for commands that change a bundle.

use std::path::Path;
use std::time::Duration;

use clap::Args;
use wade_client::{Address, AddressError, ClientError, reload};
use wade_wire::proto::{ReloadRequest, Reloaded};

use super::trust::Trust;

/// Longest wait for a server that may not be there.
const TIMEOUT: Duration = Duration::from_secs(10);

/// Which server reads a changed bundle.
#[derive(Debug, Args)]
pub struct Running {
    /// Server that reads the changed bundle, where it serves from the same folder: host:port, https://host:port or unix:PATH
    #[arg(long, value_name = "ADDR", default_value = "unix:/tmp/wade.sock", value_parser = of_grpc)]
    server: Address,
    #[command(flatten)]
    trust: Trust,
}

/// An address at which a server can be asked to read bundles.
fn of_grpc(text: &str) -> Result<Address, String> {
    let address: Address = text.parse().map_err(|error: AddressError| error.to_string())?;
    match address.url() {
        Some(_) => Ok(address),
        None => {
            Err("shared memory carries queries alone; write host:port, https://host:port or unix:PATH".into())
        }
    }
}

impl Running {
    /// Has the server read the bundle in this folder again, if it serves from there. Whatever becomes of that is no failure
    /// of the command: its own work is done.
    pub fn reload(&self, vehicle: &str, bundle: &Path) {
        let folder = wade_core::bundle::canonical(bundle);
        let request = ReloadRequest { vehicle: vehicle.to_owned(), bundle: folder.display().to_string() };
        let server = &self.server;
        match self.asked(request) {
            Ok(reloaded) => {
                for one in reloaded {
                    let (name, version) = (&one.vehicle, one.bundle_version);
                    match one.refusal.as_str() {
                        _ if one.elsewhere => {
                            eprintln!(
                                "note: the server at {server} serves {name} from another folder and goes on with it"
                            );
                        }
                        "" => eprintln!("the server at {server} now serves {name}, version {version}"),
                        refusal => eprintln!(
                            "note: the bundle is written; the server at {server} goes on with version {version} of {name}: \
                             {refusal}"
                        ),
                    }
                }
            }
            Err(ClientError::NoServer { .. }) => {
                eprintln!("note: no server runs at {server}; the next start reads the bundle");
            }
            Err(error) => {
                eprintln!("note: the bundle is written; the server at {server} did not reload it: {error}")
            }
        }
    }

    fn asked(&self, request: ReloadRequest) -> Result<Vec<Reloaded>, ClientError> {
        reload(&self.server.url().unwrap_or_default(), request, TIMEOUT, &self.trust.credentials()?)
    }

    /// Has a server that must be there read a vehicle again, or all where none is named; false where it refused a bundle.
    pub fn ask(&self, vehicle: &str) -> Result<bool, ClientError> {
        let request = ReloadRequest { vehicle: vehicle.to_owned(), bundle: String::new() };
        let reloaded = self.asked(request)?;
        for one in &reloaded {
            let (server, name, version) = (&self.server, &one.vehicle, one.bundle_version);
            match one.refusal.as_str() {
                "" => eprintln!("the server at {server} now serves {name}, version {version}"),
                refusal => {
                    eprintln!("the server at {server} goes on with version {version} of {name}: {refusal}")
                }
            }
        }
        Ok(reloaded.iter().all(|one| one.refusal.is_empty()))
    }
}
