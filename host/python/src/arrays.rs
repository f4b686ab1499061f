//! Arrays in and out, with the types that the stub states: numpy's own types state none.

use numpy::ndarray::{Dimension, Ix1, Ix2};
use numpy::{
    Element, IntoPyArray, PyArray, PyArrayMethods, PyReadonlyArray, PyUntypedArray, PyUntypedArrayMethods, dtype,
};
use palpate::rows::{BY_POSITION, Features};
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;
use pyo3::{Borrowed, type_hint_identifier, type_hint_subscript};
use std::borrow::Cow;
use std::convert::Infallible;

/// The hint of what numpy can make an array of.
pub(crate) const ARRAY_LIKE: PyStaticExpr = type_hint_identifier!("numpy.typing", "ArrayLike");

/// An array, or what numpy can make one of, as it was given.
pub(crate) struct ArrayLike<'py>(pub(crate) Bound<'py, PyAny>);

impl<'a, 'py> FromPyObject<'a, 'py> for ArrayLike<'py> {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = ARRAY_LIKE;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self(object.to_owned()))
    }
}

/// A number that arrays are made of.
pub(crate) trait Number: Element {
    /// The hint of an array of such numbers.
    const ARRAY: PyStaticExpr;
}

impl Number for f64 {
    const ARRAY: PyStaticExpr = type_hint_subscript!(
        type_hint_identifier!("numpy.typing", "NDArray"),
        type_hint_identifier!("numpy", "float64")
    );
}

impl Number for f32 {
    const ARRAY: PyStaticExpr = type_hint_subscript!(
        type_hint_identifier!("numpy.typing", "NDArray"),
        type_hint_identifier!("numpy", "float32")
    );
}

impl Number for i64 {
    const ARRAY: PyStaticExpr =
        type_hint_subscript!(type_hint_identifier!("numpy.typing", "NDArray"), type_hint_identifier!("numpy", "int64"));
}

impl Number for i16 {
    const ARRAY: PyStaticExpr =
        type_hint_subscript!(type_hint_identifier!("numpy.typing", "NDArray"), type_hint_identifier!("numpy", "int16"));
}

/// An array in C order: the caller's own if it is one of such numbers, or else a converted copy.
pub(crate) struct Input<'py, T: Element, D: Dimension>(PyReadonlyArray<'py, T, D>);

impl<'a, 'py, T: Element, D: Dimension> FromPyObject<'a, 'py> for Input<'py, T, D> {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = ARRAY_LIKE;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(array) = object.extract::<PyReadonlyArray<'py, T, D>>()
            && array.is_c_contiguous()
        {
            return Ok(Self(array));
        }
        let py = object.py();
        let any = py.import("numpy")?.call_method1("asarray", (object,))?;
        let like = [("order", "C".into_pyobject(py)?), ("casting", "same_kind".into_pyobject(py)?)].into_py_dict(py)?;
        let array = any.call_method("astype", (dtype::<T>(py),), Some(&like))?;
        let found: usize = array.getattr("ndim")?.extract()?;
        match D::NDIM {
            Some(wanted) if wanted != found => Err(pyo3::exceptions::PyValueError::new_err(format!(
                "a {found}-dimensional array, where a {wanted}-dimensional one is needed"
            ))),
            _ => array.extract().map(Self),
        }
    }
}

impl<T: Element> Input<'_, T, Ix1> {
    /// The numbers.
    pub(crate) fn values(&self) -> PyResult<&[T]> {
        Ok(self.0.as_slice()?)
    }
}

impl<T: Element> Input<'_, T, Ix2> {
    /// The numbers, row after row, and how many a row has.
    pub(crate) fn rows(&self) -> PyResult<(&[T], usize)> {
        let columns = self.0.shape().get(1).copied().unwrap_or_default();
        Ok((self.0.as_slice()?, columns))
    }
}

/// The rows as an array: of a table whose columns have names those that are the features of `owner`, which has a `_columns`.
pub(crate) fn features<'py>(owner: &Bound<'py, PyAny>, rows: Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let is_table =
        rows.cast::<PyUntypedArray>().is_err() && (rows.hasattr("columns")? || rows.hasattr("column_names")?);
    if !is_table {
        return Ok(rows);
    }
    rows.py().import("palpate._rows")?.call_method1("rows_of", (owner, rows))
}

/// The features of rows of `found` values without names: all of them, or of all columns of the library's rows those that the
/// model has.
pub(crate) fn taken<'v, V: Copy>(
    features: &Features,
    (values, found): (&'v [V], usize),
) -> palpate::Result<Cow<'v, [V]>> {
    let Some(used) = features.of_width(found)? else { return Ok(Cow::Borrowed(values)) };
    // The columns are among those found.
    Ok(values.chunks_exact(found).flat_map(|row| used.iter().filter_map(|&column| row.get(column).copied())).collect())
}

/// The positions of features among columns with these names, and a note about them.
pub(crate) fn columns(features: &Features, header: &[String]) -> palpate::Result<(Vec<usize>, Option<&'static str>)> {
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let matched = features.among(&header, &[])?;
    Ok((matched.columns, matched.by_position.then_some(BY_POSITION)))
}

/// An array of three numbers in each row.
pub(crate) fn triples<'a, T: Element>(array: &'a Input<'_, T, Ix2>, name: &str) -> PyResult<&'a [[T; 3]]> {
    match array.rows()? {
        (values, 3) => Ok(values.as_chunks().0),
        (_, columns) => {
            Err(pyo3::exceptions::PyValueError::new_err(format!("{name} has {columns} columns, where 3 are needed")))
        }
    }
}

/// An array that is handed to Python.
pub(crate) struct Output<'py, T, D>(pub(crate) Bound<'py, PyArray<T, D>>);

impl<'py, T: Number, D: Dimension> IntoPyObject<'py> for Output<'py, T, D> {
    type Target = PyArray<T, D>;
    type Output = Bound<'py, Self::Target>;
    type Error = Infallible;

    const OUTPUT_TYPE: PyStaticExpr = T::ARRAY;

    fn into_pyobject(self, _: Python<'py>) -> Result<Self::Output, Infallible> {
        Ok(self.0)
    }
}

/// The numbers as an array, without a copy.
pub(crate) fn one<T: Number>(py: Python<'_>, values: Vec<T>) -> Output<'_, T, Ix1> {
    Output(values.into_pyarray(py))
}

/// Rows of `columns` numbers as an array, without a copy.
pub(crate) fn two<T: Number>(py: Python<'_>, values: Vec<T>, columns: usize) -> PyResult<Output<'_, T, Ix2>> {
    let rows = values.len().checked_div(columns).unwrap_or_default();
    Ok(Output(values.into_pyarray(py).reshape([rows, columns])?))
}
