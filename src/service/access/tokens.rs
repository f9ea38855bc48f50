//! Tokens by their digest: the file gives nobody a token who reads it.

use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{FileError, Role, read};

/// Bytes of chance in a token.
const CHANCE: usize = 32;

/// A token, as the file knows it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Token {
    /// What it is called in the log.
    pub name: String,
    /// SHA-256 of its text, in hexadecimal digits.
    pub sha256: String,
    /// What its holder may do.
    pub roles: Vec<Role>,
}

/// The file of tokens.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TokenFile {
    #[serde(default)]
    token: Vec<Token>,
}

/// Why a token was not added to a file.
#[derive(Debug, thiserror::Error)]
pub enum TokenFileError {
    /// The file is there and cannot be used.
    #[error(transparent)]
    File(#[from] FileError),
    /// The name is taken.
    #[error("{path} has a token \"{name}\" already: take its entry out, or choose another name")]
    Taken {
        /// The file.
        path: String,
        /// The name.
        name: String,
    },
    /// The system refused.
    #[error("{path}: {source}")]
    System {
        /// The file.
        path: String,
        /// The reason.
        source: std::io::Error,
    },
}

/// The tokens of a file.
#[derive(Debug, Default)]
pub struct Tokens(HashMap<[u8; 32], Token>);

fn digest(text: &str) -> [u8; 32] {
    Sha256::digest(text.as_bytes()).into()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn from_hex(text: &str) -> Option<[u8; 32]> {
    let mut bytes = [0; 32];
    if text.len() != 2 * bytes.len() || !text.is_ascii() {
        return None;
    }
    for (byte, digits) in bytes.iter_mut().zip(text.as_bytes().chunks(2)) {
        *byte = u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()?;
    }
    Some(bytes)
}

/// The entries of a file, each of which is sound.
fn entries(path: &Path) -> Result<Vec<([u8; 32], Token)>, FileError> {
    let error = |reason: String| FileError { key: "access.tokens", path: path.to_owned(), reason };
    let bytes = read("access.tokens", path)?;
    let text = std::str::from_utf8(&bytes).map_err(|fault| error(fault.to_string()))?;
    let file: TokenFile = toml::from_str(text).map_err(|fault| error(fault.to_string()))?;
    let mut entries: Vec<([u8; 32], Token)> = Vec::new();
    for token in file.token {
        let name = &token.name;
        let digest = from_hex(&token.sha256);
        let digest = digest.ok_or_else(|| {
            error(format!("sha256 of the token \"{name}\" must have 64 hexadecimal digits"))
        })?;
        if entries.iter().any(|(known, other)| *known == digest || other.name == *name) {
            return Err(error(format!("the token \"{name}\" stands there twice")));
        }
        entries.push((digest, token));
    }
    Ok(entries)
}

impl Tokens {
    /// Reads a file; of an empty path, none.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        if path.as_os_str().is_empty() {
            return Ok(Self::default());
        }
        Ok(Self(entries(path)?.into_iter().collect()))
    }

    /// The token with this text. Digests are compared, of which a peer that does not have the token cannot guess any part.
    pub fn find(&self, text: &str) -> Option<&Token> {
        self.0.get(&digest(text))
    }
}

impl Token {
    /// Draws a token, adds it to a file, and gives its text, which is nowhere else.
    pub fn add(path: &Path, name: &str, roles: &[Role]) -> Result<String, TokenFileError> {
        let system = |source| TokenFileError::System { path: path.display().to_string(), source };
        let known = if path.exists() { entries(path)? } else { Vec::new() };
        if known.iter().any(|(_, token)| token.name == name) {
            return Err(TokenFileError::Taken { path: path.display().to_string(), name: name.to_owned() });
        }
        let mut chance = [0; CHANCE];
        rustix::rand::getrandom(&mut chance, rustix::rand::GetRandomFlags::empty())
            .map_err(|error| system(error.into()))?;
        let text = hex(&chance);
        let token = Self { name: name.to_owned(), sha256: hex(&digest(&text)), roles: roles.to_vec() };
        let entry = toml::to_string(&TokenFile { token: vec![token] })
            .map_err(|error| system(std::io::Error::other(error)))?;
        let mut file = std::fs::OpenOptions::new().create(true).append(true).open(path).map_err(system)?;
        let gap = if known.is_empty() { "" } else { "\n" };
        file.write_all(format!("{gap}{entry}").as_bytes()).and_then(|()| file.sync_all()).map_err(system)?;
        Ok(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_that_was_added_is_found_by_its_text_alone() {
        let folder = tempfile::TempDir::new().expect("a folder");
        let path = folder.path().join("tokens.toml");
        let first = Token::add(&path, "rig", &[Role::Query]).expect("added");
        let second = Token::add(&path, "watch", &[Role::Observe, Role::Administer]).expect("added");
        let tokens = Tokens::read(&path).expect("read");
        assert_eq!(tokens.find(&first).map(|token| token.name.as_str()), Some("rig"));
        assert_eq!(tokens.find(&second).map(|token| token.roles.len()), Some(2));
        assert!(tokens.find("").is_none() && tokens.find(&first[1..]).is_none());
        let text = std::fs::read_to_string(&path).expect("read");
        assert!(!text.contains(&first) && !text.contains(&second), "{text}");
        let taken = Token::add(&path, "rig", &[Role::Query]).expect_err("taken").to_string();
        assert!(taken.contains("\"rig\"") && taken.contains("tokens.toml"), "{taken}");
    }

    #[test]
    fn a_file_that_is_wrong_is_refused_with_what_is_wrong() {
        let folder = tempfile::TempDir::new().expect("a folder");
        let path = folder.path().join("tokens.toml");
        let entry = |name: &str, digest: &str| {
            format!("[[token]]\nname = \"{name}\"\nsha256 = \"{digest}\"\nroles = []\n")
        };
        let digest = hex(&digest("x"));
        for (text, named) in [
            (entry("a", "12"), "64 hexadecimal digits"),
            (entry("a", &digest) + &entry("b", &digest), "twice"),
            ("[[token]]\nname = \"a\"\n".into(), "sha256"),
            (entry("a", &digest).replace("[]", "[\"root\"]"), "root"),
        ] {
            std::fs::write(&path, text).expect("written");
            let error = Tokens::read(&path).expect_err(named).to_string();
            assert!(error.contains(named) && error.contains("access.tokens"), "{error}");
        }
    }
}
