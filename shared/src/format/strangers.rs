//! Statements of a model about objects that it does not know: a background, and a misfit test.
//!
//! The test compares the evidence so far with what touches of the leading object give. With r the evidence of *rivals*
//! (other objects, and the background) against the leader, less its mean, summed over n touches, the misfit is
//!
//! ```text
//! misfit = |W·r|² / n + g·r − n · constant
//! ```
//!
//! W, g and the constant are the leader's. They are half of the log-likelihood ratio of two normal distributions of the
//! mean evidence: that of the leader's touches, and that of touches of many other shapes.

/// The optional section: whether the last object is a background, and how to test whether touches fit the leading object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Strangers<'a> {
    /// The last of the model's objects stands for everything that the model does not know: it is a rival and never
    /// named.
    pub background: bool,
    /// The test, if there is one.
    pub test: Option<MisfitTest<'a>>,
}

/// The numbers of a test that are the same for all objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MisfitTerms {
    /// Rivals of each object: 1 to [`MisfitTest::MOST_RIVALS`].
    pub rivals: u8,
    /// First touch with a test; no name is given before.
    pub first: u32,
    /// The misfit above which an object is a stranger, after many touches; in 2^-16 nats, as the next.
    pub threshold: i32,
    /// Amount by which it is higher at first.
    pub early: u32,
    /// The touches after which `early` has halved: 1 / this in Q32.
    pub halving: u32,
    /// The promised share of known objects' sequences that end as strangers, in millionths.
    pub alarms: u32,
    /// The sequences that the threshold was calibrated on.
    pub sequences: u32,
    /// The confidence that the promise is kept, in millionths.
    pub confidence: u32,
}

/// A misfit test, read in place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MisfitTest<'a> {
    /// Terms that are the same for all objects.
    pub terms: MisfitTerms,
    /// One after the other, one for each object but the background, and what has grown after them.
    records: &'a [u8],
}

/// Expected evidence of touches of one object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObjectMisfit<'a> {
    /// Means are multiples of 2^this units.
    pub mean_shift: u8,
    /// Rows of the matrix times r (in units) are shifted right by this, to 2^-8 √nats.
    pub weight_shift: u8,
    /// g·r is shifted right by this, to 2^-16 nats.
    pub slope_shift: u8,
    /// In 2^-16 nats per touch.
    pub constant: i32,
    /// The rivals.
    pub rivals: &'a [u8],
    /// For each rival its mean, then its slope, then the rows of the lower triangular matrix: i16, little endian.
    numbers: &'a [[u8; 2]],
}

impl<'a> Strangers<'a> {
    /// The section's first bytes; a test follows with [`MisfitTerms::to_bytes`] and [`ObjectMisfit::write`] for each object.
    pub const fn header(background: bool, has_test: bool) -> [u8; 4] {
        [background as u8, has_test as u8, 0, 0]
    }

    /// Reads a section of a model with this many objects, the background included; `None` if there are too few bytes or a
    /// number makes no sense. Bytes after the known ones are ignored.
    ///
    /// Cost: that of reading the terms, and with a test some instructions for each object. Cannot fail otherwise.
    pub fn from_bytes(bytes: &'a [u8], objects: usize) -> Option<Self> {
        let (&[background, test, _, _], rest) = bytes.split_first_chunk::<4>()?;
        let background = flag(background)?;
        let known = objects.checked_sub(usize::from(background)).filter(|&known| known > 0)?;
        let test = if flag(test)? { Some(MisfitTest::from_bytes(rest)?) } else { None };
        let makes_sense = test.is_none_or(|test| test.makes_sense(known, objects));
        makes_sense.then_some(Self { background, test })
    }

    /// The section of a model that was checked when it was opened.
    ///
    /// Cost: that of reading the terms. Cannot fail otherwise.
    pub fn opened(bytes: &'a [u8]) -> Option<Self> {
        let (&[background, test, _, _], rest) = bytes.split_first_chunk::<4>()?;
        Some(Self { background: background == 1, test: if test == 1 { MisfitTest::from_bytes(rest) } else { None } })
    }
}

const fn flag(byte: u8) -> Option<bool> {
    match byte {
        0 => Some(false),
        1 => Some(true),
        _ => None,
    }
}

impl MisfitTerms {
    /// Bytes in the section.
    pub(crate) const LENGTH: usize = 32;

