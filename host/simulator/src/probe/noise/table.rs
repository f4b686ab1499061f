//! The settings of noise, a row for each. Texts, probe files, checks and descriptions go by these rows.

use super::Noise;
use super::quantity::{ANGLE, DURATION, FACTOR, LENGTH, Quantity, SHARE, SHIFT, SPEED_SHARE, TURN};
use crate::probe::approach::FINGERS;
use Form::{Fingers, Move, One, Range};

/// A setting of noise.
#[derive(Debug)]
pub(super) struct Row {
    /// Its key in texts and in probe files.
    pub(super) key: &'static str,
    form: Form,
    /// Its numbers in a noise.
    numbers: fn(&mut Noise) -> Vec<&mut f64>,
    /// Words for it, with `{}` in the place of its numbers.
    words: &'static str,
}

/// The form in which the numbers of a setting are written.
#[derive(Debug)]
enum Form {
    One(Quantity),
    /// A duration, or a range of them.
    Range,
    /// One for all fingers, or one for each, with words for a finger that has `#` in the place of its number.
    Fingers(Quantity, &'static str),
    /// A length and an angle.
    Move,
}

/// Every setting in the order in which they are written and described, but not that of fingers that bend aside.
pub(super) static ROWS: [Row; 12] = [
    Row {
        key: "noise",
        form: Range,
        numbers: |noise| vec![&mut noise.deviation.least, &mut noise.deviation.largest],
        words: "noise of {}",
    },
    Row { key: "timer", form: One(DURATION), numbers: |noise| vec![&mut noise.timer], words: "a timer of {}" },
    Row {
        key: "debounce",
        form: One(DURATION),
        numbers: |noise| vec![&mut noise.debounce],
        words: "bouncing of up to {}",
    },
    Row {
        key: "missed",
        form: Fingers(SHARE, "{} of finger #'s contacts missed"),
        numbers: |noise| noise.missed.iter_mut().collect(),
        words: "{} of contacts missed",
    },
    Row {
        key: "bent",
        form: Fingers(SHIFT, "finger # is {}"),
        numbers: |noise| noise.bent.iter_mut().collect(),
        words: "every finger is {}",
    },
    Row {
        key: "speed_factor",
        form: One(FACTOR),
        numbers: |noise| vec![&mut noise.speed],
        words: "a speed of {} times the nominal one",
    },
    Row {
        key: "speed_error",
        form: One(SPEED_SHARE),
        numbers: |noise| vec![&mut noise.speed_error],
        words: "speed off by up to {} per touch",
    },
    Row {
        key: "speed_bias",
        form: One(SPEED_SHARE),
        numbers: |noise| vec![&mut noise.speed_bias],
        words: "speed off by up to {} per robot",
    },
    Row {
        key: "pose_noise",
        form: One(ANGLE),
        numbers: |noise| vec![&mut noise.pose],
        words: "a pose turned by {} per touch",
    },
    Row {
        key: "pose_bias",
        form: One(ANGLE),
        numbers: |noise| vec![&mut noise.pose_bias],
        words: "a pose turned by {} per robot",
    },
    Row {
        key: "position",
        form: One(LENGTH),
        numbers: |noise| vec![&mut noise.position],
        words: "a position off by {} per touch",
    },
    Row {
        key: "drift",
        form: Move,
        numbers: |noise| noise.drift.iter_mut().collect(),
        words: "an object that moves by {} per approach",
    },
];

impl Row {
    /// The row of a key.
    pub(super) fn of_key(key: &str) -> Option<&'static Self> {
        ROWS.iter().find(|row| row.key == key)
    }

    /// Its numbers in a noise.
    pub(super) fn of(&self, noise: &Noise) -> Vec<f64> {
        let mut copy = *noise;
        (self.numbers)(&mut copy).into_iter().map(|number| *number).collect()
    }

    /// Sets its numbers.
    pub(super) fn set(&self, noise: &mut Noise, numbers: &[f64]) {
        (self.numbers)(noise).into_iter().zip(numbers).for_each(|(own, number)| *own = *number);
    }

    /// True if it changes touches in this noise.
    pub(super) fn adds_to(&self, noise: &Noise) -> bool {
        self.of(noise) != self.of(&Noise::default())
    }

    /// The quantity that is at this position of its numbers.
    fn quantity(&self, position: usize) -> &Quantity {
        match (&self.form, position) {
            (One(quantity) | Fingers(quantity, _), _) => quantity,
            (Range, _) => &DURATION,
            (Move, 0) => &LENGTH,
            (Move, _) => &TURN,
        }
    }

