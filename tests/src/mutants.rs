//! Models damaged section by section, with lengths and checksum right again: bytes that every reader takes or refuses alike.

use crate::abuse::places;
use crate::scripts::sealed;
use palpate_shared::format::{HEADER_LENGTH, MUST_UNDERSTAND};
use rand::RngExt;
use rand::rngs::SmallRng;

/// Names of the parts that are not optional, and the lengths of their pieces.
const PARTS: [(&str, usize); 7] = [
    ("the text", 1),
    ("the margins", 8),
    ("the axes", 4),
    ("the thresholds", 1),
    ("the groups", 8),
    ("the splits", 1),
    ("the leaves", 1),
];

/// Limits that `FORMAT.md` has for bytes, and the values just beyond.
const EDGES: [u8; 26] =
    [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 15, 16, 17, 22, 23, 24, 25, 26, 27, 40, 41, 64, 65, 128, 129, 255];

/// A model taken apart.
#[derive(Clone, Debug)]
pub struct Parts {
    header: Vec<u8>,
    /// In the order of [`PARTS`].
    parts: [Vec<u8>; 7],
    /// Optional sections: their tags as they stand there, and their contents.
    sections: Vec<(u16, Vec<u8>)>,
    /// Bytes after them that are not a whole section.
    tail: Vec<u8>,
}

impl Parts {
    /// Takes a model apart.
    ///
    /// # Panics
    /// If it is not a model.
    pub fn of(model: &[u8]) -> Self {
        let [optional, margins, axes, cuts, groups, splits, leaves, end] = places(model);
        let part = |start: usize, end: usize| model[start..end].to_vec();
        let mut sections = Vec::new();
        let mut at = optional;
        while at < margins {
            let tag = u16::from_le_bytes([model[at], model[at + 1]]);
            let length = u32::from_le_bytes(model[at + 4..at + 8].try_into().expect("four bytes")) as usize;
            sections.push((tag, part(at + 8, at + 8 + length)));
            at += 8 + length.next_multiple_of(4);
        }
        Self {
            header: part(0, HEADER_LENGTH),
            parts: [
                part(HEADER_LENGTH, optional),
                part(margins, axes),
                part(axes, cuts),
                part(cuts, groups),
                part(groups, splits),
                part(splits, leaves),
                part(leaves, end),
            ],
            sections,
            tail: Vec::new(),
        }
    }

    /// The model put together, with the lengths of its parts, its own, and its checksum.
    pub fn bytes(&self) -> Vec<u8> {
        let mut sections = Vec::new();
        for (tag, content) in &self.sections {
            sections.extend(tag.to_le_bytes().into_iter().chain([0; 2]));
            sections.extend((content.len() as u32).to_le_bytes());
            sections.extend(content);
            sections.resize(sections.len().next_multiple_of(4), 0);
        }
        sections.extend(&self.tail);
        let [text, margins, axes, cuts, groups, splits, leaves] = &self.parts;
        let mut bytes = self.header.clone();
        bytes[14] = (margins.len() / 8).saturating_sub(1) as u8;
        for (at, count) in [(16, axes.len() / 4), (18, groups.len() / 8)] {
            bytes[at..at + 2].copy_from_slice(&(count as u16).to_le_bytes());
        }
        for (at, part) in [(68, text), (80, cuts), (84, splits), (88, leaves), (92, &sections)] {
            bytes[at..at + 4].copy_from_slice(&(part.len() as u32).to_le_bytes());
        }
        for part in [text, &sections, margins, axes, cuts, groups, splits, leaves] {
            bytes.extend(part);
        }
        bytes.extend([0; 4]);
        resealed(&mut bytes);
        bytes
    }

    /// Damages one section or part, and says how.
    fn damage(&mut self, others: &[Self], rng: &mut SmallRng) -> String {
        match rng.random_range(0..10) {
            0 => {
                let at = rng.random_range(0..self.header.len());
                self.header[at] = edge(self.header[at], rng);
                format!("byte {at} of the header is {}", self.header[at])
            }
            1 if rng.random_ratio(1, 4) => {
                // The start of a section with the last tag.
                let length = rng.random_range(1..12);
                self.tail = [77, 0, 0, 0, rng.random_range(0..8), 0, 0, 0, 0, 0, 0][..length].to_vec();
                format!("{length} bytes after the sections")
            }
            1..4 => {
                let number = rng.random_range(0..PARTS.len());
                let (name, piece) = PARTS[number];
                let other = &others[rng.random_range(0..others.len())].parts[number];
                format!("{name}: {}", damage_bytes(&mut self.parts[number], piece, other, rng))
            }
            _ => self.damage_section(others, rng),
        }
    }

    fn damage_section(&mut self, others: &[Self], rng: &mut SmallRng) -> String {
        let count = self.sections.len();
        if count == 0 || rng.random_ratio(1, 5) {
            return self.put_section(others, rng);
        }
        let number = rng.random_range(0..count);
        let what = self.damage_this(number, others, rng);
        // Now and then again, with nothing between it and the margins.
        if number < self.sections.len() && rng.random_ratio(1, 3) {
            self.sections.truncate(number + 1);
            return format!("{what}; the last; {}", self.damage_this(number, others, rng));
        }
        what
    }

