//! The layouts: the same trees as different bytes.

use super::axes::Axes;
use super::cells::Cells;
use super::code::Program;
use super::code::Statements;
use super::cost::{Instructions, Shape};
use super::forest::Forest;
use super::merge::{Merged, merge};
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
    cells: Option<&Cells>,
    leaf: LeafType,
    wanted: Option<Layout>,
    shared: Option<bool>,
) -> Result<Vec<(Layout, Parts)>> {
    let mut layouts = wanted
        .map_or_else(|| vec![Layout::Complete, Layout::Compact, Layout::Grid, Layout::Patterns], |layout| vec![layout]);
    let scale = Scale::for_trees(forest, leaf);
    let merged = scale.as_ref().and_then(|scale| merge(forest, leaf, scale));
    // What is walked: fewer trees with the same sums, where there are such.
    let walk = Walk::new(forest, leaf, scale.as_ref(), merged.as_ref());
    let axes = &Axes::new(walk.forest);
    if !trees::fits_narrow(walk.forest, axes) {
        layouts.iter_mut().filter(|layout| **layout == Layout::Compact).for_each(|layout| *layout = Layout::Wide);
    }
    let mut candidates = Vec::new();
    // The same for every layout that walks trees, and slow to find.
    let error = OnceCell::new();
    let error = || {
        let bound = |scale: &Scale| rounding::margin_error(forest, cells, leaf, scale);
        *error.get_or_init(|| scale.as_ref().map_or(0.0, bound))
    };
    for layout in layouts {
        let walked =
            |write: &dyn Fn(&[Run], &mut Leaves<'_>) -> Option<Sections>| walked(&walk, layout, &error, leaf, write);
        let parts = match layout {
            Layout::Complete => walked(&|runs, leaves| trees::complete(walk.forest, axes, runs, leaves)),
            Layout::Compact => walked(&|runs, leaves| trees::compact(walk.forest, axes, runs, leaves)),
            Layout::Wide => walked(&|runs, leaves| trees::wide(walk.forest, runs, leaves)),
            Layout::Code => None,
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

/// The same trees as code, and what a model beside it has; `None` if they do not fit.
pub(super) fn code(
    forest: &Forest<'_>,
    cells: Option<&Cells>,
    leaf: LeafType,
    stated: &Statements,
) -> Option<(Program, Parts)> {
    if leaf == LeafType::F32 {
        return None;
    }
    let scale = Scale::for_trees(forest, leaf)?;
    let merged = merge(forest, leaf, &scale);
    let walk = Walk::new(forest, leaf, Some(&scale), merged.as_ref());
    let program = Program::new(walk.forest, walk.scale?, walk.base, stated)?;
    let parts = Parts {
        axes: Vec::new(),
        cuts: Vec::new(),
        groups: Vec::new(),
        nodes: Vec::new(),
        leaves: Vec::new(),
        shared: None,
        base: vec![0; forest.objects()],
        unit: scale.unit,
        margin_error: rounding::margin_error(forest, cells, leaf, &scale),
        instructions: Instructions { m4f: 0, m0_plus: None },
    };
    Some((program, parts))
}

/// Trees that layouts walk.
struct Walk<'f> {
    forest: &'f Forest<'f>,
    /// `None` where leaves do not fit their type.
    scale: Option<&'f Scale>,
    /// Starting values of the margins: in units, or f32 bits.
    base: Vec<i32>,
}

impl<'f> Walk<'f> {
    fn new(forest: &'f Forest<'f>, leaf: LeafType, scale: Option<&'f Scale>, merged: Option<&'f Merged<'f>>) -> Self {
        if let Some(merged) = merged {
            return Self { forest: &merged.forest, scale: Some(&merged.scale), base: merged.base.clone() };
        }
        let bits = |&base: &f32| scale.map_or(0, |scale| base_bits(base, leaf, scale));
        Self { forest, scale, base: forest.base.iter().map(bits).collect() }
    }
}

/// The parts of a layout that walks trees; `write` writes its sections and leaves.
fn walked(
    walk: &Walk<'_>,
    layout: Layout,
    margin_error: &impl Fn() -> f32,
    leaf: LeafType,
    write: &dyn Fn(&[Run], &mut Leaves<'_>) -> Option<Sections>,
) -> Option<Parts> {
    let (forest, scale) = (walk.forest, walk.scale?);
    let mut leaves = Leaves::new(leaf, scale);
    let runs = trees::runs(forest, leaf, scale);
    let Sections { axes, cuts, groups, nodes } = write(&runs, &mut leaves)?;
    if groups.len() > usize::from(u16::MAX) {
        return None;
    }
    let base = walk.base.clone();
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
