//! Content of a model of maps, and its file.

use super::follow::{CELLS, TOUCHES};
use super::refused::{no_hand, refused};
use super::{Aimed, Effort, Hand, Maps, Real};
use crate::calibrate;
use crate::error::{Error, Place, Result};
use crate::probe::approach::Probe;
use crate::probe::noise::Noise;
use crate::with;
use palpate_onboard::locate::Locator;
use palpate_shared::format::{Header, MAGIC, MAPS_LAYOUT, TrainedProbe};
use serde::Serialize;
use std::io::Read;
use std::path::Path;

/// The bytes of a model of maps from a file; they were checked.
#[derive(Clone, Debug)]
pub struct MapsFile(Vec<u8>);

impl MapsFile {
    /// Reads a model of maps; none for a file that is not one, such as a model of trees, and for a pipe, which cannot be read twice.
    ///
    /// # Errors
    /// When the file cannot be read, or a model of maps is damaged.
    pub fn read(path: &Path) -> Result<Option<Self>> {
        let is_file = std::fs::metadata(path).is_ok_and(|about| about.is_file());
        let Some(file) = is_file.then(|| std::fs::File::open(path).ok()).flatten() else { return Ok(None) };
        let failed = |source| Error::io(path, "read the model", source);
        let mut bytes = Vec::new();
        (&file).take(8).read_to_end(&mut bytes).map_err(failed)?;
        if bytes.len() < 8 || !bytes.starts_with(&MAGIC) || Header::of(&bytes).layout() != MAPS_LAYOUT {
            return Ok(None);
        }
        (&file).read_to_end(&mut bytes).map_err(failed)?;
        match Maps::new(&bytes) {
            Ok(_) => Ok(Some(Self(bytes))),
            Err(error) => Err(refused(error).at(Place::file(path))),
        }
    }

    /// The maps.
    pub fn maps(&self) -> Maps<'_> {
        Maps::new(&self.0).unwrap_or_else(|_| unreachable!("the bytes were checked and do not change"))
    }
}

/// The names of the objects that maps know, in their order.
pub fn names(maps: &Maps<'_>) -> Vec<String> {
    (0..maps.objects()).map(|object| maps.object_name(object).to_owned()).collect()
}

/// The probe that maps were made with, in millimeters.
///
/// # Errors
/// When the maps state no hand.
pub fn hand(maps: &Maps<'_>) -> Result<Probe> {
    let stated = Hand::of(maps).and(maps.probe()).ok_or_else(no_hand)?;
    let TrainedProbe { radius, spacing, speed, stroke, travel, stroke_tolerance, .. } = stated;
    // Decimals of a file are not those of its rounding to f32.
    let exact = |length: f32| length.to_string().parse().unwrap_or(f64::from(length));
    Ok(with!(
        Probe::default(),
        radius = exact(radius),
        spacing = exact(spacing),
        speed = exact(speed),
        tilt = 0.0,
        stroke = stroke.map(exact),
        travel = travel.map(exact),
        stroke_tolerance = stroke_tolerance.map(exact)
    ))
}

/// Noise that the likelihoods of maps are for.
pub fn stated(maps: &Maps<'_>) -> Real {
    let ([height, position, lost], [drift, turn]) = (maps.noise(), maps.drift());
    let length = |number: u16| f64::from(number) / 50.0;
    // Written in steps of a sixteenth of a millimeter, and of 2^-14 radians.
    let turn = (f64::from(turn) / 16_384.0).to_degrees();
    Real {
        height: length(height),
        lost: f64::from(lost) / 1e4,
        position: length(position),
        drift: f64::from(drift) / 16.0,
        drift_yaw: (turn * 100.0).round() / 100.0,
        ..Real::default()
    }
}

/// Content of a model of maps.
#[derive(Clone, Debug, Serialize)]
pub struct Inspected<'m> {
    /// Kind of model.
    pub kind: &'static str,
    /// Version of the format.
    pub version: u16,
    /// Version of the tool that wrote it.
    pub tool_version: &'m str,
    /// Objects.
    pub objects: Vec<&'m str>,
    /// Placements.
    pub placements: Vec<OfPlacement<'m>>,
    /// Side of a cell, in millimeters.
    pub cell: u8,
    /// Half of the side of the square in which an object's origin is looked for, in millimeters.
    pub range: f64,
    /// The hand.
    pub probe: Probe,
    /// Noise that the likelihoods are for, in words.
    pub noise: String,
    /// Lead over all others at which an object is named, in nats.
    pub margin: f64,
    /// Limit of approaches.
    pub max_touches: u32,
    /// The promise, if it was calibrated.
    pub promise: Option<Promised>,
    /// Cost of an approach.
    pub approach: Cost,
    /// Bytes.
    pub bytes: usize,
    /// Its checksum.
    pub checksum: String,
}