    /// Damages the section with this number.
    fn damage_this(&mut self, number: usize, others: &[Self], rng: &mut SmallRng) -> String {
        let count = self.sections.len();
        let tag = self.sections[number].0 & !MUST_UNDERSTAND;
        let what = match rng.random_range(0..16) {
            0 => {
                let copy = self.sections[number].clone();
                self.sections.insert(rng.random_range(0..=count), copy);
                "twice".into()
            }
            1 => {
                self.sections.swap(number, rng.random_range(0..count));
                "swapped".into()
            }
            2 => {
                self.sections.remove(number);
                "dropped".into()
            }
            3 => {
                self.sections[number].0 ^= MUST_UNDERSTAND;
                "the other mark".into()
            }
            4 => {
                let other = rng.random_range(0..24);
                self.sections[number].0 = other;
                format!("now {other}")
            }
            _ => {
                let other = others[rng.random_range(0..others.len())]
                    .sections
                    .iter()
                    .find(|own| own.0 & !MUST_UNDERSTAND == tag);
                let other = other.map_or(Vec::new(), |own| own.1.clone());
                damage_bytes(&mut self.sections[number].1, 1, &other, rng)
            }
        };
        format!("section {tag}: {what}")
    }

    /// A section of another model, or of small numbers, where it belongs.
    fn put_section(&mut self, others: &[Self], rng: &mut SmallRng) -> String {
        let from = &others[rng.random_range(0..others.len())].sections;
        let (tag, mut content) = if from.is_empty() || rng.random_ratio(1, 4) {
            let most = if rng.random() { 12 } else { 60 };
            let numbers = (0..rng.random_range(0..most)).map(|_| rng.random_range(0..4)).collect();
            (rng.random_range(1..24) | if rng.random() { MUST_UNDERSTAND } else { 0 }, numbers)
        } else {
            from[rng.random_range(0..from.len())].clone()
        };
        let number = tag & !MUST_UNDERSTAND;
        let whole = content.len();
        if rng.random() {
            content.truncate(rng.random_range(0..=whole));
        }
        let what = format!("section {number} of another model: {} of {whole} bytes", content.len());
        self.sections.retain(|own| own.0 & !MUST_UNDERSTAND != number);
        let at = self.sections.partition_point(|own| own.0 & !MUST_UNDERSTAND < number);
        self.sections.insert(at, (tag, content));
        if rng.random() {
            self.sections.truncate(at + 1);
        }
        what
    }
}

/// A byte near the one that was there, or near a limit.
fn edge(byte: u8, rng: &mut SmallRng) -> u8 {
    match rng.random_range(0..4) {
        0 => byte.wrapping_add(1),
        1 => byte.wrapping_sub(1),
        2 => byte ^ (1 << rng.random_range(0..8)),
        _ => EDGES[rng.random_range(0..EDGES.len())],
    }
}

/// Cuts bytes at any length in pieces, lets them grow, doubles them, changes some, or takes those of another model.
fn damage_bytes(bytes: &mut Vec<u8>, piece: usize, other: &[u8], rng: &mut SmallRng) -> String {
    let pieces = bytes.len() / piece;
    match rng.random_range(0..10) {
        0..4 => {
            // What is checked first is at the start.
            let most = if rng.random() { pieces } else { pieces.min(16) };
            let left = rng.random_range(0..=most) * piece;
            bytes.truncate(left);
            format!("cut to {left} of {} bytes", pieces * piece)
        }
        4 => {
            let more = piece * rng.random_range(1..9);
            bytes.extend((0..more).map(|_| EDGES[rng.random_range(0..EDGES.len())]));
            format!("{more} bytes more")
        }
        5 => {
            bytes.extend_from_within(..pieces * piece);
            "doubled".into()
        }
        6 => {
            bytes.clear();
            bytes.extend(other);
            "another model's".into()
        }
        _ if bytes.is_empty() => "empty as before".into(),
        from => {
            // Lengths and counts are at the start, and small ones often fit what a section was cut to.
            let near = if from < 9 { bytes.len().min(8) } else { bytes.len() };
            let changed = (0..rng.random_range(1..4)).map(|_| {
                let at = rng.random_range(0..near);
                bytes[at] = if from == 7 { rng.random_range(0..3) } else { edge(bytes[at], rng) };
                format!("byte {at} is {}", bytes[at])
            });
            changed.collect::<Vec<_>>().join(", ")
        }
    }
}

/// Puts the length and the checksum right.
fn resealed(bytes: &mut [u8]) {
    let length = (bytes.len() as u32).to_le_bytes();
    if let Some(field) = bytes.get_mut(8..12) {
        field.copy_from_slice(&length);
        sealed(bytes);
    }
}

