//! Touching meshes.

use crate::arrays::{Input, triples};
use crate::data::DataSet;
use crate::failure::Failure;
use crate::objects::Probe;
use crate::work::{Callback, long};
use numpy::ndarray::Ix2;
use palpate::capture::{self as library, Settings};
use palpate::error::Error;
use palpate::mesh::source::{self, Source};
use palpate::mesh::{Mesh, Object};
use palpate::probe::approach::Aim;
use palpate::shared::format::Length;
use palpate::touches::{Origin, Samples, Surroundings};
use palpate::with;
use pyo3::exceptions::PyTypeError;
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::types::{PyMapping, PyString};
use pyo3::{Borrowed, type_hint_identifier};
use std::path::PathBuf;

/// Objects to touch: sources that name themselves, or names with what stands for them.
pub(crate) enum Meshes {
    Sources(Vec<String>),
    Named(Vec<(String, Given)>),
}

/// A flag that keeps approaches that touched nothing, too; or a number of approaches, all kept.
#[derive(FromPyObject)]
pub(crate) enum Approaches {
    Kept(bool),
    Count(u64),
}

/// Meshes or sources that stand for one object.
pub(crate) enum Given {
    Source(String),
    Mesh(Mesh),
}

impl Meshes {
    /// The objects, read.
    pub(crate) fn objects(self, instances: bool) -> palpate::Result<Vec<Object>> {
        let objects: Vec<Object> = match self {
            Self::Sources(sources) if instances => source::objects_of_instances(&sources),
            Self::Sources(sources) => source::objects(&sources),
            Self::Named(named) => named
                .into_iter()
                .map(|(name, given)| match given {
                    Given::Mesh(mesh) => Ok(Object::new(name, mesh)),
                    Given::Source(source) => {
                        let mut object = source::object(&source)?;
                        object.name = name;
                        Ok(object)
                    }
                })
                .collect(),
        }?;
        if objects.is_empty() {
            return Err(Error::setting("meshes", "empty", "at least one mesh, directory or built-in object"));
        }
        Ok(objects)
    }
}

impl<'a, 'py> FromPyObject<'a, 'py> for Meshes {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = type_hint_identifier!("palpate._types", "Meshes");

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(mapping) = object.cast::<PyMapping>() {
            let of = |pair: Bound<'py, PyAny>| {
                let (name, mesh): (String, Bound<'py, PyAny>) = pair.extract()?;
                let given =
                    if is_source(&mesh)? { Given::Source(source_of(&mesh)?) } else { Given::Mesh(mesh_of(&mesh)?) };
                Ok((name, given))
            };
            return mapping.items()?.iter().map(of).collect::<PyResult<_>>().map(Self::Named);
        }
        if is_source(&object)? {
            return Ok(Self::Sources(vec![source_of(&object)?]));
        }
        let sources = object.try_iter()?.map(|source| source_of(&source?)).collect::<PyResult<_>>()?;
        Ok(Self::Sources(sources))
    }
}

fn is_source(object: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(object.is_instance_of::<PyString>() || object.hasattr("__fspath__")?)
}

fn source_of(object: &Bound<'_, PyAny>) -> PyResult<String> {
    let path: PathBuf = object.extract()?;
    let text = path.into_os_string().into_string();
    text.map_err(|path| pyo3::exceptions::PyValueError::new_err(format!("{} is not UTF-8", path.display())))
}

/// A mesh as a pair of arrays, or as an object that has them, such as one of trimesh.
fn mesh_of(object: &Bound<'_, PyAny>) -> PyResult<Mesh> {
    let (vertices, faces): (Bound<'_, PyAny>, Bound<'_, PyAny>) = if object.hasattr("faces")? {
        (object.getattr("vertices")?, object.getattr("faces")?)
    } else {
        object.extract().map_err(|_| PyTypeError::new_err("a mesh is a pair of arrays: vertices and faces"))?
    };
    let vertices: Input<'_, f64, Ix2> = vertices.extract()?;
    Ok(Mesh::from_f64(triples(&vertices, "vertices")?, triangles(&faces.extract()?)?).0)
}

fn triangles(faces: &Input<'_, i64, Ix2>) -> PyResult<Vec<[u32; 3]>> {
    // Beyond the last vertex: refused with its number when the mesh is used.
    let index = |&index: &i64| u32::try_from(index).unwrap_or(u32::MAX);
    Ok(triples(faces, "faces")?.iter().map(|face| face.each_ref().map(index)).collect())
}

pub(crate) fn mesh(vertices: &Input<'_, f32, Ix2>, faces: &Input<'_, i64, Ix2>) -> PyResult<Mesh> {
    Ok(Mesh { vertices: triples(vertices, "vertices")?.to_vec(), triangles: triangles(faces)? })
}

