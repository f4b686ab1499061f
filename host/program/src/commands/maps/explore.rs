//! `palpate maps explore`.

use super::recognize::Next;
use crate::commands::recognize_lines::{Event, each_of};
use crate::commands::shape::noise;
use crate::commands::{Global, kinds, print_line};
use palpate::locate::{self, Shape};
use palpate::probe::file::ProbeFile;
use palpate::{Error, Result};
use palpate_shared::format::Length;
use std::path::{Path, PathBuf};
use std::str::FromStr;

#[derive(clap::Args)]
#[command(after_help = "\
The object stands still. Each line in is a touch with the hand's position, straight down: twelve columns. Each line out is a JSON object: `state` is exploring or known, `known` the share of the cells that may be the object's whose height is known as well as --known says, and `next` the next approach. An empty line begins another object.

Examples:
  robot | palpate maps explore hand.toml
  robot | palpate maps explore hand.toml --known 1mm/80% --workspace 40")]
pub(super) struct Arguments {
    /// The hand: a probe file in millimeters, or a model of maps, which states it
    hand: PathBuf,
    /// File with touches, or a robot's log (MCAP); - is standard input
    #[arg(default_value = "-")]
    file: PathBuf,
    /// Go on until the heights of this share of the cells are known to this many millimeters
    #[arg(long, value_name = "MM/SHARE", default_value = "2mm/50%")]
    known: Known,
    /// Keep the middle finger this close to the table's origin, in x and y
    #[arg(long, value_name = "MM", default_value = "60")]
    workspace: f64,
}

/// Goal of exploring: the share of the map that has to be known, and the error that counts as known.
#[derive(Clone, Copy, Debug)]
struct Known {
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

/// The hand that a probe file or a model of maps states.
fn hand(path: &Path) -> Result<ProbeFile> {
    if path.extension().is_some_and(|extension| extension == "toml") {
        let file = ProbeFile::read(path)?;
        let error =
            || ProbeFile::unusable("its unit is not mm, and touches on a table are in millimeters").in_file(path);
        return if file.unit == Length::Millimeter { Ok(file) } else { Err(error()) };
    }
    let file = kinds::maps(path, "explore")?;
    let maps = file.maps();
    let probe = locate::hand(&maps).map_err(|error| error.in_file(path))?;
    Ok(ProbeFile { probe, unit: Length::Millimeter, real: locate::stated(&maps).noise(probe.speed) })
}

pub(super) fn run(arguments: Arguments, _: &Global) -> Result<()> {
    let Arguments { known: goal, workspace: half, .. } = arguments;
    let file = hand(&arguments.hand)?;
    if !(1.0..=200.0).contains(&half) {
        return Err(Error::setting("workspace", half, "a number of millimeters from 1 to 200"));
    }
    let begin = || Shape::within(&file.probe, [half; 2], noise(&file));
    let (mut shape, mut touch) = (begin(), 0);
    each_of(&arguments.file, &mut |event| {
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
        print_line(&Explored { touch, state, known: (known * 1e3).round() / 1e3, next })
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
