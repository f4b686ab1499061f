//! Trees from your own trainer into a model that a chip reads.
//!
//! ```text
//! cargo run --release -p palpate --example own_trees
//! ```
//!
//! Any trainer of boosted trees will do, as long as its trees split on the features of a descriptor: here curvature
//! (κ = t1 − 2·t2 + t3, and the slope |t3 − t1|, both in microseconds). XGBoost's JSON is read by `ensemble::load`.

use palpate::compile::{self, compile};
use palpate::ensemble::{Ensemble, Node, Output, OverTouches, Provenance, Tree, feature_row, inputs};
use palpate::onboard::Model;
use palpate::shared::{Descriptor, Touch};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let split = |feature, threshold, left, right| Node::Split { feature, threshold, missing_left: true, left, right };
    let leaf = |flat: f32, round: f32| Node::Leaf(vec![flat, round]);
    let ensemble = Ensemble {
        inputs: inputs(Descriptor::Curvature),
        objects: vec!["flat".into(), "round".into()],
        base_margins: vec![0.0, 0.0],
        trees: vec![
            // κ < 20 ms: flat rather than round.
            Tree { nodes: vec![split(0, 20_000.0, 1, 2), leaf(1.5, -1.5), leaf(-1.5, 1.5)], output: Output::Each },
            // A tree may also add to one object only.
            Tree {
                nodes: vec![split(1, 50_000.0, 1, 2), Node::Leaf(vec![0.25]), Node::Leaf(vec![-0.25])],
                output: Output::One(1),
            },
        ],
        origin: Provenance::default(),
    };
    let compiled = compile(&ensemble, &compile::Settings::default())?;
    println!("{} bytes, margins within {} nats", compiled.bytes.len(), compiled.margin_error);

    // The same touch through both: margins of the compiled model are whole numbers of `unit()` nats.
    let model = Model::new(&compiled.bytes)?;
    let touch = Touch::from_micros([31_000, 0, 42_000]);
    println!("features {:?}", feature_row(Descriptor::Curvature, &touch));
    let mut margins = [0; 2];
    model.margins(&touch, &mut margins);
    for ((name, full), compiled) in ensemble.objects.iter().zip(ensemble.margins(&touch)).zip(margins) {
        let compiled = compiled as f32 * model.unit();
        println!("{name:6} full {full:+.4}, compiled {compiled:+.4}");
        assert!((full - compiled).abs() <= model.margin_error());
    }
    Ok(())
}
