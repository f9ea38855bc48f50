//! A data set in Parquet: refused, or one that can be written and is then the same.

use std::fs;
use std::path::Path;

use tempfile::TempDir;
use wade_learn::dataset::{read, write};

thread_local! {
    static FOLDER: TempDir = TempDir::new_in("/dev/shm").expect("a temporary folder");
}

/// The file.
pub fn run(bytes: &[u8]) {
    FOLDER.with(|folder| {
        let path = folder.path().join("set.parquet");
        fs::write(&path, bytes).expect("written");
        match read(&path) {
            Err(error) => assert!(error.to_string().contains("set.parquet"), "{error}"),
            Ok(dataset) => {
                write(&path, &dataset).expect("what was read can be written");
                // single precision may have been double in somebody else's file
                let ours = read(&path).expect("what was written can be read");
                write(&path, &ours).expect("what was read can be written");
                let again = read(&path).expect("what was written can be read");
                assert_eq!(format!("{ours:?}"), format!("{again:?}"));
            }
        }
    });
}

/// The files of the tests.
pub fn seeds() -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/parquet");
    let files =
        fs::read_dir(folder).expect("the repository's tests").map(|entry| entry.expect("readable").path());
    let mut files: Vec<_> = files.collect();
    files.sort();
    files.into_iter().map(|file| fs::read(file).expect("readable")).collect()
}
