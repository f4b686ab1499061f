//! `palpate data`: data sets of touches, and built-in objects.

mod check;
mod objects;
mod record;

group! {
    /// Check a data set
    Check => check,
    /// Record touches of a real probe: from lines, a log, or a chip
    Record => record,
    /// Write built-in objects, meshes or maps of touched objects as OBJ
    Objects => objects,
}
