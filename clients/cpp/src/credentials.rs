//! The files with which a client connects: named when it is opened and read at each connection, so that it finds what was renewed.

use std::path::{Path, PathBuf};
use std::time::Duration;

use rustls_pki_types::pem::PemObject;
use rustls_pki_types::{CertificateDer, PrivateKeyDer};
use wade_client::{ClientError, Credentials, GrpcLink};

/// Files of PEM, and one that holds a token alone.
#[derive(Clone, Default)]
pub struct CredentialFiles {
    pub ca: Option<PathBuf>,
    pub certificate: Option<PathBuf>,
    pub key: Option<PathBuf>,
    pub token: Option<PathBuf>,
}

impl CredentialFiles {
    /// Connects to `http://HOST:PORT`, `https://HOST:PORT` or `unix:PATH` within the timeout, which each call has too.
    pub async fn connect(
        &self,
        url: &str,
        vehicle: &str,
        timeout: Duration,
    ) -> Result<GrpcLink, ClientError> {
        let connected = match self.read(url) {
            Ok(credentials) => GrpcLink::connect(url, vehicle, timeout, &credentials).await,
            Err(error) => Err(error),
        };
        connected.map_err(|error| self.with_files(error))
    }

    /// What the files hold for a server at this URL.
    fn read(&self, url: &str) -> Result<Credentials, ClientError> {
        // the system tells the server whose process this is
        if url.starts_with("unix:") {
            return Ok(Credentials::default());
        }
        let Self { ca, certificate, key, token } = self;
        let for_tls = [("CA", ca), ("certificate", certificate), ("key", key)];
        if url.starts_with("http://")
            && let Some((what, Some(path))) = for_tls.into_iter().find(|(_, path)| path.is_some())
        {
            return Err(fault(what, path, &format!("{url} is not encrypted: write https://")));
        }
        let credentials =
            Credentials::from_files(ca.as_deref(), certificate.as_deref(), key.as_deref(), token.as_deref())?;
        if let (Some(path), Some(pem)) = (ca, &credentials.ca) {
            check_certificates("CA", path, pem)?;
        }
        if let (Some(certificate), Some(key), Some((chain, secret))) =
            (certificate, key, &credentials.identity)
        {
            check_certificates("certificate", certificate, chain)?;
            PrivateKeyDer::from_pem_slice(secret)
                .map_err(|error| fault("key", key, &format!("holds no private key in PEM: {error}")))?;
        }
        let is_token =
            |token: &String| !token.is_empty() && token.bytes().all(|byte| byte.is_ascii_graphic());
        match (token, &credentials.token) {
            (Some(path), Some(held)) if !is_token(held) => {
                Err(fault("token", path, "must hold a token alone"))
            }
            _ => Ok(credentials),
        }
    }

    /// The error with the files that it can be about, where it names none.
    fn with_files(&self, error: ClientError) -> ClientError {
        let ClientError::Credentials { what, reason } = error else { return error };
        let files = match what.as_str() {
            "token" => vec![&self.token],
            _ => vec![&self.ca, &self.certificate, &self.key],
        };
        let files: Vec<String> = files.into_iter().flatten().map(|path| path.display().to_string()).collect();
        if files.is_empty() || files.iter().any(|file| reason.contains(file)) {
            return ClientError::Credentials { what, reason };
        }
        ClientError::Credentials { what, reason: format!("{reason} ({})", files.join(", ")) }
    }
}

fn fault(what: &str, path: &Path, reason: &str) -> ClientError {
    ClientError::Credentials { what: what.to_owned(), reason: format!("{}: {reason}", path.display()) }
}

/// There is at least one certificate.
fn check_certificates(what: &str, path: &Path, pem: &[u8]) -> Result<(), ClientError> {
    let found: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(pem).collect();
    match found {
        Ok(found) if !found.is_empty() => Ok(()),
        Ok(_) => Err(fault(what, path, "holds no certificate in PEM")),
        Err(error) => Err(fault(what, path, &format!("is not PEM: {error}"))),
    }
}
