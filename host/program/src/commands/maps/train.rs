//! `palpate maps train`.

use super::name;
use crate::commands::Global;
use crate::commands::capture::complain;
use crate::commands::keys::pairs;
use crate::commands::probe::{SizeArguments, refuse_unstated};
use crate::commands::progress::{Bar, cancel_when_interrupted};
use crate::commands::real::RealArguments;
use crate::commands::teach::RecordedArguments;
use palpate::locate::{self, CastSettings, Maps, Real, Standing, Surface};
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::probe::noise::quantity::{ANGLE, LENGTH, SHARE};
use palpate::touches::Origin;
use palpate::with;
use palpate::wording::{count, decimal, percent};
use palpate::{Error, Result};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Instant;

#[derive(clap::Args)]
#[command(after_help = "\
The maps say what a fingertip that comes straight down meets on each object in each pose that it rests in: a model for the other commands of `palpate maps`. Meshes keep their true size. Touches of --teach need a position.

Keys of --maps: cell, range, noise, lost, position, drift; docs/reference/options.md explains them.

Examples:
  palpate maps train meshes/ -o maps.palpate --true-size mm --probe hand.toml
  palpate maps train builtin -o maps.palpate --true-size cm --probe hand.toml \\
      --real noise=5ms,missed=2% --maps cell=2mm
  palpate maps train meshes/ -o maps.palpate --probe hand.toml --teach pot.txt
  palpate maps train --teach recorded -o maps.palpate")]
pub(super) struct Arguments {
    /// Objects: `builtin` or built-in objects' names, meshes (OBJ, STL, PLY, glTF, COLLADA), directories of them
    #[arg(value_name = "SOURCE", required_unless_present = "teach")]
    sources: Vec<String>,
    #[command(flatten)]
    recorded: RecordedArguments,
    /// Output; the model of maps
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Settings of maps, such as cell=2mm,range=30mm [default: those of the noise]
    #[arg(long, value_name = "SETTINGS")]
    maps: Option<MapSettings>,
    #[command(flatten)]
    size: SizeArguments,
    #[command(flatten)]
    real: RealArguments,
}

/// Settings of maps, as one text; those that are left open are those of the noise.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MapSettings {
    fine: Option<bool>,
    /// Lengths in micrometers.
    range: Option<f64>,
    noise: Option<f64>,
    lost: Option<f64>,
    position: Option<f64>,
    drift: Option<[f64; 2]>,
}

/// Keys, and what each takes.
const KEYS: [(&str, &str); 6] = [
    ("cell", "1mm or 2mm"),
    ("range", "a length such as 30mm"),
    ("noise", "a length such as 0.5mm"),
    ("lost", "a share such as 2%"),
    ("position", "a length such as 1mm"),
    ("drift", "a length and an angle such as 1mm/1deg"),
];

/// The keys alone.
fn keys() -> impl Iterator<Item = &'static str> {
    KEYS.into_iter().map(|(key, _)| key)
}

impl FromStr for MapSettings {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut maps = Self::default();
        let known: Vec<&str> = keys().collect();
        for (key, value) in pairs(text, &known, "a setting of maps", "cell=2mm,range=30mm")? {
            let wanted = KEYS.iter().find(|own| own.0 == key).map_or("", |own| own.1);
            maps.set(key, value).ok_or_else(|| format!("{key} is {value:?}; use {wanted}"))?;
        }
        Ok(maps)
    }
}

impl MapSettings {
    fn set(&mut self, key: &str, value: &str) -> Option<()> {
        match key {
            "cell" => {
                let cell = LENGTH.read(value)?;
                self.fine = [(1_000.0, true), (2_000.0, false)].into_iter().find(|own| own.0 == cell).map(|own| own.1);
                self.fine?;
            }
            "range" => self.range = Some(LENGTH.read(value)?),
            "noise" => self.noise = Some(LENGTH.read(value)?),
            "lost" => self.lost = Some(SHARE.read(value)?),
            "position" => self.position = Some(LENGTH.read(value)?),
            _ => {
                let (moved, turned) = value.split_once('/')?;
                self.drift = Some([LENGTH.read(moved)?, ANGLE.read(turned)?]);
            }
        }
        Some(())
    }

