//! Maps of placements, learned from touches with positions.

use super::Settings;
use super::error::LocateProblem;
use super::register::recorded;
use super::shape::Relief;
use crate::error::{Error, Result};
use crate::probe::approach::{FINGERS, Probe};
use crate::touches::{Dataset, ObjectTouches, Source};
use palpate_shared::Touch;
use palpate_shared::format::Length;
use rayon::prelude::*;

/// Heights above this are the object's, in millimeters: what is below may be noise on the table.
const TABLE: f64 = 0.3;
/// Cells without an own sample take the mean of those about them, as far as this, in cells.
const FILLED: usize = 4;
/// Two placements of an object are the same where their heights differ by less than this on average, in millimeters.
pub(super) const SAME: f64 = 0.8;
/// Turns that are compared for that.
const TURNS: usize = 72;
/// A placement is round where its heights differ from their mean at the same distance by less than this, in millimeters.
const ROUND: f64 = 1.2;

/// Guesses below this are the table's, in millimeters.
const FEW: f64 = 0.8;
/// A guess is known if it is off by no more than this, in millimeters.
const KNOWN: f64 = 2.0;

/// A height that a fingertip met, in the placement's frame, in millimeters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Met {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) height: f64,
}

/// The heights of a placement on a grid about its origin.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Position of the object among the data set's.
    pub object: usize,
    /// Name of the placement; empty for an object without.
    pub placement: String,
    /// Share of the object.
    pub share: f64,
    /// Millimeters between cells.
    pub cell: f64,
    /// Cells on each side of the middle one.
    pub half: [i32; 2],
    /// Heights in millimeters, row by row.
    pub heights: Vec<f64>,
    /// Share of the cells within the footprint that a touch met.
    pub known: f64,
    /// True if it looks the same from all sides.
    pub is_round: bool,
}

impl Surface {
    /// One with these heights in cells of 1 mm.
    pub(super) fn of(object: usize, half: [i32; 2], height: impl Fn([i32; 2]) -> f64) -> Self {
        let heights = places(half).map(height).collect();
        let (placement, share, cell, known, is_round) = (String::new(), 1.0, 1.0, 1.0, false);
        Self { object, placement, share, cell, half, heights, known, is_round }
    }

    /// The height of a cell; 0 outside.
    pub(super) fn at(&self, i: i32, j: i32) -> f64 {
        index(self.half, [i, j]).map_or(0.0, |cell| self.heights[cell])
    }

    /// The height of the cell nearest to a point, in millimeters.
    fn near(&self, x: f64, y: f64) -> f64 {
        self.at((x / self.cell).round() as i32, (y / self.cell).round() as i32)
    }

    /// Each cell's place, in millimeters, and height.
    fn cells(&self) -> impl Iterator<Item = ([f64; 2], f64)> + '_ {
        places(self.half).map(|[i, j]| ([i, j].map(|place| f64::from(place) * self.cell), self.at(i, j)))
    }

    /// Farthest point that is higher than the table.
    pub(super) fn radius(&self) -> f64 {
        self.cells().filter(|(_, height)| *height > TABLE).map(|([x, y], _)| x.hypot(y)).fold(0.0, f64::max)
    }

    /// Greatest height.
    pub(super) fn top(&self) -> f64 {
        self.heights.iter().copied().fold(0.0, f64::max)
    }

    /// Mean difference of heights from another's that is turned, over the cells of either.
    pub(super) fn differs(&self, other: &Self, turn: f64) -> f64 {
        let (sin, cos) = turn.sin_cos();
        let (mut sum, mut count) = (0.0, 0.0_f64);
        for ([x, y], height) in self.cells() {
            let turned = other.near(cos * x + sin * y, cos * y - sin * x);
            sum += (height - turned).abs();
            count += f64::from(u8::from(height > TABLE || turned > TABLE));
        }
        sum / count.max(1.0)
    }

    fn looks_round(&self) -> bool {
        let reach = self.radius() / self.cell + 2.0;
        let mut rings = vec![(0.0, 0.0); reach as usize + 2];
        let ring = |[x, y]: [f64; 2]| (x.hypot(y) / self.cell).round() as usize;
        for (place, height) in self.cells() {
            if let Some((sum, count)) = rings.get_mut(ring(place)) {
                *sum += height;
                *count += 1.0;
            }
        }
        let (mut sum, mut count) = (0.0, 0.0_f64);
        for (place, height) in self.cells() {
            let Some((all, cells)) = rings.get(ring(place)) else { continue };
            sum += (height - all / cells).abs();
            count += f64::from(u8::from(height > TABLE));
        }
        sum / count.max(1.0) < ROUND
    }
}

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

/// Fingertips of a touch at its first contact; none without a position or pose.
pub(super) fn tips(touch: &Touch, probe: &Probe) -> Option<[Met; FINGERS]> {
    let (pose, position) = (touch.pose()?, touch.position()?);
    let [x, y, z] = position.micrometers.map(|micrometers| f64::from(micrometers) / 1_000.0);
    let one = f64::from(palpate_shared::Q15_ONE);
    let row = pose.alignment.map(|share| f64::from(share) / one * probe.spacing);
    Some([-1.0, 0.0, 1.0].map(|finger| Met {
        x: x + finger * row[0],
        y: y + finger * row[1],
        height: z + finger * row[2],
    }))
}

