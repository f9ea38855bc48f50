//! What a client believes and shows over the network.

use std::fmt;
use std::path::Path;
use std::time::Duration;

use tonic::metadata::{Ascii, MetadataMap, MetadataValue};
use tonic::transport::{Certificate, Channel, ClientTlsConfig, Endpoint, Identity};

use super::{ClientError, nobody_at};

/// Environment variables of [`Credentials::from_environment`]: files of PEM, and a file with a token.
pub const VARIABLES: [&str; 4] = ["WADE_CA", "WADE_CERTIFICATE", "WADE_KEY", "WADE_TOKEN_FILE"];

/// Longest file [bytes].
const LARGEST_FILE: u64 = 1 << 20;

/// What a client believes and shows over `https://`. A token goes to this machine without encryption too, and never to another.
#[derive(Clone, Default)]
pub struct Credentials {
    /// PEM of the authorities whose servers are believed; none: those of the system.
    pub ca: Option<Vec<u8>>,
    /// PEM of the client's certificate, with those between it and its authority, and of its private key.
    pub identity: Option<(Vec<u8>, Vec<u8>)>,
    /// A token of the server's file.
    pub token: Option<String>,
}

impl fmt::Debug for Credentials {
    /// Says what there is, and none of it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Credentials")
            .field("ca", &self.ca.is_some())
            .field("identity", &self.identity.is_some())
            .field("token", &self.token.is_some())
            .finish()
    }
}

fn read(what: &str, path: &Path) -> Result<Vec<u8>, ClientError> {
    let error = |reason: String| ClientError::Credentials {
        what: what.to_owned(),
        reason: format!("{}: {reason}", path.display()),
    };
    let file = std::fs::metadata(path).map_err(|fault| error(fault.to_string()))?;
    if !file.is_file() || file.len() > LARGEST_FILE {
        return Err(error(format!("must be a file of at most {LARGEST_FILE} bytes")));
    }
    std::fs::read(path).map_err(|fault| error(fault.to_string()))
}

impl Credentials {
    /// Reads files of PEM, and one that holds a token alone.
    pub fn from_files(
        ca: Option<&Path>,
        certificate: Option<&Path>,
        key: Option<&Path>,
        token: Option<&Path>,
    ) -> Result<Self, ClientError> {
        let identity = match (certificate, key) {
            (Some(certificate), Some(key)) => Some((read("certificate", certificate)?, read("key", key)?)),
            (None, None) => None,
            (missing, _) => {
                let what = if missing.is_none() { "certificate" } else { "key" }.to_owned();
                let reason = "a certificate and its key go together".into();
                return Err(ClientError::Credentials { what, reason });
            }
        };
        let token = token.map(|path| read("token", path)).transpose()?;
        let token = token.map(|bytes| String::from_utf8_lossy(&bytes).trim().to_owned());
        Ok(Self { ca: ca.map(|path| read("CA", path)).transpose()?, identity, token })
    }

    /// What the environment names: see [`VARIABLES`].
    pub fn from_environment() -> Result<Self, ClientError> {
        let [ca, certificate, key, token] =
            VARIABLES.map(|name| std::env::var_os(name).filter(|value| !value.is_empty()));
        let path = |value: &Option<std::ffi::OsString>| value.as_deref().map(Path::new).map(Path::to_owned);
        Self::from_files(
            path(&ca).as_deref(),
            path(&certificate).as_deref(),
            path(&key).as_deref(),
            path(&token).as_deref(),
        )
    }

    /// Connects to `http://HOST:PORT`, `https://HOST:PORT` or `unix:PATH`, within this time with the handshake of TLS.
    pub(crate) async fn connect(&self, url: &str, timeout: Duration) -> Result<Channel, ClientError> {
        let endpoint = self.endpoint(url, timeout)?;
        let connected = tokio::time::timeout(timeout, endpoint.connect()).await;
        let late = |_| ClientError::NoServer {
            at: url.to_owned(),
            reason: format!("no connection within {} ms", timeout.as_millis()),
        };
        connected.map_err(late)?.map_err(|error| nobody_at(url, &error))
    }

