//! Charts as SVG: axes with units, marks, and labels next to lines, or a legend where those would not fit.
//!
//! Every text has its place before anything is drawn ([`layout`]), so that none covers another, whatever is shown; a
//! chart that is wider than a phone is drawn for a phone as well.

mod draw;
mod labels;
mod layout;
mod parts;
mod text;

pub(crate) use parts::{Chart, Mark, Shape, Stroke, Svg};