/// The checksums of the meshes that each object is touched as, as `dataset.json` states them: the names, sorted, with those of
/// their instances. All files are read.
#[pyo3::pyfunction]
pub(crate) fn checksums(py: Python<'_>, meshes: Meshes) -> Result<Vec<(String, Vec<String>)>, Failure> {
    let objects = py.detach(|| meshes.objects(false))?;
    let checksum = |object: Object| {
        let checksums = object.instances().map(|instance| format!("{:016x}", instance.mesh.checksum())).collect();
        (object.name, checksums)
    };
    Ok(objects.into_iter().map(checksum).collect())
}

/// The objects that sources stand for: their names, sorted, and what `capture` takes for each alone. Nothing is read.
#[pyo3::pyfunction]
pub(crate) fn sources(meshes: Vec<PathBuf>) -> Result<Vec<(String, String)>, Failure> {
    let given: Vec<String> = meshes.into_iter().map(|path| path.to_string_lossy().into_owned()).collect();
    let of = |source: Source| {
        let name = source.name().to_owned();
        let path = match source {
            Source::File { path, .. } => path.to_string_lossy().into_owned(),
            _ => name.clone(),
        };
        (name, path)
    };
    Ok(source::files(&given)?.into_iter().map(of).collect())
}

/// Touches objects with a simulated probe.
///
/// `meshes` are files, directories or built-in objects as `palpate capture` takes them, such as "meshes/" or
/// ["bowl", "cup.obj"], or a mapping from names to files, to pairs of arrays (vertices, faces) or to meshes of trimesh. Each is
/// scaled so that its longest side has `length` units; with `millimeters`, the length of a unit of the meshes, it keeps
/// its true size and the `probe` is in millimeters.
///
/// `touches` full touches of each object are kept, or with `approaches=True` that many approaches whether fingers touch or not;
/// `approaches=500` are 500 approaches. `pose` keeps the probe's direction and alignment. With `cone` the objects lie on a
/// table in each of their placements, and approaches come within that many degrees of straight down. The same
/// `seed` gives the same touches on any number of `threads`, and the same as the program's. `samples` are the first of
/// a part of these touches or approaches, from 0, and the one after its last. With `instances` a directory inside a directory
/// is one object. With `out` the touches are written there as `palpate capture` does: `force` is its option.
///
/// `progress` is called with a stage, the steps done and their number. Ctrl-C stops the call.
///
/// >>> import palpate
/// >>> data = palpate.capture(["bowl", "mouse"], touches=100, seed=7)
/// >>> data
/// DataSet(200 touches of 2 objects)
/// >>> data.times.shape, bool(data.times.min() == 0.0)
/// ((200, 3), True)
#[pyo3::pyfunction]
#[pyo3(signature = (meshes, *, touches=21_000, seed=1, probe=None, approaches=Approaches::Kept(false), pose=false, aim="box", cone=None,
    length=10.0, millimeters=None, instances=false, samples=None, out=None, force=false,
    threads=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub(crate) fn capture(
    py: Python<'_>,
    meshes: Meshes,
    touches: u64,
    seed: u64,
    probe: Option<Probe>,
    approaches: Approaches,
    pose: bool,
    aim: &str,
    cone: Option<f64>,
    length: f64,
    millimeters: Option<f64>,
    instances: bool,
    samples: Option<(u64, u64)>,
    out: Option<PathBuf>,
    force: bool,
    threads: Option<usize>,
    progress: Option<Callback>,
) -> Result<DataSet, Failure> {
    if millimeters.is_some() && probe.is_none() {
        return Err(Error::setting("probe", "not given", "a probe in millimeters, as millimeters is given").into());
    }
    let (touches, approaches) = match approaches {
        Approaches::Kept(kept) => (touches, kept),
        Approaches::Count(count) => (count, true),
    };
    let origin = Origin {
        touches,
        seed,
        unit: if millimeters.is_some() { Length::Millimeter } else { Length::Tenth },
        length,
        probe: probe.map(|Probe(probe)| probe).unwrap_or_default(),
        aim: Aim::from_name(aim).ok_or_else(|| Error::setting("aim", aim, "box, middle or mass"))?,
        pose,
        approaches,
        scene: cone.map_or(Surroundings::Floating, |cone| Surroundings::Table { cone }),
        samples: samples.map(|(first, end)| format!("{first}..{end}").parse::<Samples>()).transpose()?,
        ..Origin::default()
    };
    let settings = with!(Settings::default(), origin, force, threads);
    settings.check()?;
    long(py, progress.as_ref(), |progress| {
        let mut objects = meshes.objects(instances)?;
        if objects.is_empty() {
            return Err(Error::setting("meshes", "empty", "one object or more"));
        }
        if millimeters.is_some() {
            objects.iter_mut().for_each(|object| object.millimeters = object.millimeters.or(millimeters));
        }
        match out {
            Some(directory) => {
                library::capture(&objects, &settings, &directory, progress)?;
                DataSet::of_directory(&directory)
            }
            None => {
                let (dataset, approaches) = library::in_memory(&objects, &settings, progress)?;
                Ok(DataSet::new(dataset, Some(approaches)))
            }
        }
    })
}
