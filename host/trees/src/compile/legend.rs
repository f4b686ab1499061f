//! The legend of a model's source code: what each feature of a row is, and what the number of a class stands for.

use crate::rows::{Encoder, columns_of, feature_names};
use palpate_onboard::Model;
use palpate_shared::format::Position;
use std::collections::BTreeMap;

/// Text for a comment of C and Rust: it neither ends one nor seems to begin another, and stands in one line, in the order in
/// which it is written.
pub(super) fn plain(text: &str) -> String {
    let is_hidden = |c: char| c.is_control() || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let text: String = text.chars().map(|character| if is_hidden(character) { ' ' } else { character }).collect();
    text.replace("*/", "* /").replace("/*", "/ *")
}

/// The classes' labels as numbers, if all of them are whole ones.
pub fn label_numbers(labels: &[impl AsRef<str>]) -> Option<Vec<i32>> {
    // A compiler takes the digits of the least number as a larger type's.
    let is_spelled = |number: &i32, label: &str| *number > i32::MIN && number.to_string() == label;
    let number = |label: &str| label.parse().ok().filter(|number| is_spelled(number, label));
    labels.iter().map(|label| number(label.as_ref())).collect()
}

/// A model, and the meaning of its rows and classes.
pub(super) struct Legend<'a> {
    pub(super) model: &'a Model<'a>,
    /// Categories of the library's columns, by the numbers that stand for them.
    categories: &'a BTreeMap<usize, Vec<String>>,
    /// The outputs that can be named, or the targets; none of a single value.
    labels: Vec<&'a str>,
}

impl<'a> Legend<'a> {
    pub(super) fn new(model: &'a Model<'a>, categories: &'a BTreeMap<usize, Vec<String>>) -> Self {
        let count = if model.object_count() > 1 { model.known_count() } else { 0 };
        Self { model, categories, labels: (0..count).map(|object| model.object_name(object)).collect() }
    }

    /// The labels in the order of their indices, for a comment.
    pub(super) fn listed(&self) -> String {
        plain(&self.labels.join(", "))
    }

    /// The labels as numbers, of classes.
    fn numbers(&self) -> Option<Vec<i32>> {
        label_numbers(&self.labels).filter(|numbers| !numbers.is_empty() && !self.model.prediction().targets)
    }

    /// Row and classes in C: constants for words, a table of numbers.
    pub(super) fn c(&self, name: &str) -> String {
        let (mut text, prefix) = (String::new(), name.to_uppercase());
        if self.model.descriptor().is_none() {
            let features = self.model.feature_count();
            text = format!("/* {} */\n#define {prefix}_FEATURES {features}\n\n", self.row().join("\n * "));
        }
        if let Some(numbers) = self.numbers() {
            let (count, numbers) = (numbers.len(), joined(&numbers));
            text += &format!(
                "/* The label of each class by its index. */\nstatic const int32_t {name}_labels[{count}] = {{{numbers}}};\n\n"
            );
        } else if !self.labels.is_empty() {
            let constant = |(index, constant, label)| format!("    {prefix}_{constant} = {index}, /* {label} */\n");
            text += &format!("enum {{\n{}}};\n\n", self.constants().into_iter().map(constant).collect::<String>());
        }
        text
    }

    /// Row and classes in Rust; `prefix` comes before the names of constants.
    pub(super) fn rust(&self, prefix: &str) -> String {
        let mut text = String::new();
        let mut put = |about: &str, item: &str| text += &format!("/// {about}\n#[allow(dead_code)]\npub {item};\n");
        if self.model.descriptor().is_none() {
            let features = self.model.feature_count();
            put(&self.row().join("\n/// "), &format!("const {prefix}FEATURES: usize = {features}"));
        }
        if let Some(numbers) = self.numbers() {
            let (count, numbers) = (numbers.len(), joined(&numbers));
            let table = format!("static {prefix}LABELS: [i32; {count}] = [{numbers}]");
            put("The label of each class by its index.", &table);
            return text;
        }
        for (index, constant, label) in self.constants() {
            put(&format!("Index of {label}."), &format!("const {prefix}{constant}: usize = {index}"));
        }
        text
    }

    /// A constant for each label that is no number: its index, a name that no other has, and the label for a comment. Names are in
    /// upper case, and the index where nothing else is left of a label.
    fn constants(&self) -> Vec<(usize, String, String)> {
        let mut constants: Vec<(usize, String, String)> = Vec::new();
        let kind = if self.model.prediction().targets { "VALUE" } else { "CLASS" };
        for (index, label) in self.labels.iter().enumerate() {
            let words = label.split(|character: char| !character.is_ascii_alphanumeric());
            let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
            let words = if words.is_empty() { index.to_string() } else { words.join("_").to_uppercase() };
            let own = format!("{kind}_{words}");
            let others = (2..).map(|number| format!("{own}_{number}"));
            let is_free = |name: &String| constants.iter().all(|(_, taken, _)| taken != name);
            let name = std::iter::once(own.clone()).chain(others).find(is_free).unwrap_or_default();
            constants.push((index, name, plain(label)));
        }
        constants
    }

    /// Lines about the features of a row: position, name, column where the library had more, scale, categories.
    fn row(&self) -> Vec<String> {
        let (encoder, columns) = (Encoder::of(self.model), columns_of(self.model));
        let line = |(feature, name): (usize, String)| {
            let column = columns.as_ref().and_then(|(_, used)| used.get(feature).copied());
            let mut line = format!("row[{feature}] = {name}");
            line += &column.map_or_else(String::new, |column| format!(" (column {column})"));
            if let Encoder::Scaled(scales) = &encoder {
                line += &format!(" times {}", scales.get(feature).unwrap_or(&1.0));
            }
            if let Some(categories) = self.categories.get(&column.unwrap_or(feature)) {
                let each = categories.iter().enumerate().map(|(number, category)| format!("{number} {category}"));
                line += &format!(": {}", each.collect::<Vec<_>>().join(", "));
            }
            plain(&line) + ";"
        };
        let mut lines = vec!["The features of a row, in their order:".to_owned()];
        lines.extend(feature_names(self.model).into_iter().enumerate().map(line));
        if let Some(Position { feature, .. }) = self.model.position() {
            lines.push(format!(
                "row[{feature}] is the number of a row in its sequence: calls that count it take rows without it."
            ));
        }
        if let Some((all, used)) = columns {
            let others = all - used.len();
            lines.push(format!(
                "The other {others} of the library's {all} columns are not in a row. Columns count from 0."
            ));
        }
        lines
    }
}

/// Numbers with commas between them.
fn joined(numbers: &[i32]) -> String {
    numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}
