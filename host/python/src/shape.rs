//! The map of an object that stands still.

use crate::arrays::{Output, two};
use crate::failure::Failure;
use crate::maps::{Row, Three};
use crate::objects::Probe;
use numpy::ndarray::Ix2;
use palpate::error::Error;
use palpate::locate::{self, Heights, Relief};
use palpate::touches::{located, touch_of_seconds};
use pyo3::prelude::*;

/// Learns the heights of one object that stands still on a table, and says where they are least known.
///
/// `probe` is in millimeters, `workspace` how far from the table's origin the middle finger is sent in x and y, and `noise` the
/// standard deviation of a contact's height, in millimeters.
///
/// >>> import palpate
/// >>> probe = palpate.Probe(radius=1.5, spacing=15, speed=100, tilt=0, stroke=20)
/// >>> shape = palpate.Shape(probe, workspace=20)
/// >>> while shape.known(2.0) < 0.5 and shape.touches < 40:
/// ...     x, y, roll = shape.next()
/// ...     shape.push_heights((10.0, 10.0, 10.0), x, y, roll)
/// >>> shape.heights.shape, bool(abs(shape.heights[22, 22] - 10) < 1)
/// ((45, 45), True)
#[pyo3::pyclass(module = "palpate._native")]
pub(crate) struct Shape {
    shape: locate::Shape,
    spacing: f64,
    radius: f64,
    relief: Option<Relief>,
}

impl Shape {
    fn relief(&mut self) -> &Relief {
        let shape = &self.shape;
        self.relief.get_or_insert_with(|| shape.relief())
    }

    fn grid<'py>(&mut self, py: Python<'py>, of: fn(&Relief) -> Vec<f64>) -> PyResult<Output<'py, f64, Ix2>> {
        let relief = self.relief();
        two(py, of(relief), 2 * relief.half[0].unsigned_abs() as usize + 1)
    }
}

#[pyo3::pymethods]
impl Shape {
    #[new]
    #[pyo3(signature = (probe, *, workspace=60.0, noise=0.5))]
    fn new(probe: Probe, workspace: f64, noise: f64) -> Result<Self, Failure> {
        let Probe(probe) = probe;
        for (name, value, most) in [("workspace", workspace, 200.0), ("noise", noise, 5.0)] {
            if !(0.01..=most).contains(&value) {
                return Err(Error::setting(name, value, format!("a number of millimeters to {most}")).into());
            }
        }
        let shape = locate::Shape::within(&probe, [workspace; 2], noise);
        Ok(Self { shape, spacing: probe.spacing, radius: probe.radius, relief: None })
    }

    /// Takes in a touch, as `Locator.push` does.
    fn push(&mut self, times: Three, position: Three, alignment: Row) -> Result<(), Failure> {
        let Three(times) = times;
        let touch = touch_of_seconds(times, Some([0.0, 0.0, -1.0]), Some(alignment.0))
            .and_then(|touch| located(touch, position.all()))?;
        self.shape.push(&touch)?;
        self.relief = None;
        Ok(())
    }

    /// Takes in heights, as `Locator.push_heights` does.
    #[pyo3(signature = (heights, x, y, alignment, *, lowest=0.0))]
    fn push_heights(&mut self, heights: Three, x: f64, y: f64, alignment: Row, lowest: f64) -> Result<(), Failure> {
        let (Three(met), Row(row)) = (heights, alignment);
        self.shape.add(Heights { met, place: [x, y], row, lowest }.samples(self.spacing)?);
        self.relief = None;
        Ok(())
    }

    /// The next approach: x and y of the middle finger in millimeters, and the roll of the row in degrees from the x axis.
    fn next(&mut self) -> (f64, f64, f64) {
        let relief = self.relief().clone();
        let next = self.shape.next(&relief);
        (f64::from(next.x) / 1e3, f64::from(next.y) / 1e3, f64::from(next.roll) * 360.0 / 256.0)
    }

    /// Share of the cells that may be the object's whose height is known to some millimeters.
    fn known(&mut self, millimeters: f64) -> Result<f64, Failure> {
        if millimeters.is_nan() || millimeters <= 0.0 {
            return Err(Error::setting("millimeters", millimeters, "a number above 0").into());
        }
        Ok(self.relief().known(millimeters))
    }

    /// Heights in millimeters on a grid of 1 mm about the origin, a row for each y, ascending.
    #[getter]
    fn heights<'py>(&mut self, py: Python<'py>) -> PyResult<Output<'py, f64, Ix2>> {
        self.grid(py, |relief| relief.heights.clone())
    }

    /// The least and the greatest height of each cell: nineteen of twenty such intervals hold the truth, of cells within 8 mm of a
    /// touch. Others have the interval from the table to the highest height so far, which states nothing.
    #[getter]
    fn bounds<'py>(&mut self, py: Python<'py>) -> PyResult<(Output<'py, f64, Ix2>, Output<'py, f64, Ix2>)> {
        let low = self.grid(py, |relief| relief.bounds.iter().map(|bounds| bounds[0]).collect())?;
        Ok((low, self.grid(py, |relief| relief.bounds.iter().map(|bounds| bounds[1]).collect())?))
    }

    /// The surface, closed to the table: vertices in millimeters, and triangles.
    fn mesh(&mut self) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let radius = self.radius;
        let mesh = self.relief().solid(radius);
        (mesh.vertices, mesh.triangles)
    }

    /// The number of touches taken in.
    #[getter]
    fn touches(&self) -> usize {
        self.shape.samples().len() / 3
    }
}
