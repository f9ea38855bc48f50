//! SHA256SUMS, in the form that `sha256sum --check` reads.

use std::collections::BTreeMap;

use super::Fault;
use crate::digest::sha256;

/// Checksums in hexadecimal by file name.
pub type Sums = BTreeMap<String, String>;

pub fn parse(bytes: &[u8]) -> Result<Sums, Fault> {
    let text = String::from_utf8_lossy(bytes);
    let line = |(i, line): (usize, &str)| {
        let (sum, name) = line.split_once("  ").ok_or(Fault::ChecksumSyntax { line: i + 1 })?;
        Ok((name.to_owned(), sum.to_owned()))
    };
    text.lines().enumerate().map(line).collect()
}

pub fn verify(sums: &Sums, name: &str, bytes: &[u8]) -> Result<(), Fault> {
    let expected = sums.get(name).ok_or(Fault::NoChecksum)?;
    if *expected == sha256(bytes) { Ok(()) } else { Err(Fault::Checksum) }
}

pub fn render(files: &BTreeMap<&'static str, Vec<u8>>) -> String {
    files.iter().map(|(name, bytes)| format!("{}  {name}\n", sha256(bytes))).collect()
}
