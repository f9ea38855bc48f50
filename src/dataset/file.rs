//! The data set on disk: one Parquet file in long form, a row for each surface of each sample, plain enough for pandas
//! and DuckDB. The key-value meta data carry what no column can: `wade.format`, `wade.meta` (JSON), `wade.units`
//! (JSON, by column) and `wade.frame`.

use std::collections::{BTreeMap, HashMap};
use std::fs::{File, Permissions};
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::UnitVector3;
use parquet::basic::Compression;
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int32Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;

use super::schema::{self, LOADS, Load, SCALARS, SECTION, STATES, SURFACE, State, TEXTS};
use super::table::Table;
use super::{Dataset, Flaw, Image, Meta, Rest, Sample, SurfaceLoad};
use crate::condition::Condition;
use crate::frame::Vec3;

/// Format of the files that this program writes, and the newest that it reads.
pub const FORMAT: u32 = 1;

const FORMAT_KEY: &str = "wade.format";
const META_KEY: &str = "wade.meta";
const UNITS_KEY: &str = "wade.units";
const FRAME_KEY: &str = "wade.frame";
const FRAME: &str = "body frame: right-handed, x forward, y left, z up, origin at the center of the hull's bounding \
                     box; velocities are the vehicle's; forces are those of the water on the vehicle, moments about \
                     the body origin";

/// Why a data set could not be read or written. The message names the file and what is wrong with it.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", .path.display())]
pub struct DatasetError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong.
    pub fault: Fault,
}

/// What is wrong with a file. Rows are counted from 0, as pandas and DuckDB do.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// Missing, unreadable, or no room to write.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// Cut off, damaged, or not Parquet at all.
    #[error("no sound Parquet file: {0}")]
    Parquet(#[from] ParquetError),
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
    load(path).map_err(|fault| DatasetError { path: path.to_owned(), fault })
}

/// Writes a data set as a whole or not at all: to a temporary file in the same folder, which then takes the name.
pub fn write(path: &Path, dataset: &Dataset) -> Result<(), DatasetError> {
    store(path, dataset).map_err(|fault| DatasetError { path: path.to_owned(), fault })
}

fn load(path: &Path) -> Result<Dataset, Fault> {
    let reader = SerializedFileReader::new(File::open(path)?)?;
    let meta = meta(&reader)?;
    let table = Table::read(&reader)?;
    let mut samples: Vec<Partial> = Vec::new();
    let mut index: HashMap<(&str, &str, u32), usize> = HashMap::new();
    for row in 0..table.rows {
        let case = table.text(schema::CASE.name, row)?;
        let image = table.text(schema::IMAGE.name, row)?;
        let at = *index.entry((case, image, section(&table, row)?)).or_insert(samples.len());
        if at == samples.len() {
            samples.push(Partial::new(&table, &meta, row)?);
        }
        samples[at].add(&table, &meta, row)?;
    }
    let samples = samples.into_iter().map(|sample| sample.finish(&meta)).collect::<Result<_, _>>()?;
    let dataset = Dataset { meta, samples };
    dataset.check()?;
    Ok(dataset)
}

fn meta(reader: &SerializedFileReader<File>) -> Result<Meta, Fault> {
    let pairs = reader.metadata().file_metadata().key_value_metadata();
    let value = |key: &'static str| {
        let pair = pairs.and_then(|pairs| pairs.iter().find(|pair| pair.key == key));
        pair.and_then(|pair| pair.value.as_deref()).ok_or(Fault::NoMeta { key })
    };
    let format = value(FORMAT_KEY)?;
    if format.parse::<u32>().ok().is_none_or(|found| found > FORMAT) {
        return Err(Fault::NewerFormat { found: format.to_owned() });
    }
    Ok(serde_json::from_str(value(META_KEY)?)?)
}

fn section(table: &Table, row: usize) -> Result<u32, Fault> {
    let value = table.number(SECTION, row)?;
    let whole = value >= 0.0 && value <= f64::from(i32::MAX) && value.fract() == 0.0;
    if whole {
        Ok(value as u32)
    } else {
        Err(Fault::Value {
            column: SECTION,
            row,
            value: value.to_string(),
            expected: "a whole number from 0",
        })
    }
}

/// A sample some of whose rows have been seen.
struct Partial {
    sample: Sample,
    loads: Vec<Option<SurfaceLoad>>,
}

