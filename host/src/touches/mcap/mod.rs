//! Touches in MCAP files, as robots log them: `docs/reference/mcap.md`.
//!
//! Channels are found by the names of their schemas: `palpate.Touch`, or as in ROS 2 `palpate_msgs/msg/Touch`; messages are JSON
//! or CDR. Other channels are skipped.
//!
//! A file is not believed: a record or chunk takes memory as its bytes come, never as its length says, and at most
//! [`LARGEST`]; a chunk is decompressed up to the size that it states; checksums are compared.

mod chunk;
mod message;
mod read;
mod records;

pub use read::read;

use crate::error::{Error, problem};
use std::fmt::Display;

/// The largest record, compressed and decompressed, that is read: 64 MiB.
pub const LARGEST: usize = 64 << 20;

/// The definition of a touch in ROS 2.
pub const TOUCH: &str = include_str!("../../../msg/Touch.msg");

/// The names of the schema of touches, as JSON and in ROS 2.
const NAMES: [&str; 2] = ["palpate.Touch", "palpate_msgs/msg/Touch"];

/// The problem of a file that is no log in MCAP, or is damaged.
fn not_mcap(why: impl Display) -> Error {
    problem!("not a usable MCAP file: {why}").fix("Repair it with `mcap recover`, or copy the log again.")
}

/// Remedy for a message that is not what its schema says.
const CORRECT: &str = "Correct the program that logged it: docs/reference/mcap.md says what belongs in a message.";
