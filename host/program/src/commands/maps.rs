//! Maps: their settings as an option, and the training of a model of them.

use super::Global;
use super::keys::pairs;
use palpate::locate::{self, Maps, Real, Settings, Surface};
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::probe::noise::quantity::{ANGLE, LENGTH, SHARE};
use palpate::touches::Dataset;
use palpate::with;
use palpate::wording::{count, decimal, percent};
use palpate::{Error, Result};
use std::fmt::Write as _;
use std::path::Path;
use std::str::FromStr;
use std::time::Instant;

/// Settings of maps, as one text; those that are left open are those of the noise.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct MapSettings {
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
    fn over(&self, base: Settings) -> Settings {
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

/// A training of maps.
#[derive(serde::Serialize)]
struct Trained<'m> {
    objects: usize,
    placements: Vec<OfPlacement<'m>>,
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
    /// Share of its cells that a touch met.
    known: f64,
    bytes: usize,
}

/// Trains maps on touches with a position. `noise` is that of the option for noise.
pub(super) fn train(
    dataset: &Dataset,
    noise: &Noise,
    given: &MapSettings,
    output: &Path,
    global: &Global,
) -> Result<()> {
    let start = Instant::now();
    let probe = locate::probe_of(dataset)?;
    let settings = Settings::default()
        .expecting(&Real::like(&dataset.real(), probe.speed))
        .expecting(&Real::of(noise, probe.speed)?);
    let settings = given.over(settings);
    settings.check().map_err(|error| match error.kind() {
        palpate::error::Kind::Setting { name, value, allowed } => {
            Error::setting("maps", format!("{name}={value}"), allowed.clone())
        }
        _ => error,
    })?;
    let surfaces = locate::learn(dataset, &settings)?;
    let names = dataset.names();
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
    let trained = Trained {
        objects: names.len(),
        placements: (0..=u8::MAX).zip(&surfaces).map(of).collect(),
        touches: dataset.len(),
        cell: maps.cell(),
        range: settings.range,
        noise: locate::stated(&maps).noise(probe.speed).to_string(),
        bytes: bytes.len(),
        seconds: start.elapsed().as_secs_f64(),
    };
    output::write_bytes(output, &bytes)?;
    match global.json {
        true => output::print_json_about(output, &trained),
        false => output::print_about(output, &text(output, &trained)),
    }
}

fn text(output: &Path, trained: &Trained<'_>) -> String {
    let mut text = format!(
        "{}: maps of {} placements of {} objects from {} approaches, learned in {} s; {} bytes\n\
         cells of {} mm, places within {} mm, for {}\n",
        output.display(),
        trained.placements.len(),
        trained.objects,
        count(trained.touches),
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
            "  {:width$} {:>6} {:>8} bytes, {} of its cells met{}",
            named(of),
            percent(of.share, 0),
            count(of.bytes),
            percent(of.known, 0),
            if of.round { ", round" } else { "" },
        );
    }
    text
}

/// The name of a placement with that of its object.
pub(super) fn name(object: &str, placement: &str) -> String {
    if placement.is_empty() { object.to_owned() } else { format!("{object}/{placement}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_that_are_given_replace_those_of_the_noise() {
        let set = |text: &str| text.parse::<MapSettings>().unwrap().over(with!(Settings::default(), lost = 0.05));
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
