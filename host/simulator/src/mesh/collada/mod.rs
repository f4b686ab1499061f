//! COLLADA: the geometries of a scene, placed by its nodes.
//!
//! `roxmltree` parses. Nodes may be nested, and instances of other nodes. The unit is not applied, but stated with the
//! mesh; the mesh is turned so that z is up. Transforms of nodes without geometry are not looked at. What would change the surface and is
//! not read (skins, morphs, splines, skew, polygons with holes) is rejected by name; materials, lights, cameras, animations
//! and physics are skipped.

mod geometry;
mod numbers;
mod transform;

use super::exact::Moved;
use super::placed::Placed;
use super::words::shown;
use super::{unread, words};
use crate::error::{Error, Place, Result};
use geometry::Geometry;
use glam::{DAffine3, DMat3, DVec3};
use roxmltree::{Document, Node, NodeId};
use std::collections::HashMap;
use std::fmt::Display;
use std::path::Path;

/// Reads the mesh of a COLLADA file, how many millimeters its unit is, if it says, and remarks on the file; errors name `path`.
///
/// # Errors
/// If the XML is malformed, a number is damaged, a reference is dangling or circular, the file uses an unsupported feature, or no
/// face is left.
pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<(Moved, Option<f64>, Vec<String>)> {
    let text = text(bytes, path)?;
    let here = |error: Error| error.at(Place::file(path));
    let document = Document::parse(&text).map_err(|error| {
        let what = match &error {
            roxmltree::Error::DtdDetected => "it has a document type declaration, which is not read".into(),
            error => {
                let text = error.to_string();
                text.rfind(" at ").map_or(text.clone(), |end| text.chars().take(end.min(200)).collect())
            }
        };
        let place = match error.pos().row {
            0 => Place::file(path),
            row => Place::line(path, row.into()),
        };
        damaged(what).at(place)
    })?;
    let root = document.root_element();
    if !named(root, "COLLADA") {
        let name: String = root.tag_name().name().chars().take(40).collect();
        if ["robot", "sdf", "mujoco"].contains(&name.as_str()) {
            let what = format!("a description of a robot or a world (<{name}>)");
            let instead = "Give the meshes that it names, with --true-size and the unit that its scale makes of them";
            return Err(here(unread::unsupported(what, instead)));
        }
        return Err(here(damaged(format!("its root is <{name}>, not <COLLADA>"))));
    }
    let mut scene = Scene::new(&document, bytes.len() as u64);
    let millimeters = scene.fill(root).and_then(|()| millimeters(root)).map_err(|Wrong { node, line, problem }| {
        let position = document.get_node(node).map_or(0, |node| node.range().start);
        let row = u64::from(document.text_pos_at(position).row);
        problem.at(Place::line(path, row + line))
    })?;
    let note = || format!("{} states no upward axis: y is up, by the standard of COLLADA", path.display());
    let notes = if stated(root, "up_axis").is_none() { vec![note()] } else { Vec::new() };
    Ok((scene.placed.into_mesh(), millimeters, notes))
}

/// The file's text. Names in it may be in Latin-1, if it says so: numbers are ASCII in either.
fn text(bytes: &[u8], path: &Path) -> Result<String> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.to_owned()),
        Err(error) => {
            let declaration = bytes.split(|&byte| byte == b'>').next().unwrap_or_default().to_ascii_lowercase();
            let names = |name: &[u8]| declaration.windows(name.len()).any(|part| part == name);
            if names(b"iso-8859-1") || names(b"latin1") || names(b"windows-1252") {
                return Ok(bytes.iter().map(|&byte| char::from(byte)).collect());
            }
            let what = "it is not text in UTF-8".into();
            Err(damaged(what).at(Place::byte(path, error.valid_up_to() as u64)))
        }
    }
}

fn damaged(what: String) -> Error {
    words::damaged("COLLADA", what)
}

/// True if an element has this name, in whichever namespace: versions differ in it.
fn named(node: Node<'_, '_>, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name
}

