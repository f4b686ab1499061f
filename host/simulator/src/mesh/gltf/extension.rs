//! Extensions of glTF: those that change the surface, and those that do not.

use crate::error::{Error, Result};
use crate::mesh::unread;

/// Says which nodes are hidden.
const VISIBILITY: &str = "KHR_node_visibility";
pub(super) const QUANTIZED: &str = "KHR_mesh_quantization";

/// Extensions that put the numbers of a mesh elsewhere.
pub(super) const COMPRESSED: [&str; 3] =
    ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Prefixes of the names of extensions that a surface does not depend on: materials, textures, lights, remarks.
const HARMLESS: [&str; 15] = [
    "KHR_materials_",
    "EXT_materials_",
    "ADOBE_materials_",
    "FB_material_",
    "KHR_texture_",
    "EXT_texture_",
    "MSFT_texture_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_xmp",
    "KHR_audio",
    "KHR_animation_",
    "KHR_technique",
    "GOOGLE_texture_",
    "EXT_structural_metadata",
];

/// Refuses a file that requires an extension which may change the surface. Quantization may be that of normals and
/// textures: positions that have it are refused where they are read.
pub(super) fn check_required(required: &[String]) -> Result<()> {
    let is_read = |name: &str| name == QUANTIZED || name == VISIBILITY;
    let is_harmless = |name: &&String| is_read(name) || HARMLESS.iter().any(|harmless| name.starts_with(harmless));
    let harmful = required.iter().find(|name| !is_harmless(name));
    harmful.map_or(Ok(()), |name| Err(unsupported(name)))
}

/// The refusal of an extension by its name.
pub(super) fn unsupported(name: &str) -> Error {
    let kind = match name {
        "KHR_draco_mesh_compression" => "Draco compression",
        QUANTIZED => "quantization",
        "EXT_mesh_gpu_instancing" => "instances by attributes",
        name if COMPRESSED.contains(&name) => "meshopt compression",
        _ => "an extension",
    };
    let shown: String = name.chars().take(80).collect();
    unread::unsupported(format!("{kind} ({shown})"), "Export it as plain glTF 2.0, without it")
}
