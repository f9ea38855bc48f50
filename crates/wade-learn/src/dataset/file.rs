//! The data set on disk: one Parquet file in long form, a row for each surface of each sample, plain enough for pandas
//! and DuckDB. The key-value meta data carry what no column can: `wade.format`, `wade.meta` (JSON), `wade.units`
//! (JSON, by column) and `wade.frame`.

use std::fs::File;
use std::path::Path;
use wade_core::at::At;
use wade_core::caught::caught;

use parquet::errors::ParquetError;

use super::decode::decode;
use super::encode::{Loads, encode};
use super::pages;
use super::{Dataset, Flaw, Image};
use crate::files::StagedFile;

/// Newest format of the files that this program reads and writes: with a column for the clearance over the bed.
pub const FORMAT: u32 = 2;

/// Format of a file without it, which the same data keep, and with it their bytes.
pub(super) const WITHOUT_CLEARANCE: u32 = 1;

pub(super) const FORMAT_KEY: &str = "wade.format";
pub(super) const META_KEY: &str = "wade.meta";

/// Why a data set could not be read or written. The message names the file and what is wrong with it.
pub type DatasetError = At<Fault>;

/// What is wrong with a file. Rows are counted from 0, as pandas and DuckDB do.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// Missing, unreadable, or no room to write.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// Cut off, damaged, or not Parquet at all.
    #[error("cannot be read as Parquet: {0}")]
    Parquet(#[from] ParquetError),
    /// Damaged in a way that the reader of Parquet does not expect.
    #[error("the file is damaged: {message}")]
    Damaged {
        /// What the reader stumbled over.
        message: String,
    },
    /// Parquet, but without our meta data.
    #[error(
        "the meta data have no key `{key}`: `wade dataset` writes it, a copy by another program may lose it"
    )]
    NoMeta {
        /// The key.
        key: &'static str,
    },
    /// Meta data of another form.
    #[error("the meta data under {META_KEY} cannot be read: {0}")]
    Meta(#[from] serde_json::Error),
    /// Written by a newer program.
    #[error("format {found} is newer than {FORMAT}, the newest that this program reads: update wade")]
    NewerFormat {
        /// The format of the file.
        found: String,
    },
    /// A column is missing.
    #[error("column {column} is missing")]
    MissingColumn {
        /// Its name.
        column: &'static str,
    },
    /// A column of another length.
    #[error("column {column} has {found} values for {rows} rows")]
    ColumnLength {
        /// Its name.
        column: &'static str,
        /// Its length.
        found: usize,
        /// Rows of the file.
        rows: usize,
    },
    /// A column of another type.
    #[error("column {column} is {found}, which is not {expected}")]
    ColumnType {
        /// Its name.
        column: &'static str,
        /// Its type.
        found: String,
        /// What it must be.
        expected: &'static str,
    },
    /// Nothing where there must be something.
    #[error("column {column}, row {row}: there is no value")]
    Null {
        /// The column.
        column: &'static str,
        /// The row.
        row: usize,
    },
    /// Bytes that are no text.
    #[error("column {column}, row {row}: not UTF-8")]
    NotText {
        /// The column.
        column: &'static str,
        /// The row.
        row: usize,
    },
    /// A number that is none.
    #[error("column {column}, row {row}: {value} is not finite")]
    NotFinite {
        /// The column.
        column: &'static str,
        /// The row.
        row: usize,
        /// What stands there.
        value: f64,
    },
    /// A value that the column cannot have.
    #[error("column {column}, row {row}: `{value}` is not {expected}")]
    Value {
        /// The column.
        column: &'static str,
        /// The row.
        row: usize,
        /// What stands there.
        value: String,
        /// What it must be.
        expected: &'static str,
    },
    /// A vehicle of which the meta data do not list the surfaces.
    #[error("column vehicle, row {row}: the meta data do not list `{vehicle}`")]
    UnknownVehicle {
        /// The row.
        row: usize,
        /// The vehicle.
        vehicle: String,
    },
    /// A surface that the vehicle has not.
    #[error("column surface, row {row}: vehicle `{vehicle}` has no surface `{surface}`")]
    UnknownSurface {
        /// The row.
        row: usize,
        /// The vehicle.
        vehicle: String,
        /// The surface.
        surface: String,
    },
    /// The same surface of the same sample again.
    #[error("column surface, row {row}: `{surface}` of case `{case}`, section {section} is there already")]
    RepeatedSurface {
        /// The row.
        row: usize,
        /// The surface.
        surface: String,
        /// The case.
        case: String,
        /// The section.
        section: u32,
    },
    /// Two rows of one sample that state different things.
    #[error("column {column}, row {row}: differs from the other rows of case `{case}`, section {section}")]
    Differs {
        /// The column.
        column: &'static str,
        /// The row.
        row: usize,
        /// The case.
        case: String,
        /// The section.
        section: u32,
    },
    /// A sample without one of its surfaces.
    #[error("case `{case}`, section {section}, image {image}: there is no row for surface `{surface}`")]
    MissingSurface {
        /// The case.
        case: String,
        /// The section.
        section: u32,
        /// The image.
        image: Image,
        /// The surface.
        surface: String,
    },
    /// Values that make no data set.
    #[error("{0}")]
    Flaw(#[from] Flaw),
}

/// Reads a data set and checks it. Rows may stand in any order; further columns are left alone.
pub fn read(path: &Path) -> Result<Dataset, DatasetError> {
    load(path).map_err(At::path(path))
}

/// Writes a data set as a whole or not at all: to a temporary file in the same folder, which then takes the name.
pub fn write(path: &Path, dataset: &Dataset) -> Result<(), DatasetError> {
    store(path, dataset, Loads::Dictionary).map_err(At::path(path))
}

/// The same in half the room, for the data sets of campaigns. The bytes, and so the digest, differ from those of [`write`].
pub fn write_compact(path: &Path, dataset: &Dataset) -> Result<(), DatasetError> {
    store(path, dataset, Loads::Split).map_err(At::path(path))
}

fn load(path: &Path) -> Result<Dataset, Fault> {
    let file = File::open(path)?;
    let decoded = caught(|| decode(&pages::open(file)?));
    let dataset = decoded.unwrap_or_else(|message| Err(Fault::Damaged { message }))?;
    dataset.check()?;
    Ok(dataset)
}

fn store(path: &Path, dataset: &Dataset, loads: Loads) -> Result<(), Fault> {
    dataset.check()?;
    let mut staged = StagedFile::new(path)?;
    encode(&mut staged, dataset, loads)?;
    Ok(staged.finish()?)
}
