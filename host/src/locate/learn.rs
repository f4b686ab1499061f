//! Maps of placements, learned from touches with positions.

use super::Settings;
use super::contacts::{Met, heights};
use super::error::LocateProblem;
use super::grid::{count, index, mean, places};
use super::register::recorded;
use super::surface::{SAME, Surface, TABLE, footprint};
use crate::error::{Error, Result};
use crate::probe::approach::Probe;
use crate::touches::{Dataset, ObjectTouches, Source};
use palpate_shared::format::Length;
use rayon::prelude::*;

/// Cells without an own sample take the mean of those about them, as far as this, in cells.
const FILLED: usize = 4;
/// Turns that are compared for that.
const TURNS: usize = 72;

/// Learns the maps of a data set's placements. Equal placements of an object become one.
///
/// # Errors
/// [`LocateProblem`] if touches have no position, or the probe is not in millimeters, or an object was not met.
pub fn learn(dataset: &Dataset, settings: &Settings) -> Result<Vec<Surface>> {
    let probe = super::probe_of(dataset)?;
    let each: Vec<Vec<Surface>> = dataset
        .objects
        .par_iter()
        .enumerate()
        .map(|(object, touches)| of_object(object, touches, &probe, settings))
        .collect::<Result<_>>()?;
    let surfaces = each.concat();
    if surfaces.len() > 255 {
        return Err(LocateProblem::Placements { found: surfaces.len() }.into());
    }
    Ok(surfaces)
}

fn of_object(object: usize, touches: &ObjectTouches, probe: &Probe, settings: &Settings) -> Result<Vec<Surface>> {
    let placements = touches.placement_weights().unwrap_or_else(|| vec![(String::new(), 1.0)]);
    let mut surfaces: Vec<Surface> = Vec::new();
    for (placement, share) in placements {
        let is_own =
            |source: &usize| placement.is_empty() || touches.sources()[*source].placement() == Some(&placement);
        let sources: Vec<usize> = (0..touches.sources().len()).filter(is_own).collect();
        let named = |problem: Error| match problem.problem() {
            Some(LocateProblem::NotMet { object, .. }) => {
                LocateProblem::NotMet { object: object.clone(), placement: placement.clone() }.into()
            }
            _ => problem,
        };
        for surface in of_placement(touches, &sources, probe, settings).map_err(named)? {
            let named = Surface {
                object,
                placement: placement.clone() + &surface.placement,
                share: share * surface.share,
                ..surface
            };
            let same = surfaces.iter_mut().find(|other| {
                (0..TURNS).any(|turn| named.differs(other, turn as f64 / TURNS as f64 * std::f64::consts::TAU) < SAME)
            });
            match same {
                Some(other) => other.share += named.share,
                None => surfaces.push(Surface { is_round: named.looks_round(), ..named }),
            }
        }
    }
    Ok(surfaces)
}

/// The surfaces of a placement: one, or several of recordings whose places relative to each other are not sure.
fn of_placement(
    touches: &ObjectTouches,
    sources: &[usize],
    probe: &Probe,
    settings: &Settings,
) -> Result<Vec<Surface>> {
    let not_met = || LocateProblem::NotMet { object: touches.name.clone(), placement: String::new() };
    let is_recorded = |source: &usize| !matches!(touches.sources()[*source], Source::Placement { .. });
    let by_source = touches.by_source();
    let all = || sources.iter().flat_map(|source| &by_source[*source]);
    let no_position = |touch: &usize| LocateProblem::NoPosition { object: touches.name.clone(), touch: touch + 1 };
    let mut met = Vec::new();
    for touch in all() {
        let heights = heights(&touches.touches()[*touch], probe).ok_or_else(|| no_position(touch))?;
        met.extend(heights.into_iter().flatten().map(|own: Met| Met { height: own.height.max(0.0), ..own }));
    }
    if sources.iter().all(is_recorded) && is_few(&met) {
        let recordings = sources
            .iter()
            .map(|source| by_source[*source].iter().map(|touch| touches.touches()[*touch]).collect::<Vec<_>>());
        return recorded(&touches.name, &recordings.collect::<Vec<_>>(), probe, settings);
    }
    let surface = surface(&met, settings.cell());
    if surface.top() <= TABLE { Err(not_met().into()) } else { Ok(vec![surface]) }
}

/// True if most of a recorded object's cells were not met.
fn is_few(met: &[Met]) -> bool {
    let raised = || met.iter().filter(|met| met.height > TABLE);
    let side = |of: fn(&Met) -> f64| {
        let [low, high] = raised().map(of).fold([0.0_f64; 2], |[low, high], at| [low.min(at), high.max(at)]);
        high - low
    };
    (met.len() as f64) < 2.0 * side(|met| met.x) * side(|met| met.y)
}

/// The surface that heights were met on: in each cell their median.
fn surface(met: &[Met], cell: f64) -> Surface {
    let place = |met: &Met| [met.x, met.y].map(|place| (place / cell).round() as i32);
    let mut half = [1; 2];
    for met in met.iter().filter(|met| met.height > TABLE) {
        half = [0, 1].map(|axis| half[axis].max(place(met)[axis].abs()).min(MOST));
    }
    let mut cells = vec![Vec::new(); count(half)];
    let mut middles = vec![Vec::new(); count(half)];
    for met in met {
        let at = place(met);
        let Some(position) = index(half, at) else { continue };
        cells[position].push(met.height);
        // A cell holds the height in its middle: of coarse cells the samples near it count.
        if [met.x, met.y].iter().zip(at).all(|(place, cell_at)| (place - f64::from(cell_at) * cell).abs() <= MIDDLE) {
            middles[position].push(met.height);
        }
    }
    cells.iter_mut().zip(middles).filter(|(_, middle)| !middle.is_empty()).for_each(|(cell, middle)| *cell = middle);
    let mut known: Vec<Option<f64>> = cells.iter_mut().map(|heights| median(heights)).collect();
    let own: Vec<bool> = known.iter().map(Option::is_some).collect();
    for _ in 0..FILLED {
        let before = known.clone();
        for at in places(half) {
            if let Some(slot @ None) = index(half, at).map(|cell| &mut known[cell]) {
                *slot = mean(SIDES.iter().filter_map(|by| before[index(half, [at[0] + by[0], at[1] + by[1]])?]));
            }
        }
    }
    let heights: Vec<f64> = known.into_iter().map(|height| height.unwrap_or(0.0)).collect();
    footprint(half, cell, &heights, &own)
}

/// Distance from a cell's middle along each axis up to which heights count as those in the middle, in millimeters.
const MIDDLE: f64 = 0.5;
/// Largest number of cells on each side of the middle one.
const MOST: i32 = 250;
const SIDES: [[i32; 2]; 4] = [[1, 0], [-1, 0], [0, 1], [0, -1]];

pub(super) fn median(heights: &mut [f64]) -> Option<f64> {
    heights.sort_unstable_by(f64::total_cmp);
    let (low, high) = (heights.get(heights.len().checked_sub(1)? / 2)?, heights.get(heights.len() / 2)?);
    Some((low + high) / 2.0)
}

/// The probe of a data set, at true size.
///
/// # Errors
/// [`LocateProblem::Unit`] unless it states one in millimeters.
pub fn probe_of(dataset: &Dataset) -> Result<Probe> {
    let origin = dataset.origin.as_ref();
    let origin = origin.filter(|origin| origin.unit == Length::Millimeter).ok_or(LocateProblem::Unit)?;
    Ok::<_, Error>(origin.probe)
}
