//! A model that XGBoost, LightGBM or CatBoost saved, or an ONNX file, to the bytes that a chip reads, and the proof that
//! they mean the same.
//!
//! ```text
//! cargo run --release -p palpate-trees --example export_and_verify -- model.json rows.csv model.palpate
//! ```
//!
//! `rows.csv` holds rows of features with a header; rows at every threshold are made besides. Without arguments a file of
//! XGBoost's that is used in tests is exported.

use palpate_trees::compile::{self, Settings, compile};
use palpate_trees::ensemble::Ensemble;
use palpate_trees::onboard::Model;
use palpate_trees::output;
use palpate_trees::rows::Rows;
use palpate_trees::verify::{Library, verify};
use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/import/");
    let tested = ["xgboost-3.2-vector-leaves.json", "xgboost-3.2-vector-leaves.csv"];
    let tested = tested.map(|name| PathBuf::from(data).join(name));
    let (model, rows) = match &arguments[..] {
        [model, rows, ..] => (model, rows),
        _ => (&tested[0], &tested[1]),
    };
    let ensemble = Ensemble::load(model)?;
    println!("{}: {} trees over {} features", model.display(), ensemble.trees.len(), ensemble.inputs.count());

    let compiled = compile(&ensemble, &Settings::default())?;
    println!("{} bytes, margins within {:.2e}", compiled.bytes.len(), compiled.margin_error);
    if let Some(output) = arguments.get(2) {
        output::write_bytes(output, &compiled.bytes)?;
    }

    // Every comparison is tried at its threshold and one step to each side of it.
    let model: Model<'_> = compile::open(&compiled.bytes)?;
    let rows = Rows::read(rows, &ensemble.inputs.names(), None)?;
    let verified = verify(&model, &ensemble, &rows, Library::default(), &())?;
    verified.check()?;
    println!(
        "{} rows and {} made at thresholds: margins differ by at most {:.2e}, {} classes differ",
        verified.rows, verified.generated_rows, verified.max_margin_error, verified.class_differs
    );
    Ok(())
}
