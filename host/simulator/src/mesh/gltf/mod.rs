//! glTF 2.0, as JSON or as GLB: the meshes of its scene, placed by their nodes.
//!
//! `serde_json` reads the document; every accessor is checked and read here. Coordinates are taken as they stand: glTF
//! says that y is up, but files disagree. What would change the surface and is not read (Draco, meshopt, quantization,
//! skins, morphs) is rejected by name; materials, textures, cameras and animations are skipped. Nodes that are not visible are
//! left out with all below them, and a note says so.

mod accessor;
mod container;
mod document;
mod extension;

use super::exact::Moved;
use super::placed::Placed;
use super::triangles::too_many_vertices;
use super::unread::unsupported;
use super::words::no_such_vertex;
use crate::error::{Error, Place, Result};
use accessor::Data;
use document::{Document, Node, Primitive};
use glam::{DAffine3, DMat4, DQuat, DVec3, Vec3};
use std::collections::HashMap;
use std::path::Path;

/// Reads the mesh of a glTF file, with remarks on the file; errors name `path`. Files that it names are looked for in `folder`.
///
/// # Errors
/// If the JSON is invalid, a number that it states is impossible, a file beside it cannot be read, it uses an unsupported
/// feature, or no face is left.
pub(super) fn parse(bytes: &[u8], path: &Path, folder: Option<&Path>) -> Result<(Moved, Vec<String>)> {
    let parts = container::parts(bytes, path)?;
    let document: Document = serde_json::from_slice(parts.json).map_err(|error| {
        if serde_json::from_slice::<document::Version1>(parts.json).is_ok() {
            return other_version("1.0").at(Place::file(path));
        }
        let mut reason = error.to_string();
        reason.truncate(reason.rfind(" at line ").unwrap_or(reason.len()));
        let place = match parts.start {
            start @ 4.. => Place::byte(path, start + offset(parts.json, error.line(), error.column())),
            _ => Place::line(path, error.line().max(1) as u64),
        };
        accessor::damaged(reason.chars().take(200).collect()).at(place)
    })?;
    let here = |error: Error| error.at(Place::file(path));
    check(&document).map_err(here)?;
    let buffers = container::buffers(&document, &parts, path, folder)?;
    let length = bytes.len() as u64 + buffers.iter().flatten().map(|buffer| buffer.len() as u64).sum::<u64>();
    let scene = Scene {
        data: Data { document: &document, buffers, most_zeros: length },
        document: &document,
        placed: Placed::new(length),
        hidden: 0,
    };
    let (moved, hidden) = scene.mesh().map_err(here)?;
    let nodes = if hidden == 1 { "1 node" } else { &format!("{hidden} nodes") };
    let note = format!("{} hides {nodes} (KHR_node_visibility), left out with all below", path.display());
    Ok((moved, if hidden > 0 { vec![note] } else { Vec::new() }))
}

/// Something is wrong with a file as a whole.
fn damaged(path: &Path, what: String) -> Error {
    accessor::damaged(what).at(Place::file(path))
}

/// Offset of a line and a column (both from 1) in a text.
fn offset(text: &[u8], line: usize, column: usize) -> u64 {
    let before: usize = text.split_inclusive(|&byte| byte == b'\n').take(line.saturating_sub(1)).map(<[u8]>::len).sum();
    (before + column.saturating_sub(1)).min(text.len()) as u64
}

fn check(document: &Document) -> Result<()> {
    // A file of a later 2.x states in `minVersion` which version a reader must know; this one knows 2.0.
    let version = document.asset.min_version.as_ref().unwrap_or(&document.asset.version);
    let is_known = match document.asset.min_version {
        Some(_) => version == "2.0",
        None => version.split('.').next() == Some("2"),
    };
    if !is_known {
        return Err(other_version(version));
    }
    extension::check_required(&document.extensions_required)
}

/// The refusal of a version that is not read.
fn other_version(version: impl std::fmt::Display) -> Error {
    let what = format!("glTF of version {}", version.to_string().chars().take(20).collect::<String>());
    unsupported(what, "Export it as glTF 2.0")
}

struct Scene<'a> {
    data: Data<'a>,
    document: &'a Document,
    placed: Placed,
    /// Number of nodes that are not visible.
    hidden: usize,
}