    /// How to connect.
    fn endpoint(&self, url: &str, timeout: Duration) -> Result<Endpoint, ClientError> {
        let endpoint = Endpoint::from_shared(url.to_owned()).map_err(|error| nobody_at(url, &error))?;
        let endpoint = endpoint.connect_timeout(timeout).tcp_nodelay(true);
        if !url.starts_with("https://") {
            return if url.starts_with("unix:") || self.token.is_none() || is_this_machine(&endpoint) {
                Ok(endpoint)
            } else {
                let reason = format!("{url} is another machine without encryption: write https://");
                Err(ClientError::Credentials { what: "token".into(), reason })
            };
        }
        let tls = ClientTlsConfig::new();
        let tls = match &self.ca {
            Some(ca) => tls.ca_certificate(Certificate::from_pem(ca)),
            None => tls.with_native_roots(),
        };
        let tls = match &self.identity {
            Some((certificate, key)) => tls.identity(Identity::from_pem(certificate, key)),
            None => tls,
        };
        endpoint.tls_config(tls).map_err(|error| {
            let causes =
                std::iter::successors(Some(&error as &dyn std::error::Error), |error| error.source());
            let reason = causes.map(ToString::to_string).collect::<Vec<_>>().join(": ");
            ClientError::Credentials { what: "TLS".into(), reason }
        })
    }

    /// The token as a header carries it.
    pub(crate) fn authorization(&self) -> Result<Option<MetadataValue<Ascii>>, ClientError> {
        let Some(token) = &self.token else { return Ok(None) };
        let mut value: MetadataValue<Ascii> =
            format!("Bearer {token}").parse().map_err(|_| ClientError::Credentials {
                what: "token".into(),
                reason: "holds characters that no header carries".into(),
            })?;
        // so that nothing prints it
        value.set_sensitive(true);
        Ok(Some(value))
    }
}

/// Adds the token to a call.
pub(crate) fn sign(headers: &mut MetadataMap, authorization: Option<&MetadataValue<Ascii>>) {
    if let Some(authorization) = authorization {
        headers.insert("authorization", authorization.clone());
    }
}

fn is_this_machine(endpoint: &Endpoint) -> bool {
    let host = endpoint.uri().host().unwrap_or_default();
    let address = host.trim_start_matches('[').trim_end_matches(']').parse::<std::net::IpAddr>();
    host.eq_ignore_ascii_case("localhost") || address.is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_not_sent_to_another_machine_without_encryption_and_never_printed() {
        let credentials = Credentials { token: Some("secret".into()), ..Credentials::default() };
        let connect = |url: &str| credentials.endpoint(url, Duration::from_secs(1)).map(drop);
        for url in ["http://127.0.0.1:1", "http://[::1]:1", "http://localhost:1", "unix:/x", "https://rig:1"]
        {
            connect(url).expect(url);
        }
        for url in ["http://10.0.0.7:1", "http://rig:1"] {
            let error = connect(url).expect_err(url).to_string();
            assert!(error.contains("https://") && error.contains(url), "{error}");
        }
        let authorization = credentials.authorization().expect("a header").expect("a token");
        assert!(!format!("{credentials:?}{authorization:?}").contains("secret"));
    }

    #[test]
    fn a_file_that_is_wrong_is_named() {
        let missing = Path::new("/nowhere/ca.pem");
        let error = Credentials::from_files(Some(missing), None, None, None).expect_err("refused");
        assert!(error.to_string().contains("/nowhere/ca.pem"), "{error}");
        let error = Credentials::from_files(None, Some(missing), None, None).expect_err("refused");
        assert!(error.to_string().contains("key"), "{error}");
    }
}
