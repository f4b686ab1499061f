//! Drawing, and nothing else: pages, tables, charts, pictures of meshes. Knows no touch and no model.

pub mod chart;
pub mod color;
pub mod document;
pub mod kinds;
pub mod render;
pub mod scale;
pub mod table;
