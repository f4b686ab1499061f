//! Properties between the crates: parity, hard cases, the pipeline, the firmware, the C header.

mod approach;
mod arduino;
mod c_header;
mod compiled_margins;
mod evidence;
mod firmware;
mod flash;
mod golden_model;
mod images;
mod model_bytes;
mod page;
mod parity;
mod precision;
mod probe_station;
mod promise;
mod prove;
mod reference;
mod rooms;
mod rows_at_once;
mod soak;
mod stated;
mod station;
mod strangers;
mod vectors;

use palpate_shared::Descriptor;
use palpate_tests::random::Shape;
use proptest::prelude::*;

/// Shapes with fewer objects and thresholds than stated, and at most the stated numbers of trees and levels.
fn shapes(objects: usize, trees: usize, depth: usize, thresholds: usize) -> impl Strategy<Value = Shape> {
    let descriptors = prop::sample::select(Descriptor::ALL.to_vec());
    (descriptors, 1..objects, 1..=trees, 0..=depth, any::<bool>(), 0..thresholds, 0.01..30.0_f32).prop_map(
        |(descriptor, objects, trees, depth, each, thresholds, leaf)| {
            // Deep trees are many nodes: fewer of them keep a case quick.
            let trees = if depth > 6 { 1 + trees / 20 } else { trees };
            Shape { descriptor, objects, trees, depth, each, thresholds, leaf }
        },
    )
}
