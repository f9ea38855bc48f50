//! The columns of a Parquet file in memory, whoever wrote it: pandas and DuckDB turn single precision into double and
//! required columns into nullable ones.

use std::collections::HashMap;

use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType};
use parquet::file::reader::{FileReader, RowGroupReader, SerializedFileReader};

use super::file::Fault;
use super::pages::{self, Pages};
use super::schema;

/// Values of one column; `None` for a null.
enum Column {
    Text(Vec<Option<ByteArray>>),
    Number(Vec<Option<f64>>),
}

/// Every column of the schema.
pub(super) struct Table {
    pub rows: usize,
    columns: HashMap<&'static str, Column>,
}

impl Table {
    /// Reads the columns that the schema names and leaves any other.
    pub(super) fn read(reader: &SerializedFileReader<Pages>) -> Result<Self, Fault> {
        let rows = usize::try_from(reader.metadata().file_metadata().num_rows()).unwrap_or(0);
        let descriptor = reader.metadata().file_metadata().schema_descr();
        let mut columns = HashMap::new();
        for column in names() {
            let index = descriptor.columns().iter().position(|c| c.path().string() == column);
            let Some(index) = index else {
                if column == schema::BED_CLEARANCE.name {
                    continue;
                }
                return Err(Fault::MissingColumn { column });
            };
            let mut values =
                if is_text(column) { Column::Text(Vec::new()) } else { Column::Number(Vec::new()) };
            for group in 0..reader.num_row_groups() {
                values.append(column, &*reader.get_row_group(group)?, index)?;
            }
            let found = values.len();
            if found != rows {
                return Err(Fault::ColumnLength { column, found, rows });
            }
            columns.insert(column, values);
        }
        Ok(Self { rows, columns })
    }

    /// The text in a row; a null is refused.
    pub(super) fn text(&self, column: &'static str, row: usize) -> Result<&str, Fault> {
        match self.columns.get(column) {
            Some(Column::Text(values)) => {
                let bytes = values[row].as_ref().ok_or(Fault::Null { column, row })?;
                bytes.as_utf8().map_err(|_| Fault::NotText { column, row })
            }
            _ => Err(Fault::MissingColumn { column }),
        }
    }

    /// The number in a row, where it is not null; one that is not finite is refused.
    pub(super) fn optional(&self, column: &'static str, row: usize) -> Result<Option<f64>, Fault> {
        match self.columns.get(column) {
            Some(Column::Number(values)) => match values[row] {
                Some(value) if !value.is_finite() => Err(Fault::NotFinite { column, row, value }),
                value => Ok(value),
            },
            _ => Err(Fault::MissingColumn { column }),
        }
    }

    /// The clearance over the bed in a row; none where the file has no such column.
    pub(super) fn clearance(&self, row: usize) -> Result<Option<f64>, Fault> {
        match self.optional(schema::BED_CLEARANCE.name, row) {
            Err(Fault::MissingColumn { .. }) => Ok(None),
            found => found,
        }
    }

    /// The number in a row; a null is refused.
    pub(super) fn number(&self, column: &'static str, row: usize) -> Result<f64, Fault> {
        self.optional(column, row)?.ok_or(Fault::Null { column, row })
    }
}

fn is_text(column: &str) -> bool {
    column == schema::SURFACE || schema::TEXTS.iter().any(|text| text.name == column)
}

fn names() -> impl Iterator<Item = &'static str> {
    let texts = schema::TEXTS.into_iter().map(|text| text.name);
    let numbers = schema::units().map(|(name, _)| name);
    texts.chain([schema::SURFACE, schema::SECTION]).chain(numbers).chain([schema::BED_CLEARANCE.name])
}

impl Column {
    fn len(&self) -> usize {
        match self {
            Self::Text(values) => values.len(),
            Self::Number(values) => values.len(),
        }
    }

    fn append(
        &mut self,
        column: &'static str,
        group: &dyn RowGroupReader,
        index: usize,
    ) -> Result<(), Fault> {
        let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
        let found = group.metadata().column(index).column_type();
        match (self, pages::column(group, index)?) {
            (Self::Text(to), ColumnReader::ByteArrayColumnReader(from)) => {
                extend(to, from, rows, |value| value)
            }
            (Self::Number(to), ColumnReader::FloatColumnReader(from)) => extend(to, from, rows, f64::from),
            (Self::Number(to), ColumnReader::DoubleColumnReader(from)) => {
                extend(to, from, rows, |value| value)
            }
            (Self::Number(to), ColumnReader::Int32ColumnReader(from)) => extend(to, from, rows, f64::from),
            (Self::Number(to), ColumnReader::Int64ColumnReader(from)) => {
                extend(to, from, rows, |value| value as f64)
            }
            (Self::Text(_), _) => {
                Err(Fault::ColumnType { column, found: found.to_string(), expected: "text" })
            }
            (Self::Number(_), _) => {
                Err(Fault::ColumnType { column, found: found.to_string(), expected: "a number" })
            }
        }
    }
}

/// Appends a column chunk. Parquet stores the values that are there, and a level for every row that says whether its
/// value is.
fn extend<T: DataType, V>(
    to: &mut Vec<Option<V>>,
    mut from: ColumnReaderImpl<T>,
    rows: usize,
    convert: impl Fn(T::T) -> V,
) -> Result<(), Fault> {
    let (mut levels, mut values) = (Vec::new(), Vec::new());
    let mut left = rows;
    while left > 0 {
        let (read, ..) = from.read_records(left, Some(&mut levels), None, &mut values)?;
        if read == 0 {
            break;
        }
        left -= read;
    }
    let mut values = values.into_iter().map(convert);
    if levels.is_empty() {
        to.extend(values.map(Some));
    } else {
        to.extend(levels.into_iter().map(|level| if level > 0 { values.next() } else { None }));
    }
    Ok(())
}
