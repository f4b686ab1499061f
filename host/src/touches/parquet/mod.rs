//! Touches as Parquet: smaller and faster to load than text, and read by pandas, Polars, DuckDB and others.
//!
//! One row per touch: `object` (string), `t1`, `t2`, `t3` (seconds, null where a finger never touched), `direction` and
//! `alignment` (lists of three, null where unknown), and where the touches have one `position` (a list of three whole numbers,
//! in micrometers). Row groups of about a million rows.

#[cfg(test)]
mod tests;

use super::dataset::name_of;
use super::text::Alike;
use super::{located, touch_of_seconds};
use crate::error::{Error, Place, Result, TouchesProblem};
use bytes::Bytes;
use palpate_shared::{Pose, Q15_ONE, Touch};
use parquet::basic::Compression;
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int32Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::{ParquetMetaData, RowGroupMetaData};
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{ChunkReader, FileReader, Length, RowGroupReader, SerializedFileReader};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::record::Field;
use std::cell::Cell;
use std::fs::File;
use std::io::BufReader;
use std::panic::AssertUnwindSafe;
use std::path::Path;
use std::sync::{Arc, Once};

/// Number of rows in a row group.
const GROUP: usize = 1 << 20;

/// Number of rows encoded or decoded at once.
const BATCH: usize = 1 << 14;

const SCHEMA: &str = "
message touches {
  REQUIRED BYTE_ARRAY object (STRING);
  OPTIONAL DOUBLE t1;
  OPTIONAL DOUBLE t2;
  OPTIONAL DOUBLE t3;
  OPTIONAL GROUP direction (LIST) { REPEATED GROUP list { REQUIRED FLOAT element; } }
  OPTIONAL GROUP alignment (LIST) { REPEATED GROUP list { REQUIRED FLOAT element; } }
}";

/// The last column, of touches with a position.
const POSITION: &str = "  OPTIONAL GROUP position (LIST) { REPEATED GROUP list { REQUIRED INT32 element; } }
}";

/// Writes touches of one object, as they come, to `file`. Either all have a position or none has one.
///
/// # Errors
/// Errors of the touches; some touches with a position and some without; a file, called `path` in the message, that cannot be written.
pub fn write(path: &Path, file: &File, object: &str, touches: impl Iterator<Item = Result<Touch>>) -> Result<()> {
    let wrong = |error| write_error(path, error);
    let mut alike = Alike::default();
    let mut touches =
        touches.map(|touch| alike.admit(touch?).map_err(|problem| Error::at(Place::file(path), problem))).peekable();
    let has_position = touches.peek().is_some_and(|touch| touch.as_ref().is_ok_and(|touch| touch.position().is_some()));
    let schema = match has_position {
        true => SCHEMA.trim_end_matches('}').to_owned() + POSITION,
        false => SCHEMA.into(),
    };
    let schema = Arc::new(parquet::schema::parser::parse_message_type(&schema).map_err(wrong)?);
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(format!("palpate {}", env!("CARGO_PKG_VERSION")))
        .build();
    let mut writer = SerializedFileWriter::new(file, schema, Arc::new(properties)).map_err(wrong)?;
    while touches.peek().is_some() {
        let group = touches.by_ref().take(GROUP).collect::<Result<Vec<_>>>()?;
        let mut columns = writer.next_row_group().map_err(wrong)?;
        write_group(&mut columns, object, &group).map_err(wrong)?;
        columns.close().map_err(wrong)?;
    }
    writer.close().map_err(wrong)?;
    Ok(())
}

