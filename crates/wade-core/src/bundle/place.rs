//! Folders that take their place as a whole and survive a power cut.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use nix::errno::Errno;
use nix::fcntl::{AT_FDCWD, RenameFlags, renameat2};

/// Writes a file that is on the disk when this returns.
pub fn write_synced(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Puts what a folder lists on the disk.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    // a path of one component stands in the working directory
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    File::open(folder)?.sync_all()
}

fn sync_parent(path: &Path) -> io::Result<()> {
    path.parent().map_or(Ok(()), sync_folder)
}

/// Puts a staged folder in its place, and what was there where that was staged.
pub fn place(staged: &Path, directory: &Path) -> io::Result<()> {
    if directory.exists() {
        return exchange(staged, directory);
    }
    move_folder(staged, directory)
}

/// Where the folder in place waits while the staged one takes its place, on file systems that cannot exchange two.
pub fn aside_of(directory: &Path) -> PathBuf {
    let name = directory.file_name().unwrap_or_default().to_string_lossy();
    directory.with_file_name(format!(".{name}.old"))
}

/// Exchanges the staged folder with the one in place, in a single step where the file system has one.
pub fn exchange(staged: &Path, directory: &Path) -> io::Result<()> {
    match renameat2(AT_FDCWD, staged, AT_FDCWD, directory, RenameFlags::RENAME_EXCHANGE) {
        // a folder of a lower layer of an overlay; a file system without the step; a kernel without it
        Err(Errno::EXDEV | Errno::EINVAL | Errno::ENOSYS | Errno::EOPNOTSUPP) => {
            exchange_in_steps(staged, directory)?;
        }
        outcome => outcome?,
    }
    sync_parent(directory)
}

/// The same in steps. Killed between them, the folder that was in place stands under [`aside_of`], whole.
fn exchange_in_steps(staged: &Path, directory: &Path) -> io::Result<()> {
    let aside = aside_of(directory);
    let _ = fs::remove_dir_all(&aside);
    match fs::rename(directory, &aside) {
        // a folder of a lower layer stays where it is, and its files are replaced one by one
        Err(error) if error.kind() == io::ErrorKind::CrossesDevices => {
            copy_folder(directory, &aside)?;
            replace_files(staged, directory)?;
            fs::remove_dir_all(staged)?;
        }
        moved => {
            moved?;
            fs::rename(staged, directory).inspect_err(|_| {
                let _ = fs::rename(&aside, directory);
            })?;
        }
    }
    move_folder(&aside, staged)
}

/// Moves the files of a folder over those of another, and removes what only the latter has.
fn replace_files(from: &Path, to: &Path) -> io::Result<()> {
    let names = |folder: &Path| {
        fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name())).collect::<io::Result<Vec<_>>>()
    };
    let new = names(from)?;
    for name in &new {
        fs::rename(from.join(name), to.join(name))?;
    }
    for name in names(to)?.iter().filter(|name| !new.contains(name)) {
        fs::remove_file(to.join(name))?;
    }
    sync_folder(to)
}

/// Moves a folder, also to another file system.
pub fn move_folder(from: &Path, to: &Path) -> io::Result<()> {
    match fs::rename(from, to) {
        Err(error) if error.kind() == io::ErrorKind::CrossesDevices => {
            copy_folder(from, to)?;
            fs::remove_dir_all(from)?;
        }
        outcome => outcome?,
    }
    sync_parent(to)
}

/// Copies the files of a folder, byte for byte, with the times at which they were written.
pub fn copy_folder(from: &Path, to: &Path) -> io::Result<()> {
    let _ = fs::remove_dir_all(to);
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let path = to.join(entry.file_name());
        fs::copy(entry.path(), &path)?;
        let copied = File::options().write(true).open(&path)?;
        copied.set_modified(entry.metadata()?.modified()?)?;
        copied.sync_all()?;
    }
    sync_folder(to)
}
