//! Drawing, and nothing else: pages, tables, charts, pictures of meshes, 3-D scenes. Knows no touch and no model.
//!
//! ```text
//! color ──► axis ──► chart ──► heat map ──► document (html) ──► a file
//! mesh  ──► render: PNG        mesh, lines ──► scene: for a page of its own
//! ```

pub(crate) mod axis;
pub(crate) mod chart;
pub(crate) mod color;
pub mod document;
pub(crate) mod heat_map;
pub(crate) mod html;
pub mod render;
pub(crate) mod scene;
