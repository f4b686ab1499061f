//! The game of `palpate play` as WebAssembly: functions that a page's script calls, and nothing that they import.
//!
//! Numbers come as arguments. Bytes come through [`input`], which says where in memory the script may write them. Numbers
//! go out through [`output`] (f64) and [`evidence`] (i64), whose memory holds until the next call. A function that can
//! fail returns −1 then.
//!
//! `build` compiles it into `host/report/assets/play/palpate.wasm`, which the program puts into its pages.

mod exports;
mod press;
mod table;
