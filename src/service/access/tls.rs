//! TLS 1.3, and nothing older: every client of this server has it, and what is not spoken cannot be negotiated down to.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::crypto::{CryptoProvider, ring, verify_tls13_signature};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName, UnixTime};
use rustls::server::{NoServerSessionStorage, WebPkiClientVerifier};
use rustls::version::TLS13;
use rustls::{
    ClientConfig, DigitallySignedStruct, Error, PeerMisbehaved, RootCertStore, ServerConfig, SignatureScheme,
};
use serde::{Deserialize, Serialize};
use tokio::net::TcpStream;
use tokio_rustls::{TlsAcceptor, TlsConnector, client, server};

use super::{FileError, names, read};

/// Settings of TLS.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// PEM file of the server's certificate and of those between it and its authority; an empty path: no TLS.
    pub certificate: PathBuf,
    /// PEM file of its private key.
    pub key: PathBuf,
    /// PEM file of the authorities whose client certificates are believed; an empty path: no client shows one.
    pub client_ca: PathBuf,
}

impl Config {
    /// Whether TCP is encrypted.
    pub fn is_on(&self) -> bool {
        !self.certificate.as_os_str().is_empty()
    }

    /// Whether clients may show certificates.
    pub fn believes_clients(&self) -> bool {
        !self.client_ca.as_os_str().is_empty()
    }
}

/// What is spoken over a connection, which both ends agree on in the handshake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// HTTP/2, of gRPC.
    Http2,
    /// HTTP/1.1, of the page and the probes.
    Http1,
}

impl Protocol {
    /// Its name in the negotiation (RFC 7301).
    fn name(self) -> Vec<u8> {
        match self {
            Self::Http2 => b"h2".to_vec(),
            Self::Http1 => b"http/1.1".to_vec(),
        }
    }
}

/// The certificates and the key in force.
#[derive(Debug)]
pub struct Keys {
    http2: Arc<ServerConfig>,
    http1: Arc<ServerConfig>,
    leaf: CertificateDer<'static>,
    /// When the certificate expires.
    pub not_after: SystemTime,
}

fn provider() -> Arc<CryptoProvider> {
    Arc::new(ring::default_provider())
}

/// The certificates in a file, of which there is at least one.
fn certificates(key: &'static str, path: &Path) -> Result<Vec<CertificateDer<'static>>, FileError> {
    let bytes = read(key, path)?;
    let error = |reason: String| FileError { key, path: path.to_owned(), reason };
    let found: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&bytes).collect();
    let found = found.map_err(|fault| error(format!("not PEM: {fault}")))?;
    if found.is_empty() { Err(error("holds no certificate in PEM".into())) } else { Ok(found) }
}

impl Keys {
    /// Reads the files.
    pub fn read(config: &Config) -> Result<Self, FileError> {
        let chain = certificates("tls.certificate", &config.certificate)?;
        let of_certificate =
            |reason: String| FileError { key: "tls.certificate", path: config.certificate.clone(), reason };
        let of_key = |reason: String| FileError { key: "tls.key", path: config.key.clone(), reason };
        let of_ca =
            |reason: String| FileError { key: "tls.client_ca", path: config.client_ca.clone(), reason };
        let leaf = chain[0].clone();
        let not_after = names::not_after(&leaf).map_err(|fault| of_certificate(fault.to_string()))?;
        let key = PrivateKeyDer::from_pem_slice(&read("tls.key", &config.key)?)
            .map_err(|fault| of_key(format!("holds no private key in PEM: {fault}")))?;
        warn_of_readers(config);
        let builder = ServerConfig::builder_with_provider(provider())
            .with_protocol_versions(&[&TLS13])
            .map_err(|fault| of_certificate(fault.to_string()))?;
        let builder = if config.believes_clients() {
            let mut roots = RootCertStore::empty();
            for authority in certificates("tls.client_ca", &config.client_ca)? {
                roots.add(authority).map_err(|fault| of_ca(fault.to_string()))?;
            }
            // who shows no certificate may show a token; what neither allows is refused call by call
            let verifier = WebPkiClientVerifier::builder_with_provider(Arc::new(roots), provider())
                .allow_unauthenticated()
                .build()
                .map_err(|fault| of_ca(fault.to_string()))?;
            builder.with_client_cert_verifier(verifier)
        } else {
            builder.with_no_client_auth()
        };
        let mut common = builder.with_single_cert(chain, key).map_err(|fault| match fault {
            Error::InconsistentKeys(_) => of_key("is not the key of tls.certificate".into()),
            fault => of_certificate(fault.to_string()),
        })?;
        // a session that is resumed is not asked for its certificate again, which may have expired since
        common.session_storage = Arc::new(NoServerSessionStorage {});
        common.send_tls13_tickets = 0;
        let of = |protocol: Protocol| {
            let mut config = common.clone();
            config.alpn_protocols = vec![protocol.name()];
            Arc::new(config)
        };
        Ok(Self { http2: of(Protocol::Http2), http1: of(Protocol::Http1), leaf, not_after })
    }

