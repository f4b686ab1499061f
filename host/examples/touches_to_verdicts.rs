//! A stream of touches to verdicts.
//!
//! ```text
//! cargo run --release -p palpate --example touches_to_verdicts -- model.palpate < touches.txt
//! ```
//!
//! Each line holds three contact times in seconds. Without arguments it simulates touches of two built-in objects, one
//! after the other, and recognizes them with the model in `models/`.

use palpate::capture;
use palpate::mesh::builtin;
use palpate::onboard::{Model, Recognizer, Stopping, Verdict};
use palpate::probe::scene::Scene;
use palpate::shared::Touch;
use palpate::touches::{Origin, text};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let Some(path) = std::env::args().nth(1) else {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/household.palpate");
        return recognize(&std::fs::read(path)?, simulated(&["bowl", "wristwatch"])?.into_iter().map(Ok));
    };
    recognize(&std::fs::read(path)?, text::touches(std::io::stdin().lock(), Path::new("standard input")))
}

/// Prints each verdict as soon as it is reached; the next touch is the first of another object.
fn recognize(bytes: &[u8], touches: impl Iterator<Item = palpate::Result<Touch>>) -> Result<(), Box<dyn Error>> {
    // The bytes are checked once, here; a `Recognizer` has room for a number of objects that is fixed when compiling.
    let model = Model::new(bytes)?;
    let mut recognizer = Recognizer::<256>::new(&model, Stopping::from_model(&model))?;
    for touch in touches {
        match recognizer.push(&touch?) {
            Ok(Verdict::Undecided) => continue,
            Err(refused) => {
                println!("not counted: {refused}");
                continue;
            }
            Ok(Verdict::Recognized { object, touches, rivals }) => {
                let (name, posterior) = (model.object_name(object.into()), rivals.posterior().to_f64());
                println!("{name} after {touches} touches, posterior {posterior:.4}");
            }
            Ok(Verdict::Unknown) => println!("unknown: the touches fit no object of the model"),
            Ok(Verdict::GaveUp) => println!("undecided after the limit of touches"),
        }
        recognizer.reset();
    }
    if recognizer.touches() > 0 {
        println!("undecided after {} touches", recognizer.touches());
    }
    Ok(())
}

/// Approaches to the built-in objects `names`; most of them touch something.
fn simulated(names: &[&str]) -> palpate::Result<Vec<Touch>> {
    let origin = Origin { seed: 2, approaches: true, ..Default::default() };
    let mut all = Vec::new();
    for name in names {
        let scene = [Scene::new(builtin::one(name)?.mesh(), origin.length)?];
        all.extend(capture::touches(&scene, name, &origin, 0..300)?.touches());
    }
    Ok(all)
}
