//! Depth images with poses, in the layout of the BOP benchmark for 6D object pose estimation.
//!
//! `scene_camera.json` holds, for each image by its number, the camera's matrix `cam_K` (row by row), the pose of the world
//! in the camera's frame `cam_R_w2c` (row by row) and `cam_t_w2c` (in millimeters), and `depth_scale`, which makes
//! millimeters of a pixel. Image 7 is `depth/000007.png` beside it, gray with 16 bits; 0 is no measurement. Of an object
//! among others, `mask_visib/000007_000000.png` is not 0 where it is seen: `scene_camera.json@3` stands for the object of the
//! masks `_000003`.

use super::views::{self, View};
use super::{MOST, Point, Points, Sensors, table};
use crate::error::{Error, MeshProblem, Place, Result};
use glam::{DMat3, DVec3};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Most pixels of an image.
const MOST_PIXELS: u64 = 1 << 26;

/// Images that are compared with each other.
const COMPARED: usize = 12;

#[derive(Deserialize)]
struct Camera {
    #[serde(rename = "cam_K")]
    matrix: [f64; 9],
    #[serde(rename = "cam_R_w2c")]
    rotation: Option<[f64; 9]>,
    #[serde(rename = "cam_t_w2c")]
    translation: Option<[f64; 3]>,
    #[serde(default = "one")]
    depth_scale: f64,
}

fn one() -> f64 {
    1.0
}

fn damaged(place: Place, what: impl Into<String>) -> Error {
    Error::at(place, MeshProblem::Damaged { format: "scan", what: what.into() })
}

/// Reads the points of the images that a list names, from `folder`. Where there are masks, only object number `chosen` is read,
/// by default 0. Coordinates are in millimeters; errors name `path`, or the image.
pub(in crate::mesh) fn parse(list: &[u8], path: &Path, folder: Option<&Path>, chosen: Option<u32>) -> Result<Points> {
    let cameras: BTreeMap<u32, Camera> = serde_json::from_slice(list)
        .map_err(|error| damaged(Place::line(path, error.line() as u64), error.to_string()))?;
    let whole = |what: String| damaged(Place::file(path), what);
    let folder = folder.ok_or_else(|| whole("its images are files beside it, which it cannot have here".into()))?;
    let mut points = Points { sensors: Sensors::Images, ..Points::default() };
    let masks = Masks::find(folder, &cameras, (path, chosen), &mut points.notes)?;
    let view = |(number, camera): (&u32, &Camera)| view(*number, camera, path, folder, &masks);
    let step = cameras.len().div_ceil(COMPARED).max(1);
    let compared: Vec<View> = cameras.iter().step_by(step).map(view).collect::<Result<_>>()?;
    points.notes.extend(views::check(&compared).map_err(|problem| Error::at(Place::file(path), problem))?);
    let mut compared = compared.into_iter();
    for (index, camera) in cameras.iter().enumerate() {
        let known = if index % step == 0 { compared.next() } else { None };
        let view = known.map_or_else(|| view(camera), Ok)?;
        let viewpoint = Some(view.world(DVec3::ZERO).to_array());
        for (pixel, _) in view.depths.iter().enumerate().filter(|(_, depth)| **depth > 0) {
            points.add(Point { place: view.world(view.seen(pixel)).to_array(), normal: None, viewpoint });
        }
        let count = points.measured.len();
        if count > MOST {
            return Err(Error::at(
                Place::file(path),
                MeshProblem::PointCount { count, fewest: super::FEWEST, most: MOST },
            ));
        }
    }
    if masks.number.is_none() {
        table::leave_out(&mut points);
    }
    Ok(points)
}

/// Reads an image. Pixels outside of its mask are 0.
fn view(number: u32, camera: &Camera, path: &Path, folder: &Path, masks: &Masks) -> Result<View> {
    let whole = |what: String| damaged(Place::file(path), what);
    let &Camera { matrix: [fx, _, cx, _, fy, cy, ..], rotation, translation, depth_scale } = camera;
    let (Some(rotation), Some(translation)) = (rotation, translation) else {
        let what = format!("image {number}, whose camera has no pose (cam_R_w2c and cam_t_w2c),");
        let instead = "Add the poses: in BOP data sets without them, those of the object that stands still are cam_R_m2c and \
                       cam_t_m2c in scene_gt.json";
        return Err(Error::at(Place::file(path), MeshProblem::Unsupported { what, instead }));
    };
    let rotation = DMat3::from_cols_array(&rotation).transpose();
    let is_rotation =
        (rotation * rotation.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-3) && rotation.determinant() > 0.0;
    if !is_rotation {
        return Err(whole(format!("cam_R_w2c of image {number} is not a rotation")));
    }
    if !(fx.is_normal() && fy.is_normal() && depth_scale > 0.0 && (cx + cy).is_finite()) {
        return Err(whole(format!("cam_K or depth_scale of image {number} is 0 or not finite")));
    }
    let (mut depths, width) = gray(&folder.join(format!("depth/{number:06}.png")), true)?;
    if let Some(object) = masks.number {
        let mask = masks.path(number, object);
        let (values, wide) = gray(&mask, false)?;
        if wide != width || values.len() != depths.len() {
            return Err(damaged(Place::file(mask), "its size is not that of the depth image"));
        }
        depths.iter_mut().zip(values).filter(|(_, mask)| *mask == 0).for_each(|(depth, _)| *depth = 0);
    }
    let translation = DVec3::from(translation);
    Ok(View { rotation, translation, focal: [fx, fy], center: [cx, cy], scale: depth_scale, depths, width })
}

