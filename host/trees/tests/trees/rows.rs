//! Tables of rows and of sequences: their columns, what is wrong with them by line, and rows that are made at thresholds.

use crate::fixtures::{assert_says, leaf, of_one_value, split};
use palpate_trees::Result as Read;
use palpate_trees::ensemble::Threshold;
use palpate_trees::error::Result;
use palpate_trees::rows::{Features, Matched, RowSequence, Rows, SequenceColumns, Sequences, generate, whole};
use palpate_trees::shared::MISSING_FEATURE;
use std::collections::BTreeSet;
use std::path::Path;

/// The complaint about a table, without the path of its file.
fn of_file<T>(text: &str, read: impl Fn(&Path) -> Read<T>) -> Result<T, String> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    read(file.path()).map_err(|error| {
        let error = error.to_string();
        error.trim_start_matches(&file.path().display().to_string()).to_owned()
    })
}

fn read_rows(text: &str, features: &[&str], label: Option<&str>) -> Result<Rows, String> {
    of_file(text, |path| Rows::read(path, features, label))
}

#[test]
fn columns_are_matched_by_name_or_else_by_position() {
    let rows = read_rows("b,x,a\n1,9,2\n,8,inf\n", &["a", "b"], None).unwrap();
    assert_eq!((rows.values[..2].to_vec(), rows.by_position), (vec![2.0, 1.0], false));
    assert_eq!((rows.values[2], rows.values[3].is_nan(), rows.len()), (f64::INFINITY, true, 2));
    let rows = read_rows("0,1\n1,2\n", &["a", "b"], None).unwrap();
    assert_eq!((rows.values, rows.by_position), (vec![1.0, 2.0], true));
    let rows = read_rows("p,kind,q\n1,cup,2\n", &["f0", "f1"], Some("kind")).unwrap();
    assert_eq!((rows.values, rows.labels), (vec![1.0, 2.0], vec!["cup".to_owned()]));
    for (text, expected) in [
        ("p,q\n1,2\n", ":1: no column is named a, b; its columns are p, q"),
        ("a,q\n1,2\n", ":1: no column is named b; its columns are a, q"),
        ("0,1,2\n1,2,3\n", ":1: it has 3 columns for 2 features"),
        ("0.5,1\n1,2\n", ":1: its columns are named 0.5, 1: numbers alone"),
        ("a;b\n1;2\n", ":1: its cells are separated by \";\""),
        ("a,b\n1,2\n\n3,4\n", ":3: the line is empty"),
        ("a,b,a\n1,2,3\n", ":1: two columns are named \"a\""),
        ("a,b\n", "no rows"),
        ("", "no rows"),
        ("a,b\n1,x\n", ":2: \"x\" in the column b is not a number"),
        ("a,b\n1\n", ":2: it has 1 cell, where the header has 2"),
    ] {
        assert_says(read_rows(text, &["a", "b"], None).unwrap_err(), &[expected]);
    }
    assert!(read_rows("a,b\n1,2\n", &["a", "b"], Some("kind")).unwrap_err().contains("no column \"kind\""));
}

#[test]
fn whole_numbers_saturate_and_a_missing_value_stays_missing() {
    assert_eq!(whole(1.25, 10.0), 13);
    assert_eq!(whole(-1.25, 10.0), -13);
    assert_eq!(whole(f64::NAN, 10.0), MISSING_FEATURE);
    for value in [f64::INFINITY, 1e30] {
        assert_eq!((whole(value, 1.0), whole(-value, 1.0)), (i32::MAX, -i32::MAX));
    }
}

#[test]
fn every_split_is_reached_and_decided_both_ways() {
    let nodes = vec![
        split(0, 5.0, 1, 2),
        split(1, -1.0, 3, 4),
        split(0, 9.0, 5, 6),
        leaf(&[1.0]),
        split(0, 1.0, 7, 8),
        leaf(&[2.0]),
        leaf(&[3.0]),
        leaf(&[4.0]),
        leaf(&[5.0]),
    ];
    let ensemble = of_one_value(2, vec![nodes]);
    let mut reached = BTreeSet::new();
    let mut count = 0;
    let around = |_, threshold: Threshold| {
        let threshold = threshold.value as f32;
        [threshold.next_down(), threshold, threshold.next_up()].map(f64::from)
    };
    generate(&ensemble, &[7.0, 7.0], around, |row| {
        count += 1;
        let row: Vec<f32> = row.iter().map(|&value| value as f32).collect();
        reached.insert(ensemble.margins_of_features(&row)[0].to_bits());
    });
    assert_eq!(reached.len(), 5, "every leaf");
    assert_eq!(count, 4 * 4 + 9 * 2 + 9);
}

