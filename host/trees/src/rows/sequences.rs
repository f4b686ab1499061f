//! Sequences of rows: the rows of one object, in their order, with the object's class.

use super::label::not_a_class;
use super::table::{Table, no_column, no_rows};
use super::{Features, class, not_a_number, number};
use crate::error::{Error, Place, Result, problem};
use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;

/// The rows of one object, in their order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RowSequence {
    /// Its rows among all.
    pub rows: Range<usize>,
    /// Its class: the position in the model's.
    pub class: usize,
    /// The group that it belongs to, such as a person or a machine: a position in [`Sequences::groups`].
    pub group: Option<usize>,
}

/// Sequences of rows of features, NaN where one is missing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sequences {
    /// Features of a row.
    pub features: usize,
    /// Row after row.
    pub values: Vec<f64>,
    /// The sequences, in their order.
    pub sequences: Vec<RowSequence>,
    /// The names of the groups, if sequences belong to some.
    pub groups: Vec<String>,
    /// True if columns were taken by their position: see [`BY_POSITION`](super::BY_POSITION).
    pub by_position: bool,
}

/// Columns of a table of rows that are not features.
#[derive(Clone, Copy, Debug)]
pub struct SequenceColumns<'c> {
    /// The class of the row, by name or number: the same for all rows of a sequence. Without it all are of class 0.
    pub label: Option<&'c str>,
    /// The sequence that the row belongs to; its rows follow each other.
    pub sequence: &'c str,
    /// The group that the sequence belongs to, such as a person or a machine.
    pub group: Option<&'c str>,
}

/// Statements of a row beside its features.
#[derive(Clone, Copy, Debug)]
pub struct RowOf<'r> {
    /// The class, by name or number.
    pub label: &'r str,
    /// The sequence.
    pub sequence: &'r str,
    /// The group.
    pub group: Option<&'r str>,
}

/// Advice on a sequence of two classes or groups.
const ONE_OF_EACH: &str = "A sequence is of one class and one group: give the rows of another one another id.";

/// Sequences, put together row by row.
#[derive(Clone, Debug, Default)]
pub struct SequencesBuilder {
    classes: Vec<String>,
    built: Sequences,
    /// The positions of sequences and groups, by name.
    seen: HashMap<String, usize>,
    groups: HashMap<String, usize>,
    /// Name and label of the last sequence.
    last: Option<[String; 2]>,
}

impl SequencesBuilder {
    /// For rows of this many features, and these classes.
    pub fn new(features: usize, classes: &[String]) -> Self {
        Self { classes: classes.to_vec(), built: Sequences { features, ..Sequences::default() }, ..Self::default() }
    }

    /// Takes in a row; `values` are as many as there are features.
    ///
    /// # Errors
    /// A sequence or group without a name, a label that is not a class, another label or group than that of the rows before
    /// in the same sequence, a sequence that comes back after another.
    pub fn push(&mut self, values: &[f64], row: RowOf<'_>) -> Result<()> {
        for (what, name) in [("sequence", Some(row.sequence)), ("group", row.group)] {
            if name == Some("") {
                return Err(
                    problem!("the {what} is missing").fix(format!("Give each row the {what} that it belongs to."))
                );
            }
        }
        let number = self.built.len() + 1;
        let name = row.sequence;
        let group = row.group.unwrap_or_default();
        match &self.last {
            Some([sequence, label]) if sequence == row.sequence => {
                if label != row.label {
                    let other = row.label;
                    return Err(
                        problem!("the sequence {name:?} has the labels {label:?} and {other:?}").fix(ONE_OF_EACH)
                    );
                }
                let last = self.built.sequences.last_mut().filter(|_| row.group.is_some());
                let own = last.and_then(|last| self.built.groups.get(last.group?));
                if let Some(own) = own.filter(|own| *own != group) {
                    return Err(
                        problem!("the sequence {name:?} belongs to the groups {own:?} and {group:?}").fix(ONE_OF_EACH)
                    );
                }
            }
            _ => {
                let count = self.built.sequences.len();
                if self.seen.insert(row.sequence.into(), count).is_some() {
                    return Err(problem!("the sequence {name:?} comes back after another one").fix(
                        "Sort the rows by sequence, each in its order, or give each stretch of rows an id of its own.",
                    ));
                }
                let class = class(&self.classes, row.label)
                    .ok_or_else(|| not_a_class(row.label, number, &self.classes.join(", ")))?;
                let group = row.group.map(|name| {
                    *self.groups.entry(name.into()).or_insert_with(|| {
                        self.built.groups.push(name.into());
                        self.built.groups.len() - 1
                    })
                });
                self.built.sequences.push(RowSequence { rows: number - 1..number - 1, class, group });
                self.last = Some([row.sequence.into(), row.label.into()]);
            }
        }
        self.built.values.extend_from_slice(values);
        if let Some(last) = self.built.sequences.last_mut() {
            last.rows.end = number;
        }
        Ok(())
    }

