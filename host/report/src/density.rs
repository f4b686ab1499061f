//! A classifier by density estimation, for descriptors of two features.
//!
//! Both features are taken to the scale of their ranks among all touches, where every interval holds equally many; a
//! change of scale multiplies all objects' densities by the same factor, so it changes no posterior. There each object's touches are counted
//! into a grid and smoothed by a Gaussian kernel that is mirrored at the borders, its width the one of several that
//! explains held-out touches best.
//!
//! The result is written as an [`Ensemble`] of a single tree with one leaf per cell, so that it is evaluated like any other model.

use palpate::ensemble::{Ensemble, Node, Output, Provenance, Tree, feature_row, inputs};
use palpate::error::{Result, problem};
use palpate::touches::Dataset;
use palpate_shared::Descriptor;
use rayon::prelude::*;

/// Cells along each feature, at most.
pub(super) const CELLS: usize = 256;
/// Kernel widths to choose from, in cells.
const WIDTHS: [f64; 7] = [0.5, 0.8, 1.2, 1.8, 2.7, 4.0, 6.0];
/// Densities are mixed with this share of the mean density of all objects, so that no single cell rules an object out.
const FLOOR: f64 = 1e-3;

/// Counts of touches in the cells of a grid, `rows × columns`, one grid per object.
struct Grids {
    rows: usize,
    columns: usize,
    counts: Vec<Vec<f64>>,
}

/// The density classifier of `train`, its kernel's width chosen on `held_out`; and that width, in cells of a 256th of
/// all touches.
///
/// # Errors
/// A descriptor that has not exactly two features.
pub(super) fn density_model(descriptor: Descriptor, train: &Dataset, held_out: &Dataset) -> Result<(Ensemble, f64)> {
    let (train_rows, held_rows) = (rows(descriptor, train)?, rows(descriptor, held_out)?);
    let edges = [0, 1].map(|feature| edges(&train_rows, feature));
    let (counts, held) = (grids(&train_rows, &edges), grids(&held_rows, &edges));
    let losses = WIDTHS.into_par_iter().map(|width| (loss(&log_densities(&counts, width), &held), width));
    let best = losses.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(WIDTHS[0], |best| best.1);
    let logs = log_densities(&counts, best);
    let objects = train.names();
    let tree = tree(&edges, &logs);
    let base_margins = vec![0.0; objects.len()];
    Ok((
        Ensemble {
            inputs: inputs(descriptor),
            objects,
            base_margins,
            trees: vec![tree],
            origin: Provenance::default(),
        },
        best,
    ))
}

/// The features of every touch, one list per object.
fn rows(descriptor: Descriptor, data: &Dataset) -> Result<Vec<Vec<[f32; 2]>>> {
    data.objects
        .iter()
        .map(|object| {
            let row = |touch| <[f32; 2]>::try_from(feature_row(descriptor, touch)).ok();
            object.touches().par_iter().map(row).collect::<Option<Vec<_>>>().ok_or_else(|| {
                let (name, features) = (descriptor.name(), descriptor.feature_count());
                problem!("the descriptor {name} has {features} features, not two")
                    .fix("Estimate densities for the descriptor curvature only.")
            })
        })
        .collect()
}

/// Thresholds between cells that hold equally many touches of all objects, where values differ enough.
fn edges(rows: &[Vec<[f32; 2]>], feature: usize) -> Vec<f32> {
    // An even share of each object's touches is plenty for 256 quantiles.
    let mut values: Vec<f32> = rows
        .iter()
        .flat_map(|object| object.iter().step_by(object.len().div_ceil(20_000).max(1)))
        .map(|row| row[feature])
        .filter(|value| value.is_finite())
        .collect();
    values.sort_by(f32::total_cmp);
    let mut edges: Vec<f32> = (1..CELLS).filter_map(|k| values.get(k * values.len() / CELLS).copied()).collect();
    edges.dedup();
    // A cell holds what is below its edge, so an edge at the smallest value would close an empty one.
    edges.retain(|edge| values.first().is_some_and(|first| edge > first));
    edges
}

