//! Your own meshes to a model that a chip reads.
//!
//! ```text
//! cargo run --release -p palpate --example mesh_to_model -- meshes/ model.palpate
//! ```
//!
//! Without arguments it makes two small meshes itself and writes the model to a temporary directory.

use palpate::capture::capture;
use palpate::compile::{self, compile};
use palpate::ensemble::train::{self, train};
use palpate::error::Result;
use palpate::mesh::{Mesh, Object, source};
use palpate::touches::{Dataset, Origin};
use std::path::PathBuf;

fn main() -> Result<()> {
    let scratch = tempfile::tempdir().expect("a directory for temporary files");
    let mut arguments = std::env::args().skip(1);
    let objects = match arguments.next() {
        Some(meshes) => source::objects(&[meshes])?,
        None => two_meshes(),
    };
    let model = arguments.next().map_or_else(|| scratch.path().join("model.palpate"), PathBuf::from);

    // Touch each object with the virtual probe. The touches stay on disk: train on them as often as you like.
    let settings = Origin { touches: 2000, ..Default::default() }.into();
    let data = scratch.path().join("data");
    let summary = capture(&objects, &settings, &data, &())?;
    for object in &summary.objects {
        println!("{:12} {} touches in {} approaches", object.name, object.touches, object.approaches);
    }

    // Train, and compile for the chip.
    let ensemble = train(&Dataset::read(&data)?, &train::Settings::compact(), &())?;
    let compiled = compile(&ensemble, &compile::Settings::default())?;
    palpate::output::write_bytes(&model, &compiled.bytes)?;
    println!(
        "{}: {} bytes, {} trees, about {} instructions per touch on a Cortex-M4F",
        model.display(),
        compiled.bytes.len(),
        ensemble.trees.len(),
        compiled.instructions.m4f
    );
    Ok(())
}

/// A globe and a disc.
fn two_meshes() -> Vec<Object> {
    let globe = Mesh::globe(12);
    let mut disc = globe.clone();
    disc.vertices.iter_mut().for_each(|vertex| vertex[2] *= 0.1);
    [("disc", disc), ("globe", globe)].map(|(name, mesh)| Object::new(name, mesh)).into()
}