/// Heights that the fingers of a touch met; none without a position or pose.
pub(super) fn heights(touch: &Touch, probe: &Probe) -> Option<[Option<Met>; FINGERS]> {
    let (tips, times) = (tips(touch, probe)?, touch.times());
    Some(std::array::from_fn(|finger| {
        let micros = times[finger].micros()?;
        let Met { x, y, height } = tips[finger];
        Some(Met { x, y, height: height - f64::from(micros) * 1e-6 * probe.speed })
    }))
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

/// The surface of an object whose touches are few: guesses between them, about the middle of its footprint.
pub(super) fn guessed(relief: &Relief, cell: f64) -> Surface {
    let step = cell.round() as i32;
    let half = relief.half.map(|half| half / step);
    let at = |place: [i32; 2]| index(relief.half, place.map(|axis| axis * step));
    let height =
        |cell: usize| if relief.may_be_object(cell) && relief.heights[cell] > FEW { relief.heights[cell] } else { 0.0 };
    let heights: Vec<f64> = places(half).map(|place| at(place).map_or(0.0, height)).collect();
    let is_known = |cell: usize| !relief.is_guessed(cell, KNOWN);
    let known: Vec<bool> = places(half).map(|place| at(place).is_some_and(is_known)).collect();
    footprint(half, cell, &heights, &known)
}

/// The part of a grid that an object stands on.
fn footprint(half: [i32; 2], cell: f64, heights: &[f64], own: &[bool]) -> Surface {
    // What rises from the table with its neighbors; one cell alone is noise.
    let is_object = |at: [i32; 2]| {
        let about = places([2, 2]).filter_map(|by| Some(heights[index(half, [at[0] + by[0], at[1] + by[1]])?]));
        mean(about).is_some_and(|mean| mean > TABLE)
    };
    let footprint = pieces(half, places(half).filter(|at| is_object(*at)).collect());
    let reach = |axis: usize| footprint.iter().map(|at| at[axis].abs()).max().unwrap_or(0) + MARGIN;
    let cropped = [reach(0), reach(1)];
    let mut surface = vec![0.0; count(cropped)];
    for at in &footprint {
        if let (Some(to), Some(from)) = (index(cropped, *at), index(half, *at)) {
            surface[to] = heights[from];
        }
    }
    let known = footprint.iter().filter(|at| index(half, **at).is_some_and(|cell| own[cell])).count();
    let known = known as f64 / footprint.len().max(1) as f64;
    let (object, placement, is_round) = (0, String::new(), false);
    Surface { object, placement, share: 1.0, cell, half: cropped, heights: surface, known, is_round }
}

/// Cells of the connected pieces that are at least a twentieth of the largest: noise on the table makes small ones.
pub(super) fn pieces(half: [i32; 2], cells: Vec<[i32; 2]>) -> Vec<[i32; 2]> {
    let mut is_free = vec![false; count(half)];
    cells.iter().filter_map(|at| index(half, *at)).for_each(|cell| is_free[cell] = true);
    let mut pieces = Vec::new();
    for at in cells {
        let mut piece = Vec::new();
        let mut next = vec![at];
        while let Some(at) = next.pop() {
            if let Some(free) = index(half, at).map(|cell| &mut is_free[cell]).filter(|free| **free) {
                *free = false;
                piece.push(at);
                next.extend(places([1, 1]).map(|by| [at[0] + by[0], at[1] + by[1]]));
            }
        }
        pieces.push(piece);
    }
    let largest = pieces.iter().map(Vec::len).max().unwrap_or(0);
    pieces.retain(|piece| piece.len() * 20 >= largest);
    pieces.concat()
}

/// Distance from a cell's middle along each axis up to which heights count as those in the middle, in millimeters.
const MIDDLE: f64 = 0.5;
/// Largest number of cells on each side of the middle one.
const MOST: i32 = 250;
/// Cells about the footprint.
const MARGIN: i32 = 3;
const SIDES: [[i32; 2]; 4] = [[1, 0], [-1, 0], [0, 1], [0, -1]];

pub(super) fn count([x, y]: [i32; 2]) -> usize {
    ((2 * x + 1) * (2 * y + 1)) as usize
}

/// All cells of a grid.
pub(super) fn places([x, y]: [i32; 2]) -> impl Iterator<Item = [i32; 2]> {
    (-y..=y).flat_map(move |j| (-x..=x).map(move |i| [i, j]))
}

/// The position of a cell in a grid, if it is in it.
pub(super) fn index([x, y]: [i32; 2], [i, j]: [i32; 2]) -> Option<usize> {
    (i.abs() <= x && j.abs() <= y).then(|| ((j + y) * (2 * x + 1) + i + x) as usize)
}

fn mean(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = numbers.fold((0.0, 0), |(sum, count), number| (sum + number, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

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