    /// Shakes hands with a client.
    pub fn accept(
        &self,
        protocol: Protocol,
        stream: TcpStream,
    ) -> impl Future<Output = io::Result<server::TlsStream<TcpStream>>> + Send + 'static {
        let config = match protocol {
            Protocol::Http2 => &self.http2,
            Protocol::Http1 => &self.http1,
        };
        TlsAcceptor::from(Arc::clone(config)).accept(stream)
    }

    /// Shakes hands with the server that has these keys.
    pub fn connect(
        &self,
        protocol: Protocol,
        stream: TcpStream,
    ) -> impl Future<Output = io::Result<client::TlsStream<TcpStream>>> + Send + 'static {
        let pinned = Arc::new(Pinned(self.leaf.clone()));
        let config = ClientConfig::builder_with_provider(provider()).with_protocol_versions(&[&TLS13]);
        let config = config.map(|builder| {
            let mut config =
                builder.dangerous().with_custom_certificate_verifier(pinned).with_no_client_auth();
            config.alpn_protocols = vec![protocol.name()];
            config
        });
        async move {
            let config = config.map_err(io::Error::other)?;
            let name = ServerName::try_from("localhost").map_err(io::Error::other)?;
            TlsConnector::from(Arc::new(config)).connect(name, stream).await
        }
    }
}

/// Warns where other users can read the private key.
fn warn_of_readers(config: &Config) {
    use std::os::unix::fs::PermissionsExt;
    let mode = std::fs::metadata(&config.key).map_or(0, |file| file.permissions().mode());
    if mode & 0o004 != 0 {
        tracing::warn!(
            key = %config.key.display(),
            "tls.key can be read by every user of this machine: chmod 600 it"
        );
    }
}

/// Believes one certificate, whoever signed it and whatever it is for: the server asks itself.
#[derive(Debug)]
struct Pinned(CertificateDer<'static>);

impl ServerCertVerifier for Pinned {
    fn verify_server_cert(
        &self,
        end_entity: &CertificateDer<'_>,
        _: &[CertificateDer<'_>],
        _: &ServerName<'_>,
        _: &[u8],
        _: UnixTime,
    ) -> Result<ServerCertVerified, Error> {
        if *end_entity == self.0 {
            Ok(ServerCertVerified::assertion())
        } else {
            Err(rustls::CertificateError::ApplicationVerificationFailure.into())
        }
    }

    fn verify_tls12_signature(
        &self,
        _: &[u8],
        _: &CertificateDer<'_>,
        _: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        Err(PeerMisbehaved::SelectedUnofferedCipherSuite.into())
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        let algorithms = ring::default_provider().signature_verification_algorithms;
        verify_tls13_signature(message, certificate, signature, &algorithms)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        ring::default_provider().signature_verification_algorithms.supported_schemes()
    }
}
