//! Depth images, and whether they agree with each other.
//!
//! A point that one image shows is where another one sees it, if the cameras are right. Where few points are, and most would
//! be after one of the usual mistakes is undone, that mistake is named: translations in meters, another depth scale, the axes
//! of OpenGL, poses of cameras in the world, matrices by columns.

use super::smooth::median;
use crate::error::MeshProblem;
use crate::mesh::facts::short;
use glam::{DMat3, DVec3};

/// A depth image, and the camera that took it.
#[derive(Clone)]
pub(super) struct View {
    /// The world's pose in the frame of the camera, which looks along its z axis.
    pub(super) rotation: DMat3,
    pub(super) translation: DVec3,
    pub(super) focal: [f64; 2],
    pub(super) center: [f64; 2],
    /// Millimeters of a pixel's value.
    pub(super) scale: f64,
    /// Values of pixels, row by row; 0 where nothing was measured.
    pub(super) depths: Vec<u16>,
    pub(super) width: usize,
}

impl View {
    /// A pixel's point in the camera's frame.
    pub(super) fn seen(&self, pixel: usize) -> DVec3 {
        let depth = f64::from(self.depths[pixel]) * self.scale;
        let [column, row] = [pixel % self.width, pixel / self.width].map(|index| index as f64);
        let [x, y] = [(column - self.center[0]) / self.focal[0], (row - self.center[1]) / self.focal[1]];
        DVec3::new(x * depth, y * depth, depth)
    }

    /// A point of the camera's frame in the world's.
    pub(super) fn world(&self, seen: DVec3) -> DVec3 {
        self.rotation.transpose() * (seen - self.translation)
    }

    /// 1 if this image sees a point of the world where it is, -1 if it sees through it, 0 if it sees neither.
    fn confirms(&self, place: DVec3) -> i32 {
        let seen = self.rotation * place + self.translation;
        let column = (seen.x / seen.z * self.focal[0] + self.center[0]).round();
        let row = (seen.y / seen.z * self.focal[1] + self.center[1]).round();
        if !(seen.z > 0.0 && column >= 0.0 && column < self.width as f64 && row >= 0.0) {
            return 0;
        }
        match self.depths.get(row as usize * self.width + column as usize).copied().unwrap_or_default() {
            0 => 0,
            depth => {
                let behind = f64::from(depth) * self.scale - seen.z;
                i32::from(behind.abs() < NEAR * seen.z) - i32::from(behind >= NEAR * seen.z)
            }
        }
    }
}

/// Largest difference of a depth from where it is expected, in that distance.
const NEAR: f64 = 0.015;

/// Points of an image that are compared.
const POINTS: usize = 150;

/// Share of points at which images agree.
const AGREED: f64 = 0.5;

/// Share of points that other images see where they are, more than see through them; none if there is nothing to compare.
fn agreement(views: &[View]) -> Option<f64> {
    let (mut all, mut confirmed) = (0, 0);
    for (number, view) in views.iter().enumerate() {
        let measured: Vec<usize> = (0..view.depths.len()).filter(|&pixel| view.depths[pixel] > 0).collect();
        for &pixel in measured.iter().step_by(measured.len().div_ceil(POINTS).max(1)) {
            let place = view.world(view.seen(pixel));
            let others = views.iter().enumerate().filter(|(other, _)| *other != number);
            all += 1;
            confirmed += usize::from(others.map(|(_, other)| other.confirms(place)).sum::<i32>() > 0);
        }
    }
    (views.len() > 1 && all > 0).then(|| confirmed as f64 / all as f64)
}

/// A way to read poses.
#[derive(Clone, Copy, PartialEq)]
enum Pose {
    World,
    Camera,
    Columns,
}

/// Conventions that may have been meant.
#[derive(Clone, Copy)]
struct Meant {
    pose: Pose,
    is_opengl: bool,
    /// Factor of depths.
    scale: f64,
}

