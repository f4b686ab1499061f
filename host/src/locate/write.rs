//! Surfaces as the bytes that the chip reads.

use super::CastSettings;
use super::refused::{not_met, refused, too_large};
use super::surface::Surface;
use crate::compile::{self, OwnedSection, file, restated_file};
use crate::error::{Result, problem};
use crate::probe::approach::Probe;
use palpate_onboard::locate::{BEYOND, DISTANCES, MAPS_LENGTH, Maps, PLACEMENT_LENGTH, WIDTHS, WITHIN};
use palpate_shared::format::{HeaderBuilder, Length, MAPS_LAYOUT, Promise, Tag, TrainedProbe};

/// 1/16 mm in a millimeter.
const SIXTEENTHS: f64 = 16.0;
/// Units of logarithms in a nat.
const NAT: f64 = 64.0;
/// Squares of the radius of a window's disc, in squares of its size.
const DISC: i32 = 13;
/// Sides of windows that have minima and maxima of their own, in millimeters.
const WINDOWS: [i32; 4] = [4, 8, 16, 32];

/// Writes a model of maps.
///
/// # Errors
/// For an object without a surface, and for a name or a map that is too large; [`Kind::Setting`](crate::error::Kind::Setting) for
/// settings out of range.
pub fn write(surfaces: &[Surface], objects: &[String], probe: &Probe, settings: &CastSettings) -> Result<Vec<u8>> {
    settings.check()?;
    if objects.is_empty() {
        return Err(
            problem!("there are no objects to make maps of").fix("Give at least one mesh, or touches of one object.")
        );
    }
    for (index, object) in objects.iter().enumerate() {
        if !surfaces.iter().any(|surface| surface.object == index) {
            return Err(not_met(object, ""));
        }
    }
    let count = u8::try_from(surfaces.len()).map_err(|_| {
        problem!("there are {} placements, and a model has at most 255", surfaces.len())
            .fix("Leave objects out, or placements that are rare.")
    })?;
    let (mut records, mut heights) = (Vec::new(), Vec::new());
    for surface in surfaces {
        let offset = u32::try_from(heights.len()).unwrap_or(u32::MAX);
        let scale = (surface.top() * SIXTEENTHS * 64.0 / 255.0).ceil().max(1.0);
        let radius = ((surface.radius() + 2.0) * SIXTEENTHS).ceil();
        let large = || too_large(&objects[surface.object], &surface.placement);
        let [scale, radius] =
            [scale, radius].map(|number| if number < 65_535.0 { Ok(number as u16) } else { Err(large()) });
        let (scale, radius) = (scale?, radius?);
        records.push(u8::try_from(surface.object).unwrap_or(u8::MAX));
        records.push(u8::from(surface.is_round));
        records.extend(((surface.share.max(1e-6).ln() * NAT).round() as i16).to_le_bytes());
        records.extend(scale.to_le_bytes());
        records.extend(radius.to_le_bytes());
        records.extend(offset.to_le_bytes());
        for half in levels(surface, &mut heights, scale) {
            for half in half {
                records.push(u8::try_from(half).map_err(|_| large())?);
            }
        }
        records.extend([0; 2]);
    }
    let number = |number: f64, most: u16| (number.round() as u16).min(most).to_le_bytes();
    let mut content = vec![if settings.fine { 4 } else { 5 }, settings.roots(), count, 0];
    content.extend(number(settings.range * SIXTEENTHS, 4_096));
    content.extend(number(settings.drift * SIXTEENTHS, 1_023));
    content.extend(number(settings.drift_yaw.to_radians() * 16_384.0, 1_023));
    content.extend([0; 2]);
    content.extend(settings.stretch.to_le_bytes());
    content.extend([0; 2]);
    content.extend([settings.noise, settings.position].map(|length| (length * 50.0).round() as u8));
    content.extend(number(settings.lost * 1e4, 10_000));
    content.extend(records);
    content.extend(likelihoods(settings).into_iter().flat_map(i16::to_le_bytes));
    content.extend(heights);
    let mut text = Vec::new();
    let placements = surfaces.iter().map(|surface| surface.placement.as_str());
    for name in std::iter::once(env!("CARGO_PKG_VERSION")).chain(objects.iter().map(String::as_str)).chain(placements) {
        text.push(
            u8::try_from(name.len())
                .map_err(|_| problem!("the name {name:?} is longer than 255 bytes").fix("Give it a shorter name."))?,
        );
        text.extend(name.bytes());
    }
    text.resize(text.len().next_multiple_of(4), 0);
    let stated = TrainedProbe {
        radius: probe.radius as f32,
        spacing: probe.spacing as f32,
        speed: probe.speed as f32,
        length: Length::Millimeter,
        cone: 0,
        stroke: probe.stroke.map(|stroke| stroke as f32),
        travel: probe.travel.map(|travel| travel as f32),
        stroke_tolerance: probe.stroke_tolerance.map(|tolerance| tolerance as f32),
    };
    let sections = vec![
        OwnedSection::new(Tag::Probe, false, &stated.to_bytes()[..stated.length()]),
        OwnedSection::new(Tag::Maps, true, content),
    ];
    let header = HeaderBuilder::default()
        .with_layout(MAPS_LAYOUT)
        .with_last_object(u8::try_from(objects.len() - 1).unwrap_or(u8::MAX))
        .with_odds(crate::calibrate::odds_of(settings.margin()))
        .with_max_touches(settings.max_touches);
    let bytes = file(header, text, sections, Vec::new())?;
    Maps::new(&bytes).map_err(refused)?;
    Ok(bytes)
}