    /// Returns the bytes of the section.
    pub fn to_bytes(&self) -> [u8; Self::LENGTH] {
        let Self { rivals, first, threshold, early, halving, alarms, sequences, confidence } = *self;
        let mut bytes = [0; Self::LENGTH];
        let numbers = [first, threshold.cast_unsigned(), early, halving, alarms, sequences, confidence];
        let head = [rivals, 0, 0, 0];
        let all = head.into_iter().chain(numbers.into_iter().flat_map(u32::to_le_bytes));
        bytes.iter_mut().zip(all).for_each(|(byte, from)| *byte = from);
        bytes
    }

    fn from_bytes(bytes: &[u8; Self::LENGTH]) -> Option<Self> {
        let (&[rivals, _, _, _], numbers) = bytes.split_first_chunk::<4>()?;
        let numbers = numbers.as_chunks::<4>().0.first_chunk::<7>()?.map(u32::from_le_bytes);
        let [first, threshold, early, halving, alarms, sequences, confidence] = numbers;
        let threshold = threshold.cast_signed();
        let makes_sense = (1..=MisfitTest::MOST_RIVALS).contains(&usize::from(rivals))
            && first > 0
            && early <= i32::MAX.cast_unsigned();
        makes_sense.then_some(Self { rivals, first, threshold, early, halving, alarms, sequences, confidence })
    }
}

impl<'a> MisfitTest<'a> {
    /// The most rivals of an object: what a test costs on the chip does not grow beyond.
    pub const MOST_RIVALS: usize = 16;

    /// Bytes of one object's record, with this many rivals.
    pub(crate) const fn record_length(rivals: usize) -> usize {
        // A header of 8, rivals, means, slopes and a lower triangle.
        let length = 8 + rivals.next_multiple_of(2) + 2 * (2 * rivals + rivals * (rivals + 1) / 2);
        length.next_multiple_of(4)
    }

    fn from_bytes(bytes: &'a [u8]) -> Option<Self> {
        let (terms, records) = bytes.split_first_chunk::<{ MisfitTerms::LENGTH }>()?;
        Some(Self { terms: MisfitTerms::from_bytes(terms)?, records })
    }

    /// True if there are records of `known` objects, with rivals that exist among `objects`.
    fn makes_sense(&self, known: usize, objects: usize) -> bool {
        (0..known).all(|object| {
            self.object(object).is_some_and(|record| {
                let shifts = [record.mean_shift, record.weight_shift, record.slope_shift];
                record.rivals.iter().all(|&rival| usize::from(rival) < objects)
                    && shifts.iter().all(|&shift| shift <= ObjectMisfit::MOST_SHIFT)
            })
        })
    }

    /// Expected evidence of touches of an object; `None` for one that has no record.
    ///
    /// Cost: a few instructions. Cannot fail otherwise.
    pub fn object(&self, object: usize) -> Option<ObjectMisfit<'a>> {
        let count = usize::from(self.terms.rivals);
        let length = Self::record_length(count);
        let start = object.checked_mul(length)?;
        let record = self.records.get(start..start.checked_add(length)?)?;
        let (&[mean_shift, weight_shift, slope_shift, _, a, b, c, d], rest) = record.split_first_chunk::<8>()?;
        let rivals = rest.get(..count)?;
        let numbers = rest.get(count.next_multiple_of(2)..)?.as_chunks().0;
        let constant = i32::from_le_bytes([a, b, c, d]);
        Some(ObjectMisfit { mean_shift, weight_shift, slope_shift, constant, rivals, numbers })
    }
}

