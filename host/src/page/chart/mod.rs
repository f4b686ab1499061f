//! Charts as SVG: axes with units, marks, and labels beside what they name instead of a legend.

mod draw;
mod labels;
mod parts;

pub(crate) use parts::{Chart, Mark, Shape, Side, Stroke, Svg};
