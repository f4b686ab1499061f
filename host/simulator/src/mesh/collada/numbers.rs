//! The numbers in an element.

use super::{Wrong, damaged};
use crate::error::Error;
use crate::mesh::words::{not_a_number, shown};
use roxmltree::Node;

/// A number of a COLLADA file.
pub(super) trait Number: std::str::FromStr {
    /// Problem with it, if there is one.
    fn problem(&self, word: &str) -> Option<Error>;
}

impl Number for f64 {
    fn problem(&self, word: &str) -> Option<Error> {
        let what = || damaged(format!("the number {:?} is not finite", shown(word.as_bytes())));
        // Coordinates are kept as `f32`.
        (!(*self as f32).is_finite()).then(what)
    }
}

impl Number for u32 {
    fn problem(&self, _: &str) -> Option<Error> {
        None
    }
}

/// All numbers in an element, including those after comments in it.
pub(super) fn numbers<T: Number>(node: Node<'_, '_>) -> Result<Vec<T>, Wrong> {
    let mut numbers = Vec::new();
    for text in node.children().filter(|child| child.is_text()) {
        let content = text.text().unwrap_or_default();
        for word in content.split_ascii_whitespace() {
            let problem = match word.parse::<T>() {
                Ok(number) => {
                    let problem = number.problem(word);
                    numbers.push(number);
                    problem
                }
                Err(_) => Some(not_a_number(word.as_bytes())),
            };
            if let Some(problem) = problem {
                // A word is a part of the text, so it starts somewhere in it.
                let start = (word.as_ptr() as usize).saturating_sub(content.as_ptr() as usize);
                let before = content.get(..start).unwrap_or_default();
                return Err(Wrong { node: text.id(), line: before.matches('\n').count() as u64, problem });
            }
        }
    }
    Ok(numbers)
}