/// The child elements of this name.
fn children<'a, 'input>(node: Node<'a, 'input>, name: &'a str) -> impl Iterator<Item = Node<'a, 'input>> {
    node.children().filter(move |&child| named(child, name))
}

/// Element in which the file describes itself as a whole.
fn stated<'a, 'input>(root: Node<'a, 'input>, name: &'a str) -> Option<Node<'a, 'input>> {
    children(root, "asset").flat_map(|asset| children(asset, name)).next()
}

/// Number of millimeters in the unit, where the file states it.
fn millimeters(root: Node<'_, '_>) -> Result<Option<f64>, Wrong> {
    let Some(unit) = stated(root, "unit") else { return Ok(None) };
    let text = unit.attribute("meter").unwrap_or("1.0").trim();
    match text.parse::<f64>() {
        Ok(meters) if meters.is_finite() && meters > 0.0 => Ok(Some(1_000.0 * meters)),
        _ => Err(wrong(unit, damaged(format!("its unit is {:?} meters", shown(text.as_bytes()))))),
    }
}

/// The turn that makes z the upward axis. Where the file does not say which one is, y is.
fn upright(root: Node<'_, '_>) -> Result<DAffine3, Wrong> {
    let axis = stated(root, "up_axis");
    let turn = match axis.map_or("Y_UP", |axis| axis.text().unwrap_or_default().trim()) {
        "X_UP" => DMat3::from_cols(DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y),
        "Y_UP" => DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y),
        "Z_UP" => DMat3::IDENTITY,
        other => {
            let what = format!("{:?} is not an up axis", shown(other.as_bytes()));
            return Err(wrong(axis.unwrap_or(root), damaged(what)));
        }
    };
    Ok(DAffine3::from_mat3(turn))
}

/// True if an element is an instance of something that may have a surface.
fn is_instance(node: Node<'_, '_>) -> bool {
    ["instance_node", "instance_geometry", "instance_controller"].iter().any(|name| named(node, name))
}

/// Something is wrong with an element.
#[derive(Clone, Debug)]
struct Wrong {
    node: NodeId,
    /// Number of lines after the element's first.
    line: u64,
    problem: Error,
}

/// Blames a problem on an element.
fn wrong(node: Node<'_, '_>, problem: Error) -> Wrong {
    Wrong { node: node.id(), line: 0, problem }
}

fn unsupported(node: Node<'_, '_>, what: impl Display, instead: &str) -> Wrong {
    wrong(node, unread::unsupported(what, instead))
}

struct Scene<'a, 'input> {
    /// Elements that others refer to, by their ids.
    ids: HashMap<&'a str, Node<'a, 'input>>,
    geometries: HashMap<NodeId, Geometry>,
    placed: Placed,
    /// Number of further nodes that may be placed: instances of instances multiply, and a circle of them has no end.
    steps: u64,
    /// Number of further numbers that may be read: several geometries may share one list.
    numbers: u64,
}

impl<'a, 'input> Scene<'a, 'input> {
    fn new(document: &'a Document<'input>, length: u64) -> Self {
        let with_ids = document.descendants().filter(|node| node.is_element());
        let mut ids = HashMap::new();
        for node in with_ids {
            // The first of several: ids are unique.
            if let Some(id) = node.attribute("id") {
                ids.entry(id).or_insert(node);
            }
        }
        Self {
            ids,
            geometries: HashMap::new(),
            placed: Placed::new(length),
            steps: (1 << 12) + length / 4,
            numbers: (1 << 12) + 2 * length,
        }
    }

    /// The element that an attribute refers to.
    fn find(&self, node: Node<'a, 'input>, attribute: &str, name: &str) -> Result<Node<'a, 'input>, Wrong> {
        let url = node.attribute(attribute).unwrap_or_default();
        let shown: String = url.chars().take(60).collect();
        let Some(id) = url.strip_prefix('#') else {
            if url.is_empty() {
                return Err(wrong(node, damaged(format!("<{}> has no {attribute}", node.tag_name().name()))));
            }
            return Err(unsupported(node, format!("the part in another file, {shown:?},"), "Export it as one file"));
        };
        let found = self.ids.get(id).copied().filter(|&found| named(found, name));
        found.ok_or_else(|| wrong(node, damaged(format!("there is no <{name}> with the id {shown:?}"))))
    }

