//! Commands for the C header's test program (`tests/c/replay.h`), and its required answer to each: the crate's.

use crate::abuse::places;
use palpate_onboard::{Model, ModelError, Recognizer, Refused, RowsSeen, Stopping, Verdict};
use palpate_shared::Touch;
use palpate_shared::format::{Group, HEADER_LENGTH, Layout};
use std::fmt::Write;

/// Commands, and the lines that have to come out.
#[derive(Default)]
pub struct Script<'m> {
    /// Commands that the program reads.
    pub commands: Vec<u8>,
    /// Output that the program has to write.
    pub expected: String,
    recognizer: Option<Recognizer<'m, 256>>,
    seen: RowsSeen<256>,
    /// Number of rows of sequences so far.
    pub next_rows: usize,
}

impl<'m> Script<'m> {
    /// Opens a model; whether it is one.
    pub fn open(&mut self, bytes: &'m [u8]) -> bool {
        self.block(b'M', bytes);
        let opened = Model::new(bytes);
        let (code, place) = opened.as_ref().map_or_else(|error| (code(error), error.offset()), |_| (0, 0));
        self.say(&format!("open {code:x} {place:x}"));
        let start =
            |model: &Model<'m>| Recognizer::new(model, Stopping::from_model(model)).expect("at most 256 objects");
        self.recognizer = opened.ok().as_ref().map(start);
        self.seen.reset();
        self.recognizer.is_some()
    }

