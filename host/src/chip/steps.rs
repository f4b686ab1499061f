//! Steps that are streamed to a chip: touches, and where one object ends and the next begins.

use crate::error::Result;
use crate::touches::{Dataset, Log, text};
use palpate_shared::Touch;
use std::io::BufRead;
use std::path::Path;

/// Something to tell the chip.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// The next object begins: forget the touches so far. With its name, if known.
    Object(Option<String>),
    /// A touch.
    Touch(Touch),
}

/// Source of touches.
pub enum Steps {
    /// A data set: a sequence of touches of each object in turn, again and again.
    Sequences {
        /// The touches.
        dataset: Box<Dataset>,
        /// Touches of an object before the next one comes.
        length: usize,
        /// Touches still to come.
        left: u64,
        /// Indices of the sequence and of its touch.
        at: (usize, usize),
    },
    /// Touches of a log, in the order of their times; where the object changes, another one begins.
    Logged(std::vec::IntoIter<Step>),
    /// Lines of text as they come; an empty line begins another object.
    Lines(text::Lines<Box<dyn BufRead + Send>>),
}

impl Steps {
    /// `count` touches of a data set: `length` of the first object, `length` of the second, and so on, then `length` more
    /// of the first. An object's touches begin again when they are used up. Those of a sequence are of one source, such as
    /// an instance; sources take turns.
    pub fn sequences(dataset: Dataset, length: usize, count: u64) -> Self {
        Self::Sequences { dataset: dataset.into(), length: length.max(1), left: count, at: (0, 0) }
    }

    /// Lines as in a data set's files, until they end.
    pub fn lines(reader: Box<dyn BufRead + Send>, path: &Path) -> Self {
        Self::Lines(text::Lines::new(reader, path))
    }

    /// The touches of a log.
    pub fn logged(log: &Log) -> Self {
        let mut steps = Vec::with_capacity(log.touches().len());
        let mut before = None;
        for logged in log.touches() {
            let object = log.object(logged);
            if object != before {
                steps.push(Step::Object(object.map(String::from)));
            }
            before = object;
            steps.push(Step::Touch(logged.touch));
        }
        Self::Logged(steps.into_iter())
    }

    /// Number of touches there will be, if known.
    pub fn count(&self) -> Option<u64> {
        match self {
            Self::Sequences { left, .. } => Some(*left),
            Self::Logged(steps) => {
                let is_touch = |step: &&Step| matches!(step, Step::Touch(_));
                Some(steps.as_slice().iter().filter(is_touch).count() as u64)
            }
            Self::Lines(_) => None,
        }
    }

    /// The next step; `None` at the end.
    ///
    /// # Errors
    /// When a line is not a touch.
    pub fn next_step(&mut self) -> Result<Option<Step>> {
        match self {
            Self::Sequences { dataset, length, left, at: (sequence, touch) } => {
                if *left == 0 {
                    return Ok(None);
                }
                let objects = dataset.objects.len();
                let number = *sequence % objects.max(1);
                let Some(object) = dataset.objects.get(number) else { return Ok(None) };
                let pools = object.pools();
                if *touch == 0 {
                    *touch = 1;
                    return Ok(Some(Step::Object(Some(object.name.clone()))));
                }
                let round = *sequence / objects;
                let own = pools.get(round % pools.len().max(1)).map_or(&[][..], |pool| object.of_pool(pool));
                let index = (round / pools.len().max(1)) * *length + *touch - 1;
                let next = own.get(index % own.len().max(1)).copied();
                *left -= 1;
                (*sequence, *touch) = if touch == length { (*sequence + 1, 0) } else { (*sequence, *touch + 1) };
                Ok(next.map(Step::Touch))
            }
            Self::Logged(steps) => Ok(steps.next()),
            Self::Lines(lines) => {
                let step = |(_, touch): (u64, Option<Touch>)| touch.map_or(Step::Object(None), Step::Touch);
                lines.next().map(|line| line.map(step)).transpose()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::touches::ObjectTouches;
    use crate::touches::Source;

    #[test]
    fn sequences_take_turns_and_continue_where_each_object_stopped() {
        let object = |name: &str, first: u32| {
            let touches = (first..first + 3).map(|t| Touch::from_micros([0, t, t])).collect();
            ObjectTouches::new(name, touches, Source::Object)
        };
        let dataset = Dataset::new(vec![object("a", 10), object("b", 20)]);
        let mut steps = Steps::sequences(dataset, 2, 7);
        let mut seen = Vec::new();
        while let Some(step) = steps.next_step().unwrap() {
            seen.push(match step {
                Step::Object(name) => name.unwrap(),
                Step::Touch(touch) => touch.times()[1].micros().unwrap().to_string(),
            });
        }
        assert_eq!(seen, ["a", "10", "11", "b", "20", "21", "a", "12", "10", "b", "22"]);
    }

    #[test]
    fn lines_are_touches_and_an_empty_line_begins_another_object() {
        let text: &[u8] = b"0.03 0 0.05\n\n0 - 0.1\nnonsense\n";
        let mut steps = Steps::lines(Box::new(text), Path::new("touches.txt"));
        assert_eq!(steps.next_step().unwrap(), Some(Step::Touch(Touch::from_micros([30_000, 0, 50_000]))));
        assert_eq!(steps.next_step().unwrap(), Some(Step::Object(None)));
        assert!(matches!(steps.next_step().unwrap(), Some(Step::Touch(touch)) if !touch.is_full()));
        let error = steps.next_step().unwrap_err().to_string();
        assert!(error.starts_with("touches.txt:4:"), "{error}");
        assert_eq!(steps.next_step().unwrap(), None);
    }
}
