//! What commands that ask a server believe and show over the network.

use std::path::PathBuf;

use clap::Args;
use wade_client::{ClientError, Credentials};

/// What to believe and to show.
#[derive(Debug, Clone, Default, Args)]
pub struct Trust {
    /// Authorities whose servers are believed over https:// [default: those of the system]
    #[arg(long, value_name = "FILE", env = "WADE_CA")]
    ca: Option<PathBuf>,
    /// Certificate to show over https://
    #[arg(long, value_name = "FILE", env = "WADE_CERTIFICATE", requires = "key")]
    certificate: Option<PathBuf>,
    /// Private key of the certificate
    #[arg(long, value_name = "FILE", env = "WADE_KEY", requires = "certificate")]
    key: Option<PathBuf>,
    /// File that holds the token to show
    #[arg(long, value_name = "FILE", env = "WADE_TOKEN_FILE")]
    token_file: Option<PathBuf>,
}

impl Trust {
    /// Reads the files.
    pub fn credentials(&self) -> Result<Credentials, ClientError> {
        let [ca, certificate, key, token] = [&self.ca, &self.certificate, &self.key, &self.token_file]
            .map(|file| file.as_deref().filter(|path| !path.as_os_str().is_empty()));
        Credentials::from_files(ca, certificate, key, token)
    }
}