    /// Recognizer of the model that is open.
    ///
    /// # Panics
    /// If none is.
    pub fn recognizer(&self) -> &Recognizer<'m, 256> {
        self.recognizer.as_ref().expect("a model is open")
    }

    fn known(&mut self) -> &mut Recognizer<'m, 256> {
        self.recognizer.as_mut().expect("a model is open")
    }

    /// Pushes a touch.
    pub fn touch(&mut self, touch: &Touch) {
        self.commands.push(b'T');
        for time in touch.times() {
            self.commands.extend(time.micros().unwrap_or(u32::MAX).to_le_bytes());
        }
        self.commands.push(touch.pose().is_some().into());
        let pose = touch.pose().map_or([[0; 3]; 2], |pose| [pose.direction, pose.alignment]);
        self.commands.extend(pose.into_iter().flatten().flat_map(i16::to_le_bytes));
        if let Err(refused) = self.known().push(touch) {
            return self.say(&format!("refused {}", refusal(refused)));
        }
        let model = *self.recognizer().model();
        let features = model.descriptor().expect("it takes touches").features(touch);
        let mut margins = vec![0; model.object_count()];
        model.margins(touch, &mut margins);
        self.numbers("touch", &margins);
        self.row_known(features.as_slice());
    }

    /// Pushes a row of all features, whatever the model says about sequences.
    pub fn row(&mut self, row: &[i32]) {
        self.row_command(b'R', row);
        let model = *self.recognizer().model();
        let pushed = if model.position().is_some() || model.guard().is_some() {
            let mut margins = vec![0; model.object_count()];
            model.margins_of(row, &mut margins);
            Ok(self.known().push_margins(&margins))
        } else {
            self.known().push_features(row)
        };
        match pushed {
            Err(refused) => self.say(&format!("refused {}", refusal(refused))),
            Ok(_) => self.row_known(row),
        }
    }

    /// Pushes the measured features of the next row of a sequence.
    ///
    /// # Panics
    /// If the row is refused by one of [`RowsSeen::next`] and [`Recognizer::push_seen`] alone.
    pub fn next_row(&mut self, measured: &[i32]) {
        self.row_command(b'Q', measured);
        self.next_rows += 1;
        let model = *self.recognizer().model();
        let features = self.seen.clone().next(&model, measured);
        let pushed = self.recognizer.as_mut().expect("a model is open").push_seen(measured, &mut self.seen);
        assert_eq!(pushed.err(), features.err());
        match features {
            Err(Refused::Guarded(feature, _)) => self.say(&format!("guarded {:x}", u16::from(feature) + 1)),
            Err(refused) => self.say(&format!("refused {}", refusal(refused))),
            Ok(features) => self.row_known(&features[..model.feature_count()]),
        }
    }

    fn row_command(&mut self, command: u8, row: &[i32]) {
        self.commands.push(command);
        self.commands.extend((row.len() as u16).to_le_bytes());
        self.commands.extend(row.iter().flat_map(|value| value.to_le_bytes()));
    }

    /// Pushes margins.
    pub fn margins(&mut self, margins: &[i32]) {
        self.row_command(b'E', margins);
        self.known().push_margins(margins);
        self.evidence();
    }

    /// Forgets all touches.
    pub fn reset(&mut self) {
        self.commands.push(b'X');
        self.known().reset();
        self.seen.reset();
    }

    /// The posteriors of all objects, and of one that does not exist.
    pub fn posteriors(&mut self) {
        self.commands.push(b'P');
        let recognizer = self.recognizer();
        let objects = 0..=recognizer.model().object_count();
        let posteriors: Vec<u64> = objects.map(|object| recognizer.posterior(object).q56()).collect();
        self.say(&format!("best {:x}", self.recognizer().best()));
        self.numbers("posteriors", &posteriors);
        let recognizer = self.recognizer();
        if recognizer.model().outputs().is_some() {
            let outputs = 0..=recognizer.model().object_count();
            let together = outputs.map(|output| recognizer.posterior_together(output));
            let numbers: Vec<u64> = together.flat_map(|(object, share)| [object.q56(), share.q56()]).collect();
            self.numbers("together", &numbers);
        }
    }

    /// The objects' names.
    pub fn names(&mut self) {
        self.commands.push(b'N');
        let model = *self.recognizer().model();
        // Where `int` has 16 bits, the number after the last of these is 0.
        for object in (0..=model.object_count()).chain([65_535]) {
            let name: String = model.object_name(object).bytes().map(|byte| format!("{byte:02x}")).collect();
            self.say(&format!("name {name} {:x}", name.len() / 2));
        }
    }

    fn row_known(&mut self, features: &[i32]) {
        let model = *self.recognizer().model();
        self.numbers("features", features);
        let mut margins = vec![0; model.object_count()];
        model.margins_of(features, &mut margins);
        self.numbers("margins", &margins);
        let mut sums = vec![0.0; model.object_count()];
        if model.f32_margins_of(features, &mut sums) {
            let bits = |sum: &f32| if sum.is_nan() { -1 } else { i64::from(sum.to_bits()) };
            self.numbers("sums", &sums.iter().map(bits).collect::<Vec<_>>());
        }
        let class = model.predict_class(features, &mut margins).expect("as many margins as classes");
        let bits =
            |value: Option<f32>| value.map_or(0, |value| if value.is_nan() { -1 } else { i64::from(value.to_bits()) });
        let values = [bits(model.predict_raw(features)), bits(model.predict_value(features))];
        self.numbers("predicted", &[class as i64, values[0], values[1]]);
        self.numbers("margins", &margins);
        self.evidence();
    }

    fn evidence(&mut self) {
        let evidence = self.recognizer().evidence().to_vec();
        self.numbers("evidence", &evidence);
        let (verdict, object) = match self.recognizer().verdict() {
            Verdict::Undecided => (0, 0),
            Verdict::Recognized { object, .. } => (1, object),
            Verdict::Unknown => (2, 0),
            Verdict::GaveUp => (3, 0),
        };
        self.say(&format!("verdict {verdict} {object:x} {:x}", self.recognizer().touches()));
    }

    fn block(&mut self, command: u8, bytes: &[u8]) {
        self.commands.push(command);
        self.commands.extend((bytes.len() as u32).to_le_bytes());
        self.commands.extend_from_slice(bytes);
    }

    fn numbers<T: Copy + Into<i128>>(&mut self, word: &str, numbers: &[T]) {
        self.expected += word;
        for &number in numbers {
            let number: i128 = number.into();
            let sign = if number < 0 { "-" } else { "" };
            write!(self.expected, " {sign}{:x}", number.unsigned_abs()).expect("a string");
        }
        self.say("");
    }

    fn say(&mut self, line: &str) {
        self.expected += line;
        self.expected.push('\n');
    }
}