impl ObjectMisfit<'_> {
    /// The largest shift.
    pub const MOST_SHIFT: u8 = 40;

    /// The mean of a rival's evidence against the object per touch, before the shift.
    pub fn mean(&self, rival: usize) -> i16 {
        self.number(rival)
    }

    /// A rival's slope.
    pub fn slope(&self, rival: usize) -> i16 {
        self.number(self.rivals.len().saturating_add(rival))
    }

    /// The matrix's element in this row and column, of the lower triangle.
    pub fn weight(&self, row: usize, column: usize) -> i16 {
        let count = self.rivals.len();
        if column > row || row >= count {
            return 0;
        }
        self.number(2 * count + row * (row + 1) / 2 + column)
    }

    fn number(&self, index: usize) -> i16 {
        self.numbers.get(index).map_or(0, |bytes| i16::from_le_bytes(*bytes))
    }

    /// Hands the bytes of a record to `put`: its shifts, constant and rivals, and as `numbers` the means, as many slopes, and
    /// the rows of the triangle. Any other count of numbers gives a record that cannot be read.
    pub fn write(
        [mean_shift, weight_shift, slope_shift]: [u8; 3],
        constant: i32,
        rivals: &[u8],
        numbers: impl Iterator<Item = i16>,
        put: &mut impl FnMut(&[u8]),
    ) {
        put(&[mean_shift, weight_shift, slope_shift, 0]);
        put(&constant.to_le_bytes());
        put(rivals);
        put([0].get(..rivals.len() % 2).unwrap_or_default());
        let mut length = 8 + rivals.len().next_multiple_of(2);
        for number in numbers {
            put(&number.to_le_bytes());
            length = length.wrapping_add(2);
        }
        put([0; 3].get(..length.wrapping_neg() % 4).unwrap_or_default());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::tests::{assert_refused, written};
    use std::vec::Vec;

    const TERMS: MisfitTerms = MisfitTerms {
        rivals: 3,
        first: 5,
        threshold: 300_000,
        early: 500_000,
        halving: 150_000_000,
        alarms: 20_000,
        sequences: 10_000,
        confidence: 950_000,
    };

    /// Three objects and a background.
    fn section() -> Vec<u8> {
        let mut bytes = Strangers::header(true, true).to_vec();
        bytes.extend(TERMS.to_bytes());
        for object in 0..3_u8 {
            let rivals: Vec<u8> = (0..4).filter(|&rival| rival != object).collect();
            let numbers = (0..12).map(|number| 100 * i16::from(object) + number);
            ObjectMisfit::write([1, 2, 3], -7, &rivals, numbers, &mut |part| bytes.extend_from_slice(part));
        }
        bytes
    }

    #[test]
    fn a_test_is_read_back_as_written() {
        let bytes = section();
        assert_eq!(bytes.len(), 4 + 32 + 3 * MisfitTest::record_length(3));
        let strangers = Strangers::from_bytes(&bytes, 4).unwrap();
        assert!(strangers.background);
        let test = strangers.test.unwrap();
        assert_eq!(test.terms, TERMS);
        let fit = test.object(2).unwrap();
        assert_eq!((fit.mean_shift, fit.weight_shift, fit.slope_shift, fit.constant), (1, 2, 3, -7));
        assert_eq!(fit.rivals, [0, 1, 3]);
        assert_eq!((fit.mean(0), fit.mean(2), fit.slope(0), fit.slope(2)), (200, 202, 203, 205));
        assert_eq!([(0, 0), (1, 0), (1, 1), (2, 0), (2, 2)].map(|(r, c)| fit.weight(r, c)), [206, 207, 208, 209, 211]);
        assert_eq!((fit.weight(0, 1), fit.weight(3, 0)), (0, 0));
        assert_eq!(test.object(3), None);
        assert_eq!(Strangers::from_bytes(&Strangers::header(true, false), 2).unwrap().test, None);
    }

    #[test]
    fn sections_that_make_no_sense_are_refused_and_grown_ones_read() {
        let bytes = section();
        let grown = [&bytes[..], &[1, 2, 3, 4]].concat();
        assert!(Strangers::from_bytes(&grown, 4).is_some());
        for length in 0..bytes.len() {
            assert_eq!(Strangers::from_bytes(&bytes[..length], 4), None, "{length} bytes");
        }
        // One object more has no record; one less leaves a rival that does not exist; a background alone knows nothing.
        assert_eq!(Strangers::from_bytes(&bytes, 5), None);
        assert_eq!(Strangers::from_bytes(&bytes, 3), None);
        assert_eq!(Strangers::from_bytes(&Strangers::header(true, false), 1), None);
        let record = 4 + MisfitTerms::LENGTH;
        let wrong: [(usize, &[u8]); 8] = [
            (0, &[2]),
            (1, &[2]),
            (4, &[0]),
            (4, &[17]),
            (8, &[0; 4]),
            (16, &[255; 4]),
            (record, &[41]),
            (record + 8, &[4]),
        ];
        assert_refused(&bytes, &wrong, |bytes| Strangers::from_bytes(bytes, 4).is_some());
    }

    #[test]
    fn records_are_as_long_as_stated() {
        for rivals in 1..=MisfitTest::MOST_RIVALS {
            let numbers = (0..2 * rivals + rivals * (rivals + 1) / 2).map(|_| 0);
            let all: Vec<u8> = (0..rivals as u8).collect();
            let record = written(|put| ObjectMisfit::write([0; 3], 0, &all, numbers, put));
            assert_eq!(record.len(), MisfitTest::record_length(rivals));
        }
        assert_eq!(MisfitTest::record_length(9), 144);
    }
}