fn write_group(
    columns: &mut SerializedRowGroupWriter<'_, &File>,
    object: &str,
    touches: &[Touch],
) -> Result<(), ParquetError> {
    let object = ByteArray::from(object);
    column::<ByteArrayType>(columns, touches, |_, values, _| values.push(object.clone()))?;
    for finger in 0..3 {
        column::<DoubleType>(columns, touches, |touch, values, levels| {
            let micros = touch.times()[finger].micros();
            values.extend(micros.map(|micros| f64::from(micros) / 1e6));
            levels.push((i16::from(micros.is_some()), 0));
        })?;
    }
    let vectors: [fn(Pose) -> [i16; 3]; 2] = [|pose| pose.direction, |pose| pose.alignment];
    for vector in vectors {
        column::<FloatType>(columns, touches, |touch, values, levels| match touch.pose() {
            None => levels.push((0, 0)),
            Some(pose) => {
                values.extend(vector(pose).map(|cosine| f32::from(cosine) / f32::from(Q15_ONE)));
                levels.extend([(2, 0), (2, 1), (2, 1)]);
            }
        })?;
    }
    if touches.first().is_some_and(|touch| touch.position().is_some()) {
        column::<Int32Type>(columns, touches, |touch, values, levels| {
            values.extend(touch.position().into_iter().flat_map(|position| position.micrometers));
            levels.extend([(2, 0), (2, 1), (2, 1)]);
        })?;
    }
    Ok(())
}

/// Writes the next column: `encode` appends a touch's values, and its definition and repetition levels.
fn column<T: DataType>(
    columns: &mut SerializedRowGroupWriter<'_, &File>,
    touches: &[Touch],
    encode: impl Fn(&Touch, &mut Vec<T::T>, &mut Vec<(i16, i16)>),
) -> Result<(), ParquetError> {
    let Some(mut column) = columns.next_column()? else {
        return Err(ParquetError::General("more columns than the schema has".into()));
    };
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    for batch in touches.chunks(BATCH) {
        values.clear();
        levels.clear();
        batch.iter().for_each(|touch| encode(touch, &mut values, &mut levels));
        let (definition, repetition): (Vec<i16>, Vec<i16>) = levels.iter().copied().unzip();
        // A column that is never null has no levels.
        let levels = |levels| (!definition.is_empty()).then_some(levels);
        column.typed::<T>().write_batch(&values, levels(definition.as_slice()), levels(repetition.as_slice()))?;
    }
    column.close()
}

/// Reads the touches of a file with columns `t1`, `t2`, `t3`, and, where known, `direction`, `alignment` and `position`. A column
/// `object` names the object that the file is called after, or is null.
///
/// # Errors
/// When the file cannot be read, is no Parquet, lacks a column, a value is wrong, or a row is of another object (the row is
/// named).
pub fn read(path: &Path) -> Result<Vec<Touch>> {
    let io = |error| Error::io(path, "read the touches", error);
    let wrong = |problem| Error::at(Place::file(path), problem);
    let file = File::open(path).map_err(io)?;
    let length = file.metadata().map_err(io)?.len();
    let touches = contained(|| read_touches(Bounded { file, length }, &name_of(path))).map_err(wrong)?;
    if touches.is_empty() {
        return Err(wrong(TouchesProblem::NoTouches));
    }
    Ok(touches)
}

/// A table of any columns, as text, null where it is empty: its header and its rows, in their order.
///
/// # Errors
/// When the file cannot be read, or as `wrong` says for one that is not Parquet.
pub(crate) fn table(path: &Path, wrong: impl Fn(String) -> Error) -> Result<(Vec<String>, Vec<Vec<String>>)> {
    let io = |error| Error::io(path, "read the rows", error);
    let file = File::open(path).map_err(io)?;
    let length = file.metadata().map_err(io)?.len();
    let read = || {
        let reader = SerializedFileReader::new(Bounded { file, length }).map_err(|error| not_parquet(&error))?;
        check_ranges(reader.metadata(), length)?;
        let schema = reader.metadata().file_metadata().schema_descr();
        let header = schema.root_schema().get_fields().iter().map(|field| field.name().to_owned()).collect();
        let rows = reader.get_row_iter(None).map_err(|error| not_parquet(&error))?;
        let cells = |row: parquet::record::Row| row.get_column_iter().map(|(_, field)| cell(field)).collect();
        let rows: Result<Vec<Vec<String>>, TouchesProblem> =
            rows.map(|row| row.map(cells).map_err(|error| not_parquet(&error))).collect();
        Ok((header, rows?))
    };
    contained(read).map_err(|problem| wrong(problem.to_string()))
}