/// Asserts that features are not found among columns, for this reason.
fn assert_refused(features: impl Into<Features>, header: &[&str], what: &str) {
    assert_eq!(among(features, header).unwrap_err().what(), what);
}

const SIZES: [&str; 2] = ["width", "height"];

fn among(features: impl Into<Features>, header: &[&str]) -> Result<(Vec<usize>, bool)> {
    features.into().among(header, &[]).map(|Matched { columns, by_position }| (columns, by_position))
}

#[test]
fn names_are_found_in_any_order_among_more_columns() {
    assert_eq!(among(&SIZES, &["", "height", "age", "width"]), Ok((vec![3, 1], false)));
    let others = Features::from(&SIZES).among(&["0", "kind", "1"], &[1]);
    assert_eq!(others, Ok(Matched { columns: vec![0, 2], by_position: true }));
}

#[test]
fn a_feature_that_no_column_is_named_after_is_an_error_that_lists_both() {
    // As many columns as features, or more: none takes another one's place.
    for (missing, header) in [
        ("height", &["width", "Height"][..]),
        ("height", &["width", "person", "id"]),
        ("width, height", &["f1", "f0"]),
        ("width, height", &["f1", "f2"]),
    ] {
        let what = format!("no column is named {missing}; its columns are {}", header.join(", "));
        assert_refused(&SIZES, header, &what);
    }
}

#[test]
fn generated_names_count_as_numbers_and_as_no_names() {
    for model in [&["f0", "f1", "f2"], &["Column_0", "Column_1", "Column_2"], &["0", "1", "2"]] {
        assert_eq!(among(model, &["0", "1", "2"]), Ok((vec![0, 1, 2], false)), "{model:?}");
        assert_eq!(among(model, &["Column_2", "Column_1", "Column_0"]), Ok((vec![2, 1, 0], false)));
        assert_eq!(among(model, &["f3", "f2", "f1", "f0"]), Ok((vec![3, 2, 1], false)));
        // Names on one side alone.
        assert_eq!(among(model, &["a", "b", "c"]), Ok((vec![0, 1, 2], true)));
        assert_refused(model, &["a", "b", "c", "d"], "it has 4 columns for 3 features");
    }
    assert_eq!(among(&SIZES, &["0", "1"]), Ok((vec![0, 1], true)));
    assert_eq!(among(&SIZES, &["Column_0", "Column_1"]), Ok((vec![0, 1], true)));
    // What only looks like a number.
    assert_refused(&["f00", "f1"], &["a", "b"], "no column is named f00, f1; its columns are a, b");
}

#[test]
fn a_header_of_numbers_alone_is_refused_unless_they_count_or_are_the_models_own() {
    for header in [&["0.35", "0.82"][..], &["1", "2"], &["1", "0"], &["-1e3", "nan"], &["", "7"]] {
        let what = format!("its columns are named {}: numbers alone", header.join(", "));
        assert_refused(&SIZES, header, &what);
        assert_refused(&["f0", "f1"], header, &what);
    }
    assert_eq!(among(&["3", "7"], &["7", "3"]), Ok((vec![1, 0], false)));
    assert_eq!(among(&["3", "7"], &["0", "1"]), Ok((vec![0, 1], true)));
}

#[test]
fn underscores_stand_for_what_lightgbm_and_models_replace() {
    let features = &["mean_of_x", "max_y_", "two_words"];
    assert_eq!(among(features, &["two\twords", "max[y]", "mean of x"]), Ok((vec![2, 1, 0], false)));
    // Names that only differ in that.
    assert_refused(&["a_b", "c_d"], &["a b", "a[b", "c d"], "two columns are named \"a_b\"");
}

