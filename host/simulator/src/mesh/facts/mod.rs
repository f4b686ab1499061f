//! Facts about a mesh: is it closed, is it right side out, how large is it.
//!
//! The simulator touches any mesh, from both sides. But through a hole, a finger gets where no real one could, and an
//! inside-out mesh is often a sign of a broken export: whoever captures from such a mesh should know.

mod gaps;
mod parts;

pub(crate) use parts::Part;

use super::exact::FINE;
use crate::mesh::Mesh;
use glam::Vec3;

/// Facts about a mesh, in the units of its file. Vertices closer than a billionth of its size count as one.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Facts {
    /// Number of triangles.
    pub triangles: usize,
    /// The lowest corner of its bounding box.
    pub low: Vec3,
    /// The highest corner of its bounding box.
    pub high: Vec3,
    /// Open edges: those that belong to one triangle only.
    pub open_edges: usize,
    /// Edges whose two triangles face opposite sides.
    pub contrary_edges: usize,
    /// Edges that three or more triangles share.
    pub branching_edges: usize,
    /// The width of the widest gap that open edges leave, in the units of the file; 0 if there is none.
    pub widest_gap: f64,
    /// The volume that it encloses, in cubic units of its file: negative if it is inside out, meaningless if it is open.
    pub volume: f64,
    /// Its parts, the one with most triangles first.
    pub parts: Vec<Part>,
    /// The step in which its file rounds coordinates; 0 if that is not known.
    pub step: f64,
}

/// The sizes in millimeters that an object for a finger may have: a grain of rice to a car.
const SIZES: std::ops::RangeInclusive<f64> = 1.0..=10_000.0;

impl Facts {
    /// The facts about `mesh`: two seconds or so for a million triangles.
    ///
    /// # Panics
    /// If a triangle names a vertex that the mesh does not have. Meshes that were read or built in never do.
    pub fn of(mesh: &Mesh) -> Self {
        let welded = mesh.welded();
        let [low, high] = mesh.bounds();
        let (parts, branching_edges) = parts::parts(&welded);
        Self {
            triangles: mesh.triangles.len(),
            low,
            high,
            open_edges: parts.iter().map(|part| part.open_edges).sum(),
            contrary_edges: parts.iter().map(|part| part.contrary_edges).sum(),
            branching_edges,
            widest_gap: gaps::widest(&welded),
            volume: parts.iter().map(|part| part.volume).sum(),
            parts,
            step: 0.0,
        }
    }

    /// True if each edge belongs to exactly two triangles.
    pub fn is_closed(&self) -> bool {
        self.open_edges == 0 && self.branching_edges == 0
    }

    /// True if it is closed and each triangle is anticlockwise when seen from outside, in every part.
    pub fn is_right_side_out(&self) -> bool {
        self.is_closed() && self.contrary_edges == 0 && self.volume > 0.0 && self.inside_out().next().is_none()
    }

    /// The parts that are inside out.
    pub fn inside_out(&self) -> impl Iterator<Item = &Part> {
        self.parts.iter().filter(|part| part.is_inside_out)
    }

    /// Says in words if the mesh is closed: "yes", or its open parts.
    pub fn closed(&self) -> String {
        match (self.open_edges, self.branching_edges) {
            (0, 0) => "yes".into(),
            (0, branching) => format!("yes, but more than two triangles meet at {}", edges(branching)),
            (open, 0) => format!("no: {}", counted(open, "open edge")),
            (open, branching) => {
                format!("no: {}, and more than two triangles at {branching}", counted(open, "open edge"))
            }
        }
    }

    /// Says in words if the mesh is right side out: "yes", or the parts that are not.
    pub fn side(&self) -> String {
        let turned = self.inside_out().count();
        if turned > 0 && turned == self.parts.len() {
            "no: inside out".into()
        } else if turned > 0 {
            format!("no: {turned} of {} are inside out", counted(self.parts.len(), "part"))
        } else if self.contrary_edges > 0 {
            format!("no: at {} the two triangles face opposite sides", edges(self.contrary_edges))
        } else if !self.is_closed() {
            "unknown for an open surface: look for orange".into()
        } else if self.volume > 0.0 {
            "yes".into()
        } else {
            "unknown: it encloses nothing".into()
        }
    }