/// A value as text that reads as the same number.
fn cell(field: &Field) -> String {
    match field {
        Field::Null => String::new(),
        Field::Str(text) => text.clone(),
        Field::Float(number) => number.to_string(),
        Field::Double(number) => number.to_string(),
        other => other.to_string(),
    }
}

fn read_touches(file: Bounded, object: &str) -> Result<Vec<Touch>, TouchesProblem> {
    let length = file.length;
    let reader = SerializedFileReader::new(file).map_err(|error| not_parquet(&error))?;
    check_ranges(reader.metadata(), length)?;
    let (mut touches, mut alike) = (Vec::new(), Alike::default());
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group).map_err(|error| not_parquet(&error))?;
        read_group(group.as_ref(), object, &mut touches, &mut alike)?;
    }
    Ok(touches)
}

/// Turns a panic of the reader into an error, and keeps its message from stderr. Version 60.1 panics on several kinds of
/// damage, such as a page that refers to a dictionary that is not there.
fn contained<T>(read: impl FnOnce() -> Result<T, TouchesProblem>) -> Result<T, TouchesProblem> {
    thread_local! {
        static READING: Cell<bool> = const { Cell::new(false) };
    }
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let earlier = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !READING.get() {
                earlier(panic);
            }
        }));
    });
    READING.set(true);
    // Whatever a panic leaves half done is dropped.
    let result = std::panic::catch_unwind(AssertUnwindSafe(read));
    READING.set(false);
    result.unwrap_or_else(|_| Err(not_parquet(&"damaged in a way that the reader cannot name")))
}

fn not_parquet(message: &impl ToString) -> TouchesProblem {
    TouchesProblem::NotParquet { message: message.to_string() }
}

/// Refuses columns that lie outside the file: the reader panics on those that start or end below 0.
fn check_ranges(metadata: &ParquetMetaData, length: u64) -> Result<(), TouchesProblem> {
    for column in metadata.row_groups().iter().flat_map(RowGroupMetaData::columns) {
        let start = column.dictionary_page_offset().unwrap_or_else(|| column.data_page_offset());
        let end = u64::try_from(start).ok().zip(u64::try_from(column.compressed_size()).ok());
        if end.and_then(|(start, size)| start.checked_add(size)).is_none_or(|end| end > length) {
            return Err(not_parquet(&format!("the column {} lies outside the file", column.column_path())));
        }
    }
    Ok(())
}

/// A file that is asked for no more than it has, regardless of its own statements: the reader reserves memory first.
struct Bounded {
    file: File,
    length: u64,
}

impl Length for Bounded {
    fn len(&self) -> u64 {
        self.length
    }
}

impl ChunkReader for Bounded {
    type T = BufReader<File>;

