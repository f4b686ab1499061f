//! Values whose classes are written in Python, with the types that the stub states.

use palpate::locate::Real as Deviations;
use palpate::probe::approach::Probe as Measures;
use palpate::with;
use pyo3::Borrowed;
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::type_hint_identifier;
use pyo3::types::PyType;
use std::convert::Infallible;

/// A class of `palpate._types`.
pub(crate) fn class<'py>(
    py: Python<'py>,
    name: &'static str,
    cell: &'static PyOnceLock<Py<PyType>>,
) -> PyResult<&'py Bound<'py, PyType>> {
    cell.import(py, "palpate._types", name)
}

macro_rules! handed_out {
    ($($(#[$doc:meta])* $name:ident is $module:literal . $class:literal;)*) => {$(
        $(#[$doc])*
        pub(crate) struct $name<'py>(pub(crate) Bound<'py, PyAny>);

        impl<'py> IntoPyObject<'py> for $name<'py> {
            type Target = PyAny;
            type Output = Bound<'py, PyAny>;
            type Error = Infallible;

            const OUTPUT_TYPE: PyStaticExpr = type_hint_identifier!($module, $class);

            fn into_pyobject(self, _: Python<'py>) -> Result<Self::Output, Infallible> {
                Ok(self.0)
            }
        }
    )*};
}

handed_out! {
    /// A verdict.
    Verdict is "palpate._types"."Verdict";
    /// Result of a locator.
    Located is "palpate._types"."Located";
    /// Maps that keep a promise.
    CalibratedMaps is "palpate._locate"."CalibratedMaps";
    /// Results of maps on a simulated table.
    MapsEvaluation is "palpate._locate"."MapsEvaluation";
    /// Predictions of a model.
    Predictions is "palpate._types"."Predictions";
    /// A table of pandas.
    DataFrame is "pandas"."DataFrame";
}

impl<'a, 'py> FromPyObject<'a, 'py> for DataFrame<'py> {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = type_hint_identifier!("pandas", "DataFrame");

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self(object.to_owned()))
    }
}

/// A probe's measures.
pub(crate) struct Probe(pub(crate) Measures);

impl<'a, 'py> FromPyObject<'a, 'py> for Probe {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = type_hint_identifier!("palpate._types", "Probe");

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let number = |name: &str| object.getattr(name)?.extract::<f64>();
        let (radius, spacing) = (number("radius")?, number("spacing")?);
        let length = |name: &str| object.getattr(name)?.extract::<Option<f64>>();
        let (stroke, travel, stroke_tolerance) = (length("stroke")?, length("travel")?, length("stroke_tolerance")?);
        let (speed, tilt) = (number("speed")?, number("tilt")?);
        Ok(Self(with!(Measures::default(), radius, spacing, speed, tilt, stroke, travel, stroke_tolerance)))
    }
}

impl<'py> IntoPyObject<'py> for Probe {
    type Target = PyAny;
    type Output = Bound<'py, PyAny>;
    type Error = PyErr;

    const OUTPUT_TYPE: PyStaticExpr = type_hint_identifier!("palpate._types", "Probe");

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        let Measures { radius, spacing, speed, tilt, stroke, travel, stroke_tolerance, .. } = self.0;
        class(py, "Probe", &CLASS)?.call1((radius, spacing, speed, tilt, stroke, travel, stroke_tolerance))
    }
}

/// Noise that a hand and a table add to touches.
#[derive(Default)]
pub(crate) struct Real(pub(crate) Deviations);

impl<'a, 'py> FromPyObject<'a, 'py> for Real {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = type_hint_identifier!("palpate._types", "Real");

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let number = |name: &str| object.getattr(name)?.extract::<f64>();
        Ok(Self(Deviations {
            height: number("height")?,
            lost: number("lost")?,
            position: number("position")?,
            drift: number("drift")?,
            drift_yaw: number("drift_yaw")?,
            size: number("size")?,
            bent: number("bent")?,
            tips: number("tips")?,
            table: number("table")?,
            turned: number("turned")?,
        }))
    }
}
