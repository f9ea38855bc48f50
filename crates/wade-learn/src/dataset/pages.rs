//! What a Parquet file and its pages claim, compared with the bytes that are there: the reader of Parquet makes room for
//! the claim, or sets out on it, first and looks afterwards.

use std::fs::File;
use std::io::BufReader;

use parquet::basic::Encoding;
use parquet::column::page::{Page, PageMetadata, PageReader};
use parquet::column::reader::{ColumnReader, get_column_reader};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::ParquetMetaData;
use parquet::file::reader::{ChunkReader, FileReader, Length, RowGroupReader, SerializedFileReader};

use super::thrift;

/// Rows for each byte of a file, at most. Rows of a data set differ in case, image, section or surface, which a dictionary
/// with run lengths, the densest of the encodings that are read, keeps in no less than a bit a row.
const ROWS_A_BYTE: u64 = 8;
/// Bytes that Snappy makes of one, at most: its densest element copies 64 bytes and takes three
/// (<https://github.com/google/snappy/blob/main/format_description.txt>, section 2.2.2).
const BYTES_A_BYTE: u64 = 22;
/// The length of the meta data and the four letters at the end of a file.
const FOOTER: u64 = 8;
/// Bytes of the header of a page, at most: with the smallest and the largest of its values, which are names here.
const HEADER: u64 = 65_536;
/// A field of 32 bits that follows the one before it, in Thrift's compact protocol.
const NEXT_I32: u8 = 0x15;

/// A file whose pages say no more bytes than can be made of those that are there.
pub(super) struct Pages(File);

/// Opens a file and reads what stands at its end.
pub(super) fn open(file: File) -> Result<SerializedFileReader<Pages>> {
    let bytes = file.len();
    check_metadata(&file)?;
    let reader = SerializedFileReader::new(Pages(file))?;
    let most = bytes.saturating_mul(ROWS_A_BYTE);
    let rows = rows(reader.metadata());
    if rows > most {
        return Err(damaged(format!("{rows} rows in {bytes} bytes, which hold at most {most}")));
    }
    Ok(reader)
}

/// Looks at what stands at the end of a file, where it is of a length that can be; if it is not, the reader says so.
fn check_metadata(file: &File) -> Result<()> {
    let Some(end) = file.len().checked_sub(FOOTER) else { return Ok(()) };
    let length = file.get_bytes(end, FOOTER as usize)?;
    let length = u32::from_le_bytes([length[0], length[1], length[2], length[3]]);
    let Some(start) = end.checked_sub(u64::from(length)) else { return Ok(()) };
    let metadata = file.get_bytes(start, length as usize)?;
    thrift::check(&metadata).map_err(|fault| damaged(format!("the description of the file: {fault}")))
}

/// A column of a group of rows.
pub(super) fn column(group: &dyn RowGroupReader, index: usize) -> Result<ColumnReader> {
    let descriptor = group.metadata().column(index).column_descr_ptr();
    Ok(get_column_reader(descriptor, Box::new(Column(group.get_column_page_reader(index)?))))
}

/// Rows that room is made for: of all groups together, or as the file says as a whole.
fn rows(metadata: &ParquetMetaData) -> u64 {
    let whole = metadata.file_metadata().num_rows();
    let number = |rows| u64::try_from(rows).unwrap_or(0);
    let groups = metadata.row_groups().iter().map(|group| number(group.num_rows()));
    groups.fold(0, u64::saturating_add).max(number(whole))
}

fn damaged(what: String) -> ParquetError {
    ParquetError::General(what)
}

impl Length for Pages {
    fn len(&self) -> u64 {
        self.0.len()
    }
}

impl ChunkReader for Pages {
    type T = BufReader<File>;

    /// Where the header of a page is read: its first two fields are its kind and its size.
    fn get_read(&self, start: u64) -> Result<Self::T> {
        let there = self.len().saturating_sub(start);
        if there == FOOTER {
            return self.0.get_read(start);
        }
        let header = self.0.get_bytes(start, there.min(HEADER) as usize)?;
        thrift::check(&header).map_err(|fault| damaged(format!("the page at byte {start}: {fault}")))?;
        let mut header = &header[..];
        let claim = next_number(&mut header).and_then(|_| next_number(&mut header));
        let claim = claim.ok_or_else(|| damaged(format!("no page begins at byte {start}")))?;
        let most = there.saturating_mul(BYTES_A_BYTE);
        if claim > most {
            return Err(damaged(format!(
                "the page at byte {start} says {claim} bytes, at most {most} can be made of the rest of the file"
            )));
        }
        self.0.get_read(start)
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<bytes::Bytes> {
        self.0.get_bytes(start, length)
    }
}

/// The number in the next field, at least 0.
fn next_number(from: &mut &[u8]) -> Option<u64> {
    let mut rest = from.strip_prefix(&[NEXT_I32])?;
    let mut number = 0;
    for shift in (0..35).step_by(7) {
        let (byte, after) = rest.split_first()?;
        rest = after;
        number |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            *from = rest;
            // zigzag: negative numbers are odd
            return (number & 1 == 0).then_some(number >> 1);
        }
    }
    None
}

/// The pages of one column.
struct Column(Box<dyn PageReader>);

impl Column {
    fn checked(page: Page) -> Result<Page> {
        // both make room for a number of values that stands among them, one for values that grow with their square
        if matches!(page.encoding(), Encoding::DELTA_LENGTH_BYTE_ARRAY | Encoding::DELTA_BYTE_ARRAY) {
            return Err(damaged(format!(
                "the encoding {} is not read: write PLAIN or a dictionary",
                page.encoding()
            )));
        }
        // a text has four bytes of length, no number has less
        let most = page.buffer().len() / 4;
        let values = page.num_values() as usize;
        if page.is_dictionary_page() && values > most {
            return Err(damaged(format!("a dictionary of {values} values in bytes for at most {most}")));
        }
        Ok(page)
    }
}

impl Iterator for Column {
    type Item = Result<Page>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}

impl PageReader for Column {
    fn get_next_page(&mut self) -> Result<Option<Page>> {
        self.0.get_next_page()?.map(Self::checked).transpose()
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>> {
        self.0.peek_next_page()
    }

    fn skip_next_page(&mut self) -> Result<()> {
        self.0.skip_next_page()
    }
}
