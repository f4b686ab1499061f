//! The layouts: the same trees as different bytes.

use super::axes::Axes;
use super::cells::Cells;
use super::cost::{Instructions, Shape};
use super::forest::Forest;
use super::parts::Parts;
use super::quantize::Scale;
use super::rounding;
use super::share::share;
use super::table;
use super::trees::{self, Leaves, Run, Sections};
use crate::error::{CompileProblem, Result};
use palpate_shared::format::{Layout, LeafType};
use std::cell::OnceCell;

/// Layouts of a forest: the one that was asked for, or all that fit.
pub(super) fn candidates(
    forest: &Forest<'_>,
    axes: &Axes,
    cells: Option<&Cells>,
    leaf: LeafType,
    wanted: Option<Layout>,
    shared: Option<bool>,
) -> Result<Vec<(Layout, Parts)>> {
    let mut layouts = wanted
        .map_or_else(|| vec![Layout::Complete, Layout::Compact, Layout::Grid, Layout::Patterns], |layout| vec![layout]);
    if !trees::fits_narrow(forest, axes) {
        layouts.iter_mut().filter(|layout| **layout == Layout::Compact).for_each(|layout| *layout = Layout::Wide);
    }
    let mut candidates = Vec::new();
    let scale = Scale::for_trees(forest, leaf);
    // The same for every layout that walks trees, and slow to find.
    let error = OnceCell::new();
    let scale = scale
        .as_ref()
        .map(|scale| (scale, || *error.get_or_init(|| rounding::margin_error(forest, cells, leaf, scale))));
    for layout in layouts {
        let walked = |write: &dyn Fn(&[Run], &mut Leaves<'_>) -> Option<Sections>| {
            let (scale, error) = scale.as_ref()?;
            walked(forest, layout, scale, error, leaf, write)
        };
        let parts = match layout {
            Layout::Complete => walked(&|runs, leaves| trees::complete(forest, axes, runs, leaves)),
            Layout::Compact => walked(&|runs, leaves| trees::compact(forest, axes, runs, leaves)),
            Layout::Wide => walked(&|runs, leaves| trees::wide(forest, runs, leaves)),
            Layout::Grid => cells.and_then(|cells| table::grid(forest, cells, leaf)),
            Layout::Patterns => cells.and_then(|cells| table::patterns(forest, cells, leaf)),
        };
        match parts {
            Some(parts) => {
                let sharing = if shared == Some(false) { None } else { share(&parts, leaf, forest.objects()) };
                let sharing = sharing.filter(|sharing| shared == Some(true) || sharing.bytes() < parts.bytes());
                if shared != Some(true) || sharing.is_none() {
                    candidates.push((layout, parts));
                }
                if let Some(mut parts) = sharing {
                    parts.instructions = instructions(layout, leaf, forest.objects(), &parts);
                    candidates.push((layout, parts));
                }
            }
            None if wanted.is_some() => return Err(CompileProblem::DoesNotFit { layout }.into()),
            None => {}
        }
    }
    Ok(candidates)
}

/// The parts of a layout that walks trees; `write` writes its sections and leaves.
fn walked(
    forest: &Forest<'_>,
    layout: Layout,
    scale: &Scale,
    margin_error: &impl Fn() -> f32,
    leaf: LeafType,
    write: &dyn Fn(&[Run], &mut Leaves<'_>) -> Option<Sections>,
) -> Option<Parts> {
    let mut leaves = Leaves::new(leaf, scale);
    let runs = trees::runs(forest, leaf, scale);
    let Sections { axes, cuts, groups, nodes } = write(&runs, &mut leaves)?;
    if groups.len() > usize::from(u16::MAX) {
        return None;
    }
    let base = forest.base.iter().map(|&base| base_bits(base, leaf, scale)).collect();
    let (unit, margin_error) = (scale.unit, margin_error());
    let leaves_bytes = leaves.into_bytes();
    let none = Instructions { m4f: 0, m0_plus: None };
    let mut parts = Parts {
        axes,
        cuts,
        groups,
        nodes,
        leaves: leaves_bytes,
        shared: None,
        base,
        unit,
        margin_error,
        instructions: none,
    };
    parts.instructions = instructions(layout, leaf, forest.objects(), &parts);
    Some(parts)
}

/// Instructions of a touch in a layout that walks trees.
fn instructions(layout: Layout, leaf: LeafType, objects: usize, parts: &Parts) -> Instructions {
    let Parts { axes, groups, nodes, shared, .. } = parts;
    let is_shared = shared.is_some();
    Instructions::new(&Shape { layout, leaf, objects, axes: axes.len(), groups, nodes, is_shared })
}

fn base_bits(base: f32, leaf: LeafType, scale: &Scale) -> i32 {
    if leaf == LeafType::F32 { base.to_bits().cast_signed() } else { scale.integer(base, 0) }
}