/// The number of an error in `palpate.h`.
const fn code(error: &ModelError) -> u8 {
    match error {
        ModelError::Length { .. } => 1,
        ModelError::NotAModel => 2,
        ModelError::Version(_) => 3,
        ModelError::Checksum { .. } => 4,
        ModelError::Field { .. } => 5,
        ModelError::Section { .. } => 6,
        ModelError::NotUnderstood { .. } => 7,
        ModelError::MarginRange => 8,
        ModelError::NeedsCode => 11,
        _ => 9,
    }
}

/// The number of a refusal in `palpate.h`.
const fn refusal(refused: Refused) -> u8 {
    match refused {
        Refused::Pattern(_) => 1,
        Refused::Spread => 2,
        Refused::NoPose => 3,
        Refused::NeedsFeatures => 4,
        _ => 5,
    }
}

/// Sentence of `FORMAT.md`, and the models that it leaves something open for.
pub type LeftOpen = (&'static str, fn(&Model<'_>) -> bool);

/// Models whose margins `FORMAT.md` leaves open. Two implementations may differ in these, in what follows from them, and in
/// [names](NAMES_LEFT_OPEN); in nothing else.
pub const MARGINS_LEFT_OPEN: [LeftOpen; 1] =
    [("subtrees of compact and wide trees whose sizes contradict each other must end the", has_contradictions)];

/// Models whose names of objects it leaves open.
pub const NAMES_LEFT_OPEN: LeftOpen =
    ("a reader that does not check UTF-8 may give the bytes of such a name", has_a_name_that_is_no_utf8);

/// True if `FORMAT.md` says what margins a model has.
pub fn is_specified(model: &Model<'_>) -> bool {
    !MARGINS_LEFT_OPEN.iter().any(|(_, is_of)| is_of(model))
}

/// The groups of a model, and the splits of each.
///
/// # Panics
/// If it is no model that was opened.
pub fn groups_and_splits<'m>(model: &Model<'m>) -> Vec<(Group, &'m [u8])> {
    let bytes = model.bytes();
    let [_, _, _, _, groups, mut splits, _, _] = places(bytes);
    let groups = bytes[groups..splits].as_chunks().0;
    let group = |group: &[u8; Group::LENGTH]| {
        let group = Group::from_bytes(*group).expect("a group");
        let start = splits;
        for _ in 0..group.trees {
            splits += 2 + size_of_split(model) * number(&bytes[splits..]);
        }
        (group, &bytes[start..splits])
    };
    groups.iter().map(group).collect()
}

fn size_of_split(model: &Model<'_>) -> usize {
    if model.layout() == Layout::Wide { 6 } else { 3 }
}

fn number(bytes: &[u8]) -> usize {
    usize::from(u16::from_le_bytes([bytes[0], bytes[1]]))
}

fn has_contradictions(model: &Model<'_>) -> bool {
    let size = size_of_split(model);
    let contradicts = |mut splits: &[u8]| {
        while !splits.is_empty() {
            let count = number(splits);
            let (tree, rest) = splits[2..].split_at(size * count);
            let left = |split: usize| {
                let own = &tree[size * split..][..size];
                if size == 6 { number(&own[4..]) } else { own[2].into() }
            };
            if !agrees(&left, 0, count) {
                return true;
            }
            splits = rest;
        }
        false
    };
    groups_and_splits(model).iter().any(|(_, splits)| contradicts(splits))
}

/// True if subtrees stay within those that they are part of.
fn agrees(left: &impl Fn(usize) -> usize, mut start: usize, end: usize) -> bool {
    while start < end {
        let right = start + 1 + left(start);
        if right > end || !agrees(left, start + 1, right) {
            return false;
        }
        start = right;
    }
    true
}

fn has_a_name_that_is_no_utf8(model: &Model<'_>) -> bool {
    let [end, ..] = places(model.bytes());
    let mut text = &model.bytes()[HEADER_LENGTH..end];
    while let Some((&length, rest)) = text.split_first() {
        let Some((name, rest)) = rest.split_at_checked(length.into()) else { return false };
        if std::str::from_utf8(name).is_err() {
            return true;
        }
        text = rest;
    }
    false
}