impl Scene<'_> {
    /// The mesh of the scene, and the number of nodes that are not visible.
    fn mesh(mut self) -> Result<(Moved, usize)> {
        let nodes = &self.document.nodes;
        let mut waiting: Vec<(u32, DAffine3)> = Vec::new();
        let add = |nodes: &[u32], transform: &DAffine3, waiting: &mut Vec<_>| {
            waiting.extend(nodes.iter().rev().map(|&node| (node, *transform)));
        };
        match (self.document.scene, self.document.scenes.first()) {
            (Some(index), _) => {
                let scene = self.document.scenes.get(index as usize);
                let scene = scene.ok_or_else(|| accessor::damaged(format!("scenes[{index}] is missing")))?;
                add(&scene.nodes, &DAffine3::IDENTITY, &mut waiting);
            }
            (None, Some(scene)) => add(&scene.nodes, &DAffine3::IDENTITY, &mut waiting),
            // Without scenes, all nodes without a parent; without nodes, all meshes.
            (None, None) => {
                let mut is_root = vec![true; nodes.len()];
                for &child in nodes.iter().flat_map(|node| &node.children) {
                    if let Some(is_root) = is_root.get_mut(child as usize) {
                        *is_root = false;
                    }
                }
                let roots: Vec<u32> =
                    (0..).zip(is_root).filter(|(_, is_root)| *is_root).map(|(node, _)| node).collect();
                add(&roots, &DAffine3::IDENTITY, &mut waiting);
            }
        }
        if nodes.is_empty() {
            for mesh in 0..self.document.meshes.len() {
                self.place(mesh as u32, &DAffine3::IDENTITY)?;
            }
        }
        // Nodes are a forest: each is met once at most, so this ends.
        let mut met = vec![false; nodes.len()];
        while let Some((index, parent)) = waiting.pop() {
            let node = nodes.get(index as usize);
            let node = node.ok_or_else(|| accessor::damaged(format!("nodes[{index}] is missing")))?;
            match met.get_mut(index as usize) {
                Some(met) if !*met => *met = true,
                _ => return Err(accessor::damaged(format!("nodes[{index}] has two parents, or is above itself"))),
            }
            let visibility = node.extensions.as_ref().and_then(|extensions| extensions.visibility.as_ref());
            if visibility.is_some_and(|visibility| !visibility.visible) {
                self.hidden += 1;
                continue;
            }
            let transform = parent * transform(node, index)?;
            if let Some(mesh) = node.mesh {
                self.check_node(node)?;
                self.place(mesh, &transform)?;
            }
            add(&node.children, &transform, &mut waiting);
        }
        Ok((self.placed.into_mesh(), self.hidden))
    }

    /// Rejects features that would place or bend a node's mesh in another way than its transform.
    fn check_node(&self, node: &Node) -> Result<()> {
        if node.extensions.as_ref().is_some_and(|extensions| extensions.instancing.is_some()) {
            return Err(extension::unsupported("EXT_mesh_gpu_instancing"));
        }
        if node.skin.is_some() {
            let what = "a skin, which bends the mesh,";
            return Err(unsupported(what, "Apply the skin to the mesh, then export it"));
        }
        is_still(&node.weights)
    }

    /// Places the mesh of this number.
    fn place(&mut self, index: u32, transform: &DAffine3) -> Result<()> {
        let mesh = self.document.meshes.get(index as usize);
        let mesh = mesh.ok_or_else(|| accessor::damaged(format!("meshes[{index}] is missing")))?;
        is_still(&mesh.weights)?;
        // Primitives that share their positions share vertices.
        let mut parts: Vec<Part> = Vec::new();
        let mut known: HashMap<u32, usize> = HashMap::new();
        // How many vertices and triangles wait in `parts`.
        let mut pending = (0, 0);
        for primitive in &mesh.primitives {
            let Some(faces) = Faces::of(primitive.mode)? else { continue };
            let Some(positions) = primitive.attributes.position else {
                return Err(without_positions(index, primitive));
            };
            let part = match known.get(&positions) {
                Some(&part) => part,
                None => {
                    let vertices = self.data.positions(positions, &primitive.extensions)?;
                    pending.0 += vertices.len();
                    parts.push((vertices, Vec::new()));
                    known.insert(positions, parts.len() - 1);
                    parts.len() - 1
                }
            };
            let Some((vertices, triangles)) = parts.get_mut(part) else { continue };
            let count = vertices.len() as u64;
            let indices = match primitive.indices {
                Some(accessor) => self.data.indices(accessor, &primitive.extensions)?,
                None => (0..u32::try_from(count).map_err(|_| too_many_vertices())?).collect(),
            };
            if let Some(&wrong) = indices.iter().find(|&&index| u64::from(index) >= count) {
                return Err(no_such_vertex(wrong, count));
            }
            pending.1 += faces.count(indices.len());
            self.placed.check(pending.0, pending.1)?;
            faces.append(&indices, triangles).ok_or_else(|| {
                accessor::damaged(format!(
                    "meshes[{index}] has {} corners, which is not a multiple of 3",
                    indices.len()
                ))
            })?;
        }
        parts.into_iter().try_for_each(|(vertices, triangles)| {
            self.placed.note_f32(&vertices, transform);
            let places = vertices.into_iter().map(|vertex| Vec3::from(vertex).as_dvec3());
            self.placed.place(places, &triangles, transform)
        })
    }
}