impl Meant {
    fn number(self) -> usize {
        usize::from(self.pose != Pose::World) + usize::from(self.is_opengl) + usize::from(self.scale != 1.0)
    }

    fn read(self, view: &View) -> View {
        let mut view = view.clone();
        match self.pose {
            Pose::World => {}
            Pose::Camera => {
                view.rotation = view.rotation.transpose();
                view.translation = -(view.rotation * view.translation);
            }
            Pose::Columns => view.rotation = view.rotation.transpose(),
        }
        if self.is_opengl {
            let turned = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
            (view.rotation, view.translation) = (turned * view.rotation, turned * view.translation);
        }
        view.scale *= self.scale;
        view
    }

    /// The problem, and what to do.
    fn said(self, views: &[View]) -> [String; 2] {
        let (mut causes, mut remedies) = (Vec::new(), Vec::new());
        let mut add = |cause: &str, remedy: &str| {
            causes.push(cause.to_owned());
            remedies.push(remedy.to_owned());
        };
        match self.pose {
            Pose::World => {}
            Pose::Camera => add(
                "the poses are those of the cameras in the world",
                "write the inverse: the transposed rotation R, and -R times the translation",
            ),
            Pose::Columns => add("cam_R_w2c is written column by column", "write it row by row"),
        }
        if self.is_opengl {
            add(
                "the cameras look along -z with y up, as those of OpenGL do",
                "turn them to +z with y down: negate the second and the third row of cam_R_w2c, and those numbers of cam_t_w2c",
            );
        }
        let depths = views.iter().filter_map(|view| {
            median(view.depths.iter().filter(|depth| **depth > 0).map(|&depth| f64::from(depth) * view.scale).collect())
        });
        let depth = median(depths.collect()).unwrap_or_default();
        if self.scale == 1e-3 && depth < 1e5 {
            add("cam_t_w2c is in meters", "multiply cam_t_w2c by 1000, which makes it millimeters");
        } else if self.scale != 1.0 {
            let scale = views.first().map_or(1.0, |view| view.scale);
            let [now, right] = [scale, scale * self.scale].map(short);
            add(
                &format!("depth_scale is {right} and not {now}, which is also its value where it is not stated"),
                &format!("write depth_scale {right}: it makes millimeters of a pixel's value"),
            );
        }
        [causes, remedies].map(|texts| texts.join(", and "))
    }
}

/// Checks that images agree; a note if they do not, for no reason that is known.
///
/// # Errors
/// [`MeshProblem::Cameras`] with the mistake that explains it.
pub(super) fn check(views: &[View]) -> Result<Option<String>, MeshProblem> {
    let Some(now) = agreement(views).filter(|share| *share < AGREED) else { return Ok(None) };
    let mut best: Option<(f64, Meant)> = None;
    for pose in [Pose::World, Pose::Camera, Pose::Columns] {
        for is_opengl in [false, true] {
            for scale in [1.0, 1e-3, 1e3, 0.1, 10.0, 0.2, 5.0, 0.01, 100.0] {
                let meant = Meant { pose, is_opengl, scale };
                let read: Vec<View> = views.iter().map(|view| meant.read(view)).collect();
                let share = agreement(&read).unwrap_or_default();
                // The fewest mistakes that explain it.
                if best.is_none_or(|(other, found)| {
                    share > other + 0.1 || (share > other - 0.1 && meant.number() < found.number())
                }) {
                    best = Some((share, meant));
                }
            }
        }
    }
    match best {
        Some((then, meant)) if meant.number() > 0 && then >= AGREED && then >= now + 0.3 => {
            let [cause, remedy] = meant.said(views);
            Err(MeshProblem::Cameras { now: 100.0 * now, then: 100.0 * then, cause, remedy })
        }
        _ if views.len() > 2 && now < 0.2 => {
            let now = short(100.0 * now);
            Ok(Some(format!("only {now} % of the points are where another image sees them: are the poses right?")))
        }
        _ => Ok(None),
    }
}
