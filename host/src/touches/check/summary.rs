//! Summary of a data set: counts, patterns, ranges, quantiles of features.

use super::{Found, Key, key};
use crate::touches::{Listing, ObjectTouches, Origin};
use palpate_shared::{Descriptor, Touch};
use std::collections::HashSet;

/// Contents of a data set, as far as they can be read.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Summary {
    /// The objects, in the order of their names.
    pub objects: Vec<ObjectSummary>,
    /// Origin of the touches, where the data set says so: the probe among other things.
    pub origin: Option<Origin>,
}

/// Summary of one object.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct ObjectSummary {
    /// The object's name.
    pub name: String,
    /// Number of touches.
    pub touches: u64,
    /// Number of approaches they took, where the data set says so.
    pub approaches: Option<u64>,
    /// Number of touches of each contact pattern, in the order of the patterns' codes: none, outer, middle, outer and
    /// middle, both outer, all.
    pub patterns: [u64; 6],
    /// Number of touches that equal an earlier one of the same object, to the microsecond.
    pub duplicates: u64,
    /// Number of touches with the probe's pose.
    pub posed: u64,
    /// Number of touches with the hand's position.
    #[serde(skip_serializing_if = "is_none")]
    pub located: u64,
    /// The longest time between two contacts, in seconds.
    pub longest: f64,
    /// Curvature of the full touches, in milliseconds; none without full touches.
    pub curvature: Option<Quantiles>,
    /// Slope of the full touches, in milliseconds.
    pub slope: Option<Quantiles>,
}

/// The least, the quantiles of 5, 25, 50, 75 and 95 %, and the largest.
pub type Quantiles = [f64; 7];

impl Summary {
    pub(super) fn of(objects: &[Found], listing: Option<Listing>) -> Self {
        let entries = listing.as_ref().map_or(&[][..], |listing| &listing.objects);
        let stated = |name: &str| entries.iter().find(|entry| entry.name == name).map(|entry| entry.approaches);
        let of = |object: &Found| ObjectSummary::of(&object.touches, stated(&object.touches.name));
        Self { objects: objects.iter().map(of).collect(), origin: listing.map(|listing| listing.origin) }
    }

    /// Number of touches in all.
    pub fn touches(&self) -> u64 {
        self.objects.iter().map(|object| object.touches).sum()
    }
}

impl ObjectSummary {
    fn of(object: &ObjectTouches, approaches: Option<u64>) -> Self {
        let touches = object.touches();
        let mut patterns = [0; 6];
        for touch in touches {
            if let Some(count) = patterns.get_mut(usize::from(touch.pattern().code())) {
                *count += 1;
            }
        }
        let mut known: HashSet<Key> = HashSet::with_capacity(touches.len());
        let duplicates = touches.iter().filter(|touch| !known.insert(key(touch))).count() as u64;
        let feature = |index: usize| {
            let full = touches.iter().filter(|touch| touch.is_full());
            let value = |touch: &Touch| Descriptor::Curvature.features(touch).as_slice().get(index).copied();
            quantiles(full.filter_map(value).collect())
        };
        Self {
            name: object.name.clone(),
            touches: touches.len() as u64,
            approaches,
            patterns,
            duplicates,
            posed: touches.iter().filter(|touch| touch.pose().is_some()).count() as u64,
            located: touches.iter().filter(|touch| touch.position().is_some()).count() as u64,
            longest: touches.iter().map(|touch| f64::from(touch.spread()) / 1e6).fold(0.0, f64::max),
            curvature: feature(0),
            slope: feature(1),
        }
    }
}

fn is_none(count: &u64) -> bool {
    *count == 0
}

/// The quantiles of microseconds, in milliseconds; none of nothing.
fn quantiles(mut values: Vec<i32>) -> Option<Quantiles> {
    values.sort_unstable();
    let last = values.len().checked_sub(1)?;
    Some([0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0].map(|share| {
        let index = (share * last as f64).round() as usize;
        f64::from(values.get(index).copied().unwrap_or_default()) / 1e3
    }))
}
