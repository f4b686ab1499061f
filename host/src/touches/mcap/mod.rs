//! Touches and verdicts in MCAP files, as robots log them and Foxglove shows them: `docs/reference/mcap.md`.
//!
//! Channels are found by the names of their schemas: `palpate.Touch` and `palpate.Verdict`, or as in ROS 2
//! `palpate_msgs/msg/Touch` and `palpate_msgs/msg/Verdict`; messages are JSON or CDR. Other channels are skipped.
//!
//! A file is not believed: a record or chunk takes memory as its bytes come, never as its length says, and at most
//! [`LARGEST`]; a chunk is decompressed up to the size that it states; checksums are compared.

mod chunk;
mod message;
mod read;
mod records;
mod write;

pub use read::read;
pub use write::Writer;

/// The largest record, compressed and decompressed, that is read: 64 MiB.
pub const LARGEST: usize = 64 << 20;

/// The definition of a touch in ROS 2.
pub const TOUCH: &str = include_str!("../../../msg/Touch.msg");
/// The definition of a verdict in ROS 2.
pub const VERDICT: &str = include_str!("../../../msg/Verdict.msg");

/// Kind of a channel's messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Touch,
    Verdict,
}

impl Kind {
    /// The kind whose schema has this name.
    fn of(schema: &str) -> Option<Self> {
        let is = |kind: &Self| kind.names().contains(&schema);
        [Self::Touch, Self::Verdict].into_iter().find(is)
    }

    /// The names of its schema, as JSON and in ROS 2.
    fn names(self) -> [&'static str; 2] {
        match self {
            Self::Touch => ["palpate.Touch", "palpate_msgs/msg/Touch"],
            Self::Verdict => ["palpate.Verdict", "palpate_msgs/msg/Verdict"],
        }
    }

    /// Its definition in ROS 2.
    fn definition(self) -> &'static str {
        match self {
            Self::Touch => TOUCH,
            Self::Verdict => VERDICT,
        }
    }
}
