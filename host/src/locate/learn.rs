//! Maps of placements: cast at meshes, or learned from recorded touches with positions.

use super::refused::{not_met, too_large};
use super::register::recorded;
use super::surface::{SAME, Surface, TABLE};
use super::{CastSettings, Standing};
use crate::error::{Error, Result, problem};
use crate::probe::approach::Probe;
use crate::touches::{Dataset, ObjectTouches, Pool};
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
/// When an object is too large for a map, or too flat to be felt.
pub fn cast(standing: &[Standing], probe: &Probe, settings: &CastSettings) -> Result<Vec<Surface>> {
    let of = |(object, stands): (usize, &Standing)| {
        let looks: Vec<_> = stands.looks().collect();
        let cast = |&(lying, share): &(&super::Lying, f64)| {
            let placement = lying.name.clone();
            if lying.half().truncate().max_element() + probe.radius > f64::from(MOST) * settings.cell() {
                return Err(too_large(&stands.name, &placement));
            }
            let surface = Surface::cast(lying, probe.radius, settings.cell());
            if surface.top() <= TABLE {
                return Err(not_met(&stands.name, &placement));
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
/// When touches have no position, the probe is not in millimeters, or an object was not met.
pub fn learn(dataset: &Dataset, settings: &CastSettings) -> Result<Vec<Surface>> {
    let probe = probe_of(dataset)?;
    let of = |(object, touches)| of_object(object, touches, &probe, settings);
    Ok(dataset.objects.par_iter().enumerate().map(of).collect::<Result<Vec<_>>>()?.concat())
}

fn of_object(object: usize, touches: &ObjectTouches, probe: &Probe, settings: &CastSettings) -> Result<Vec<Surface>> {
    if let Some(touch) = touches.touches().iter().position(|touch| touch.position().is_none()) {
        return Err(problem!("{}: touch {} has no position", touches.name, touch + 1)
            .fix("State the position of every touch, or of none: the last three columns of a line."));
    }
    let placements = touches.placement_weights().unwrap_or_else(|| vec![(String::new(), 1.0)]);
    let mut surfaces: Vec<Surface> = Vec::new();
    for (placement, share) in placements {
        let is_own = |pool: &&Pool| placement.is_empty() || pool.source.placement() == Some(&placement);
        let recordings: Vec<Vec<Touch>> =
            touches.pools().iter().filter(is_own).map(|pool| touches.of_pool(pool).to_vec()).collect();
        let named = |error: Error| match placement.is_empty() {
            true => error,
            false => error.within(format_args!("{placement}: ")),
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
/// When it states none in millimeters.
pub fn probe_of(dataset: &Dataset) -> Result<Probe> {
    let origin = dataset.origin.as_ref();
    let origin = origin.filter(|origin| origin.unit == Length::Millimeter).ok_or_else(|| {
        problem!("the touches are not of objects at their true size").fix("State the probe in millimeters (--probe).")
    })?;
    Ok::<_, Error>(origin.probe)
}
