//! Touches in memory and on disk.
//!
//! A data set is a directory, and each file in it is a [`Pool`]: touches of one object that may be mixed in a sequence, one line
//! per touch ([`text`]). An object has the file `<object>.txt` or, if it has several instances, placements or recordings, the
//! files `<object>/1.txt`, `<object>/2.txt` and so on. A directory that [`capture`](crate::capture) wrote also holds
//! `dataset.json`, its [`Listing`]: which objects and files there are, what each file is of, how many touches it has, its
//! checksum, and how the touches were made ([`Origin`]). A directory without a listing is a data set too, and states nothing about its probe; it
//! may also hold logs of robots (`<object>.mcap`, or of any objects that their messages name), and a log is a data set by
//! itself ([`Log`]).
//!
//! [`Recording`] adds the touches of a real probe to such a directory, one by one as they come; its listing says when, from
//! where and by which firmware ([`Recorded`]).
//!
//! [`check`] lists the faults of a data set, line by line; [`noise`](crate::probe::noise) adds the deviations of a real
//! sensor, timer and robot; [`folds`] divides touches into some to train on and others to test on.
//!
//! ```
//! use palpate::touches::{Dataset, folds};
//!
//! # fn main() -> palpate::Result<()> {
//! let directory = tempfile::tempdir().expect("a directory for temporary files");
//! std::fs::write(directory.path().join("cup.txt"), "0.000000 0.012000 0.031000\n0.004 0 -\n").expect("written");
//! std::fs::write(directory.path().join("fork.txt"), "0 0.2 0.1\n0.3 0 0.1\n").expect("written");
//!
//! let dataset = Dataset::read(directory.path())?;
//! assert_eq!(dataset.names(), ["cup", "fork"]);
//! assert_eq!(dataset.len(), 4);
//! assert!(dataset.probe().is_none(), "no dataset.json, so no probe is stated");
//!
//! let split = folds::split(&dataset, 0.5, 1)?;
//! assert_eq!((split.train.len(), split.test.len()), (2, 2));
//! # Ok(())
//! # }
//! ```

mod alike;
pub mod check;
mod checksum;
mod dataset;
mod files;
mod finding;
pub mod folds;
mod listing;
mod log;
mod logged;
#[cfg(feature = "mcap")]
pub mod mcap;
#[cfg(not(feature = "mcap"))]
#[path = "no_mcap.rs"]
mod mcap;
mod object;
mod origin;
mod read;
mod recorded;
mod recording;
mod samples;
mod save;
mod seconds;
mod surroundings;
pub mod text;
mod writer;

pub use dataset::Dataset;
pub(crate) use files::files;
pub use files::{begins_log, is_log};
pub use finding::Finding;
pub use listing::{Entry, Listing, Lying, PoolFile};
pub use log::{Log, Logged, read_touches};
pub use logged::{Channels, Message};
pub use object::{ObjectTouches, Part, Pool, Source};
pub use origin::Origin;
pub use recorded::Recorded;
pub use recording::Recording;
pub use samples::Samples;
pub use seconds::{Longest, located, touch_of_seconds};
pub use surroundings::Surroundings;
pub use text::{parse_touch, write_touch};
pub(crate) use writer::Writer;
