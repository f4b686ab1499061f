//! Recognize objects by touch: simulate a probe with three fingers, train boosted trees on its virtual touches, compile
//! them for a microcontroller, and measure how well they recognize.
//!
//! ```text
//! mesh ──► scene ──► approach ──► contact times ──► touch ──► ensemble ──► compiled model ──► verdict
//! ```
//!
//! # From a mesh to a verdict
//!
#![cfg_attr(feature = "train", doc = "```")]
#![cfg_attr(not(feature = "train"), doc = "```ignore")]
//! use palpate::capture::{self, capture};
//! use palpate::compile::{self, compile};
//! use palpate::ensemble::train::{self, train};
//! use palpate::mesh::{Mesh, Object};
//! use palpate::onboard::{Model, Recognizer, Stopping, Verdict};
//! use palpate::probe::scene::Scene;
//! use palpate::touches::{Dataset, Origin};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // Two objects. `palpate::mesh::source::objects` reads yours from files.
//! let globe = Mesh::globe(12);
//! let mut disc = globe.clone();
//! disc.vertices.iter_mut().for_each(|vertex| vertex[2] *= 0.1);
//! let objects = [("disc", disc), ("globe", globe)].map(|(name, mesh)| Object::new(name, mesh));
//!
//! // Touch each a thousand times, and train on the touches.
//! let origin = Origin { touches: 1000, ..Default::default() };
//! let directory = tempfile::tempdir()?;
//! capture(&objects, &origin.clone().into(), directory.path(), &())?;
//! let ensemble = train(&Dataset::read(directory.path())?, &train::Settings::compact(), &())?;
//!
//! // Compile the trees to the bytes that a chip reads, and recognize with the code that runs there.
//! let compiled = compile(&ensemble, &compile::Settings::default())?;
//! let model = Model::new(&compiled.bytes)?;
//! let mut recognizer = Recognizer::<2>::new(&model, Stopping::from_model(&model))?;
//! let scene = [Scene::new(objects[0].mesh(), origin.length)?];
//! let unseen = Origin { seed: 2, ..origin };
//! let mut verdict = Verdict::Undecided;
//! for touch in capture::touches(&scene, "disc", &unseen, 0..200)?.touches() {
//!     verdict = recognizer.push(&touch)?;
//!     if verdict != Verdict::Undecided {
//!         break;
//!     }
//! }
//! let Verdict::Recognized { object, touches, .. } = verdict else { panic!("{verdict:?}") };
//! println!("{} after {touches} touches", model.object_name(object.into()));
//! assert_eq!(model.object_name(object.into()), "disc");
//! # Ok(())
//! # }
//! ```
//!
//! The `examples` folder has four programs to start from: `mesh_to_model`, `touches_to_verdicts`, `own_trees` and
//! `compare_models`.
//!
//! # Modules, in the data's order
//!
//! | module | what it does | start with |
//! |---|---|---|
//! | [`mesh`] | reads triangles from files; makes the built-in objects | [`mesh::source::objects`](fn@mesh::source::objects) |
//! | [`probe`] | the simulator: scene, approach, first contact | [`probe::scene::Scene`] |
//! | [`touches`] | touches in memory and on disk; noise; splits | [`touches::Dataset`] |
//! | [`capture`] | touches objects, many times | [`capture::capture`](fn@capture::capture) |
//! | `fit` | finds the probe that recorded touches came from | `fit::fit` |
//! | [`ensemble`] | the full model: trees in `f32`, files of XGBoost, LightGBM, CatBoost and ONNX, training | [`ensemble::Ensemble`] |
//! | [`rows`] | rows of features, for models that other libraries trained | [`rows::Rows`] |
//! | [`compile`] | an ensemble to the bytes that a chip reads | [`compile::compile`](fn@compile::compile) |
//! | [`evaluate`] | accuracy, touches to a verdict, comparison of two models | [`evaluate::evaluate`](fn@evaluate::evaluate) |
//! | [`calibrate`] | thresholds that keep a promised error rate | [`calibrate::calibrate`](fn@calibrate::calibrate) |
//! | `strangers` | a test of whether touches fit any object that a model knows | `strangers::calibrate` |
//! | `teach` | objects that are learned from recorded touches | `teach::teach` |
//! | [`stream`] | verdicts of streams of rows, as early as a promised error rate allows | [`stream::calibrate`](fn@stream::calibrate) |
//! | [`play`] | objects touched one approach after the other, and models that follow: the page of `palpate play` | [`play::Game`] |
//! | [`locate`] | what an object on a table is and where it lies, for a hand that knows where it is | [`locate::cast`] |
//! | [`chip`] | talks to a chip, real or emulated | [`chip::Connection`] |
//!
//! [`shared`] (touches, descriptors, the model format) and [`onboard`] (models, recognizers) are the crates that run on
//! the chip; the host uses the same code. [`progress::Progress`] follows and cancels long calls. Errors are
//! [`Error`], with a [`Kind`](error::Kind) that can be matched on.
//!
//! # Features
//!
//! | feature | default | what it adds |
//! |---|---|---|
//! | none | | simulator, compiler, evaluator |
//! | `train` | yes | `ensemble::train`, `fit`, `strangers` and `teach` |
//! | `objects` | yes | `mesh::builtin`: ten objects made from implicit functions. |
//! | `mcap` | yes | touches and verdicts in robots' logs (MCAP) |
//! | `serial` | yes | chips at serial ports |
//! | `xgboost` | no | XGBoost 1.6.2 as a second trainer, built from its C++ source |
//!
//! `palpate = { version = "0.3", default-features = false }` brings no terminal, no progress bar, no plots, no serial
//! port and no trainer.

pub mod error;

pub mod touches;

pub mod capture;
#[cfg(feature = "train")]
pub mod fit;

pub mod ensemble;

pub mod compile;
pub mod evaluate;
mod evidence;

pub mod calibrate;
#[cfg(feature = "train")]
pub mod teach;

#[cfg(feature = "train")]
pub mod strangers;

pub mod stream;

pub mod play;

pub mod locate;

pub mod chip;

#[cfg(all(test, feature = "train"))]
mod tests;

// Helpers of tests name the library as those in `tests/palpate` do.
#[cfg(all(test, feature = "train"))]
extern crate self as palpate;

pub use error::{Error, Result};
pub use glam;
pub use palpate_base::{gone, output, progress, results, row, with, wording};
pub use palpate_onboard as onboard;
pub use palpate_shared as shared;
pub use palpate_simulator::{in_order, mesh, probe, random};
pub use palpate_trees as trees;
pub use palpate_trees::{prove, rows};