impl Partial {
    fn new(table: &Table, meta: &Meta, row: usize) -> Result<Self, Fault> {
        let text = |column: &schema::Text| table.text(column.name, row);
        let number = |column: &schema::Scalar| table.number(column.name, row);
        let vector = |column: &State| vector(table, column.names, row);
        let vehicle = text(&schema::VEHICLE)?.to_owned();
        let surfaces = meta
            .vehicles
            .get(&vehicle)
            .ok_or_else(|| Fault::UnknownVehicle { row, vehicle: vehicle.clone() })?;
        let named = |column: &schema::Text, expected| {
            let value = text(column).map(str::to_owned);
            value.map(|value| Fault::Value { column: column.name, row, value, expected })
        };
        let image = match Image::from_name(text(&schema::IMAGE)?) {
            Some(image) => image,
            None => return Err(named(&schema::IMAGE, "original, left_right, front_rear or both")?),
        };
        let ground_contact = match schema::contact_from_name(text(&schema::GROUND_CONTACT)?) {
            Some(contact) => contact,
            None => return Err(named(&schema::GROUND_CONTACT, "wetted or dry")?),
        };
        let condition = Condition {
            velocity: vector(&schema::VELOCITY)?,
            ground_velocity: vector(&schema::GROUND_VELOCITY)?,
            angular_velocity: vector(&schema::ANGULAR_VELOCITY)?,
            acceleration: vector(&schema::ACCELERATION)?,
            angular_acceleration: vector(&schema::ANGULAR_ACCELERATION)?,
            depth: number(&schema::DEPTH)?,
            density: number(&schema::DENSITY)?,
            up: UnitVector3::new_unchecked(vector(&schema::UP)?),
            ground_contact,
        };
        let sample = Sample {
            vehicle,
            case: text(&schema::CASE)?.to_owned(),
            set: text(&schema::SET)?.to_owned(),
            image,
            section: section(table, row)?,
            start_s: number(&schema::START)?,
            end_s: number(&schema::END)?,
            condition,
            surfaces: Vec::new(),
        };
        Ok(Self { sample, loads: vec![None; surfaces.len()] })
    }

    fn add(&mut self, table: &Table, meta: &Meta, row: usize) -> Result<(), Fault> {
        self.agrees(table, row)?;
        let Sample { vehicle, case, section, .. } = &self.sample;
        let name = table.text(SURFACE, row)?;
        let index = meta.vehicles[vehicle].iter().position(|surface| surface == name).ok_or_else(|| {
            Fault::UnknownSurface { row, vehicle: vehicle.clone(), surface: name.to_owned() }
        })?;
        if self.loads[index].is_some() {
            let (surface, case, section) = (name.to_owned(), case.clone(), *section);
            return Err(Fault::RepeatedSurface { row, surface, case, section });
        }
        let rest =
            optional(table, &schema::REST_FORCE, row)?.zip(optional(table, &schema::REST_MOMENT, row)?);
        self.loads[index] = Some(SurfaceLoad {
            force: vector(table, schema::FORCE.names, row)?,
            moment: optional(table, &schema::MOMENT, row)?,
            viscous: optional(table, &schema::VISCOUS, row)?,
            rest: rest.map(|(force, moment)| Rest { force, moment }),
        });
        Ok(())
    }

    /// Every row of a sample repeats its state.
    fn agrees(&self, table: &Table, row: usize) -> Result<(), Fault> {
        let sample = &self.sample;
        let differs =
            |column| Err(Fault::Differs { column, row, case: sample.case.clone(), section: sample.section });
        for column in &TEXTS {
            if table.text(column.name, row)? != (column.of)(sample) {
                return differs(column.name);
            }
        }
        for column in &SCALARS {
            if table.number(column.name, row)? != (column.of)(sample) {
                return differs(column.name);
            }
        }
        for column in &STATES {
            let expected = (column.of)(sample);
            for (axis, name) in column.names.into_iter().enumerate() {
                if table.number(name, row)? != expected[axis] {
                    return differs(name);
                }
            }
        }
        Ok(())
    }

    fn finish(mut self, meta: &Meta) -> Result<Sample, Fault> {
        for (load, surface) in self.loads.into_iter().zip(&meta.vehicles[&self.sample.vehicle]) {
            let Some(load) = load else {
                let Sample { case, section, image, .. } = self.sample;
                return Err(Fault::MissingSurface { case, section, image, surface: surface.clone() });
            };
            self.sample.surfaces.push(load);
        }
        Ok(self.sample)
    }
}