    fn get_read(&self, start: u64) -> Result<Self::T, ParquetError> {
        self.file.get_read(start)
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes, ParquetError> {
        match start.checked_add(length as u64) {
            Some(end) if end <= self.length => self.file.get_bytes(start, length),
            _ => Err(ParquetError::EOF(format!("{length} bytes from {start} of a file of {}", self.length))),
        }
    }
}

fn read_group(
    group: &dyn RowGroupReader,
    object: &str,
    touches: &mut Vec<Touch>,
    alike: &mut Alike,
) -> Result<(), TouchesProblem> {
    let mut names = Column::open(group, "object")?;
    let time = |name| Column::open(group, name)?.ok_or(TouchesProblem::NoColumn { name });
    let mut times = [time("t1")?, time("t2")?, time("t3")?];
    let [mut direction, mut alignment] = [Column::open(group, "direction")?, Column::open(group, "alignment")?];
    let mut position = Column::open(group, "position")?;
    loop {
        let mut rows = Vec::with_capacity(times.len());
        for column in &mut times {
            rows.push(column.rows::<1>()?);
        }
        let [first, middle, last] = rows.as_slice() else { return Ok(()) };
        let count = first.len();
        // A column that the file does not have is one of nulls.
        let vectors =
            |column: &mut Option<Column>| column.as_mut().map_or_else(|| Ok(vec![None; count]), Column::rows::<3>);
        let (directions, alignments) = (vectors(&mut direction)?, vectors(&mut alignment)?);
        let positions = vectors(&mut position)?;
        let names = names.as_mut().map_or_else(|| Ok(vec![None; count]), Column::names)?;
        let lengths = [middle.len(), last.len(), directions.len(), alignments.len(), positions.len(), names.len()];
        if lengths.iter().any(|&rows| rows != count) {
            return Err(not_parquet(&"columns of different length"));
        }
        if count == 0 {
            return Ok(());
        }
        let is_other = |name: &Option<ByteArray>| name.as_ref().is_some_and(|name| name.data() != object.as_bytes());
        if let Some(index) = names.iter().position(is_other) {
            let found = names[index].as_ref().map(|name| String::from_utf8_lossy(name.data()).into_owned());
            let problem = TouchesProblem::OtherObject { found: found.unwrap_or_default(), object: object.into() };
            return Err(TouchesProblem::Row { row: (touches.len() + index) as u64 + 1, problem: Box::new(problem) });
        }
        let times = first.iter().zip(middle).zip(last);
        let vectors = directions.iter().zip(&alignments).zip(positions);
        for (((first, middle), last), ((direction, alignment), position)) in times.zip(vectors) {
            let row = touches.len() as u64 + 1;
            let times = [*first, *middle, *last].map(|time| time.map(|[seconds]| seconds));
            let touch = touch_of_seconds(times, *direction, *alignment);
            let touch = touch.and_then(|touch| match position {
                Some(micrometers) => located(touch, micrometers.map(|micrometers| micrometers / 1e3)),
                None => Ok(touch),
            });
            touches.push(
                touch
                    .and_then(|touch| alike.admit(touch))
                    .map_err(|problem| TouchesProblem::Row { row, problem: Box::new(problem) })?,
            );
        }
    }
}

/// A column of numbers, of lists of numbers, or of names.
struct Column {
    name: &'static str,
    reader: ColumnReader,
    /// The definition level of a value that is there.
    present: i16,
    /// True if rows are lists.
    lists: bool,
}

impl Column {
    /// The column of this name; none if the file has none.
    fn open(group: &dyn RowGroupReader, name: &'static str) -> Result<Option<Self>, TouchesProblem> {
        let metadata = group.metadata();
        let is_it =
            |index: &usize| metadata.column(*index).column_path().parts().first().is_some_and(|part| part == name);
        let Some(index) = (0..metadata.num_columns()).find(is_it) else { return Ok(None) };
        let descriptor = metadata.column(index).column_descr();
        let (present, lists) = (descriptor.max_def_level(), descriptor.max_rep_level() > 0);
        let wrong = |error: ParquetError| TouchesProblem::Column { name, message: error.to_string() };
        let reader = group.get_column_reader(index).map_err(wrong)?;
        Ok(Some(Self { name, reader, present, lists }))
    }

    /// The next rows: N numbers each, or none where the row is null.
    fn rows<const N: usize>(&mut self) -> Result<Vec<Option<[f64; N]>>, TouchesProblem> {
        self.read().map_err(|message| TouchesProblem::Column { name: self.name, message })
    }

