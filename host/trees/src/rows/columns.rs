//! Columns of a table that are a model's features: found by name, or taken by position where there are no names.

use crate::ensemble::{Columns, Ensemble, columns::holdable};
use crate::error::{Error, Result, problem};
use palpate_onboard::Model;
use palpate_shared::format::Tag;
use std::collections::HashSet;

/// Features of a model or an ensemble, as the columns of a table have to hold them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Features {
    names: Vec<String>,
    /// The columns of the library's rows, and the one of each feature, where it had more than the model has.
    columns: Option<(usize, Vec<usize>)>,
}

/// Columns of the features.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Matched {
    /// For each feature the position of its column.
    pub columns: Vec<usize>,
    /// True if they were taken by their position: the table has no names, or the model has none.
    pub by_position: bool,
}

/// Note about columns that were taken by their position.
pub const BY_POSITION: &str =
    "columns are taken by their position, since the model's features have no names, or the columns have none";

impl From<&[&str]> for Features {
    fn from(names: &[&str]) -> Self {
        Self { names: names.iter().map(ToString::to_string).collect(), columns: None }
    }
}

impl From<&Vec<&str>> for Features {
    fn from(names: &Vec<&str>) -> Self {
        names.as_slice().into()
    }
}

impl<const COUNT: usize> From<&[&str; COUNT]> for Features {
    fn from(names: &[&str; COUNT]) -> Self {
        names.as_slice().into()
    }
}

impl From<&Model<'_>> for Features {
    fn from(model: &Model<'_>) -> Self {
        Self { names: super::feature_names(model), columns: columns_of(model) }
    }
}

impl From<&Ensemble> for Features {
    fn from(ensemble: &Ensemble) -> Self {
        let columns = ensemble.origin.imported.as_ref().and_then(|imported| imported.columns.as_ref());
        Self {
            names: ensemble.inputs.names().into_iter().map(String::from).collect(),
            columns: columns.map(|columns| (columns.names.len(), columns.used.clone())),
        }
    }
}

/// The number of columns that the library's rows had, and the one of each feature, if a model states them: the content of the
/// section [`Tag::Columns`].
pub fn columns_of(model: &Model<'_>) -> Option<(usize, Vec<usize>)> {
    let section = model.optional_sections().find(|section| section.tag == Tag::Columns.code())?;
    let mut numbers = section.content.as_chunks().0.iter().map(|bytes| usize::from(u16::from_le_bytes(*bytes)));
    let all = numbers.next()? + 1;
    let used: Vec<usize> = numbers.take(model.feature_count()).collect();
    (used.len() == model.feature_count() && used.iter().all(|&column| column < all)).then_some((all, used))
}

impl Features {
    /// The features of a model that someone measures: all but its [position](Model::position).
    pub fn measured(model: &Model<'_>) -> Self {
        let mut own = Self::from(model);
        if let Some(position) = model.position() {
            own.names.remove(position.feature.into());
            if let Some((all, used)) = &mut own.columns {
                let column = used.remove(position.feature.into());
                *all -= 1;
                used.iter_mut().filter(|used| **used > column).for_each(|used| *used -= 1);
            }
        }
        own
    }

    /// Number of features.
    pub fn count(&self) -> usize {
        self.names.len()
    }

    /// The features' names.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    /// The features among the columns of a table with this header, except for the columns `others`.
    ///
    /// If both have names, each feature has to be one of the columns; there may be more of them, in any order. Names are
    /// equal also where one has `_` for the other one's blanks, brackets and control characters, as LightGBM writes them.
    /// `Column_3`, `f3` and `3` are no names, but numbers: they are found by them. Where one side has none, columns are taken by
    /// their position. Numbers alone are a row without a header, unless they count from 0 or are the features' own names.
    ///
    /// # Errors
    /// If a feature is none of the columns, two columns have the same name, the header is numbers alone, or columns without
    /// names are neither as many as features nor as many as the library had.
    pub fn among(&self, header: &[&str], others: &[usize]) -> Result<Matched> {
        let mut seen = HashSet::new();
        if let Some(name) = header.iter().find(|name| !name.is_empty() && !seen.insert(**name)) {
            return Err(repeated(name));
        }
        let by_name = |columns| Ok(Matched { columns, by_position: false });
        let is_unique = self.names().collect::<HashSet<_>>().len() == self.count();
        if let Some(columns) = found(self.names(), header).filter(|_| is_unique) {
            return by_name(columns);
        }
        let open: Vec<usize> = (0..header.len()).filter(|column| !others.contains(column)).collect();
        let names: Vec<&str> = open.iter().filter_map(|&column| header.get(column).copied()).collect();
        let theirs = numbers(names.iter().copied());
        let is_counted = theirs.as_ref().is_some_and(|numbers| numbers.iter().copied().eq(0..names.len()));
        if is_numbers_alone(&names) && !is_counted {
            return Err(problem!("its columns are named {}: numbers alone", some(&names))
                .fix("Write the features' names into the first line, above the first row."));
        }
        if let (Some(own), Some(theirs)) = (numbers(self.names()), &theirs)
            && let Some(positions) = found(own.iter(), &theirs.iter().collect::<Vec<_>>())
        {
            return by_name(positions.into_iter().filter_map(|position| open.get(position).copied()).collect());
        }
        if is_counted || !is_unique || numbers(self.names()).is_some() {
            return self.by_position(&open);
        }
        let plain: Vec<String> = header.iter().map(|name| self::plain(name)).collect();
        let own: Vec<String> = self.names().map(self::plain).collect();
        let plain: Vec<&str> = plain.iter().map(String::as_str).collect();
        let used = |name: &&String| plain.iter().filter(|column| **column == name.as_str()).count();
        if let Some(name) = own.iter().find(|name| used(name) > 1) {
            return Err(repeated(name));
        }
        found(own.iter().map(String::as_str), &plain).map_or_else(
            || {
                let missing = self.names().zip(&own).filter(|(_, plain)| used(plain) == 0);
                let missing: Vec<&str> = missing.map(|(name, _)| name).collect();
                Err(problem!("no column is named {}; its columns are {}", some(&missing), some(header)).fix(
                    "Name the columns as the model's features, in any order; or 0, 1 and so on, to take them by their \
                     position.",
                ))
            },
            by_name,
        )
    }

