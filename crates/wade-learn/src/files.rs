//! Files that appear whole or not at all, and dates as people read them.

use std::fs::Permissions;
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// A file that is written beside its place and takes it once it is whole. Dropped before, nothing of it remains.
#[derive(Debug)]
pub struct StagedFile {
    file: NamedTempFile,
    place: PathBuf,
}

impl StagedFile {
    /// Begins a file. Where a link stands it stays, and what it leads to is replaced.
    ///
    /// # Errors
    ///
    /// Where `place` is a folder or a device, or its folder cannot be written to.
    pub fn new(place: &Path) -> io::Result<Self> {
        let place = place.canonicalize().unwrap_or_else(|_| place.to_owned());
        if place.exists() && !place.is_file() {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is no file: name one to write"));
        }
        let folder = place.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        // readable as any file that a program writes, less the umask; the default of temporary files is for secrets
        let everyone = Permissions::from_mode(0o666);
        let file = tempfile::Builder::new().prefix(".wade-").permissions(everyone).tempfile_in(folder)?;
        Ok(Self { file, place })
    }

    /// Puts the file in its place, where it survives a power cut.
    pub fn finish(self) -> io::Result<()> {
        self.file.as_file().sync_all()?;
        self.file.persist(&self.place)?;
        Ok(())
    }
}

impl Write for StagedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Writes a file as a whole or not at all, as [`StagedFile`] does.
pub fn write_whole(place: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = StagedFile::new(place)?;
    file.write_all(bytes)?;
    file.finish()
}

/// Seconds since 1970 as year, month, day, hour and minute UTC; "unknown" before.
pub fn utc_date(unix_s: i64) -> String {
    let Ok(since) = u64::try_from(unix_s) else { return "unknown".to_owned() };
    let (days, seconds) = (since / 86_400, since % 86_400);
    let (year, month, day) = civil(days);
    format!("{year}-{month:02}-{day:02} {:02}:{:02}", seconds / 3600, seconds / 60 % 60)
}

/// Days since 1970 as year, month, day (H. Hinnant, chrono-compatible low-level date algorithms, `civil_from_days`).
pub fn civil(days: u64) -> (u64, u64, u64) {
    let shifted = days + 719_468;
    let (era, of_era) = (shifted / 146_097, shifted % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let march = (5 * of_year + 2) / 153;
    let month = if march < 10 { march + 3 } else { march - 9 };
    (era * 400 + year + u64::from(month <= 2), month, of_year - (153 * march + 2) / 5 + 1)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::fs;

    use super::*;

    #[test]
    fn a_file_that_is_not_finished_leaves_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("table.csv");
        fs::write(&place, "old").unwrap();
        let mut file = StagedFile::new(&place).unwrap();
        file.write_all(b"half").unwrap();
        drop(file);
        assert_eq!(fs::read_to_string(&place).unwrap(), "old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        write_whole(&place, b"new").unwrap();
        assert_eq!(fs::read_to_string(&place).unwrap(), "new");
    }

    #[test]
    fn links_stay_and_folders_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (place, link) = (folder.path().join("table.csv"), folder.path().join("link.csv"));
        fs::write(&place, "old").unwrap();
        std::os::unix::fs::symlink(&place, &link).unwrap();
        write_whole(&link, b"new").unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&place).unwrap(), "new");
        let refused = write_whole(folder.path(), b"new").unwrap_err();
        assert!(refused.to_string().contains("is no file"), "{refused}");
    }

    #[test]
    fn a_new_file_is_for_everyone_whom_the_umask_lets_in() {
        let folder = tempfile::tempdir().unwrap();
        let (whole, plain) = (folder.path().join("whole"), folder.path().join("plain"));
        write_whole(&whole, b"text").unwrap();
        fs::write(&plain, b"text").unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&whole), mode(&plain));
    }
}
