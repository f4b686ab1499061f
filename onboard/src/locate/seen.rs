//! Touches as the follower keeps them: a height for each finger.

/// Farthest position that is kept, in 1/16 mm: 2 m.
const FARTHEST: i64 = 32_000;

/// Contact of a finger.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Contact {
    /// Nothing, down to the lowest point of the approach.
    #[default]
    Nothing,
    /// The object or the table, at this height in micrometers.
    At(i32),
}

/// Heights that the fingers of an approach met, in 1/16 mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    pub(super) x: [i16; 3],
    pub(super) y: [i16; 3],
    /// Below 0: nothing down to the limit.
    pub(super) z: [i16; 3],
    /// Height that the hand went down to; below 0 if it would have reached through the table.
    pub(super) limit: i16,
}

impl Seen {
    /// An approach straight down with the middle finger at `x` and `y`; `row` is from there to the third finger, `contacts` are
    /// heights above the table, and `limit` is the height down to which the hand went. All in micrometers; what is farther than 2 m
    /// counts as 2 m away. Cost: a few multiplications.
    pub fn new([x, y]: [i32; 2], row: [i32; 2], contacts: [Contact; 3], limit: i32) -> Self {
        let place =
            |middle: i32, row: i32| [-1, 0, 1].map(|finger| sixteenths(i64::from(middle) + finger * i64::from(row)));
        let [row_x, row_y] = row;
        let height = |contact| match contact {
            Contact::Nothing => -1,
            // A finger on the table may be measured below it.
            Contact::At(height) => sixteenths(i64::from(height)).max(0),
        };
        Self { x: place(x, row_x), y: place(y, row_y), z: contacts.map(height), limit: sixteenths(i64::from(limit)) }
    }
}

/// Micrometers in 1/16 mm.
fn sixteenths(micrometers: i64) -> i16 {
    let sixteenths = (micrometers * 2 + 62).div_euclid(125);
    i16::try_from(sixteenths.clamp(-FARTHEST, FARTHEST)).unwrap_or(i16::MAX)
}
