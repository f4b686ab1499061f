//! Triangle meshes: from files, or built in.
//!
//! - [`source`] finds objects by what a user names: `builtin`, a built-in object, a mesh file, a directory of them.
//! - [`mod@file`] reads one file: OBJ, STL, PLY, glTF or COLLADA, whichever its content says it is. [`obj`] writes one;
//!   [`builtin`] makes the ten objects that need no file.
//! - [`Mesh`] is what comes out: vertices and triangles, in the file's own units. [`Object`] gives it a name.
//! - [`facts`] says whether a mesh is closed and right side out, how large it is and what volume it encloses.
//!
//! From here a mesh goes to [`Scene::new`](crate::probe::Scene::new), which scales it to the units of the probe.
//!
//! ```
//! use palpate_simulator::mesh::facts::Facts;
//! use palpate_simulator::mesh::{Mesh, obj};
//! use palpate_simulator::probe::Scene;
//! use palpate_simulator::probe::glam::DVec3;
//!
//! # fn main() -> palpate_simulator::Result<()> {
//! // A tetrahedron, as it would stand in a file.
//! let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
//! let mesh: Mesh = obj::parse(text.as_bytes(), "tetrahedron.obj".as_ref())?;
//!
//! let facts = Facts::of(&mesh);
//! assert!(facts.is_closed() && facts.is_right_side_out());
//! assert!((facts.volume - 1.0 / 6.0).abs() < 1e-9);
//!
//! // The bounding box's longest side becomes 10 units. A finger of radius 0.15 that comes from above meets the face at
//! // the bottom of the box, or the slope before it.
//! let scene = Scene::new(&mesh, 10.0)?;
//! let time = scene.first_contact(DVec3::new(-4.0, -4.0, 9.0), DVec3::NEG_Z, 0.15);
//! assert!(time.is_some_and(|time| time > 4.0 && time < 14.0));
//! # Ok(())
//! # }
//! ```

#[cfg(feature = "objects")]
pub mod builtin;
#[cfg(not(feature = "objects"))]
#[path = "no_builtin.rs"]
mod builtin;
mod collada;
mod exact;
pub mod facts;
pub mod file;
mod gltf;
pub mod obj;
mod placed;
pub mod placements;
mod ply;
mod polygon;
pub mod source;
mod stl;
mod text;
mod triangles;
mod unread;
mod weld;
mod words;

pub use triangles::Mesh;
pub(crate) use triangles::no_extent;

/// The name of the object of many different shapes, and of a model's background column.
pub const BACKGROUND: &str = "background";

/// An object to recognize: one class of a model. It has a name and one or more meshes, its instances: the cups that are
/// all to be recognized as a cup.
#[derive(Clone, Debug)]
pub struct Object {
    /// Its name: the label of its touches and of its output in a model, and the stem of its files.
    pub name: String,
    /// Number of millimeters in a unit of its meshes, if known: needed to touch it at its true size.
    pub millimeters: Option<f64>,
    /// The step in which the file of its coarsest mesh rounds coordinates, in units of its meshes; 0 if that is not known.
    pub step: f64,
    /// Weights of its placements on a table that replace those of their solid angles, by name: a placement that is not among
    /// them is left out. Empty: solid angles.
    pub placement_weights: Vec<(String, f64)>,
    /// Notes for the user on how it was found and read: other files of its name that were passed over, a mesh far
    /// from the origin.
    pub notes: Vec<String>,
    first: Instance,
    others: Vec<Instance>,
}

/// One mesh of an object.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Name that distinguishes it from the object's other instances.
    pub name: String,
    /// Its mesh, in the units of its file.
    pub mesh: Mesh,
}

impl Object {
    /// An object with one mesh of unknown units. Its instance has its name.
    pub fn new(name: impl Into<String>, mesh: Mesh) -> Self {
        let name = name.into();
        let first = Instance { name: name.clone(), mesh };
        let (placement_weights, notes, others) = (Vec::new(), Vec::new(), Vec::new());
        Self { name, millimeters: None, step: 0.0, placement_weights, notes, first, others }
    }

    /// An object with several meshes of unknown units; none if there is no instance.
    pub fn of_instances(name: impl Into<String>, instances: Vec<Instance>) -> Option<Self> {
        let mut instances = instances.into_iter();
        let first = instances.next()?;
        Some(Self {
            name: name.into(),
            millimeters: None,
            step: 0.0,
            placement_weights: Vec::new(),
            notes: Vec::new(),
            first,
            others: instances.collect(),
        })
    }

    /// Its mesh, or that of its first instance.
    pub fn mesh(&self) -> &Mesh {
        &self.first.mesh
    }

    /// Its only instance, or the first of several.
    pub fn first(&self) -> &Instance {
        &self.first
    }

    /// Its instances: at least one.
    pub fn instances(&self) -> impl ExactSizeIterator<Item = &Instance> + Clone {
        let count = 1 + self.others.len();
        (0..count).map(|index| if index == 0 { &self.first } else { &self.others[index - 1] })
    }

    /// Facts about an instance: about its mesh, and the step in which its file rounds it.
    pub fn facts(&self, instance: &Instance) -> facts::Facts {
        facts::Facts { step: self.step, ..facts::Facts::of(&instance.mesh) }
    }

    /// The longest side of an instance's bounding box in millimeters, where its units are known.
    pub fn true_length(&self, instance: &Instance) -> Option<f64> {
        self.true_size(instance).map(|size| size.max_element())
    }

    /// The sides of an instance's bounding box in millimeters, where its units are known.
    pub fn true_size(&self, instance: &Instance) -> Option<glam::DVec3> {
        let [low, high] = instance.mesh.bounds();
        Some((high - low).as_dvec3() * self.millimeters?)
    }
}
