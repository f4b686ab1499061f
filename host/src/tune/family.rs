//! The ensembles that tuning chooses from.

use super::{Recipe, Settings};
use crate::ensemble::Ensemble;
use crate::ensemble::train::{self, train as train_ensemble};
use crate::error::Result;
use crate::progress::{self, Progress};
use crate::touches::Dataset;

/// Trainings of ensembles for the layouts that walk trees: depth, eta, and the numbers of trees after which to stop.
const TREES: [(usize, f64, &[usize]); 6] = [
    (6, 0.3, &[12, 16, 20, 24, 30, 40]),
    (6, 0.6, &[6, 8, 12]),
    (5, 0.3, &[12, 16, 20, 24, 30, 40]),
    (5, 0.6, &[6, 8, 10, 12, 16]),
    (4, 0.4, &[12, 16, 20, 30, 40]),
    (4, 0.6, &[8, 12, 16, 20]),
];

/// Trainings for the table layout: bins of curvature and of slope. Accuracy depends on curvature, so it gets more.
const TABLES: [[usize; 2]; 9] =
    [[24, 8], [32, 12], [48, 12], [48, 24], [64, 16], [64, 24], [96, 24], [96, 48], [128, 32]];

/// A training of trees for little flash.
struct Small {
    depth: usize,
    eta: f64,
    threshold_cost: f64,
    /// The numbers of trees and of different leaves after which to stop.
    stops: &'static [(usize, usize)],
}

const SMALL: [Small; 3] = [
    Small { depth: 4, eta: 0.5, threshold_cost: 5e-5, stops: &[(8, 24), (12, 40), (18, 48)] },
    Small { depth: 5, eta: 0.4, threshold_cost: 4e-5, stops: &[(9, 56), (12, 72), (14, 80), (16, 88)] },
    Small {
        depth: 6,
        eta: 0.3,
        threshold_cost: 2e-5,
        stops: &[(9, 96), (11, 112), (13, 144), (15, 160), (16, 176), (24, 224), (32, 256)],
    },
];

/// With more objects than this, they are not tried: the fit takes time and memory for each object in each bin, and such a model
/// needs more than a few kilobytes anyway.
const MOST_OBJECTS: usize = 50;

/// Bins of each feature that these trees choose thresholds from: few are used, so they may be fine.
const FINE: usize = 512;

/// Trains the family; the first is the large one that all are compared with.
pub(super) fn train(
    dataset: &Dataset,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Vec<(Recipe, Ensemble)>> {
    let base = train::Settings {
        descriptor: settings.descriptor,
        probe: settings.probe,
        noise: settings.noise,
        ..train::Settings::compact()
    };
    let tables: &[[usize; 2]] = if settings.descriptor.feature_count() == 2 { &TABLES } else { &[] };
    let small: &[Small] = if dataset.objects.len() <= MOST_OBJECTS { &SMALL } else { &[] };
    progress.begin("trainings", Some((1 + TREES.len() + tables.len() + small.len()) as u64));
    let mut family = Vec::new();
    let mut add = |depth: usize, eta: f64, bins: Option<[usize; 2]>, stops: &[usize]| -> Result<()> {
        let rounds = stops.iter().copied().max().unwrap_or(1);
        let feature_bins = bins.map(Vec::from);
        let ensemble =
            train_ensemble(dataset, &train::Settings { rounds, depth, eta, feature_bins, ..base.clone() }, &())?;
        for &trees in stops {
            let bins = bins.map_or_else(|| vec![base.bins], Vec::from);
            let first = Ensemble { trees: ensemble.trees[..trees].to_vec(), ..ensemble.clone() };
            family.push((Recipe { trees, depth, eta, bins, different_leaves: None }, first));
        }
        progress::advance(progress, 1)
    };
    add(6, 0.15, None, &[120])?;
    for (depth, eta, stops) in TREES {
        add(depth, eta, None, stops)?;
    }
    for &bins in tables {
        add(6, 0.3, Some(bins), &[40])?;
    }
    for &Small { depth, eta, threshold_cost, stops } in small {
        let how = train::Settings { depth, eta, bins: FINE, leaf_bits: Some(8), ..base.clone() };
        let ensembles = train::train_small(dataset, &how, threshold_cost, stops, &())?;
        for (&(trees, leaves), ensemble) in stops.iter().zip(ensembles) {
            family.push((Recipe { trees, depth, eta, bins: vec![FINE], different_leaves: Some(leaves) }, ensemble));
        }
        progress::advance(progress, 1)?;
    }
    Ok(family)
}
