use super::*;
use palpate_shared::{ContactTime, Position};

fn round_trip(touches: &[Touch]) -> Result<Vec<Touch>> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("cup.parquet");
    let file = File::create(&path).unwrap();
    write(&path, &file, "cup", touches.iter().copied().map(Ok))?;
    read(&path)
}

#[test]
fn touches_with_and_without_pose_and_contacts_survive() {
    let pose = Pose { direction: [32767, 0, -1], alignment: [12345, -30352, 7] };
    let mixed = [
        Touch::from_micros([0, 123_456, 4_294_967_294]),
        Touch::new([ContactTime::MISSING, ContactTime::FIRST, ContactTime::from_micros(1)]).with_pose(pose),
        Touch::new([ContactTime::MISSING; 3]),
        Touch::from_micros([7, 0, 7]).with_pose(pose),
    ];
    assert_eq!(round_trip(&mixed).unwrap(), mixed);
}

#[test]
fn positions_survive_to_the_micrometer_and_rows_with_and_without_are_not_mixed() {
    let pose = Pose { direction: [0, 0, -Q15_ONE], alignment: [Q15_ONE, 0, 0] };
    let at = |micrometers| Touch::from_micros([0, 1, 2]).with_pose(pose).with_position(Position { micrometers });
    let many: Vec<Touch> = (0..BATCH as i32 + 9).map(|i| at([i32::MIN + i, i32::MAX - i, -i])).collect();
    assert!(round_trip(&many).unwrap() == many);
    let without = Touch::from_micros([0, 1, 2]).with_pose(pose);
    let error = round_trip(&[at([1, 2, 3]), without]).unwrap_err().to_string();
    assert!(error.contains("cup.parquet: no position, where the touches before it have one"), "{error}");
    let error = round_trip(&[without, at([1, 2, 3])]).unwrap_err().to_string();
    assert!(error.contains("cup.parquet: a position, where the touches before it have none"), "{error}");
    // A file without positions has no such column.
    assert!(SCHEMA.len() > 100 && !SCHEMA.contains("position"));
}

/// A file of two touches down on a table, `cup.parquet`, with another column of positions.
fn with_positions<T: DataType>(element: &str, values: &[T::T], levels: [&[i16]; 2]) -> Result<Vec<Touch>> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("cup.parquet");
    let list = |name, element| {
        format!("OPTIONAL GROUP {name} (LIST) {{ REPEATED GROUP list {{ REQUIRED {element} element; }} }}")
    };
    let [direction, alignment] = ["direction", "alignment"].map(|name| list(name, "FLOAT"));
    let position = list("position", element);
    let schema = format!(
        "message touches {{ REQUIRED DOUBLE t1; REQUIRED DOUBLE t2; REQUIRED DOUBLE t3; {direction} {alignment} {position} }}"
    );
    let file = File::create(&path).unwrap();
    let schema = Arc::new(parquet::schema::parser::parse_message_type(&schema).unwrap());
    let mut writer = SerializedFileWriter::new(&file, schema, Arc::default()).unwrap();
    let mut columns = writer.next_row_group().unwrap();
    for _ in 0..3 {
        let mut times = columns.next_column().unwrap().unwrap();
        times.typed::<DoubleType>().write_batch(&[0.5, 0.5], None, None).unwrap();
        times.close().unwrap();
    }
    for vector in [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0]] {
        let mut column = columns.next_column().unwrap().unwrap();
        let values = [vector, vector].concat();
        column.typed::<FloatType>().write_batch(&values, Some(&[2; 6]), Some(&[0, 1, 1, 0, 1, 1])).unwrap();
        column.close().unwrap();
    }
    let mut column = columns.next_column().unwrap().unwrap();
    column.typed::<T>().write_batch(values, Some(levels[0]), Some(levels[1])).unwrap();
    column.close().unwrap();
    columns.close().unwrap();
    writer.close().unwrap();
    read(&path)
}

#[test]
fn positions_in_parquet_are_whole_micrometers_in_range_of_all_rows() {
    use parquet::data_type::Int64Type;
    let both: [&[i16]; 2] = [&[2; 6], &[0, 1, 1, 0, 1, 1]];
    let read = with_positions::<Int64Type>("INT64", &[1, -2, 3, 4, 5, 6], both).unwrap();
    assert_eq!(read[0].position(), Some(Position { micrometers: [1, -2, 3] }));
    let error = with_positions::<Int64Type>("INT64", &[1, 2, 3, 4, 5, 1 << 31], both).unwrap_err().to_string();
    assert!(error.contains("row 2: the coordinate 2147483.648 mm is farther than"), "{error}");
    let error = with_positions::<DoubleType>("DOUBLE", &[1.0; 6], both).unwrap_err().to_string();
    assert!(error.contains("column position: does not hold whole numbers"), "{error}");
    let one = [&[2, 2, 2, 0][..], &[0, 1, 1, 0]];
    let error = with_positions::<Int32Type>("INT32", &[1, 2, 3], one).unwrap_err().to_string();
    assert!(error.contains("cup.parquet: row 2: no position, where the touches before it have one"), "{error}");
}

