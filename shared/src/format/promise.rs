//! Promises of a model about its verdicts, and the sections that hold them.

use super::codes::Per;
use super::trained::TrainedNoise;

/// A billion, the unit of rates and shares, so that decimal fractions are exact.
const BILLION: f64 = 1e9;

/// Stopping thresholds by object: 4 bytes for each object, in their order.
#[derive(Clone, Copy, Debug)]
pub struct OddsByObject<'a>(&'a [u8]);

impl<'a> OddsByObject<'a> {
    /// Bytes for each object.
    pub const LENGTH: usize = 4;

    /// Reads a section's content.
    pub const fn from_bytes(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// Largest sum of the weights of all other objects, this one's being 1, with which it is recognized: in Q56. `None`
    /// beyond the objects that there are.
    ///
    /// Cost: a few instructions. Cannot fail.
    pub fn odds(&self, object: usize) -> Option<u64> {
        let odds = self.0.as_chunks::<4>().0.get(object)?;
        Some(u64::from(u32::from_le_bytes(*odds)) << 24)
    }

    /// An object's content for odds in Q56, rounded down to Q32: to what is stricter.
    pub fn to_bytes(odds: u64) -> [u8; 4] {
        u32::try_from(odds >> 24).unwrap_or(u32::MAX).to_le_bytes()
    }
}

/// Promise of a model about its verdicts, and how it was determined: 48 bytes, and up to 56 more if the touches had more
/// noise than [`TrainedNoise`] can say. Nothing on the chip uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Promise {
    /// The error rate: wrong names of those that are given.
    pub rate: f64,
    /// The probability that the rate is kept.
    pub confidence: f64,
    /// Names that the rate covers.
    pub per: Per,
    /// True if sequences were of approaches, including ones that are not evidence; false if of touches only.
    pub approaches: bool,
    /// True if each approach was in the pose that the model's plan proposed.
    pub active: bool,
    /// True if sequences came in groups, such as persons or machines, and the promise is for new groups; otherwise
    /// sequences were independent of each other.
    pub groups: bool,
    /// Sequences that it rests on.
    pub sequences: u32,
    /// Names given in these.
    pub given: u32,
    /// Wrong ones of them.
    pub wrong: u32,
    /// Touches, or approaches, that a sequence took on average, also one that ended without a name; in thousandths.
    pub mean_thousandths: u32,
    /// The limit of touches.
    pub max_touches: u32,
    /// Noise that was added to the touches.
    pub noise: PromisedNoise,
}

/// Noise that was added to the touches that a promise was made on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PromisedNoise {
    /// Noise of contact times, timer, and noise of the pose (without the bias).
    pub touch: TrainedNoise,
    /// Bouncing of up to this, in microseconds.
    pub debounce: u32,
    /// Time by which each finger touches too early, in microseconds.
    pub bent: [i32; 3],
    /// The probability that a contact of each finger is missed, in parts of a billion.
    pub missed: [u32; 3],
    /// Largest error of the speed of a touch, in parts of a billion.
    pub speed_error: u32,
    /// The largest deviation of the speed for a robot, through all of its touches.
    pub speed_bias: u32,
    /// The speed less the nominal one, in parts of a billion of it.
    pub speed: i32,
    /// Standard deviation of the angle by which all poses of a robot are turned, in thousandths of a degree.
    pub pose_bias: u32,
    /// Standard deviation of each coordinate of a touch's position, in micrometers.
    pub position: u32,
    /// Standard deviations of an object's move in an approach, in micrometers, and of its turn, in thousandths of a degree.
    pub drift: [u32; 2],
}

impl PromisedNoise {
    /// True if [`TrainedNoise`] can state all of it.
    fn is_short(&self) -> bool {
        *self == Self { touch: self.touch, ..Self::default() }
    }

    /// Excess of the missed contacts of the middle and the third finger over those of the first.
    fn missed_more(&self) -> [i32; 2] {
        let [first, middle, third] = self.missed;
        // Shares of at most a billion: their differences fit.
        [middle, third].map(|share| share.cast_signed().wrapping_sub(first.cast_signed()))
    }
}

impl Promise {
    /// Bytes of the section at least.
    pub(crate) const LENGTH: usize = 48;
    /// Bytes of the section with all noise.
    pub(crate) const FULL_LENGTH: usize = 84;
    /// Bytes of the section with all noise, in which every finger misses another share of its contacts.
    pub(crate) const FINGERS_LENGTH: usize = 92;
    /// Bytes of the section with noise of the position, or objects that move.
    pub(crate) const LOCATED_LENGTH: usize = 104;

    /// Bytes of the section with this noise: one of the four lengths.
    pub(crate) fn length(noise: &PromisedNoise) -> usize {
        if noise.position > 0 || noise.drift != [0; 2] {
            return Self::LOCATED_LENGTH;
        }
        match (noise.is_short(), noise.missed_more()) {
            (true, _) => Self::LENGTH,
            (false, [0, 0]) => Self::FULL_LENGTH,
            (false, _) => Self::FINGERS_LENGTH,
        }
    }