    /// The features among columns without names, given their positions.
    fn by_position(&self, open: &[usize]) -> Result<Matched> {
        let columns = match self.of_width(open.len())? {
            None => open.to_vec(),
            Some(used) => used.iter().filter_map(|&column| open.get(column).copied()).collect(),
        };
        Ok(Matched { columns, by_position: true })
    }

    /// The positions of the features in rows of `found` values without names; `None` if the values are the features.
    ///
    /// # Errors
    /// If there are neither as many as features nor as many as the library had columns.
    pub fn of_width(&self, found: usize) -> Result<Option<&[usize]>> {
        match &self.columns {
            _ if found == self.names.len() => Ok(None),
            Some((all, used)) if found == *all => Ok(Some(used)),
            columns => {
                let all = columns.as_ref().map(|(all, _)| format!(" of the library's {all} columns"));
                Err(other_width(found, self.names.len(), &all.unwrap_or_default()))
            }
        }
    }
}

/// Returns an error unless rows have `wanted` features.
///
/// # Errors
/// If they have another number of them.
pub fn check_columns(found: usize, wanted: usize) -> Result<()> {
    if found == wanted { Ok(()) } else { Err(other_width(found, wanted, "")) }
}

/// Another number of columns than of features.
fn other_width(found: usize, wanted: usize, of: &str) -> Error {
    problem!("it has {found} columns for {wanted} features{of}").fix(
        "Name the columns as the features (`palpate inspect` lists them), or give as many columns as features, in their \
         order.",
    )
}

/// A name of two columns.
fn repeated(name: &str) -> Error {
    problem!("two columns are named {name:?}").fix("Give each column a name of its own.")
}

/// The first names of many, `?` for those that are not text.
pub(crate) fn some<N: AsRef<str>>(names: &[N]) -> String {
    let plain = |name: &N| name.as_ref().chars().map(|own| if own.is_control() { '?' } else { own }).collect();
    let names: Vec<String> = names.iter().map(plain).collect();
    Columns::first(names.iter().map(String::as_str), 12)
}

/// The position of each of these in a header, if all are there.
fn found<T: PartialEq>(wanted: impl Iterator<Item = T>, header: &[T]) -> Option<Vec<usize>> {
    wanted.map(|name| header.iter().position(|column| *column == name)).collect()
}

/// The numbers of columns, if no column has a name.
fn numbers<'n>(names: impl Iterator<Item = &'n str>) -> Option<Vec<usize>> {
    let numbers: Option<Vec<usize>> = names.map(number).collect();
    numbers.filter(|numbers| !numbers.is_empty() && numbers.iter().collect::<HashSet<_>>().len() == numbers.len())
}

/// The number of a column whose name a library or pandas made of it: `Column_3`, `f3` or `3`.
fn number(name: &str) -> Option<usize> {
    let digits = name.strip_prefix("Column_").or_else(|| name.strip_prefix('f')).unwrap_or(name);
    let is_number = digits.bytes().all(|byte| byte.is_ascii_digit()) && (digits.len() == 1 || !digits.starts_with('0'));
    digits.parse().ok().filter(|_| is_number)
}

/// True if a header has nothing but numbers, and so is probably the first row of a file without one.
fn is_numbers_alone(names: &[&str]) -> bool {
    let is_number = |name: &&str| name.parse::<f64>().is_ok();
    names.iter().any(is_number) && names.iter().all(|name| name.is_empty() || is_number(name))
}

/// The name as LightGBM writes it, and a model holds it: without blanks, brackets and control characters.
fn plain(name: &str) -> String {
    let replaced = |character: char| match character {
        ' ' | '[' | ']' | '{' | '}' | '(' | ')' | '<' | '>' | ',' | ':' | '"' => '_',
        other => other,
    };
    holdable(name.trim()).chars().map(replaced).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_without_names_have_all_columns_of_the_library_or_the_features() {
        let names = ["f7", "f299"].map(String::from).to_vec();
        let features = Features { names, columns: Some((300, vec![7, 299])) };
        assert_eq!(features.of_width(2), Ok(None));
        assert_eq!(features.of_width(300), Ok(Some(&[7, 299][..])));
        let wrong = features.of_width(299).unwrap_err();
        assert_eq!(wrong.what(), "it has 299 columns for 2 features of the library's 300 columns");
    }
}
