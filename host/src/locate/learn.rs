//! Maps of placements: cast at meshes, or learned from recorded touches with positions.

use super::error::LocateProblem;
use super::register::recorded;
use super::surface::{SAME, Surface, TABLE};
use super::{Settings, Standing};
use crate::error::{Error, Result};
use crate::probe::approach::Probe;
use crate::touches::{Dataset, ObjectTouches};
use palpate_shared::Touch;
use palpate_shared::format::Length;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Turns that are compared to find equal placements.
const TURNS: usize = 72;
/// Farthest cell from the middle of a map, in cells.
const MOST: i32 = 250;

/// Casts the maps of objects that stand on a table: what a fingertip meets in the middle of each cell. Poses that look the same have one.
/// Cost: a cast for each cell.
///
/// # Errors
/// [`LocateProblem`] for an object that is too large for a map, or too flat to be felt.
pub fn cast(standing: &[Standing], probe: &Probe, settings: &Settings) -> Result<Vec<Surface>> {
    let of = |(object, stands): (usize, &Standing)| {
        let looks: Vec<_> = stands.looks().collect();
        let cast = |&(lying, share): &(&super::Lying, f64)| {
            let placement = lying.name.clone();
            if lying.half().truncate().max_element() + probe.radius > f64::from(MOST) * settings.cell() {
                return Err(LocateProblem::Large { object: stands.name.clone(), placement }.into());
            }
            let surface = Surface::cast(lying, probe.radius, settings.cell());
            if surface.top() <= TABLE {
                return Err(LocateProblem::NotMet { object: stands.name.clone(), placement }.into());
            }
            Ok(Surface { object, placement, share, is_round: surface.looks_round(), ..surface })
        };
        looks.par_iter().map(cast).collect::<Result<Vec<_>>>()
    };
    Ok(standing.par_iter().enumerate().map(of).collect::<Result<Vec<_>>>()?.concat())
}

/// Learns the maps of recorded objects. Equal placements of an object become one.
///
/// # Errors
/// [`LocateProblem`] if touches have no position, or the probe is not in millimeters, or an object was not met.
pub fn learn(dataset: &Dataset, settings: &Settings) -> Result<Vec<Surface>> {
    let probe = probe_of(dataset)?;
    let of = |(object, touches)| of_object(object, touches, &probe, settings);
    Ok(dataset.objects.par_iter().enumerate().map(of).collect::<Result<Vec<_>>>()?.concat())
}

fn of_object(object: usize, touches: &ObjectTouches, probe: &Probe, settings: &Settings) -> Result<Vec<Surface>> {
    if let Some(touch) = touches.touches().iter().position(|touch| touch.position().is_none()) {
        return Err(LocateProblem::NoPosition { object: touches.name.clone(), touch: touch + 1 }.into());
    }
    let placements = touches.placement_weights().unwrap_or_else(|| vec![(String::new(), 1.0)]);
    let by_source = touches.by_source();
    let mut surfaces: Vec<Surface> = Vec::new();
    for (placement, share) in placements {
        let is_own =
            |source: &usize| placement.is_empty() || touches.sources()[*source].placement() == Some(&placement);
        let recordings: Vec<Vec<Touch>> = (0..touches.sources().len())
            .filter(is_own)
            .map(|source| by_source[source].iter().map(|touch| touches.touches()[*touch]).collect())
            .collect();
        let named = |problem: Error| match problem.problem() {
            Some(LocateProblem::NotMet { object, .. }) => {
                LocateProblem::NotMet { object: object.clone(), placement: placement.clone() }.into()
            }
            _ => problem,
        };
        for surface in recorded(&touches.name, &recordings, probe, settings).map_err(named)? {
            let named = Surface {
                object,
                placement: placement.clone() + &surface.placement,
                share: share * surface.share,
                ..surface
            };
            let is_same = |other: &&mut Surface| {
                (0..TURNS).any(|turn| named.differs(other, turn as f64 / TURNS as f64 * TAU) < SAME)
            };
            match surfaces.iter_mut().find(is_same) {
                Some(other) => other.share += named.share,
                None => surfaces.push(Surface { is_round: named.looks_round(), ..named }),
            }
        }
    }
    Ok(surfaces)
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