#[test]
fn more_rows_than_a_batch_and_a_group_hold_survive_in_order() {
    let many: Vec<Touch> = (0..GROUP as u32 + BATCH as u32 + 5).map(|i| Touch::from_micros([0, i, 2 * i])).collect();
    assert!(round_trip(&many).unwrap() == many);
}

#[test]
fn what_is_no_parquet_or_empty_is_refused() {
    assert!(round_trip(&[]).unwrap_err().to_string().contains("cup.parquet: no touches in it"));
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("cup.parquet");
    std::fs::write(&path, "PAR1 0 0 0 PAR1").unwrap();
    assert!(read(&path).unwrap_err().to_string().contains("cup.parquet: not a usable Parquet file"));
}

/// Writes a file with other poses than touches can have.
/// A direction and an alignment.
type Vectors = (Option<[f32; 3]>, Option<[f32; 3]>);

fn with_poses(poses: &[Vectors]) -> Result<Vec<Touch>> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("cup.parquet");
    let file = File::create(&path).unwrap();
    let schema = Arc::new(parquet::schema::parser::parse_message_type(SCHEMA).unwrap());
    let mut writer = SerializedFileWriter::new(&file, schema, Arc::default()).unwrap();
    let mut columns = writer.next_row_group().unwrap();
    let touches = vec![Touch::from_micros([0, 1, 2]); poses.len()];
    column::<ByteArrayType>(&mut columns, &touches, |_, values, _| values.push(ByteArray::from("cup"))).unwrap();
    for _ in 0..3 {
        column::<DoubleType>(&mut columns, &touches, |_, values, levels| {
            values.push(0.5);
            levels.push((1, 0));
        })
        .unwrap();
    }
    for vectors in [poses.iter().map(|pose| pose.0).collect::<Vec<_>>(), poses.iter().map(|pose| pose.1).collect()] {
        let mut column = columns.next_column().unwrap().unwrap();
        let values: Vec<f32> = vectors.iter().flatten().copied().flatten().collect();
        let levels = |vector: &Option<[f32; 3]>| match vector {
            Some(_) => vec![(2, 0), (2, 1), (2, 1)],
            None => vec![(0, 0)],
        };
        let (definition, repetition): (Vec<i16>, Vec<i16>) = vectors.iter().flat_map(levels).unzip();
        column.typed::<FloatType>().write_batch(&values, Some(&definition), Some(&repetition)).unwrap();
        column.close().unwrap();
    }
    columns.close().unwrap();
    writer.close().unwrap();
    read(&path)
}

#[test]
fn poses_in_parquet_are_checked_as_in_text() {
    let (x, y) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    assert_eq!(with_poses(&[(None, None), (Some(x), Some(y))]).unwrap().len(), 2);
    for (wrong, what) in [
        ([10.0, 0.0, 0.0], "row 2: the direction has length 10.000 where a unit vector has 1"),
        ([0.0; 3], "row 2: the direction has length 0.000"),
        ([f32::NAN, 0.0, 0.0], "row 2: the direction has length NaN"),
        ([f32::INFINITY, 0.0, 0.0], "row 2: the direction has length inf"),
    ] {
        let error = with_poses(&[(Some(x), Some(y)), (Some(wrong), Some(y))]).unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
        assert!(with_poses(&[(Some(y), Some(wrong))]).unwrap_err().to_string().contains("row 1: the alignment"));
    }
}

#[test]
fn a_lone_direction_or_alignment_is_refused() {
    let x = Some([1.0, 0.0, 0.0]);
    let error = |direction, alignment| with_poses(&[(x, x), (direction, alignment)]).unwrap_err().to_string();
    assert!(error(x, None).contains("row 2: a direction without an alignment. Give both or neither."));
    assert!(error(None, x).contains("row 2: an alignment without a direction"));
}

/// Bytes of a file of a few touches, and where its metadata begins.
fn written() -> (Vec<u8>, usize) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("cup.parquet");
    let file = File::create(&path).unwrap();
    let pose = Pose { direction: [Q15_ONE, 0, 0], alignment: [0, Q15_ONE, 0] };
    let touch = |i| Ok(Touch::from_micros([0, i, 2 * i]).with_pose(pose));
    write(&path, &file, "cup", (0..40).map(touch)).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let length = bytes.len();
    let metadata = u32::from_le_bytes(bytes[length - 8..length - 4].try_into().unwrap());
    (bytes, length - 8 - metadata as usize)
}