    /// Its numbers, only one if all are alike.
    fn different<'n>(&self, numbers: &'n [f64]) -> &'n [f64] {
        let is_one = !matches!(self.form, Move) && numbers.iter().all(|number| *number == numbers[0]);
        if is_one { &numbers[..1] } else { numbers }
    }

    /// Words for what it adds in this noise.
    pub(super) fn described(&self, noise: &Noise) -> Vec<String> {
        let numbers = self.of(noise);
        let said = |(position, number): (usize, &f64)| (self.quantity(position).said)(*number);
        match (&self.form, self.different(&numbers)) {
            (Fingers(_, words), each @ [_, _, _]) => {
                let there = each.iter().enumerate().filter(|(_, number)| **number != 0.0);
                let words = |finger: usize| words.replace('#', &(finger + 1).to_string());
                there.map(|finger| words(finger.0).replace("{}", &said(finger))).collect()
            }
            (Range, [least, largest]) => {
                vec![self.words.replace("{}", &format!("{} to {}", least / 1e3, said((1, largest))))]
            }
            (_, different) => {
                let said: Vec<String> = different.iter().enumerate().map(said).collect();
                vec![self.words.replace("{}", &said.join(" and "))]
            }
        }
    }

    /// Numbers that are out of range, and the range in words; none if all are in range.
    pub(super) fn wrong(&self, numbers: &[f64]) -> Option<(String, &'static str)> {
        let is_wrong = |(position, number): &(usize, &f64)| !self.quantity(*position).range.contains(*number);
        let wrong = numbers.iter().enumerate().find(is_wrong);
        match (&self.form, numbers) {
            (Range, [least, largest]) if least != largest => {
                let is_range = wrong.is_none() && least < largest;
                (!is_range).then(|| (format!("{least}..{largest}"), DURATION.allowed))
            }
            _ => wrong.map(|(position, number)| (number.to_string(), self.quantity(position).allowed)),
        }
    }

    /// The numbers of a text.
    ///
    /// # Errors
    /// A text that can be read instead, with an example.
    pub(super) fn read(&self, text: &str) -> Result<Vec<f64>, &'static str> {
        if let Range = self.form {
            return range(text).ok_or("a duration with its unit such as 5ms, or a range such as 0..10ms");
        }
        let number = |(position, text): (usize, &str)| {
            let quantity = self.quantity(position);
            quantity.read(text).ok_or(quantity.example)
        };
        let numbers = text.split('/').enumerate().map(number).collect::<Result<Vec<_>, _>>()?;
        match (&self.form, &numbers[..]) {
            (Fingers(..), [one]) => Ok(vec![*one; FINGERS]),
            (One(_), [_]) | (Move, [_, _]) | (Fingers(..), [_, _, _]) => Ok(numbers),
            (One(quantity), _) => Err(quantity.example),
            (Move, _) => Err("a length and an angle such as 1mm/1deg"),
            _ => Err("one value for all fingers, or one for each such as 1%/2%/0% or 3ms/0ms/-1ms"),
        }
    }

    /// A text that reads as these numbers to the last bit.
    pub(super) fn written(&self, numbers: &[f64]) -> String {
        let different = self.different(numbers).iter().enumerate();
        let texts: Vec<String> = different.map(|(position, number)| self.quantity(position).written(*number)).collect();
        match (&self.form, &texts[..]) {
            (Range, [least, largest]) => {
                let short = format!("{}..{largest}", least.trim_end_matches(|c: char| c.is_ascii_alphabetic()));
                if range(&short).as_deref() == Some(numbers) { short } else { format!("{least}..{largest}") }
            }
            _ => texts.join("/"),
        }
    }
}

/// The least and the largest of a range of durations.
fn range(text: &str) -> Option<Vec<f64>> {
    let Some((least, largest)) = text.split_once("..") else { return DURATION.read(text).map(|both| vec![both; 2]) };
    // The first number may go without a unit: it has that of the second.
    let unit = largest.trim_start_matches(|c: char| !c.is_ascii_alphabetic());
    let least = DURATION.read(least).or_else(|| DURATION.read(&format!("{least}{unit}")))?;
    let largest = DURATION.read(largest).filter(|largest| least <= *largest)?;
    Some(vec![least, largest])
}
