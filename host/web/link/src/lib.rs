//! The host's end of the link as WebAssembly: functions that the script of `palpate watch` calls, and nothing that they
//! import.
//!
//! Bytes come through [`input`], which says where in memory the script may write them. What a call brings goes out as bytes
//! for the line ([`line`]) and as JSON ([`heard`], an array of [`Happening`](watch::Happening)), whose memory holds until the
//! next call. Times are microseconds on any clock that does not go back.

mod exports;
mod watch;
