//! `palpate maps`: objects on a table, by height maps of them.

mod calibrate;
mod evaluate;
mod explore;
mod level;
mod play;
mod recognize;
mod train;
mod view;

pub(super) use recognize::print_located;

group! {
    /// Make maps of objects, from meshes or recorded touches
    Train => train,
    /// Set the threshold that keeps an error rate, on a simulated table or on recordings
    Calibrate => calibrate,
    /// Measure on a simulated table how often names and places are right
    Evaluate => evaluate,
    /// Recognize objects and where they lie, from a stream of touches
    Recognize => recognize,
    /// Say where to touch an object without a mesh, until its heights are known
    Explore => explore,
    /// Measure the table and the fingertips, by presses on the bare table
    Level => level,
    /// Show the map of a touched object on a page, or two of them
    View => view,
    /// Make a page on which a hidden object is found on a table
    Play => play,
}

/// The name of a placement with that of its object.
pub(super) fn name(object: &str, placement: &str) -> String {
    if placement.is_empty() { object.to_owned() } else { format!("{object}/{placement}") }
}