    /// The settings that are given, and `base` where they are open.
    fn over(&self, base: CastSettings) -> CastSettings {
        let or = |given: Option<f64>, own: f64| given.map_or(own, |micrometers| micrometers / 1e3);
        with!(
            base.clone(),
            fine = self.fine.unwrap_or(base.fine),
            range = or(self.range, base.range),
            noise = or(self.noise, base.noise),
            lost = self.lost.unwrap_or(base.lost),
            position = or(self.position, base.position),
            drift = self.drift.map_or(base.drift, |[moved, _]| moved / 1e3),
            drift_yaw = self.drift.map_or(base.drift_yaw, |[_, turned]| turned)
        )
    }
}

/// Maps that were made.
#[derive(serde::Serialize)]
struct Trained<'m> {
    objects: usize,
    placements: Vec<OfPlacement<'m>>,
    /// Poses of meshes that have no map since they are rare, with their shares.
    left_out: Vec<(String, f64)>,
    /// Number of recorded touches.
    touches: usize,
    cell: u8,
    range: f64,
    /// Noise that the likelihoods are for.
    noise: String,
    bytes: usize,
    seconds: f64,
}

#[derive(serde::Serialize)]
struct OfPlacement<'m> {
    object: &'m str,
    placement: &'m str,
    share: f64,
    round: bool,
    /// Share of its cells that is known: all of a mesh's.
    known: f64,
    bytes: usize,
}

/// Makes maps of meshes, and of recorded touches with a position.
pub(super) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let Arguments { sources, recorded, output, maps, mut size, real } = arguments;
    let files = recorded.files();
    output::admit(&output, files.iter().cloned().chain(sources.iter().map(PathBuf::from)))?;
    let start = Instant::now();
    let taught = |error: Error| match files.first() {
        Some(path) if error.exit_code() == 1 => error.in_file(path),
        _ => error,
    };
    let mut dataset = recorded.read()?.unwrap_or_default();
    size.units.imply_true_size();
    if dataset.origin.is_none() {
        if !sources.is_empty() {
            refuse_unstated(&size)?;
        }
        let file = size.probe.read()?;
        dataset.origin = file.map(|file| Origin { probe: file.probe, unit: file.unit, ..Origin::default() });
    }
    size.origin(Origin::default())?;
    let file = size.probe.read()?;
    size.probe.of_dataset(file.as_ref(), &dataset)?;
    let probe = locate::probe_of(&dataset).map_err(taught)?;
    let noise = real.on_table(size.probe.noise(file.as_ref(), &dataset, Noise::default())?)?;
    let settings = maps.unwrap_or_default().over(CastSettings::default().expecting(&Real::of(&noise, probe.speed)?));
    settings.check().map_err(|error| match error.kind() {
        palpate::error::Kind::Setting { name, value, allowed } => {
            Error::setting("maps", format!("{name}={value}"), allowed.clone())
        }
        _ => error,
    })?;
    let objects = if sources.is_empty() { Vec::new() } else { size.objects(&sources, global.seed())? };
    objects.iter().for_each(complain);
    if let Some(known) = dataset.objects.iter().find(|own| objects.iter().any(|object| object.name == own.name)) {
        let allowed = "objects that have no mesh: maps of meshes are not adjusted";
        return Err(Error::setting("teach", &known.name, allowed));
    }
    cancel_when_interrupted();
    let standing = locate::standing(&objects.iter().collect::<Vec<_>>(), &probe, settings.noise, &Bar::new())?;
    let cast = locate::cast(&standing, &probe, &settings)?;
    let learned = locate::learn(&dataset, &settings).map_err(taught)?;
    let mut names: Vec<String> = standing.iter().map(|object| object.name.clone()).chain(dataset.names()).collect();
    let learned = learned.into_iter().map(|own| Surface { object: own.object + standing.len(), ..own });
    let mut surfaces: Vec<(String, Surface)> =
        cast.into_iter().chain(learned).map(|own| (names[own.object].clone(), own)).collect();
    surfaces.sort_by(|(one, _), (other, _)| one.cmp(other));
    names.sort();
    let number = |name: &String| names.iter().position(|own| own == name).unwrap_or(0);
    let surfaces: Vec<Surface> =
        surfaces.into_iter().map(|(name, own)| Surface { object: number(&name), ..own }).collect();
    let bytes = locate::write(&surfaces, &names, &probe, &settings)?;
    // Written just now.
    let Ok(maps) = Maps::new(&bytes) else { unreachable!("they were read when they were written") };
    let of = |(number, surface): (u8, &Surface)| OfPlacement {
        object: maps.object_name(surface.object),
        placement: maps.placement_name(number),
        share: surface.share,
        round: surface.is_round,
        known: surface.known,
        bytes: maps.bytes_of(number),
    };
    let left_out = |object: &Standing| {
        let named = |(placement, share): &(String, f64)| (name(&object.name, placement), *share);
        object.left_out.iter().map(named).collect::<Vec<_>>()
    };
    let trained = Trained {
        objects: names.len(),
        placements: (0..=u8::MAX).zip(&surfaces).map(of).collect(),
        left_out: standing.iter().flat_map(left_out).collect(),
        touches: dataset.len(),
        cell: maps.cell(),
        range: settings.range,
        noise: locate::stated(&maps).noise(probe.speed).to_string(),
        bytes: bytes.len(),
        seconds: start.elapsed().as_secs_f64(),
    };
    output::write_bytes(&output, &bytes)?;
    global.print_about(&output, &trained, || text(&output, &trained))
}

