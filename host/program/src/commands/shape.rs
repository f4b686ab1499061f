//! Objects without a mesh: files of touches with a position, and the next approach.

use super::probe::ProbeArguments;
use super::recognize_lines::{Event, each_of};
use super::recognize_maps::Next;
use palpate::locate::{self, MapsFile, Real, Shape};
use palpate::output;
use palpate::probe::file::ProbeFile;
use palpate::{Error, Result};
use palpate_shared::Touch;
use palpate_shared::format::Length;
use std::path::Path;
use std::str::FromStr;

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
fn noise(file: &ProbeFile) -> f64 {
    let height = Real::like(&file.real, file.probe.speed).height;
    if height > 0.0 { height } else { Real::default().height }
}

/// The probe file of touches, which must be in millimeters.
pub(super) fn hand(probe: &ProbeArguments) -> Result<ProbeFile> {
    let allowed = "a probe file in millimeters: touches state times, not ways";
    in_millimeters(probe.read()?).ok_or_else(|| Error::setting("probe", "not given", allowed))
}

fn in_millimeters(file: Option<ProbeFile>) -> Option<ProbeFile> {
    file.filter(|file| file.unit == Length::Millimeter)
}

/// Goal of exploring: the share of the map that has to be known, and the error that counts as known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    millimeters: f64,
    share: f64,
}

impl FromStr for Known {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("use a length and a share, such as 2mm/80%, not {text}");
        let (length, share) = text.split_once('/').ok_or_else(wrong)?;
        let number = |text: &str, unit| text.strip_suffix(unit).and_then(|number| number.parse::<f64>().ok());
        let (millimeters, percent) = number(length, "mm").zip(number(share, "%")).ok_or_else(wrong)?;
        let is_possible = millimeters > 0.0 && (1.0..=100.0).contains(&percent);
        if is_possible { Ok(Self { millimeters, share: percent / 100.0 }) } else { Err(wrong()) }
    }
}

/// State of a map after a touch.
#[derive(serde::Serialize)]
struct Explored {
    touch: u32,
    state: &'static str,
    /// Share of the cells that may be the object's that is known as well as wanted.
    known: f64,
    /// The next approach; none once the map is known.
    next: Option<Next>,
}

/// Half of the square that is explored by default, in millimeters.
const WORKSPACE: f64 = 60.0;

/// Says after each touch of an object that stands still where its map is least known.
pub(super) fn explore(goal: Known, model: &Path, touches: &Path, workspace: Option<f64>) -> Result<()> {
    let is_probe = model.extension().is_some_and(|extension| extension == "toml");
    let of_maps = |file: MapsFile| -> Result<ProbeFile> {
        let maps = file.maps();
        let probe = locate::hand(&maps).map_err(|error| error.in_file(model))?;
        Ok(ProbeFile { probe, unit: Length::Millimeter, real: locate::stated(&maps).noise(probe.speed) })
    };
    let file =
        if is_probe { Some(ProbeFile::read(model)?) } else { MapsFile::read(model)?.map(of_maps).transpose()? };
    let allowed = "it with a probe file in millimeters (hand.toml) or a model of maps, which states its hand";
    if file.is_none() {
        // If the file holds no trees either, its own error says why.
        palpate::compile::CompiledModel::read(model)?;
    }
    let file = in_millimeters(file).ok_or_else(|| Error::setting("explore", "given", allowed))?;
    let half = workspace.unwrap_or(WORKSPACE);
    if !(1.0..=200.0).contains(&half) {
        return Err(Error::setting("workspace", half, "a number of millimeters from 1 to 200"));
    }
    let begin = || Shape::within(&file.probe, [half; 2], noise(&file));
    let (mut shape, mut touch) = (begin(), 0);
    each_of(touches, &mut |event| {
        let Event::Touch { touch: met, place } = event else {
            (shape, touch) = (begin(), 0);
            return Ok(());
        };
        shape.push(met).map_err(|error| error.at(place))?;
        touch += 1;
        let relief = shape.relief();
        let known = relief.known(goal.millimeters);
        let is_known = known >= goal.share;
        let next = (!is_known).then(|| shape.next(&relief).into());
        let state = if is_known { "known" } else { "exploring" };
        let line = Explored { touch, state, known: (known * 1e3).round() / 1e3, next };
        // Numbers and strings are always JSON.
        output::print(&format!("{}\n", serde_json::to_string(&line).unwrap_or_default()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_to_be_known_is_a_length_and_a_share() {
        let known: Known = "1.5mm/90%".parse().unwrap();
        assert_eq!((known.millimeters, known.share), (1.5, 0.9));
        for wrong in ["2mm", "2mm/0%", "-1mm/50%", "2/80%", "NaNmm/80%"] {
            assert!(wrong.parse::<Known>().unwrap_err().contains(wrong), "{wrong}");
        }
    }
}