    /// Warnings before touching the mesh, as sentences: that it is open, inside out in all or some of its parts, not a
    /// manifold, of a size that cannot be, or rounded by its file. `millimeters` is how many its unit is, if that is known. None
    /// if nothing is wrong.
    pub fn complaints(&self, millimeters: Option<f64>) -> Vec<String> {
        let rounded = self.rounded().map(|why| format!("The mesh is rounded: {why}."));
        let sentences =
            [self.open(), self.turned(), self.contrary(), self.branching(), self.size(millimeters), rounded];
        sentences.into_iter().flatten().collect()
    }

    /// Says if the mesh can be touched as it is by fingers of a diameter (in the units of its file), in words:
    /// "usable", or "repair first" and why. What is wrong and makes no difference to touches is no reason.
    pub fn verdict(&self, diameter: f64) -> String {
        if let Some(why) = self.rounded() {
            return format!("repair first: {why}");
        }
        match (self.widest_gap >= diameter, self.is_right_side_out()) {
            (true, _) => format!(
                "repair first: a gap is {} wide and a finger {}, so it reaches inside where a real one may find a surface",
                short(self.widest_gap),
                short(diameter)
            ),
            (false, true) => "usable".into(),
            (false, false) => {
                "usable: fingers feel a surface from both sides, and there is no gap that one of them fits through"
                    .into()
            }
        }
    }

    /// The coarse steps in which the file rounds the mesh, in words; none if they are fine.
    fn rounded(&self) -> Option<String> {
        rounded(self.step, f64::from((self.high - self.low).max_element()))
    }

    fn open(&self) -> Option<String> {
        let belong = match self.open_edges {
            0 => return None,
            1 => "1 edge belongs".to_owned(),
            open => format!("{open} edges belong"),
        };
        Some(format!("The mesh is open: {belong} to one triangle only, so fingers may reach through the gaps."))
    }

    fn turned(&self) -> Option<String> {
        match (self.inside_out().count(), self.parts.len()) {
            (0, _) => None,
            (count, all) if count == all => {
                Some("The mesh is inside out: reverse the order of the vertices in its faces.".into())
            }
            (count, all) => Some(format!(
                "The mesh is partly inside out: {count} of {all} parts. Reverse the vertices of those faces."
            )),
        }
    }

    fn contrary(&self) -> Option<String> {
        let edges = edges(self.contrary_edges);
        (self.contrary_edges > 0)
            .then(|| format!("The mesh is partly inside out: at {edges}, the two triangles face opposite sides."))
    }

    fn branching(&self) -> Option<String> {
        let edges = edges(self.branching_edges);
        (self.branching_edges > 0)
            .then(|| format!("The mesh is not a manifold: more than two triangles meet at {edges}."))
    }

    fn size(&self, millimeters: Option<f64>) -> Option<String> {
        let length = f64::from((self.high - self.low).max_element());
        let shown = short(length);
        match millimeters {
            Some(unit) if SIZES.contains(&(length * unit)) => None,
            Some(unit) => Some(format!(
                "The mesh has an implausible size: its longest side is {} mm in its unit.",
                short(length * unit)
            )),
            None if SIZES.contains(&length) || SIZES.contains(&(length * 1_000.0)) => None,
            None => Some(format!(
                "The mesh has an implausible size, in meters as well as in millimeters: its longest side is {shown}."
            )),
        }
    }
}

/// The fault of coordinates in steps of `step`, for a mesh whose longest side is `side`; none if they are fine.
pub(super) fn rounded(step: f64, side: f64) -> Option<String> {
    (step > FINE * side).then(|| {
        format!(
            "its file gives coordinates in steps of {}, and its longest side is {}; export it near the origin, or with more digits",
            short(step),
            short(side)
        )
    })
}

fn edges(count: usize) -> String {
    counted(count, "edge")
}

fn counted(count: usize, name: &str) -> String {
    if count == 1 { format!("1 {name}") } else { format!("{count} {name}s") }
}

/// The sides of a box in words, with about three significant digits: "90 × 80.5 × 90".
pub fn sides(size: glam::DVec3) -> String {
    let side = |side: f64| {
        let text = short(side);
        if text.contains('.') && !text.contains('e') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    };
    size.to_array().map(side).join(" × ")
}

/// A number with about three significant digits.
pub(super) fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        1e-3..1e6 => {
            let digits = (2.0 - libm::floor(libm::log10(value.abs()))).max(0.0) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.2e}"),
    }
}