    /// The next rows: a name each, or none where the row is null.
    fn names(&mut self) -> Result<Vec<Option<ByteArray>>, TouchesProblem> {
        self.read_names().map_err(|message| TouchesProblem::Column { name: self.name, message })
    }

    fn read_names(&mut self) -> Result<Vec<Option<ByteArray>>, String> {
        let ColumnReader::ByteArrayColumnReader(reader) = &mut self.reader else {
            return Err("does not hold text".into());
        };
        if self.lists {
            return Err("does not hold one name per row".into());
        }
        let (values, definition, _) = records(reader)?;
        if self.present == 0 {
            return Ok(values.into_iter().map(Some).collect());
        }
        let mut values = values.into_iter();
        let row = |level: &i16| match *level == self.present {
            true => values.next().map(Some).ok_or_else(|| "fewer values than it says".to_owned()),
            false => Ok(None),
        };
        definition.iter().map(row).collect()
    }

    fn read<const N: usize>(&mut self) -> Result<Vec<Option<[f64; N]>>, String> {
        let (present, lists) = (self.present, self.lists);
        if lists != (N > 1) {
            return Err(format!("does not hold {N} numbers per row"));
        }
        let are_whole = self.name == "position";
        let (values, definition, repetition) = match &mut self.reader {
            ColumnReader::Int32ColumnReader(reader) if are_whole => {
                let (values, definition, repetition) = records(reader)?;
                (values.into_iter().map(f64::from).collect(), definition, repetition)
            }
            ColumnReader::Int64ColumnReader(reader) if are_whole => {
                let (values, definition, repetition) = records(reader)?;
                (values.into_iter().map(|value| value as f64).collect(), definition, repetition)
            }
            _ if are_whole => return Err("does not hold whole numbers".into()),
            ColumnReader::DoubleColumnReader(reader) => records(reader)?,
            ColumnReader::FloatColumnReader(reader) => {
                let (values, definition, repetition) = records(reader)?;
                (values.into_iter().map(f64::from).collect(), definition, repetition)
            }
            _ => return Err("does not hold floating-point numbers".into()),
        };
        // A column that is never null, or never a list, comes without levels.
        let levels = if present == 0 { values.len() } else { definition.len() };
        let mut rows: Vec<(usize, [f64; N], bool)> = Vec::new();
        let mut values = values.into_iter();
        for level in 0..levels {
            let starts = repetition.get(level).is_none_or(|&level| level == 0);
            let is_there = definition.get(level).is_none_or(|&level| level == present);
            if starts {
                rows.push((0, [0.0; N], is_there));
            }
            let Some((count, row, _)) = rows.last_mut() else { return Err("a list starts in its middle".into()) };
            if is_there {
                let value = values.next().ok_or("fewer values than it says")?;
                *row.get_mut(*count).ok_or_else(|| format!("a list has more than {N} numbers"))? = value;
                *count += 1;
            }
        }
        let row = |(count, row, is_there): (usize, [f64; N], bool)| match (is_there, count == N) {
            (false, _) => Ok(None),
            (true, true) => Ok(Some(row)),
            (true, false) => Err(format!("a list has {count} numbers where {N} belong")),
        };
        rows.into_iter().map(row).collect()
    }
}

/// Up to a batch of records: values, definition levels, repetition levels.
#[expect(clippy::type_complexity, reason = "three vectors, used once")]
fn records<T: DataType>(reader: &mut ColumnReaderImpl<T>) -> Result<(Vec<T::T>, Vec<i16>, Vec<i16>), String> {
    let (mut values, mut definition, mut repetition) = (Vec::new(), Vec::new(), Vec::new());
    reader
        .read_records(BATCH, Some(&mut definition), Some(&mut repetition), &mut values)
        .map_err(|error| error.to_string())?;
    Ok((values, definition, repetition))
}

fn write_error(path: &Path, error: ParquetError) -> Error {
    Error::at(Place::file(path), TouchesProblem::ParquetNotWritten { message: error.to_string() })
}