fn grids(rows: &[Vec<[f32; 2]>], edges: &[Vec<f32>; 2]) -> Grids {
    let (height, width) = (edges[0].len() + 1, edges[1].len() + 1);
    let cell = |feature: usize, value: f32| edges[feature].partition_point(|edge| *edge <= value);
    let counts = rows.par_iter().map(|object| {
        let mut counts = vec![0.0; height * width];
        for row in object {
            counts[cell(0, row[0]) * width + cell(1, row[1])] += 1.0;
        }
        counts
    });
    Grids { rows: height, columns: width, counts: counts.collect() }
}

/// The logarithm of each object's smoothed density in each cell, up to what is common to all objects.
fn log_densities(grids: &Grids, width: f64) -> Vec<Vec<f64>> {
    let smooth: Vec<Vec<f64>> = grids
        .counts
        .par_iter()
        .map(|counts| {
            let total = counts.iter().sum::<f64>().max(1.0);
            let across = blurred(counts, grids.rows, grids.columns, 1, grids.columns, width);
            let both = blurred(&across, grids.columns, grids.rows, grids.columns, 1, width);
            both.into_iter().map(|count| count / total).collect()
        })
        .collect();
    let cells = grids.rows * grids.columns;
    let mean: Vec<f64> =
        (0..cells).map(|cell| smooth.iter().map(|object| object[cell]).sum::<f64>() / smooth.len() as f64).collect();
    let log = |object: &Vec<f64>| {
        let mixed = |cell: usize| (1.0 - FLOOR) * object[cell] + FLOOR * mean[cell];
        (0..cells).map(|cell| if mean[cell] > 0.0 { (mixed(cell) / mean[cell]).ln() } else { 0.0 }).collect()
    };
    smooth.iter().map(log).collect()
}

/// `lines` lines of `length` cells, each blurred by a Gaussian `width` cells wide, mirrored at both ends. Cells of a line
/// are `step` apart, lines `line_step`.
fn blurred(cells: &[f64], lines: usize, length: usize, step: usize, line_step: usize, width: f64) -> Vec<f64> {
    let reach = (4.0 * width).ceil() as usize;
    let weight = |k: usize| (-0.5 * (k as f64 / width).powi(2)).exp();
    let total = weight(0) + 2.0 * (1..=reach).map(weight).sum::<f64>();
    let weights: Vec<f64> = (0..=reach).map(|k| weight(k) / total).collect();
    let mut out = vec![0.0; cells.len()];
    for line in 0..lines {
        for place in 0..length {
            let value = cells[line * line_step + place * step];
            if value == 0.0 {
                continue;
            }
            for (k, weight) in weights.iter().enumerate() {
                out[line * line_step + mirrored(place, k as i64, length) * step] += value * weight;
                if k > 0 {
                    out[line * line_step + mirrored(place, -(k as i64), length) * step] += value * weight;
                }
            }
        }
    }
    out
}

/// The cell `offset` cells from `place`, reflected at the borders as often as it takes.
fn mirrored(place: usize, offset: i64, length: usize) -> usize {
    let length = length as i64;
    let at = (place as i64 + offset).rem_euclid(2 * length);
    (if at < length { at } else { 2 * length - 1 - at }) as usize
}

/// Mean negative logarithm of the right object's posterior over held-out counts, objects weighted equally.
fn loss(logs: &[Vec<f64>], held: &Grids) -> f64 {
    let mut loss = 0.0;
    for (object, counts) in held.counts.iter().enumerate() {
        let total = counts.iter().sum::<f64>().max(1.0);
        for (cell, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0.0) {
            let all: f64 = logs.iter().map(|log| log[cell].exp()).sum();
            loss += count / total * (all.ln() - logs[object][cell]);
        }
    }
    loss / logs.len().max(1) as f64
}