    /// Hands the section's content to `put`.
    pub fn write<T>(&self, put: impl FnOnce(&[u8]) -> T) -> T {
        let billionths = |share: f64| (share * BILLION + 0.5) as u32;
        let Self { sequences, given, wrong, mean_thousandths, max_touches, noise, .. } = *self;
        let codes =
            u32::from_le_bytes([self.per.code(), self.approaches.into(), self.active.into(), self.groups.into()]);
        let TrainedNoise { least, largest, timer, pose } = noise.touch;
        let [first, second, third] = noise.bent.map(i32::cast_unsigned);
        let head = [billionths(self.rate), billionths(self.confidence), codes, sequences, given, wrong];
        let [middle, last] = noise.missed_more().map(i32::cast_unsigned);
        let [moved, turned] = noise.drift;
        let words: [[u32; 3]; 9] = [
            [head[0], head[1], head[2]],
            [head[3], head[4], head[5]],
            [mean_thousandths, max_touches, least],
            [largest, timer, pose],
            [noise.debounce, first, second],
            [third, noise.missed[0], noise.speed_error],
            [noise.speed_bias, noise.speed.cast_unsigned(), noise.pose_bias],
            [middle, last, noise.position],
            [moved, turned, 0],
        ];
        let mut bytes = [0; Self::LOCATED_LENGTH];
        let numbers = words.into_iter().flatten().flat_map(u32::to_le_bytes);
        bytes.iter_mut().zip(numbers).for_each(|(to, from)| *to = from);
        put(bytes.get(..Self::length(&noise)).unwrap_or(&bytes))
    }

    /// Reads a section; `None` if it is too short, promises nothing (a rate or a confidence that is not between 0 and 1,
    /// more names than sequences, more wrong names than names) or has a code that does not exist. Bytes after the known
    /// ones are ignored.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let words = bytes.as_chunks::<4>().0;
        let (head, rest) = words.split_first_chunk::<12>()?;
        let [_, _, [per, approaches, active, groups], ..] = *head;
        let [rate, confidence, _, sequences, given, wrong, mean, touches, least, largest, timer, pose] =
            head.map(u32::from_le_bytes);
        let more = rest.first_chunk::<9>().map_or([0; 9], |more| more.map(u32::from_le_bytes));
        let fingers = rest.get(9..).and_then(<[[u8; 4]]>::first_chunk::<2>);
        let [middle, last] = fingers.map_or([0; 2], |fingers| fingers.map(i32::from_le_bytes));
        let located = rest.get(11..).and_then(<[[u8; 4]]>::first_chunk::<3>);
        let [position, drift @ ..] = located.map_or([0; 3], |located| located.map(u32::from_le_bytes));
        let [debounce, first, second, third, missed, speed_error, speed_bias, speed, pose_bias] = more;
        let share = |billionths: u32| {
            let share = f64::from(billionths) / BILLION;
            (billionths > 0 && share < 1.0).then_some(share)
        };
        if wrong > given || given > sequences || approaches > 1 || active > 1 || groups > 1 || least > largest {
            return None;
        }
        Some(Self {
            rate: share(rate)?,
            confidence: share(confidence)?,
            per: Per::from_code(per)?,
            approaches: approaches == 1,
            active: active == 1,
            groups: groups == 1,
            sequences,
            given,
            wrong,
            mean_thousandths: mean,
            max_touches: touches,
            noise: PromisedNoise {
                touch: TrainedNoise { least, largest, timer, pose },
                debounce,
                bent: [first, second, third].map(u32::cast_signed),
                missed: [0, middle, last].map(|more| missed.saturating_add_signed(more)),
                speed_error,
                speed_bias,
                speed: speed.cast_signed(),
                pose_bias,
                position,
                drift,
            },
        })
    }
}

/// Divisor of the evidence before it becomes a posterior that is shown: 4 bytes. Thresholds are of evidence as it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Temperature {
    /// One over the temperature, in Q16.
    sharpness: u32,
}

impl Temperature {
    /// Bytes of the section.
    pub(crate) const LENGTH: usize = 4;
    /// A temperature of 1: it changes no posterior.
    pub const ONE: Self = Self { sharpness: 1 << 16 };
    /// The least and the largest [`sharpness`](Temperature::sharpness): those of temperatures of 16 and 1/16.
    const RANGE: core::ops::RangeInclusive<u32> = 1 << 12..=1 << 20;

    /// The nearest to `temperature`; `None` unless it is between 1/16 and 16.
    pub fn new(temperature: f64) -> Option<Self> {
        let sharpness = 65_536.0 / temperature + 0.5;
        Self::from_bytes(&(sharpness as u32).to_le_bytes())
    }

    /// One over the temperature, in Q16.
    pub const fn sharpness(self) -> u32 {
        self.sharpness
    }

    /// The temperature.
    pub fn value(self) -> f64 {
        65_536.0 / f64::from(self.sharpness)
    }

    /// The section's content.
    pub const fn to_bytes(self) -> [u8; Self::LENGTH] {
        self.sharpness.to_le_bytes()
    }

