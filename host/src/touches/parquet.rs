//! Touches as Parquet: smaller and faster to load than text, and read by pandas, Polars, DuckDB and others.
//!
//! A row a touch: `object` (string), `t1`, `t2`, `t3` (seconds, null where a finger never touched), `direction` and
//! `alignment` (lists of three, null where unknown). Row groups of about a million rows.

use super::text::{contact_time, to_q15};
use crate::error::{Error, Result};
use palpate_shared::{ContactTime, Pose, Q15_ONE, Touch};
use parquet::basic::Compression;
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, FloatType};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, RowGroupReader, SerializedFileReader};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use std::fs::File;
use std::path::Path;
use std::sync::Arc;

/// How many rows a row group has.
const GROUP: usize = 1 << 20;

/// How many rows are encoded or decoded at once.
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

/// Writes touches of one object, as they come, to `file`.
///
/// # Errors
/// What the touches end with, or that the file, called `path` in the message, cannot be written.
pub fn write(path: &Path, file: &File, object: &str, touches: impl Iterator<Item = Result<Touch>>) -> Result<()> {
    let wrong = |error| write_error(path, error);
    let schema = Arc::new(parquet::schema::parser::parse_message_type(SCHEMA).map_err(wrong)?);
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(format!("palpate {}", env!("CARGO_PKG_VERSION")))
        .build();
    let mut writer = SerializedFileWriter::new(file, schema, Arc::new(properties)).map_err(wrong)?;
    let mut touches = touches.peekable();
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

/// Reads the touches of a file with columns `t1`, `t2`, `t3`, and, where known, `direction` and `alignment`.
///
/// # Errors
/// When the file cannot be read, is no Parquet, lacks a column, or a value is wrong (the row is named).
pub fn read(path: &Path) -> Result<Vec<Touch>> {
    let file = File::open(path).map_err(|error| Error::io(path, "read the touches", error))?;
    let wrong = |what: String| Error::file(path, what, "Capture the object anew, or remove the file.");
    let reader = SerializedFileReader::new(file).map_err(|error| wrong(format!("no Parquet file ({error})")))?;
    let mut touches = Vec::new();
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group).map_err(|error| wrong(error.to_string()))?;
        read_group(group.as_ref(), &mut touches).map_err(wrong)?;
    }
    if touches.is_empty() {
        return Err(wrong("no touches in it".into()));
    }
    Ok(touches)
}

fn read_group(group: &dyn RowGroupReader, touches: &mut Vec<Touch>) -> Result<(), String> {
    let mut times = Vec::with_capacity(3);
    for name in ["t1", "t2", "t3"] {
        times.push(Column::open(group, name)?.ok_or_else(|| format!("no column {name}"))?);
    }
    let [mut direction, mut alignment] = [Column::open(group, "direction")?, Column::open(group, "alignment")?];
    loop {
        let rows = times.iter_mut().map(Column::rows::<1>).collect::<Result<Vec<_>, _>>()?;
        let vectors = |column: &mut Option<Column>| column.as_mut().map(Column::rows::<3>).transpose();
        let (directions, alignments) = (vectors(&mut direction)?, vectors(&mut alignment)?);
        let [first, middle, last] = rows.as_slice() else { return Ok(()) };
        if first.is_empty() {
            return Ok(());
        }
        for (index, first) in first.iter().enumerate() {
            let row = touches.len() + 1;
            let time = |value: Option<&Option<[f64; 1]>>| match value {
                Some(Some([seconds])) if !seconds.is_finite() => {
                    Err(format!("row {row}: the time {seconds} is not finite"))
                }
                Some(Some([seconds])) => contact_time(*seconds).map_err(|what| format!("row {row}: {what}")),
                _ => Ok(ContactTime::MISSING),
            };
            let touch = Touch::new([time(Some(first))?, time(middle.get(index))?, time(last.get(index))?]);
            let vector = |vectors: &Option<Vec<Option<[f64; 3]>>>| vectors.as_ref().and_then(|all| *all.get(index)?);
            touches.push(match (vector(&directions), vector(&alignments)) {
                (Some(direction), Some(alignment)) => {
                    touch.with_pose(Pose { direction: direction.map(to_q15), alignment: alignment.map(to_q15) })
                }
                _ => touch,
            });
        }
    }
}

/// A column of numbers, or of lists of numbers.
struct Column {
    reader: ColumnReader,
    /// The definition level of a value that is there.
    present: i16,
    /// Whether rows are lists.
    lists: bool,
}

impl Column {
    /// The column of this name; none if the file has none.
    fn open(group: &dyn RowGroupReader, name: &str) -> Result<Option<Self>, String> {
        let metadata = group.metadata();
        let is_it =
            |index: &usize| metadata.column(*index).column_path().parts().first().is_some_and(|part| part == name);
        let Some(index) = (0..metadata.num_columns()).find(is_it) else { return Ok(None) };
        let descriptor = metadata.column(index).column_descr();
        let (present, lists) = (descriptor.max_def_level(), descriptor.max_rep_level() > 0);
        let reader = group.get_column_reader(index).map_err(|error| format!("column {name}: {error}"))?;
        Ok(Some(Self { reader, present, lists }))
    }

    /// The next rows: N numbers each, or none where the row is null.
    fn rows<const N: usize>(&mut self) -> Result<Vec<Option<[f64; N]>>, String> {
        let (present, lists) = (self.present, self.lists);
        if lists != (N > 1) {
            return Err(format!("a column that should hold {N} numbers a row holds something else"));
        }
        let (values, definition, repetition) = match &mut self.reader {
            ColumnReader::DoubleColumnReader(reader) => records(reader)?,
            ColumnReader::FloatColumnReader(reader) => {
                let (values, definition, repetition) = records(reader)?;
                (values.into_iter().map(f64::from).collect(), definition, repetition)
            }
            _ => return Err("a column of times or cosines does not hold floating-point numbers".into()),
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
                let value = values.next().ok_or("a column has fewer values than it says")?;
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
    let what = format!("cannot write the touches: {error}");
    Error::file(path, what, "Check the disk and the space on it, then repeat the command with --resume.")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_trip(touches: &[Touch]) -> Result<Vec<Touch>> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("cup.parquet");
        let file = File::create(&path).unwrap();
        write(&path, &file, "cup", touches.iter().copied().map(Ok))?;
        read(&path)
    }

    #[test]
    fn touches_with_and_without_pose_and_contacts_survive() {
        let pose = Pose { direction: [32767, 0, -1], alignment: [12345, -32767, 7] };
        let mixed = [
            Touch::from_micros([0, 123_456, 4_294_967_294]),
            Touch::new([ContactTime::MISSING, ContactTime::FIRST, ContactTime::from_micros(1)]).with_pose(pose),
            Touch::new([ContactTime::MISSING; 3]),
            Touch::from_micros([7, 0, 7]).with_pose(pose),
        ];
        assert_eq!(round_trip(&mixed).unwrap(), mixed);
    }

    #[test]
    fn more_rows_than_a_batch_and_a_group_hold_survive_in_order() {
        let many: Vec<Touch> =
            (0..GROUP as u32 + BATCH as u32 + 5).map(|i| Touch::from_micros([0, i, 2 * i])).collect();
        assert!(round_trip(&many).unwrap() == many);
    }

    #[test]
    fn what_is_no_parquet_or_empty_is_refused() {
        assert!(round_trip(&[]).unwrap_err().to_string().contains("cup.parquet: no touches in it"));
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("cup.parquet");
        std::fs::write(&path, "PAR1 0 0 0 PAR1").unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("cup.parquet: no Parquet file"));
    }
}
