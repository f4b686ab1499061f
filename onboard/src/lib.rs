//! Recognizes objects by touch on a microcontroller.
//!
//! ```text
//! Touch ──► features ──► ranks ──► trees ──► margins ──► evidence ──► Verdict
//! ```
//!
//! A [`Model`] is opened from bytes, which are checked once. A [`Recognizer`] turns each touch into margins, one integer
//! per object, adds them to the evidence, and stops as soon as it is sure of one object. All of it is integer
//! arithmetic (unless the model has f32 leaves), so every machine gives the same bits.
//!
//! ```
//! use palpate_onboard::shared::Touch;
//! use palpate_onboard::{Model, Recognizer, Stopping, Verdict, include_model};
//!
//! // Bytes in flash: the file that `palpate run` or `palpate export` wrote.
//! # macro_rules! model { () => { concat!(env!("CARGO_MANIFEST_DIR"), "/../models/household.palpate") } }
//! # /*
//! let model = Model::new(include_model!("household.palpate"))?;
//! # */
//! # let model = Model::new(include_model!(model!()))?;
//! let mut recognizer = Recognizer::<16>::new(&model, Stopping::from_model(&model))?;
//! // Contact times of the three fingers in microseconds, as an `effector` measures them.
//! match recognizer.push(&Touch::from_micros([30_000, 0, 50_000])) {
//!     Ok(Verdict::Undecided) => { /* touch again */ }
//!     Ok(Verdict::Recognized { object, touches, rivals }) => {
//!         let _ = (model.object_name(object.into()), touches, rivals.posterior());
//!     }
//!     Ok(Verdict::Unknown) => { /* the touches fit no object that the model knows */ }
//!     Ok(Verdict::GaveUp) => { /* the limit of touches was reached */ }
//!     Err(refused) => { /* the model was not trained for such touches: not counted, touch again */
//! #       let _ = refused;
//!     }
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A model of another library, over rows of features:
//!
//! ```
//! use palpate_onboard::{Model, f32_key, include_model};
//!
//! # macro_rules! model { () => { concat!(env!("CARGO_MANIFEST_DIR"), "/../models/household.palpate") } }
//! # /*
//! let model = Model::new(include_model!("wine.palpate"))?;
//! # */
//! # let model = Model::new(include_model!(model!()))?;
//! let row = [13.2, 1.8, f32::NAN].map(f32_key); // NaN where a value is missing
//! let mut margins = [0; 10]; // room for one number per class
//! let class = model.predict_class(&row, &mut margins);
//! # assert!(class.is_some());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module or item | what |
//! |---|---|
//! | [`effector`] | edges of three switches to touches |
//! | [`Model`], [`Recognizer`] | touches to verdicts |
//! | [`locate`] | touches with positions to an object, its pose, and where to touch next |
//! | [`station`] | touches, verdicts and models to and from a host, and models that last through a power cut |
//!
//! | feature | what |
//! |---|---|
//! | `effector` | [`effector`]; off by default |
//! | `link` | [`shared`]`::link`; off by default |
//! | `station` | [`station`], with both of these; off by default |
//! | `compact`, `wide` | splits of three bytes, and of six |
//! | `code` | models whose trees are a function of the program (`Model::with_code`); off by default |
//! | `i8-leaves`, `i16-leaves`, `f32-leaves` | types of leaves that can be read |
//! | `shared-leaves` | trees whose equal leaves are stored once |
//! | `sentinel` | models over rows in which a number stands for a missing value |
//! | `row-evidence` | models that state what a row adds to the evidence, and how much rows count together |
//! | `sequences` | models that number the rows of a sequence, or state which of them they take |
//! | `strangers` | models with a background, or a test for objects that they do not know |
//! | `outputs` | models with several outputs for one object |
//! | `locate` | [`locate`]; off by default |
//! | `rows` | many rows at once, for hosts (`Model::margins_of_rows`) |
//! | `defmt` | touches, verdicts, refusals and faults can be logged; off by default |
//!
//! A model that needs a feature which is not built in is refused when it is opened.
//!
//! `no_std`, without a heap and without `unsafe`; once a model has been validated nothing here can panic.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
// What only the station uses is small and has no feature of its own.
#![cfg_attr(not(feature = "station"), allow(dead_code))]

#[cfg(test)]
extern crate std;

mod bytes;
mod decide;
#[cfg(feature = "effector")]
pub mod effector;
mod exponential;
mod layouts;
#[cfg(feature = "locate")]
pub mod locate;
mod model;
#[cfg(feature = "station")]
pub mod station;

pub use bytes::{Aligned, ModelError};
pub use decide::{
    CapacityError, Familiarity, NothingExpected, Posterior, Proposal, Recognizer, Rivals, RowsSeen, Stopping, Verdict,
};
pub use exponential::exp2_negative;
#[cfg(feature = "rows")]
pub use layouts::batch::Batch;
#[cfg(feature = "code")]
pub use model::Code;
pub use model::{Model, Refused, predicted_value};
pub use palpate_shared as shared;
pub use palpate_shared::format::f32_key;

/// `palpate.h`, which reads the same models in C99 and gives the same bits: for programs that write it beside a model. No
/// chip has it in flash unless it uses it.
pub const C_HEADER: &str = include_str!("../c/palpate.h");