    /// Reads a section; `None` if it is too short or out of range. Bytes after the known ones are ignored.
    ///
    /// Cost: a few instructions.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let sharpness = u32::from_le_bytes(*bytes.first_chunk()?);
        Self::RANGE.contains(&sharpness).then_some(Self { sharpness })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::tests::assert_refused;
    use std::vec::Vec;

    const PROMISE: Promise = Promise {
        rate: 0.01,
        confidence: 0.95,
        per: Per::Name,
        approaches: true,
        active: true,
        groups: true,
        sequences: 100_000,
        given: 99_321,
        wrong: 900,
        mean_thousandths: 25_412,
        max_touches: 200,
        noise: PromisedNoise {
            touch: TrainedNoise { least: 0, largest: 5_000, timer: 1_000, pose: 2_000 },
            debounce: 0,
            bent: [0; 3],
            missed: [0; 3],
            speed_error: 0,
            speed_bias: 0,
            speed: 0,
            pose_bias: 0,
            position: 0,
            drift: [0; 2],
        },
    };

    fn bytes(promise: &Promise) -> Vec<u8> {
        promise.write(<[u8]>::to_vec)
    }

    #[test]
    fn promises_are_read_back_as_written_in_as_few_bytes_as_they_need() {
        let noise = PromisedNoise { bent: [1, -3_000, 2], speed: -20_000_000, pose_bias: 5_000, ..PROMISE.noise };
        let alike = PromisedNoise { missed: [20_000_000; 3], ..noise };
        let fingers = PromisedNoise { missed: [20_000_000, 0, 1_000_000_000], ..noise };
        for (promise, length) in [
            (PROMISE, Promise::LENGTH),
            (Promise { noise, ..PROMISE }, Promise::FULL_LENGTH),
            (Promise { noise: alike, ..PROMISE }, Promise::FULL_LENGTH),
            (Promise { noise: fingers, ..PROMISE }, Promise::FINGERS_LENGTH),
            (Promise { noise: PromisedNoise { position: 7, ..PROMISE.noise }, ..PROMISE }, Promise::LOCATED_LENGTH),
            (Promise { noise: PromisedNoise { drift: [5, 6], ..fingers }, ..PROMISE }, Promise::LOCATED_LENGTH),
        ] {
            assert_eq!(Promise::length(&promise.noise), length);
            let bytes = bytes(&promise);
            assert_eq!(bytes.len(), length);
            assert_eq!(Promise::from_bytes(&bytes), Some(promise));
            assert_eq!(Promise::from_bytes(&[&bytes[..], &[0; 40]].concat()), Some(promise));
            assert_eq!(Promise::from_bytes(&bytes[..Promise::LENGTH - 1]), None);
        }
        for rate in [0.1, 0.05, 0.02, 0.005, 0.001] {
            assert_eq!(Promise::from_bytes(&bytes(&Promise { rate, ..PROMISE })).unwrap().rate, rate);
        }
    }

    #[test]
    fn promises_that_promise_nothing_are_refused() {
        let wrong: [(usize, &[u8]); 9] = [
            (0, &[0; 4]),
            (0, &[0xff; 4]),
            (4, &[0; 4]),
            (8, &[3]),
            (9, &[2]),
            (10, &[2]),
            (11, &[2]),
            (16, &[0xff; 4]),
            (20, &[0xff; 4]),
        ];
        assert_refused(&bytes(&PROMISE), &wrong, |bytes| Promise::from_bytes(bytes).is_some());
    }

    #[test]
    fn odds_by_object_are_rounded_to_what_is_stricter() {
        let odds = [(1 << 56) / 99, 0x12_3456_7890_abcd, u64::MAX, 0];
        let bytes: Vec<u8> = odds.iter().flat_map(|&odds| OddsByObject::to_bytes(odds)).collect();
        let read = OddsByObject::from_bytes(&bytes);
        for (object, odds) in odds.into_iter().enumerate() {
            let kept = read.odds(object).unwrap();
            assert!(kept <= odds && (kept == u64::from(u32::MAX) << 24 || odds - kept < 1 << 24), "{kept} {odds}");
        }
        assert_eq!(read.odds(4), None);
        assert_eq!(OddsByObject::from_bytes(&bytes[..3]).odds(0), None);
    }

    #[test]
    fn temperatures_come_back_and_absurd_ones_are_refused() {
        for temperature in [1.0, 1.1, 1.6, 0.5, 16.0, 1.0 / 16.0] {
            let read = Temperature::from_bytes(&Temperature::new(temperature).unwrap().to_bytes()).unwrap();
            assert!((read.value() / temperature - 1.0).abs() < 1e-3, "{temperature}");
        }
        for temperature in [0.0, -1.0, 17.0, 0.01, f64::NAN, f64::INFINITY] {
            assert_eq!(Temperature::new(temperature), None, "{temperature}");
        }
        assert_eq!(Temperature::new(1.0), Some(Temperature::ONE));
        assert_eq!(Temperature::from_bytes(&[0, 0, 1]), None);
    }
}
