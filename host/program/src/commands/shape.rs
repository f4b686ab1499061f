//! Objects without a mesh: files of touches with a position.

use super::probe::ProbeArguments;
use super::recognize_lines::{Event, each_of};
use palpate::locate::{self, Real, Shape};
use palpate::probe::file::ProbeFile;
use palpate::{Error, Result};
use palpate_shared::Touch;
use palpate_shared::format::Length;
use std::path::Path;

/// True for a file of touches, not of a mesh.
pub(super) fn is_touches(source: &str) -> bool {
    Path::new(source).extension().is_some_and(|extension| extension == "txt") && !Path::new(source).is_dir()
}

/// Touches of an object called like their file, with its shape.
pub(super) struct Touched {
    pub(super) name: String,
    pub(super) touches: Vec<Touch>,
    pub(super) shape: Shape,
}

/// The touches of a file, made by a probe in millimeters.
pub(super) fn read(path: &Path, file: &ProbeFile) -> Result<Touched> {
    let (mut touches, mut samples) = (Vec::new(), Vec::new());
    each_of(path, &mut |event| {
        if let Event::Touch { touch, place } = event {
            samples.extend(locate::samples(touch, &file.probe).map_err(|error| error.at(place))?);
            touches.push(*touch);
        }
        Ok(())
    })?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let shape = Shape::of(samples, &file.probe, noise(file), &name)
        .map_err(|error| if error.exit_code() == 1 { error.in_file(path) } else { error })?;
    Ok(Touched { name, touches, shape })
}

/// Standard deviation of a contact's height, in millimeters: that of the file, or half a millimeter.
pub(super) fn noise(file: &ProbeFile) -> f64 {
    let height = Real::like(&file.real, file.probe.speed).height;
    if height > 0.0 { height } else { Real::default().height }
}

/// The probe file of touches, which must be in millimeters.
pub(super) fn hand(probe: &ProbeArguments) -> Result<ProbeFile> {
    let allowed = "a probe file in millimeters: touches state times, not ways";
    let file = probe.read()?.filter(|file| file.unit == Length::Millimeter);
    file.ok_or_else(|| Error::setting("probe", "not in millimeters", allowed))
}
