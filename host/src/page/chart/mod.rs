//! Charts as SVG: axes with units, marks, and labels next to lines instead of a legend.

mod draw;
mod labels;
mod parts;

pub(crate) use parts::{Chart, Mark, Shape, Side, Stroke, Svg};
