//! Palpate for Python: the native half of the package `palpate`. What users see is documented there.

mod arrays;
mod capture;
mod cells;
mod data;
mod ensemble;
mod evaluate;
mod failure;
mod maps;
mod model;
mod named;
mod objects;
mod recognizer;
mod shape;
mod stream;
mod surface;
mod work;

/// The part of the package palpate that is written in Rust.
#[pyo3::pymodule(module = "palpate")]
mod _native {
    #[pymodule_export]
    use crate::capture::{capture, checksums, sources};
    #[pymodule_export]
    use crate::data::DataSet;
    #[pymodule_export]
    use crate::ensemble::{Ensemble, train};
    #[pymodule_export]
    use crate::evaluate::{evaluate, parity};
    #[pymodule_export]
    use crate::maps::{Locator, Maps};
    #[pymodule_export]
    use crate::model::{Model, compile};
    #[pymodule_export]
    use crate::recognizer::Recognizer;
    #[pymodule_export]
    use crate::shape::Shape;
    #[pymodule_export]
    use crate::stream::{calibrate, estimate_sequences, evaluate_sequences};
    #[pymodule_export]
    use crate::surface::Surface;
}