/// Statement of a calibration.
#[derive(Clone, Debug)]
pub(super) struct Restated {
    pub(super) odds: u64,
    pub(super) max_touches: u32,
    /// Least fit of each object, in 1/64 nat, as a test for unknown objects; none: no test.
    pub(super) least_fits: Vec<i16>,
    /// See [`CastSettings::stretch`].
    pub(super) stretch: u16,
    pub(super) promise: Option<Promise>,
}

/// The model with other statements.
///
/// # Errors
/// When the model could not be read then.
pub(super) fn restated(maps: Maps<'_>, stated: &Restated) -> Result<Vec<u8>> {
    let &Restated { odds, max_touches, ref least_fits, stretch, promise } = stated;
    let mut content = maps.section(Tag::Maps).unwrap_or_default().to_vec();
    content[STRETCH..STRETCH + 2].copy_from_slice(&stretch.to_le_bytes());
    for record in content[MAPS_LENGTH..].chunks_exact_mut(PLACEMENT_LENGTH).take(maps.placements()) {
        let least = least_fits.get(usize::from(record[0])).copied().unwrap_or(0);
        record[PLACEMENT_LENGTH - 2..].copy_from_slice(&least.to_le_bytes());
    }
    let promise = promise.map(|promise| (false, promise.write(<[u8]>::to_vec)));
    let restated = compile::Restated {
        odds: Some(odds),
        max_touches: Some(max_touches),
        sections: vec![(Tag::Maps, Some((true, content))), (Tag::Promise, promise)],
        ..compile::Restated::default()
    };
    let bytes = restated_file(maps.model(), &restated)?;
    Maps::new(&bytes).map_err(refused)?;
    Ok(bytes)
}

/// Place of the factor of intervals in a section of maps.
const STRETCH: usize = 12;

/// Writes a surface's heights, cells first and then the windows' minima and maxima, and returns how many cells each level has on
/// each side of its middle.
fn levels(surface: &Surface, bytes: &mut Vec<u8>, scale: u16) -> Vec<[i32; 2]> {
    let count = |height: f64| height * SIXTEENTHS * 64.0 / f64::from(scale);
    let [x, y] = surface.half;
    let mut halves = vec![[x, y]];
    for j in -y..=y {
        bytes.extend((-x..=x).map(|i| count(surface.at(i, j)).round().min(255.0) as u8));
    }
    let cell = surface.cell as i32;
    for window in WINDOWS {
        let half = [x, y].map(|half| half * cell / window + 2);
        halves.push(half);
        let reach = window / cell;
        for j in -half[1]..=half[1] {
            for i in -half[0]..=half[0] {
                let [mut low, mut high] = [f64::INFINITY, 0.0_f64];
                for v in -reach..=reach {
                    for u in -reach..=reach {
                        if (u * u + v * v) * 10 <= reach * reach * DISC {
                            let height = surface.at(i * reach + u, j * reach + v);
                            (low, high) = (low.min(height), high.max(height));
                        }
                    }
                }
                bytes.extend([count(low).floor() as u8, count(high).ceil().min(255.0) as u8]);
            }
        }
    }
    halves
}

/// Logarithms of the likelihoods of contacts and of missing ones, in 1/64 nat.
fn likelihoods(settings: &CastSettings) -> Vec<i16> {
    let CastSettings { noise, lost, outliers, .. } = *settings;
    // Rounding to cells adds to the noise.
    let sigma = noise.hypot(settings.blur());
    let log = |likelihood: f64| (likelihood.max(1e-200).ln() * NAT).round().max(-32_000.0) as i16;
    let gauss = |distance: f64| (-0.5 * (distance / sigma).powi(2)).exp();
    let around = (std::f64::consts::TAU).sqrt() * sigma;
    let mut all = Vec::new();
    for is_near in [false, true] {
        for width in (0..WIDTHS).map(middle) {
            for distance in 0..DISTANCES {
                let own = if distance == DISTANCES - 1 { 0.0 } else { gauss(distance as f64 / 8.0) / (width + around) };
                let table = if is_near { lost / (2.5 * sigma) } else { 0.0 };
                all.push(log(own * (1.0 - lost) + outliers + table));
            }
        }
    }
    all.extend((0..WITHIN).map(|share| log((share as f64 / 64.0).max(0.02) * (1.0 - lost) + lost)));
    all.extend((0..BEYOND).map(|distance| log(0.3 * gauss(distance as f64 / 8.0) + lost + outliers)));
    all.push(log(settings.table_missed.max(lost)));
    all
}

/// Middle of a bin of widths, in millimeters: half millimeters, then two for each octave.
fn middle(bin: usize) -> f64 {
    match bin {
        0 => 0.0,
        1..=3 => 0.5 * bin as f64 + 0.25,
        _ => {
            let octave = 0.5 * f64::from(1_u32 << (bin / 2));
            let middle = octave * (1.0 + 0.5 * (bin % 2) as f64) + octave / 4.0;
            if bin == WIDTHS - 1 { middle * 1.3 } else { middle }
        }
    }
}