/// A balanced tree over the edges of both features with the densities in its leaves.
fn tree(edges: &[Vec<f32>; 2], logs: &[Vec<f64>]) -> Tree {
    let mut nodes = Vec::new();
    let columns = edges[1].len() + 1;
    grow(&mut nodes, edges, [0..edges[0].len() + 1, 0..columns], &|row, column| {
        logs.iter().map(|log| log[row * columns + column] as f32).collect()
    });
    Tree { nodes, output: Output::Each }
}

/// Adds the subtree over these cells; returns its root.
fn grow(
    nodes: &mut Vec<Node>,
    edges: &[Vec<f32>; 2],
    cells: [std::ops::Range<usize>; 2],
    leaf: &impl Fn(usize, usize) -> Vec<f32>,
) -> usize {
    let index = nodes.len();
    let feature = usize::from(cells[0].len() < cells[1].len());
    let range = cells[feature].clone();
    if range.len() < 2 {
        nodes.push(Node::Leaf(leaf(cells[0].start, cells[1].start)));
        return index;
    }
    let middle = range.start + range.len() / 2;
    nodes.push(Node::Leaf(Vec::new()));
    let half = |range| {
        let mut cells = cells.clone();
        cells[feature] = range;
        cells
    };
    let left = grow(nodes, edges, half(range.start..middle), leaf);
    let right = grow(nodes, edges, half(middle..range.end), leaf);
    nodes[index] = Node::Split { feature, threshold: edges[feature][middle - 1], missing_left: true, left, right };
    index
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::ensemble::OverTouches;
    use palpate::touches::{ObjectTouches, Source};
    use palpate_shared::Touch;

    /// Two objects whose curvature lies around 0 and around 40 ms, with the same slopes.
    fn data(count: u32, offset: u32) -> Dataset {
        let object = |name: &str, bend: u32| {
            let touch = |k| {
                let spread = (k * 7_919 + offset) % 60_000;
                Touch::from_micros([0, 100_000 + spread + bend, 200_000 + (k * 104_729) % 50_000])
            };
            ObjectTouches::new(name, (0..count).map(touch).collect(), Source::Object)
        };
        Dataset::new(vec![object("a", 0), object("b", 30_000)])
    }

    #[test]
    fn the_tree_gives_each_cell_its_own_density() {
        let (train, held) = (data(20_000, 0), data(5_000, 11));
        let (model, width) = density_model(Descriptor::Curvature, &train, &held).unwrap();
        assert!(WIDTHS.contains(&width));
        // Where only one object ever is, its margin is higher by the floor's logarithm; where both are, about equal.
        let margin = |object: usize, k: usize| model.margins(&train.objects[object].touches()[k]);
        let mut right = 0;
        for object in 0..2 {
            for k in 0..1_000 {
                let margins = margin(object, k);
                right += usize::from(margins[object] >= margins[1 - object]);
            }
        }
        // Half of each object's touches lie where the other's do.
        assert!(right > 1_400, "{right}");
    }

    #[test]
    fn blurring_keeps_the_sum_and_mirrors_at_the_borders() {
        let cells = [4.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0];
        let out = blurred(&cells, 2, 5, 1, 5, 1.2);
        assert!((out[..5].iter().sum::<f64>() - 4.0).abs() < 1e-9, "{out:?}");
        assert!(out[0] > 1.5 && out[0] > out[1] && out[1] > out[2]);
        assert_eq!([mirrored(0, -1, 5), mirrored(4, 1, 5), mirrored(0, -6, 5), mirrored(2, 2, 5)], [0, 4, 4, 4]);
        // Down columns instead of along rows.
        let down = blurred(&[0.0, 1.0, 0.0, 0.0], 2, 2, 2, 1, 0.5);
        assert!(down[1] > 0.7 && down[3] > 0.05 && down[0] == 0.0);
    }
}
