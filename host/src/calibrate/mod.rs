//! Thresholds that keep a promised error rate, and use it up.
//!
//! A recognizer that stops when the posterior exceeds 1 − α makes fewer errors than α: the last touch carries the
//! evidence beyond the threshold. How much less depends on the model and the touches. [`calibrate`](fn@calibrate) finds
//! out on touches that nothing was trained on: it sets the model's thresholds by Learn-then-Test on whole
//! sequences ([`Sequence`]), followed by the onboard recognizer's own integers.
//!
//! The error rate is the share of the names given that are wrong. A sequence that reaches the limit of touches without a
//! name is undecided: neither right nor wrong. The rate is promised
//!
//! - on average ([`Per::Average`]): of all names, with objects touched as often as the model's priors say;
//! - per name ([`Per::Name`]): of each name, when it is given, with objects touched as often as that; each name has a
//!   threshold of its own, and the rates of all names are kept at once with the stated probability;
//! - per object ([`Per::Object`]): of the names given to each object, however often it is touched; the rates of all objects
//!   are kept at once with the stated probability.
//!
//! The probability is over calibrations: of calibrations on touches drawn anew, at most a share of 1 − confidence
//! gives thresholds whose rate is above the promised one.
//!
//! ```no_run
//! use palpate::calibrate::{self, calibrate};
//! use palpate::compile::CompiledModel;
//! use palpate::touches::Dataset;
//!
//! # fn main() -> palpate::Result<()> {
//! let compiled = CompiledModel::read("model.palpate")?;
//! let fresh = Dataset::read("fresh".as_ref())?;
//! let settings = palpate::with!(calibrate::Settings::default(), rate = 0.01);
//! let calibrated = calibrate(&compiled.model(), fresh, &settings, &())?;
//! println!("{} of {} names were wrong", calibrated.promise.wrong, calibrated.promise.given);
//! # Ok(())
//! # }
//! ```

mod ahead;
mod begin;
mod calibrated;
mod choose;
mod demand;
mod draw;
mod found;
mod fresh;
mod groups;
mod model;
mod recorded;
#[cfg(all(test, feature = "train"))]
mod recorded_tests;
mod refused;
mod temperature;
mod terms;
#[cfg(all(test, feature = "train"))]
mod tests;
mod unlike;
mod walk;

pub use crate::evidence::{Lead, Limit, Odds, Sequence, margin_of, odds_of};
pub(crate) use begin::Begin;
pub(crate) use calibrated::Stated;
pub use calibrated::{Calibrated, Gain, Guarded, OfObject, OfRecorded, OfRows, Used, Worse};
pub(crate) use choose::share_tested;
pub use choose::{Chosen, choose};
pub(crate) use choose::{Way, promise};
#[cfg(all(test, feature = "train"))]
use draw::MarginSupply;
pub use draw::{TouchSupply, follow};
pub use found::Found;
pub use fresh::{Captured, Fresh, calibrate_fresh, fresh};
pub use model::{Settings, calibrate};
#[cfg(feature = "train")]
pub(crate) use model::{Start, add_noise, begin, calibrate_from};
pub use palpate_shared::format::Per;
pub use recorded::calibrate_recorded;
pub(crate) use refused::{Tested, at_best};
pub use terms::Terms;

pub use temperature::temperature;
pub use unlike::unlike_training;

#[cfg(feature = "train")]
pub(crate) use walk::walk;
pub(crate) use walk::{Stop, binomial_tail};
pub use walk::{Tally, needed};