fn text(output: &Path, trained: &Trained<'_>) -> String {
    let touches = if trained.touches == 0 { String::new() } else { format!(" and {} touches", count(trained.touches)) };
    let mut text = format!(
        "{}: maps of {} placements of {} objects{touches}, made in {} s; {} bytes\n\
         cells of {} mm, places within {} mm, for {}\n",
        output.display(),
        trained.placements.len(),
        trained.objects,
        decimal(trained.seconds, 1),
        count(trained.bytes),
        trained.cell,
        trained.range,
        trained.noise,
    );
    let named = |of: &OfPlacement<'_>| name(of.object, of.placement);
    let width = trained.placements.iter().map(|of| named(of).chars().count()).max().unwrap_or(0);
    for of in &trained.placements {
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "  {:width$} {:>6} {:>8} bytes{}{}",
            named(of),
            percent(of.share, 0),
            count(of.bytes),
            if of.known < 1.0 { format!(", {} of its cells met", percent(of.known, 0)) } else { String::new() },
            if of.round { ", round" } else { "" },
        );
    }
    let rare: Vec<String> =
        trained.left_out.iter().map(|(name, share)| format!("{name} {}", percent(*share, 1))).collect();
    if !rare.is_empty() {
        _ = writeln!(text, "left out, since they are rare: {}", rare.join(", "));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_that_are_given_replace_those_of_the_noise() {
        let set = |text: &str| text.parse::<MapSettings>().unwrap().over(with!(CastSettings::default(), lost = 0.05));
        let all = set("cell=2mm,range=20mm,noise=1mm,lost=1%,position=500um,drift=1mm/2deg");
        assert_eq!((all.fine, all.range, all.noise, all.lost), (false, 20.0, 1.0, 0.01));
        assert_eq!((all.position, all.drift, all.drift_yaw), (0.5, 1.0, 2.0));
        assert_eq!((set("cell=1mm").fine, set("cell=1mm").lost), (true, 0.05));
    }

    #[test]
    fn what_is_no_setting_of_maps_is_refused_with_what_to_use() {
        for (text, expected) in [
            ("cell=3mm", "cell is \"3mm\"; use 1mm or 2mm"),
            ("drift=1mm", "drift is \"1mm\"; use a length and an angle"),
            ("rang=3mm", "\"rang=3mm\" is not a setting of maps"),
            ("lost=few", "lost is \"few\"; use a share such as 2%"),
        ] {
            let error = text.parse::<MapSettings>().unwrap_err();
            assert!(error.starts_with(expected), "{text}: {error}");
        }
    }
}
