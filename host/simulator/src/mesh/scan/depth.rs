//! Depth images with poses, in the layout of the BOP benchmark for 6D object pose estimation.
//!
//! `scene_camera.json` holds, for each image by its number, the camera's matrix `cam_K` (row by row), the pose of the world
//! in the camera's frame `cam_R_w2c` (row by row) and `cam_t_w2c` (in millimeters), and `depth_scale`, which makes
//! millimeters of a pixel. Image 7 is `depth/000007.png` beside it, gray with 16 bits; 0 is no measurement. Of an object
//! among others, `mask_visib/000007_000000.png` is not 0 where it is seen.

use super::{Point, Points, Sensors};
use crate::error::{Error, MeshProblem, Place, Result};
use glam::{DMat3, DVec3};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Most pixels of an image.
const MOST_PIXELS: u64 = 1 << 26;

#[derive(Deserialize)]
struct Camera {
    #[serde(rename = "cam_K")]
    matrix: [f64; 9],
    #[serde(rename = "cam_R_w2c")]
    rotation: [f64; 9],
    #[serde(rename = "cam_t_w2c")]
    translation: [f64; 3],
    #[serde(default = "one")]
    depth_scale: f64,
}

fn one() -> f64 {
    1.0
}

fn damaged(place: Place, what: impl Into<String>) -> Error {
    Error::at(place, MeshProblem::Damaged { format: "scan", what: what.into() })
}

/// Reads the points of the images that a list names, from `folder`. Coordinates are in millimeters; errors name `path`, or
/// the image.
pub(in crate::mesh) fn parse(list: &[u8], path: &Path, folder: Option<&Path>) -> Result<Points> {
    let cameras: BTreeMap<u32, Camera> = serde_json::from_slice(list)
        .map_err(|error| damaged(Place::line(path, error.line() as u64), error.to_string()))?;
    let whole = |what: String| damaged(Place::file(path), what);
    let folder = folder.ok_or_else(|| whole("its images are files beside it, which it cannot have here".into()))?;
    let mut points = Points { sensors: Sensors::Images, ..Points::default() };
    for (number, camera) in cameras {
        let Camera { matrix: [fx, _, cx, _, fy, cy, ..], rotation, translation, depth_scale } = camera;
        let rotation = DMat3::from_cols_array(&rotation).transpose();
        let is_rotation =
            (rotation * rotation.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-3) && rotation.determinant() > 0.0;
        if !is_rotation {
            return Err(whole(format!("cam_R_w2c of image {number} is not a rotation")));
        }
        if !(fx.is_normal() && fy.is_normal() && depth_scale > 0.0 && (cx + cy).is_finite()) {
            return Err(whole(format!("cam_K or depth_scale of image {number} is 0 or not finite")));
        }
        let (world, translation) = (rotation.transpose(), DVec3::from(translation));
        let viewpoint = Some((world * -translation).to_array());
        let (depths, width) = gray(&folder.join(format!("depth/{number:06}.png")), true)?;
        let mask = folder.join(format!("mask_visib/{number:06}_000000.png"));
        let mask = if mask.exists() { Some((gray(&mask, false)?, mask)) } else { None };
        if let Some(((values, wide), mask)) = &mask
            && (*wide != width || values.len() != depths.len())
        {
            return Err(damaged(Place::file(mask), "its size is not that of the depth image"));
        }
        for (pixel, &depth) in depths.iter().enumerate() {
            if depth == 0 || mask.as_ref().is_some_and(|((values, _), _)| values[pixel] == 0) {
                continue;
            }
            let z = f64::from(depth) * depth_scale;
            let [column, row] = [pixel % width, pixel / width].map(|index| index as f64);
            let seen = DVec3::new((column - cx) / fx * z, (row - cy) / fy * z, z);
            points.add(Point { place: (world * (seen - translation)).to_array(), normal: None, viewpoint });
        }
    }
    Ok(points)
}

/// The gray values of a PNG, row by row, and its width; of 16 bits if it is a depth image.
fn gray(path: &Path, is_depth: bool) -> Result<(Vec<u16>, usize)> {
    let wrong = |what: String| damaged(Place::file(path), what);
    let file = File::open(path).map_err(|source| Error::io(path, "read the image", source))?;
    let mut reader = png::Decoder::new(BufReader::new(file)).read_info().map_err(|error| wrong(error.to_string()))?;
    let info = reader.info();
    let (color, depth, width) = (info.color_type, info.bit_depth, info.width as usize);
    let is_gray = color == png::ColorType::Grayscale
        && (depth == png::BitDepth::Sixteen || (!is_depth && depth == png::BitDepth::Eight));
    if !is_gray {
        let wanted = if is_depth { "a depth image is gray with 16 bits" } else { "a mask is gray with 8 or 16 bits" };
        return Err(wrong(format!("{wanted}, and this one has {color:?} pixels with {} bits", depth as u8)));
    }
    if u64::from(info.width) * u64::from(info.height) > MOST_PIXELS {
        return Err(wrong(format!("it has more than {MOST_PIXELS} pixels")));
    }
    let mut bytes = vec![0; reader.output_buffer_size().ok_or_else(|| wrong("it is too large".into()))?];
    let frame = reader.next_frame(&mut bytes).map_err(|error| wrong(error.to_string()))?;
    bytes.truncate(frame.buffer_size());
    let values = match depth {
        png::BitDepth::Sixteen => bytes.as_chunks().0.iter().map(|bytes| u16::from_be_bytes(*bytes)).collect(),
        _ => bytes.into_iter().map(u16::from).collect(),
    };
    Ok((values, width))
}