#[test]
fn damaged_metadata_give_an_error_and_no_panic() {
    // A negative column offset made the reader panic: every value of the metadata's numbers is tried in turn.
    let (bytes, metadata) = written();
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("cup.parquet");
    let (mut refused, mut outside, mut contained) = (0, 0, 0);
    for position in metadata..bytes.len() {
        for value in [0x00, 0x01, 0x15, 0x7f, 0xff] {
            let mut damaged = bytes.clone();
            damaged[position] = value;
            std::fs::write(&path, damaged).unwrap();
            if let Err(error) = read(&path) {
                assert!(error.to_string().contains("cup.parquet: "), "{error}");
                refused += 1;
                outside += u32::from(error.to_string().contains("lies outside the file"));
                contained += u32::from(error.to_string().contains("the reader cannot name"));
            }
        }
    }
    assert!(refused > 100 && outside > 5, "{refused} refused, {outside} of them for their columns' ranges");
    assert!(contained > 0, "the reader does not panic any more: contain nothing");
}

#[test]
fn rows_of_another_object_than_the_file_is_called_after_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let touches = || (0..2_000).map(|i| Ok(Touch::from_micros([0, i, 2 * i])));
    let path = directory.path().join("fork.parquet");
    write(&path, &File::create(&path).unwrap(), "fork", touches()).unwrap();
    assert_eq!(read(&path).unwrap().len(), 2_000);
    // Two row groups, the second of another object.
    let file = File::create(&path).unwrap();
    let schema = Arc::new(parquet::schema::parser::parse_message_type(SCHEMA).unwrap());
    let mut writer = SerializedFileWriter::new(&file, schema, Arc::default()).unwrap();
    for object in ["fork", "mouse"] {
        let mut columns = writer.next_row_group().unwrap();
        write_group(&mut columns, object, &touches().collect::<Result<Vec<_>>>().unwrap()).unwrap();
        columns.close().unwrap();
    }
    writer.close().unwrap();
    let error = read(&path).unwrap_err().to_string();
    assert!(error.contains("fork.parquet: row 2001: a touch of \"mouse\" in the file of \"fork\""), "{error}");
    assert!(error.ends_with("Give each object a file with its name."), "{error}");
}

/// A file of one touch, `fork.parquet`, with another column of objects.
fn with_objects<T: DataType>(kind: &str, values: &[T::T], levels: Option<&[i16]>) -> Result<Vec<Touch>> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("fork.parquet");
    let file = File::create(&path).unwrap();
    let schema = format!("message touches {{ {kind}; REQUIRED DOUBLE t1; REQUIRED DOUBLE t2; REQUIRED DOUBLE t3; }}");
    let schema = Arc::new(parquet::schema::parser::parse_message_type(&schema).unwrap());
    let mut writer = SerializedFileWriter::new(&file, schema, Arc::default()).unwrap();
    let mut columns = writer.next_row_group().unwrap();
    let mut objects = columns.next_column().unwrap().unwrap();
    objects.typed::<T>().write_batch(values, levels, None).unwrap();
    objects.close().unwrap();
    for _ in 0..3 {
        let mut times = columns.next_column().unwrap().unwrap();
        times.typed::<DoubleType>().write_batch(&[0.5], None, None).unwrap();
        times.close().unwrap();
    }
    columns.close().unwrap();
    writer.close().unwrap();
    read(&path)
}

#[test]
fn a_row_may_name_no_object_but_nothing_else_than_a_name() {
    let (text, fork) = ("OPTIONAL BYTE_ARRAY object (STRING)", ByteArray::from("fork"));
    assert_eq!(with_objects::<ByteArrayType>(text, &[fork], Some(&[1])).unwrap().len(), 1);
    assert_eq!(with_objects::<ByteArrayType>(text, &[], Some(&[0])).unwrap().len(), 1);
    let error = with_objects::<DoubleType>("REQUIRED DOUBLE object", &[1.0], None).unwrap_err().to_string();
    assert!(error.contains("fork.parquet: column object: does not hold text"), "{error}");
}

#[test]
fn the_damaged_file_of_the_audit_gives_an_error_and_no_panic() {
    let shared = std::env::var_os("PALPATE_SHARED").map_or_else(|| "../../shared".into(), std::path::PathBuf::from);
    let path = shared.join("audit/panic.parquet");
    if !path.exists() {
        eprintln!("SKIPPED: no {} (the variable PALPATE_SHARED names its parent's parent)", path.display());
        return;
    }
    let error = read(&path).unwrap_err().to_string();
    assert!(error.contains("panic.parquet: not a usable Parquet file"), "{error}");
}
