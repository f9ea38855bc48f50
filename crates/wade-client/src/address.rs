//! Where a server answers: one grammar for every flag and client.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// Where a server answers, written `host:port`, `http://host:port`, `https://host:port`, `unix:PATH` or `shm:NAMESPACE`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Address {
    /// gRPC over TCP: host and port.
    Tcp(String),
    /// The same, encrypted.
    Tls(String),
    /// gRPC over a Unix socket: its path.
    Unix(PathBuf),
    /// Shared memory: its namespace.
    Shm(String),
}

/// Why a text is no address.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "'{text}' is no address: {fault}; write host:port, http://host:port, https://host:port, unix:PATH or shm:NAMESPACE"
)]
pub struct AddressError {
    /// What was given.
    pub text: String,
    /// What is wrong with it.
    pub fault: &'static str,
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let refused = |fault| AddressError { text: text.to_owned(), fault };
        if let Some(path) = text.strip_prefix("unix:") {
            // gRPC's own form of an absolute path is unix:///path
            let path = path.strip_prefix("//").unwrap_or(path);
            return match path {
                "" => Err(refused("the path of the socket is missing")),
                _ if path.starts_with("unix:") => Err(refused("unix: stands there twice")),
                path => Ok(Self::Unix(path.into())),
            };
        }
        if let Some(namespace) = text.strip_prefix("shm:") {
            let plain = |b: u8| b.is_ascii_alphanumeric() || b == b'-' || b == b'_';
            return match namespace {
                "" => Err(refused("the namespace is missing")),
                _ if !namespace.bytes().all(plain) => {
                    Err(refused("a namespace holds letters, digits, - and _ alone"))
                }
                _ => Ok(Self::Shm(namespace.to_owned())),
            };
        }
        let (place, form): (_, fn(String) -> Self) = match text.strip_prefix("https://") {
            Some(place) => (place, Self::Tls),
            None => (text.strip_prefix("http://").unwrap_or(text), Self::Tcp),
        };
        let place = place.strip_suffix('/').unwrap_or(place);
        if place.contains('/') {
            return Err(refused("a path of a socket stands behind unix:, and a URL ends after the port"));
        }
        let Some((host, port)) = place.rsplit_once(':') else { return Err(refused("the port is missing")) };
        // an address of IPv6 without brackets has colons of its own
        if host.is_empty() || (host.contains(':') && !(host.starts_with('[') && host.ends_with(']'))) {
            return Err(refused("the host is missing, or an address of IPv6 lacks its brackets"));
        }
        match port.parse::<u16>() {
            Ok(1..) => Ok(form(place.to_owned())),
            _ => Err(refused("the port is no number from 1 to 65535")),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp(place) => f.write_str(place),
            Self::Tls(place) => write!(f, "https://{place}"),
            Self::Unix(path) => write!(f, "unix:{}", path.display()),
            Self::Shm(namespace) => write!(f, "shm:{namespace}"),
        }
    }
}

impl Address {
    /// What gRPC connects to; none of shared memory.
    pub fn url(&self) -> Option<String> {
        match self {
            Self::Tcp(place) => Some(format!("http://{place}")),
            Self::Tls(_) | Self::Unix(_) => Some(self.to_string()),
            Self::Shm(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_is_read_and_written_back() {
        let read = |text: &str| text.parse::<Address>().expect(text);
        for (text, expected, url) in [
            ("127.0.0.1:50051", Address::Tcp("127.0.0.1:50051".into()), Some("http://127.0.0.1:50051")),
            ("http://rig.lab:1/", Address::Tcp("rig.lab:1".into()), Some("http://rig.lab:1")),
            ("https://rig.lab:1/", Address::Tls("rig.lab:1".into()), Some("https://rig.lab:1")),
            ("[::1]:50051", Address::Tcp("[::1]:50051".into()), Some("http://[::1]:50051")),
            ("unix:/run/wade.sock", Address::Unix("/run/wade.sock".into()), Some("unix:/run/wade.sock")),
            ("unix:///run/wade.sock", Address::Unix("/run/wade.sock".into()), Some("unix:/run/wade.sock")),
            ("unix:wade.sock", Address::Unix("wade.sock".into()), Some("unix:wade.sock")),
            ("shm:lab-2", Address::Shm("lab-2".into()), None),
        ] {
            assert_eq!(read(text), expected, "{text}");
            assert_eq!(read(&expected.to_string()), expected, "{text}");
            assert_eq!(expected.url().as_deref(), url, "{text}");
        }
    }

    #[test]
    fn what_is_no_address_is_refused_with_the_forms() {
        for text in [
            "",
            "localhost",
            "localhost:0",
            "localhost:70000",
            ":50051",
            "::1:50051",
            "/tmp/wade.sock",
            "unix:",
            "shm:",
            "shm:a/b",
            "https://host",
            "http://host:1/v1",
            "unix:unix:/x",
            "ftp://host:1",
        ] {
            let error = text.parse::<Address>().expect_err(text).to_string();
            assert!(error.contains(text) && error.contains("shm:NAMESPACE"), "{error}");
        }
    }
}
