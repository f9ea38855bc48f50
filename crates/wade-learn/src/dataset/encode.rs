//! From samples to the rows of the file.

use std::collections::BTreeMap;
use std::io::Write;
use std::sync::Arc;

use parquet::basic::{Compression, Encoding};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int32Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;

use super::file::{FORMAT, FORMAT_KEY, Fault, META_KEY, WITHOUT_CLEARANCE};
use super::schema::{self, BED_CLEARANCE, LOADS, SCALARS, SECTION, STATES, SURFACE, TEXTS};
use super::{Dataset, Sample, SurfaceLoad};

/// Not the version of the program: the same data has the same bytes, and so the digest that provenances of weights state,
/// whichever version writes it.
const CREATED_BY: &str = "wade 0.1.0";
const UNITS_KEY: &str = "wade.units";
const FRAME_KEY: &str = "wade.frame";
const FRAME: &str = "body frame: right-handed, x forward, y left, z up, origin at the center of the hull's bounding \
                     box; velocities are the vehicle's; forces are those of the water on the vehicle, moments about \
                     the body origin";

/// How the columns of loads are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Loads {
    /// By a dictionary. A file that is written again has the bytes, and so the digest, that provenances of weights state.
    Dictionary,
    /// By the places of their bytes: nearly every load is another, so a dictionary of them makes the file half as large again,
    /// but their exponents are alike.
    Split,
}

/// Writes the whole file; the data set has been checked.
pub(super) fn encode(to: &mut (impl Write + Send), dataset: &Dataset, loads: Loads) -> Result<(), Fault> {
    let clearance = schema::has_clearance(dataset).then_some(BED_CLEARANCE);
    let added = clearance.iter().map(|column| (column.name, column.unit));
    let units: BTreeMap<_, _> = schema::units().chain(added).collect();
    let format = if clearance.is_some() { FORMAT } else { WITHOUT_CLEARANCE };
    let pairs = [
        (FORMAT_KEY, format.to_string()),
        (META_KEY, serde_json::to_string(&dataset.meta)?),
        (UNITS_KEY, serde_json::to_string(&units)?),
        (FRAME_KEY, FRAME.to_owned()),
    ];
    let mut properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(CREATED_BY.to_owned())
        .set_key_value_metadata(Some(pairs.map(|(key, value)| KeyValue::new(key.to_owned(), value)).into()));
    // those at rest repeat from section to section
    let moving = LOADS.iter().filter(|column| loads == Loads::Split && !column.names[0].starts_with("rest"));
    for name in moving.flat_map(|column| column.names) {
        properties = properties
            .set_column_dictionary_enabled(name.into(), false)
            .set_column_encoding(name.into(), Encoding::BYTE_STREAM_SPLIT);
    }
    let properties = Arc::new(properties.build());
    let mut writer = SerializedFileWriter::new(to, Arc::new(message(clearance.is_some())?), properties)?;
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
    if let Some(column) = clearance {
        let there: Vec<_> =
            rows(dataset).map(|(sample, ..)| i16::from((column.of)(sample).is_some())).collect();
        let values: Vec<_> = rows(dataset).filter_map(|(sample, ..)| (column.of)(sample)).collect();
        put::<DoubleType>(&mut group, &values, Some(&there))?;
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
fn message(with_clearance: bool) -> Result<parquet::schema::types::Type, ParquetError> {
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
    if with_clearance {
        add("optional double", BED_CLEARANCE.name, "");
    }
    parse_message_type(&(text + " }"))
}