    /// Places the visual scene that the file names; or its first one; or, where it has none, each geometry once.
    fn fill(&mut self, root: Node<'a, 'input>) -> Result<(), Wrong> {
        let turn = upright(root)?;
        let instance = children(root, "scene").flat_map(|scene| children(scene, "instance_visual_scene")).next();
        let named_scene = instance.map(|instance| self.find(instance, "url", "visual_scene")).transpose()?;
        let in_libraries =
            |library: &'a str, name: &'a str| children(root, library).flat_map(move |library| children(library, name));
        if let Some(scene) = named_scene.or_else(|| in_libraries("library_visual_scenes", "visual_scene").next()) {
            return self.place_nodes(scene, turn);
        }
        in_libraries("library_geometries", "geometry").try_for_each(|geometry| self.place(geometry, geometry, &turn))
    }

    /// Places the nodes of a visual scene, in the order of the file.
    fn place_nodes(&mut self, scene: Node<'a, 'input>, turn: DAffine3) -> Result<(), Wrong> {
        let mut waiting = Vec::new();
        self.wait(scene, Ok(turn), &mut waiting)?;
        // A wrong transform counts where it places a geometry: cameras and lights have odd ones.
        let inner = |outer: Result<DAffine3, Wrong>, node| Ok(outer? * transform::of(node)?);
        while let Some((child, transform)) = waiting.pop() {
            match child.tag_name().name() {
                "node" => self.wait(child, inner(transform, child), &mut waiting)?,
                "instance_node" => {
                    let node = self.find(child, "url", "node")?;
                    self.wait(node, inner(transform, node), &mut waiting)?;
                }
                "instance_geometry" => {
                    let geometry = self.find(child, "url", "geometry")?;
                    self.place(child, geometry, &transform?)?;
                }
                "instance_controller" => {
                    let controller = self.find(child, "url", "controller")?;
                    let kind = if children(controller, "morph").next().is_some() { "a morph" } else { "a skin" };
                    let instead = "Apply it to the mesh, then export the mesh";
                    return Err(unsupported(child, format!("{kind} (<controller>), which bends the mesh,"), instead));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Pushes the content of a node onto the stack, the first on top.
    fn wait(
        &mut self,
        parent: Node<'a, 'input>,
        transform: Result<DAffine3, Wrong>,
        waiting: &mut Vec<(Node<'a, 'input>, Result<DAffine3, Wrong>)>,
    ) -> Result<(), Wrong> {
        let from = waiting.len();
        for child in parent.children().filter(|&child| named(child, "node") || is_instance(child)) {
            self.steps = self.steps.checked_sub(1).ok_or_else(|| {
                wrong(child, damaged("its nodes are instances of each other in a circle, or far too many".into()))
            })?;
            waiting.push((child, transform.clone()));
        }
        waiting.get_mut(from..).unwrap_or_default().reverse();
        Ok(())
    }

    fn place(
        &mut self,
        instance: Node<'a, 'input>,
        geometry: Node<'a, 'input>,
        transform: &DAffine3,
    ) -> Result<(), Wrong> {
        if !self.geometries.contains_key(&geometry.id()) {
            let mut left = self.numbers;
            let read = Geometry::read(geometry, &mut left, &|node, attribute, name| self.find(node, attribute, name))?;
            self.numbers = left;
            self.geometries.insert(geometry.id(), read);
        }
        let Some(Geometry { vertices, triangles, .. }) = self.geometries.get(&geometry.id()) else { return Ok(()) };
        let placed = self.placed.place(vertices.iter().copied(), triangles, transform);
        placed.map_err(|problem| wrong(instance, problem))
    }
}
