//! Two models compared: the published method and the compact preset, on the same touches that neither was trained on.
//!
//! ```text
//! cargo run --release -p palpate --example compare_models -- touches/
//! ```
//!
//! The argument is a directory that `palpate capture` wrote. Without it, two small meshes are touched.

use palpate::capture::capture;
use palpate::compile::{self, compile};
use palpate::ensemble::train::{self, train};
use palpate::evaluate::parity::parity;
use palpate::evaluate::{Margins, Settings, evaluate};
use palpate::mesh::{Mesh, Object};
use palpate::onboard::Model;
use palpate::touches::{Dataset, Origin, folds};
use palpate::with;
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let dataset = match std::env::args().nth(1) {
        Some(directory) => Dataset::read(Path::new(&directory))?,
        None => example_touches()?,
    };
    let split = folds::split(&dataset, 0.25, 1)?;
    let settings = with!(Settings::default(), at = vec![1, 5, 10, 20], groups = 500);
    println!("{:10} {:>8} {:>28}   stops after", "method", "bytes", "accuracy at 1, 5, 10, 20");
    for (name, preset) in [("published", train::Settings::paper()), ("compact", train::Settings::compact())] {
        let ensemble = train(&split.train, &preset, &())?;
        let compiled = compile(&ensemble, &compile::Settings::default())?;
        let model = Model::new(&compiled.bytes)?;

        let margins = Margins::new(&model, &split.test)?;
        let evaluation = evaluate(&margins, &settings)?;
        let accuracy: String = evaluation.accuracy.values().map(|share| format!(" {:5.1}%", 100.0 * share)).collect();
        let sequential = &evaluation.sequential;
        println!("{name:10} {:>8} {accuracy:>28}   {:.1} touches", compiled.bytes.len(), sequential.mean_touches);

        // What compiling changed: margins within the stated error, and the same verdicts.
        let parity = parity(&ensemble, &model, &split.test, 1000, 1, &())?;
        assert!(parity.max_margin_error <= parity.stated_bound);
        println!("{:10} {} of {} verdicts differ from the full model's", "", parity.verdict_differs, parity.sequences);
    }
    Ok(())
}

/// Touches of a globe and an egg.
fn example_touches() -> Result<Dataset, Box<dyn Error>> {
    let globe = Mesh::globe(12);
    let mut egg = globe.clone();
    egg.vertices.iter_mut().for_each(|vertex| vertex[2] *= 0.7);
    let objects = [("egg", egg), ("globe", globe)].map(|(name, mesh)| Object::new(name, mesh));
    let directory = tempfile::tempdir()?;
    capture(&objects, &Origin { touches: 2000, ..Default::default() }.into(), directory.path(), &())?;
    Ok(Dataset::read(directory.path())?)
}