/// A placement.
#[derive(Clone, Debug, Serialize)]
pub struct OfPlacement<'m> {
    /// Name of the object.
    pub object: &'m str,
    /// Name of the placement; empty for an object without.
    pub placement: &'m str,
    /// Share of the object.
    pub share: f64,
    /// True if it looks the same from all sides.
    pub round: bool,
    /// Least fit of the touches at which its object is named, in nats for each touch; none without a test for unknown objects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least_fit: Option<f64>,
    /// Bytes of its map.
    pub bytes: usize,
}

/// A promise, and its basis.
#[derive(Clone, Debug, Serialize)]
pub struct Promised {
    /// The promised share of wrong names.
    pub error_rate: f64,
    /// The probability that it is kept.
    pub confidence: f64,
    /// The aim of approaches.
    pub aimed: Aimed,
    /// Sequences that it rests on.
    pub sequences: u32,
    /// Names given.
    pub given: u32,
    /// Wrong ones.
    pub wrong: u32,
    /// Approaches on average.
    pub mean_approaches: f64,
    /// Noise that it holds for, in words.
    pub noise: String,
}

impl Promised {
    /// The promise of maps, if they have one.
    pub fn of(maps: &Maps<'_>) -> Option<Self> {
        let promise = maps.promise()?;
        Some(Self {
            error_rate: promise.rate,
            confidence: promise.confidence,
            aimed: if promise.active { Aimed::Chosen } else { Aimed::Random },
            sequences: promise.sequences,
            given: promise.given,
            wrong: promise.wrong,
            mean_approaches: f64::from(promise.mean_thousandths) / 1e3,
            noise: Noise::of_promise(&promise.noise).to_string(),
        })
    }
}

/// Bounds on the work of an approach on a chip.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Cost {
    /// Heights that are looked up at most.
    pub lookups: u32,
    /// Instructions of these on a Cortex-M4F, estimated.
    pub instructions: u64,
    /// RAM of the locator, in bytes.
    pub ram: usize,
    /// Cells that it has room for.
    pub cells: usize,
}

/// Instructions of a lookup on a Cortex-M4F.
const EACH: u64 = 160;

/// Content of a model of maps, and the cost of an approach for a chip with room for 16 objects.
///
/// # Errors
/// When the maps state no hand.
pub fn inspect<'m>(maps: &Maps<'m>) -> Result<Inspected<'m>> {
    let stopping = maps.stopping();
    let header = Header::of(maps.model());
    let of = |placement: u8| OfPlacement {
        object: maps.object_name(maps.object_of(placement).into()),
        placement: maps.placement_name(placement),
        share: (f64::from(maps.prior_of(placement)) / 64.0).exp(),
        round: maps.is_round(placement),
        least_fit: maps.least_fit(placement).map(|nats| f64::from(nats) / 64.0),
        bytes: maps.bytes_of(placement),
    };
    let count = u8::try_from(maps.placements()).unwrap_or(u8::MAX);
    let probe = hand(maps)?;
    let lookups = Effort::default().lookups;
    let checksum = maps.model().last_chunk().map_or(0, |&bytes| u32::from_le_bytes(bytes));
    Ok(Inspected {
        kind: "maps",
        version: header.version(),
        tool_version: maps.tool_version(),
        objects: (0..maps.objects()).map(|object| maps.object_name(object)).collect(),
        placements: (0..count).map(of).collect(),
        cell: maps.cell(),
        range: f64::from(maps.range()) / 1e3,
        probe,
        noise: stated(maps).noise(probe.speed).to_string(),
        margin: calibrate::margin_of(stopping.odds()),
        max_touches: stopping.max_touches(),
        promise: Promised::of(maps),
        approach: Cost {
            lookups,
            instructions: u64::from(lookups) * EACH,
            ram: size_of::<Locator<'_, CELLS, TOUCHES, 16>>(),
            cells: CELLS,
        },
        bytes: maps.model().len(),
        checksum: format!("{checksum:08x}"),
    })
}