    /// The sequences.
    ///
    /// # Errors
    /// If there is no row.
    pub fn finish(self) -> Result<Sequences> {
        if self.built.sequences.is_empty() { Err(no_rows()) } else { Ok(self.built) }
    }
}

impl Sequences {
    /// Reads a CSV file with a header, then one row per line; a cell that is empty or NaN is missing. Columns are matched
    /// as by [`Rows::read`](super::Rows::read).
    ///
    /// # Errors
    /// [`Kind::Io`](crate::error::Kind::Io); with the line, errors of [`SequencesBuilder::push`], a column that is not there,
    /// or a cell that is not a number.
    pub fn read(
        path: &Path,
        features: impl Into<Features>,
        names: &SequenceColumns<'_>,
        classes: &[String],
    ) -> Result<Self> {
        let table = Table::read(path)?;
        // Before others, since cells may be separated by something else.
        [Some(names.sequence), names.label, names.group].into_iter().flatten().try_for_each(|name| {
            table.column(name)?;
            Ok::<_, Error>(())
        })?;
        let header: Vec<&str> = table.header.iter().map(String::as_str).collect();
        let records = table.records().map(|record| {
            let (line, record) = record?;
            Ok((line, record.iter().map(String::from).collect()))
        });
        Self::from_table(&header, records, features, names, classes, |line| Place::line(path, line))
    }

    /// Sequences of the rows of a table of any kind: its header, and its records with their numbers; `place` gives the place of
    /// a number. Line 1 is the header's.
    ///
    /// # Errors
    /// Errors of [`Sequences::read`], and of the records.
    fn from_table(
        header: &[&str],
        records: impl Iterator<Item = Result<(u64, Vec<String>)>>,
        features: impl Into<Features>,
        names: &SequenceColumns<'_>,
        classes: &[String],
        place: impl Fn(u64) -> Place,
    ) -> Result<Self> {
        let position = |name: &str| {
            let found = header.iter().position(|column| *column == name);
            found.ok_or_else(|| no_column(name).at(place(1)))
        };
        let [label, group] = [names.label.map(&position).transpose()?, names.group.map(&position).transpose()?];
        let sequence = position(names.sequence)?;
        let others: Vec<usize> = [sequence].into_iter().chain(label).chain(group).collect();
        let features = features.into();
        let matched = features.among(header, &others).map_err(|error| error.at(place(1)))?;
        let mut builder = SequencesBuilder::new(features.count(), classes);
        let mut values = vec![0.0; features.count()];
        for record in records {
            let (line, record) = record?;
            let cell = |column: usize| record.get(column).map_or("", String::as_str);
            for (value, &column) in values.iter_mut().zip(&matched.columns) {
                *value = number(cell(column)).ok_or_else(|| {
                    let name = header.get(column).copied().unwrap_or_default();
                    not_a_number(name, cell(column)).at(place(line))
                })?;
            }
            let row = RowOf { label: label.map_or("0", cell), sequence: cell(sequence), group: group.map(cell) };
            builder.push(&values, row).map_err(|error| error.at(place(line)))?;
        }
        let built = builder.finish().map_err(|error| error.at(place(1)))?;
        Ok(Self { by_position: matched.by_position, ..built })
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.values.len() / self.features.max(1)
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }
}
