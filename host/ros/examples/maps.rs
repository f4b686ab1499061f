//! Writes a model of maps of a bar and a puck, to try a hand that knows where it is.
//!
//! ```text
//! cargo run --example maps maps.palpate
//! cargo run -- maps.palpate
//! ```
//!
//! The bar is 40 mm long and 16 mm wide, the puck 32 mm wide, and both are 25 mm high and lie on their origin.

use palpate::locate::{CastSettings, Surface, write};
use palpate::probe::Probe;
use palpate::with;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("give a path for the model")?;
    Ok(std::fs::write(path, maps()?)?)
}

/// The model.
pub(crate) fn maps() -> palpate::Result<Vec<u8>> {
    let objects = ["bar", "puck"];
    let surfaces = objects.iter().enumerate().map(|(object, name)| Surface {
        object,
        placement: "flat".into(),
        share: 1.0,
        cell: 2.0,
        half: [12, 12],
        heights: (-12..=12)
            .flat_map(|j| (-12..=12).map(move |i| height(name, [i, j].map(|cell| 2.0 * f64::from(cell)))))
            .collect(),
        known: 1.0,
        is_round: *name == "puck",
    });
    let surfaces: Vec<Surface> = surfaces.collect();
    let probe = with!(Probe::default(), radius = 1.5, spacing = 15.0, speed = 100.0, tilt = 0.0, stroke = Some(20.0));
    write(&surfaces, &objects.map(String::from), &probe, &with!(CastSettings::default(), fine = false))
}

/// Height of an object over a place, in millimeters.
pub(crate) fn height(object: &str, [x, y]: [f64; 2]) -> f64 {
    match object {
        "bar" if x.abs() <= 20.0 && y.abs() <= 8.0 => 25.0,
        "puck" if x.hypot(y) <= 16.0 => 25.0,
        _ => 0.0,
    }
}