/// Changes, moves, cuts or puts in some bytes, anywhere; length and checksum are nearly always right afterwards.
fn damage_anywhere(bytes: &mut Vec<u8>, rng: &mut SmallRng) {
    for _ in 0..rng.random_range(1..5) {
        let at = match rng.random_range(0..4) {
            0 => rng.random_range(0..bytes.len().min(96)),
            1 => rng.random_range(bytes.len().min(96)..bytes.len().clamp(97, 200)).min(bytes.len() - 1),
            _ => rng.random_range(0..bytes.len()),
        };
        match rng.random_range(0..8) {
            0 => bytes[at] = rng.random(),
            1..5 => bytes[at] = edge(bytes[at], rng),
            5 => {
                let number: u32 =
                    [0, u32::MAX, 1 << 31, rng.random(), rng.random_range(0..300)][rng.random_range(0..5)];
                let at = at & !3;
                bytes.iter_mut().skip(at).zip(number.to_le_bytes()).for_each(|(to, from)| *to = from);
            }
            6 => bytes.truncate(at.max(1)),
            _ => {
                let more: Vec<u8> = (0..rng.random_range(1..9)).map(|_| rng.random::<u8>() >> 4).collect();
                bytes.splice(at..at, more);
            }
        }
    }
    if !rng.random_ratio(1, 30) {
        resealed(bytes);
    }
}

/// Every section of the models cut to every length from 0 to its own and grown by up to four bytes, as it is and with small numbers at
/// its start; before other sections, and the last one before margins that are all 0: what is read behind it then is in order. Then
/// every byte of headers, axes, groups and what sections start with, at every limit, in sections that are long enough for any count, too;
/// and groups of no trees with every shift.
pub fn sweep(models: &[Parts], rng: &mut SmallRng) -> Vec<(Vec<u8>, String)> {
    let mut all = Vec::new();
    for (number, model) in models.iter().enumerate() {
        let sections = (0..model.sections.len()).map(|section| (3 + section, model.sections[section].1.len().min(48)));
        let places = [(0, HEADER_LENGTH), (1, model.parts[2].len()), (2, model.parts[4].len())];
        for (place, length) in places.into_iter().chain(sections) {
            for (at, value) in (0..length).flat_map(|at| EDGES.map(|value| (at, value))) {
                let mut parts = model.clone();
                let bytes = match place {
                    0 => &mut parts.header,
                    1 => &mut parts.parts[2],
                    2 => &mut parts.parts[4],
                    _ => &mut parts.sections[place - 3].1,
                };
                bytes[at] = value;
                all.push((parts.bytes(), format!("model {number}; byte {at} of place {place} is {value}")));
            }
        }
        for shift in 0..=32 {
            let mut parts = model.clone();
            parts.parts[4].splice(..0, [0, shift, 0, 0, 0, 0, 0, 0]);
            all.push((parts.bytes(), format!("model {number}; no trees with a shift of {shift}")));
        }
        for section in 0..model.sections.len() {
            let (tag, ref content) = model.sections[section];
            for (at, value) in (0..content.len().min(12)).flat_map(|at| EDGES.map(|value| (at, value))) {
                let mut parts = model.clone();
                let own = &mut parts.sections[section].1;
                own.resize(content.len() + 1_000, content[content.len() - 1]);
                own[at] = value;
                all.push((parts.bytes(), format!("model {number}; long section {section}; byte {at} is {value}")));
            }
            for length in 0..=content.len() + 4 {
                for round in 0..8 {
                    let mut parts = model.clone();
                    let own = &mut parts.sections[section].1;
                    own.resize(length, 0);
                    if round > 1 {
                        own.iter_mut().take(8).for_each(|byte| *byte = rng.random_range(0..4));
                    }
                    if round % 2 == 1 {
                        parts.sections.truncate(section + 1);
                        parts.parts[1].fill(0);
                    }
                    let tag = tag & !MUST_UNDERSTAND;
                    all.push((
                        parts.bytes(),
                        format!("model {number}; section {tag} of {length} bytes; round {round}"),
                    ));
                }
            }
        }
    }
    all
}

/// A damaged model, and the damage.
pub fn mutant(models: &[Parts], rng: &mut SmallRng) -> (Vec<u8>, String) {
    let number = rng.random_range(0..models.len());
    let mut parts = models[number].clone();
    let mut what = format!("model {number}");
    for _ in 0..rng.random_range(0..4) {
        what += "; ";
        what += &parts.damage(models, rng);
    }
    let mut bytes = parts.bytes();
    if rng.random_ratio(1, 4) {
        what += "; bytes anywhere";
        damage_anywhere(&mut bytes, rng);
    }
    (bytes, what)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scripts::all_models;
    use rand::SeedableRng;

    #[test]
    fn a_model_that_was_taken_apart_is_put_together_as_it_was() {
        for bytes in all_models(&mut SmallRng::seed_from_u64(1)) {
            // Version 1 has anything there.
            if bytes[4] == 2 || bytes[92..96] == [0; 4] {
                assert_eq!(Parts::of(&bytes).bytes(), bytes);
            }
        }
    }
}