fn vector(table: &Table, names: [&'static str; 3], row: usize) -> Result<Vec3, Fault> {
    Ok(Vec3::new(table.number(names[0], row)?, table.number(names[1], row)?, table.number(names[2], row)?))
}

/// All three components or none.
fn optional(table: &Table, column: &Load, row: usize) -> Result<Option<Vec3>, Fault> {
    let mut there = 0;
    for name in column.names {
        there += usize::from(table.optional(name, row)?.is_some());
    }
    if there == 0 { Ok(None) } else { vector(table, column.names, row).map(Some) }
}

fn store(path: &Path, dataset: &Dataset) -> Result<(), Fault> {
    dataset.check()?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // readable as any file that a program writes, less the umask; the default of temporary files is for secrets
    let mut staged =
        tempfile::Builder::new().permissions(Permissions::from_mode(0o666)).tempfile_in(folder)?;
    encode(staged.as_file_mut(), dataset)?;
    staged.as_file().sync_all()?;
    staged.persist(path).map_err(|error| error.error)?;
    Ok(())
}

fn encode(to: &mut (impl Write + Send), dataset: &Dataset) -> Result<(), Fault> {
    let units: BTreeMap<_, _> = schema::units().collect();
    let pairs = [
        (FORMAT_KEY, FORMAT.to_string()),
        (META_KEY, serde_json::to_string(&dataset.meta)?),
        (UNITS_KEY, serde_json::to_string(&units)?),
        (FRAME_KEY, FRAME.to_owned()),
    ];
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(format!("wade {}", env!("CARGO_PKG_VERSION")))
        .set_key_value_metadata(Some(pairs.map(|(key, value)| KeyValue::new(key.to_owned(), value)).into()))
        .build();
    let mut writer = SerializedFileWriter::new(to, Arc::new(message()?), Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    let text = |text: &str| ByteArray::from(text.as_bytes().to_vec());
    for column in &TEXTS {
        let values: Vec<_> = rows(dataset).map(|(sample, ..)| text((column.of)(sample))).collect();
        put::<ByteArrayType>(&mut group, &values, None)?;
    }
    let values: Vec<_> = rows(dataset).map(|(.., surface)| text(surface)).collect();
    put::<ByteArrayType>(&mut group, &values, None)?;
    let values: Vec<_> = rows(dataset).map(|(sample, ..)| sample.section as i32).collect();
    put::<Int32Type>(&mut group, &values, None)?;
    for column in &SCALARS {
        let values: Vec<_> = rows(dataset).map(|(sample, ..)| (column.of)(sample)).collect();
        put::<DoubleType>(&mut group, &values, None)?;
    }
    for column in &STATES {
        for axis in 0..3 {
            let values: Vec<_> = rows(dataset).map(|(sample, ..)| (column.of)(sample)[axis]).collect();
            put::<DoubleType>(&mut group, &values, None)?;
        }
    }
    for column in &LOADS {
        let there: Vec<_> =
            rows(dataset).map(|(_, load, _)| i16::from((column.of)(load).is_some())).collect();
        for axis in 0..3 {
            let values = rows(dataset).filter_map(|(_, load, _)| (column.of)(load).map(|v| v[axis] as f32));
            put::<FloatType>(&mut group, &values.collect::<Vec<_>>(), column.nullable.then_some(&there))?;
        }
    }
    group.close()?;
    writer.close()?;
    Ok(())
}

/// The rows of the file: a sample, one of its loads, and the name of the surface.
fn rows(dataset: &Dataset) -> impl Iterator<Item = (&Sample, &SurfaceLoad, &str)> {
    dataset.samples.iter().flat_map(|sample| {
        let surfaces = dataset.meta.vehicles[&sample.vehicle].iter();
        sample.surfaces.iter().zip(surfaces).map(move |(load, surface)| (sample, load, surface.as_str()))
    })
}

fn put<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, impl Write + Send>,
    values: &[T::T],
    levels: Option<&Vec<i16>>,
) -> Result<(), Fault> {
    if let Some(mut column) = group.next_column()? {
        column.typed::<T>().write_batch(values, levels.map(Vec::as_slice), None)?;
        column.close()?;
    }
    Ok(())
}

/// The schema of the file, in Parquet's own notation.
fn message() -> Result<parquet::schema::types::Type, ParquetError> {
    let mut text = "message wade {".to_owned();
    let mut add = |kind: &str, name: &str, suffix: &str| {
        text.push_str(&format!(" {kind} {name}{suffix};"));
    };
    TEXTS.iter().for_each(|column| add("required binary", column.name, " (STRING)"));
    add("required binary", SURFACE, " (STRING)");
    add("required int32", SECTION, "");
    SCALARS.iter().for_each(|column| add("required double", column.name, ""));
    STATES.iter().flat_map(|column| column.names).for_each(|name| add("required double", name, ""));
    for column in &LOADS {
        let kind = if column.nullable { "optional float" } else { "required float" };
        column.names.into_iter().for_each(|name| add(kind, name, ""));
    }
    parse_message_type(&(text + " }"))
}