/// Vertices and the triangles among them.
type Part = (Vec<[f32; 3]>, Vec<[u32; 3]>);

/// A primitive without positions has them in an extension, or is damaged.
fn without_positions(mesh: u32, primitive: &Primitive) -> Error {
    let mut extensions = primitive.extensions.iter().flat_map(|extensions| extensions.keys());
    match extensions.find(|name| extension::COMPRESSED.contains(&name.as_str())) {
        Some(name) => extension::unsupported(name),
        None => accessor::damaged(format!("meshes[{mesh}] has a primitive without positions")),
    }
}

/// Refuses morphs that are not at rest.
fn is_still(weights: &Option<Vec<f64>>) -> Result<()> {
    if weights.iter().flatten().all(|&weight| weight == 0.0) {
        return Ok(());
    }
    let what = "a morph with weights, which bends the mesh,";
    Err(unsupported(what, "Apply the morph to the mesh, then export it"))
}

/// Rule that turns indices into triangles.
enum Faces {
    Each,
    Strip,
    Fan,
}

impl Faces {
    /// Pattern of a primitive's mode; none for points and lines, which are no surface.
    fn of(mode: Option<u32>) -> Result<Option<Self>> {
        match mode {
            None | Some(4) => Ok(Some(Self::Each)),
            Some(5) => Ok(Some(Self::Strip)),
            Some(6) => Ok(Some(Self::Fan)),
            Some(0..4) => Ok(None),
            Some(other) => Err(accessor::damaged(format!("{other} is not a primitive mode"))),
        }
    }

    /// Number of triangles of this many indices.
    fn count(&self, indices: usize) -> usize {
        match self {
            Self::Each => indices / 3,
            Self::Strip | Self::Fan => indices.saturating_sub(2),
        }
    }

    /// Appends the triangles; none if their corners are not whole.
    fn append(&self, indices: &[u32], triangles: &mut Vec<[u32; 3]>) -> Option<()> {
        match self {
            Self::Each => {
                let (whole, rest) = indices.as_chunks();
                triangles.reserve_exact(whole.len());
                triangles.extend_from_slice(whole);
                return rest.is_empty().then_some(());
            }
            Self::Strip => triangles.extend(
                indices.array_windows().enumerate().map(
                    |(number, &[a, b, c])| {
                        if number % 2 == 1 { [b, a, c] } else { [a, b, c] }
                    },
                ),
            ),
            Self::Fan => {
                let others = indices.get(1..).unwrap_or_default();
                triangles.extend(others.array_windows().filter_map(|&[b, c]| Some([*indices.first()?, b, c])));
            }
        }
        Some(())
    }
}

/// Transform of a node's mesh, within its parent.
fn transform(node: &Node, index: u32) -> Result<DAffine3> {
    if let Some(matrix) = &node.matrix {
        let matrix = DMat4::from_cols_array(matrix);
        if matrix.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
            return Err(accessor::damaged(format!("nodes[{index}] has a matrix whose last row is not 0 0 0 1")));
        }
        return Ok(DAffine3::from_mat4(matrix));
    }
    let translation = node.translation.as_deref().map_or(DVec3::ZERO, |&vector| vector.into());
    let scale = node.scale.as_deref().map_or(DVec3::ONE, |&vector| vector.into());
    let rotation = match node.rotation.as_deref() {
        None => DQuat::IDENTITY,
        Some(&rotation) => {
            let rotation = DQuat::from_array(rotation);
            // Exporters round, but a quaternion far from length 1 would scale the mesh.
            if !(0.9..1.1).contains(&rotation.length()) {
                return Err(accessor::damaged(format!("nodes[{index}] has a rotation of a length other than 1")));
            }
            if rotation == DQuat::IDENTITY { rotation } else { rotation.normalize() }
        }
    };
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation, translation))
}
