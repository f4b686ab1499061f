//! A scene in three dimensions, for a page: a mesh that can be turned, its bounding box, and straight lines, some with a
//! ball at their end.
//!
//! [three.js](https://threejs.org) draws it, from inside the page. `stage.js` sets it up, for any page; `scene.js` offers
//! the page's own script one function, `drawScene(data, { hover, choose })`: it draws what [`Scene::data`] wrote, calls
//! back with the group of the line under the pointer, and returns `show`, which takes what is visible.

mod simplified;

pub(crate) use simplified::SimplifiedMesh;

use super::html;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

#[cfg(test)]
pub(crate) use simplified::MOST_TRIANGLES;

/// The styles that the scene needs. Its colors are the page's custom properties: `ground` behind it, `back` for the
/// inside of the mesh, `missed` for the bounding box, and what [`Line::color`] names.
pub(crate) const STYLE: &str = include_str!("scene.css");

/// The library that draws.
pub(crate) const LIBRARY: &str = include_str!("../../../assets/three/three.min.js");

/// A scene to draw.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    /// The mesh.
    pub(crate) mesh: SimplifiedMesh,
    /// The least corner of the bounding box, in units.
    pub(crate) low: [f64; 3],
    /// The greatest.
    pub(crate) high: [f64; 3],
    /// Radius of the balls.
    pub(crate) radius: f64,
    /// The lines.
    pub(crate) lines: Vec<Line>,
}

/// A straight line.
#[derive(Clone, Debug, serde::Serialize)]
pub(crate) struct Line {
    /// Group of lines that are shown, pointed at and chosen as one.
    pub(crate) group: usize,
    /// Start of the line.
    pub(crate) start: [f64; 3],
    /// End of the line.
    pub(crate) end: [f64; 3],
    /// The style's custom property that holds its color.
    pub(crate) color: &'static str,
    /// True if there is a ball at its end.
    pub(crate) ball: bool,
}

impl Scene {
    /// The scene as data for `drawScene`, with other fields for the page's own script.
    pub(crate) fn data(&self, own: serde_json::Map<String, serde_json::Value>) -> serde_json::Value {
        let mesh = &self.mesh;
        let mut data = serde_json::json!({
            "radius": self.radius,
            "low": self.low,
            "high": self.high,
            "step": mesh.step,
            "origin": mesh.origin.to_array(),
            "wide": mesh.is_wide(),
            "positions": STANDARD.encode(mesh.position_bytes()),
            "indices": STANDARD.encode(mesh.index_bytes()),
            "lines": self.lines,
        });
        if let Some(fields) = data.as_object_mut() {
            fields.extend(own);
        }
        data
    }
}

/// Frame that the scene is drawn in, with a caption.
pub(crate) fn figure(caption: &str) -> Markup {
    html! {
        figure id="scene" {
            div id="stage" { div id="labels" aria-hidden="true" {} p id="message" role="status" {} }
            figcaption { (caption) }
        }
    }
}

/// The scripts that set a stage up, for the page's script to draw on.
pub(crate) fn stage() -> Markup {
    html! {
        (html::script(LIBRARY))
        (html::script(include_str!("stage.js")))
    }
}

/// The scripts that draw `data`, which [`Scene::data`] gave, and then the page's `own` script.
pub(crate) fn scripts(data: &serde_json::Value, own: &str) -> Markup {
    html! {
        (html::data(data))
        (stage())
        (html::script(include_str!("scene.js")))
        (html::script(own))
    }
}