#[test]
fn a_name_that_is_there_twice_is_an_error() {
    assert_refused(&SIZES, &["width", "height", "width"], "two columns are named \"width\"");
    // Columns without a name, such as pandas' index, may be several.
    assert_eq!(among(&SIZES, &["", "", "width", "height"]), Ok((vec![2, 3], false)));
    assert_eq!(among(&["a", "a"], &["0", "1"]), Ok((vec![0, 1], true)));
}

const COLUMNS: SequenceColumns<'_> = SequenceColumns { label: Some("kind"), sequence: "id", group: Some("who") };

fn read_sequences(text: &str, columns: &SequenceColumns<'_>) -> Result<Sequences, String> {
    let classes = ["cup", "jug"].map(String::from);
    of_file(text, |path| Sequences::read(path, &["a", "b"], columns, &classes))
}

#[test]
fn rows_that_follow_each_other_with_one_id_are_a_sequence() {
    let text = "id,b,who,kind,a\n7,1,ann,cup,2\n7,3,ann,cup,\nx,5,bo,1,6\ny,7,ann,jug,8\n";
    let read = read_sequences(text, &COLUMNS).unwrap();
    assert_eq!((read.len(), read.features, read.by_position), (4, 2, false));
    assert_eq!((&read.values[..2], read.values[2].is_nan(), read.values[3]), (&[2.0, 1.0][..], true, 3.0));
    let of = |rows, class, group| RowSequence { rows, class, group: Some(group) };
    assert_eq!(read.sequences, [of(0..2, 0, 0), of(2..3, 1, 1), of(3..4, 1, 0)]);
    assert_eq!(read.groups, ["ann", "bo"]);
}

#[test]
fn what_is_wrong_with_a_sequence_is_said_with_its_line() {
    let own = SequenceColumns { group: None, ..COLUMNS };
    for (text, columns, expected) in [
        ("id,a,b,kind\n1,1,2,cup\n1,1,2,jug\n", &own, ":3: the sequence \"1\" has the labels \"cup\" and \"jug\""),
        ("id,a,b,kind\n1,1,2,cup\n2,1,2,cup\n1,1,2,cup\n", &own, ":4: the sequence \"1\" comes back after another"),
        ("id,a,b,kind\n1,1,2,pan\n", &own, ":2: the label \"pan\" in row 1 is none of the model's classes: cup, jug"),
        ("id,a,x,y,kind\n1,1,2,3,cup\n", &own, ":1: no column is named b; its columns are id, a, x, y, kind"),
        // As many columns as features, one of them missing.
        ("id,a,x,kind\n1,1,2,cup\n", &own, ":1: no column is named b; its columns are id, a, x, kind"),
        ("id;a;b;kind\n1;1;2;cup\n", &own, ":1: its cells are separated by \";\""),
        ("id,a,b,kind\n\n1,1,2,cup\n", &own, ":2: the line is empty"),
        ("id,a,b\n1,1,2\n", &own, ":1: it has no column \"kind\""),
        ("a,b,kind\n1,2,cup\n", &own, ":1: it has no column \"id\""),
        ("id,a,b,kind\n1,1,2,cup\n", &COLUMNS, ":1: it has no column \"who\""),
        ("id,a,b,kind\n1,1,x,cup\n", &own, ":2: \"x\" in the column b is not a number"),
        ("id,a,b,kind\n1,1,cup\n", &own, ":2: it has 3 cells, where the header has 4"),
        ("id,a,b,kind\n", &own, ":1: it has no rows"),
        ("id,a,b,kind\n1,1,2,cup\n,1,2,cup\n", &own, ":3: the sequence is missing"),
        ("id,a,b,kind,who\n1,1,2,cup,\n", &COLUMNS, ":2: the group is missing"),
        (
            "id,a,b,kind,who\n1,1,2,cup,ann\n1,1,2,cup,bo\n",
            &COLUMNS,
            ":3: the sequence \"1\" belongs to the groups \"ann\" and \"bo\"",
        ),
    ] {
        let complaint = read_sequences(text, columns).unwrap_err();
        assert!(complaint.starts_with(expected), "{complaint}");
    }
}

#[test]
fn columns_that_are_no_features_do_not_count_by_position() {
    let read = read_sequences("id,0,kind,1\n1,1,cup,2\n", &SequenceColumns { group: None, ..COLUMNS }).unwrap();
    assert_eq!((read.values, read.by_position), (vec![1.0, 2.0], true));
}
