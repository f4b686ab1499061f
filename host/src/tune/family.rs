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
    progress.begin("trainings", Some((1 + TREES.len() + tables.len()) as u64));
    let mut family = Vec::new();
    let mut add = |depth: usize, eta: f64, bins: Option<[usize; 2]>, stops: &[usize]| -> Result<()> {
        let rounds = stops.iter().copied().max().unwrap_or(1);
        let feature_bins = bins.map(Vec::from);
        let ensemble =
            train_ensemble(dataset, &train::Settings { rounds, depth, eta, feature_bins, ..base.clone() }, &())?;
        for &trees in stops {
            let bins = bins.map_or_else(|| vec![base.bins], Vec::from);
            let first = Ensemble { trees: ensemble.trees[..trees].to_vec(), ..ensemble.clone() };
            family.push((Recipe { trees, depth, eta, bins }, first));
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
    Ok(family)
}