/// Masks of an object in all images.
struct Masks {
    folder: PathBuf,
    /// The object's number in the names of its masks; none if there are no masks.
    number: Option<u32>,
}

impl Masks {
    /// Masks of the `chosen` object of the list at `path`, by default number 0. Either all images have one, or there are no masks
    /// at all.
    fn find(
        folder: &Path,
        cameras: &BTreeMap<u32, Camera>,
        (path, chosen): (&Path, Option<u32>),
        notes: &mut Vec<String>,
    ) -> Result<Self> {
        let folder = folder.join("mask_visib");
        let mut found: BTreeSet<(u32, u32)> = BTreeSet::new();
        let entries = if folder.exists() {
            let io = |error| Error::io(&folder, "read the directory", error);
            std::fs::read_dir(&folder).map_err(io)?.collect::<std::io::Result<Vec<_>>>().map_err(io)?
        } else {
            Vec::new()
        };
        for entry in entries {
            let name = entry.file_name();
            let numbers = name.to_str().and_then(|name| name.strip_suffix(".png")?.split_once('_'));
            if let Some((image, object)) = numbers.and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)))
                && cameras.contains_key(&image)
            {
                found.insert((object, image));
            }
        }
        let objects: BTreeSet<u32> = found.iter().map(|(object, _)| *object).collect();
        let listed = |numbers: &[u32]| numbers.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
        let all: Vec<u32> = objects.iter().copied().collect();
        let wrong = |place: &Path, what: String, instead: String| {
            Err(Error::at(Place::file(place), MeshProblem::Masks { what, instead }))
        };
        let number = match (chosen, all.as_slice()) {
            (None, []) => return Ok(Self { folder, number: None }),
            (Some(number), []) => {
                let what = format!("object {number} is chosen, and no image has a mask");
                return wrong(&folder, what, "Add masks, or choose no object".into());
            }
            (Some(number), _) if !objects.contains(&number) => {
                let what = format!("there are masks of the objects {}, and none of object {number}", listed(&all));
                return wrong(&folder, what, "Choose one of them".into());
            }
            (None, [first, ..]) if !objects.contains(&0) => {
                let what = format!("there are masks of the objects {}, and none of object 0", listed(&all));
                let instead = format!("Choose one of them: {}@{first}", path.display());
                return wrong(&folder, what, instead);
            }
            (None, [_, second, ..]) => {
                let (count, path) = (all.len(), path.display());
                notes.push(format!("there are masks of {count} objects: 0 is taken, and {path}@{second} is another"));
                0
            }
            (chosen, _) => chosen.unwrap_or(0),
        };
        let without: Vec<u32> = cameras.keys().copied().filter(|image| !found.contains(&(number, *image))).collect();
        if let Some(&first) = without.first() {
            let masks = Self { folder, number: Some(number) };
            let what = match without.len() {
                1 => "the mask is missing, and other images have one".to_owned(),
                count => format!("the mask is missing, as are those of {count} of {} images", cameras.len()),
            };
            let instead =
                "Add masks that are black where the object is not seen, or remove the directory to use all pixels";
            return wrong(&masks.path(first, number), what, instead.into());
        }
        let masks = Self { folder, number: Some(number) };
        masks.check_objects(number, cameras)?;
        Ok(masks)
    }

    fn path(&self, image: u32, object: u32) -> PathBuf {
        self.folder.join(format!("{image:06}_{object:06}.png"))
    }

    /// Refuses masks whose number is another object in other images, where `scene_gt.json` says so.
    fn check_objects(&self, number: u32, cameras: &BTreeMap<u32, Camera>) -> Result<()> {
        #[derive(Deserialize)]
        struct Object {
            obj_id: u64,
        }
        let list = self.folder.with_file_name("scene_gt.json");
        let Some(bytes) = std::fs::read(&list).ok() else { return Ok(()) };
        let Ok(images) = serde_json::from_slice::<BTreeMap<u32, Vec<Object>>>(&bytes) else { return Ok(()) };
        let named = |image: &u32| Some((*image, images.get(image)?.get(number as usize)?.obj_id));
        let mut named = cameras.keys().filter_map(named);
        let Some((first, object)) = named.next() else { return Ok(()) };
        if let Some((image, other)) = named.find(|(_, other)| *other != object) {
            let what = format!(
                "the masks of number {number} are of object {object} in image {first}, and of {other} in {image}"
            );
            let instead = "Number the masks so that each object has the same number in all images".into();
            return Err(Error::at(Place::file(list), MeshProblem::Masks { what, instead }));
        }
        Ok(())
    }
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
