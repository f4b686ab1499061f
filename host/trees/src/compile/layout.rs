//! The layouts: the same trees as different bytes.

use super::axes::Axes;
use super::cells::Cells;
use super::code::{Form, Program, Statements};
use super::cost::{Instructions, Shape, on_average};
use super::early::{self, EarlyExitFound, Plan, Work};
use super::forest::Forest;
use super::merge::{Merged, merge};
use super::parts::Parts;
use super::quantize::Scale;
use super::rounding;
use super::share::share;
use super::table;
use super::trees::{self, Leaves, Sections};
use crate::error::{CompileProblem, Result};
use palpate_shared::format::{EarlyExit, Layout, LeafType, Sentinel};
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
        let parts = match layout {
            Layout::Complete | Layout::Compact | Layout::Wide => walk.parts(layout, axes, leaf, None, &error),
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
        exits: Vec::new(),
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

impl Walk<'_> {
    /// The parts of a layout that walks trees, in the order of a plan if there is one.
    fn parts(
        &self,
        layout: Layout,
        axes: &Axes,
        leaf: LeafType,
        plan: Option<&Plan>,
        margin_error: &dyn Fn() -> f32,
    ) -> Option<Parts> {
        let (forest, scale) = (self.forest, self.scale?);
        let mut leaves = Leaves::new(leaf, scale);
        let walked_in =
            plan.map_or_else(Vec::new, |plan| early::parts(&plan.order, plan.ends.iter().map(|(end, _)| *end)));
        let runs = trees::runs(forest, leaf, scale, &walked_in);
        let Sections { axes, cuts, groups, nodes } = match layout {
            Layout::Complete => trees::complete(forest, axes, &runs, &mut leaves)?,
            Layout::Compact => trees::compact(forest, axes, &runs, &mut leaves)?,
            Layout::Wide => trees::wide(forest, &runs, &mut leaves)?,
            Layout::Code | Layout::Grid | Layout::Patterns => return None,
        };
        if groups.len() > usize::from(u16::MAX) {
            return None;
        }
        let ends = plan.into_iter().flat_map(|plan| &plan.ends);
        let exits = trees::groups_before(&runs, &walked_in).into_iter().zip(ends);
        let mut parts = Parts {
            axes,
            cuts,
            groups,
            nodes,
            leaves: leaves.into_bytes(),
            shared: None,
            exits: exits.map(|(groups, &(_, bound))| EarlyExit { groups, bound }).collect(),
            base: self.base.clone(),
            unit: scale.unit,
            margin_error: margin_error(),
            instructions: Instructions { m4f: 0, m0_plus: None },
        };
        parts.instructions = instructions(layout, leaf, forest.objects(), &parts);
        Some(parts)
    }

    /// Plan of a walk that may end early.
    fn plan(
        &self,
        layout: Layout,
        wanted: &super::EarlyExit,
        features: (Option<&[f32]>, Option<Sentinel>),
    ) -> Option<Plan> {
        let place = PLACE + PLACE_OF_OBJECT * self.forest.objects() as f64;
        let work = Work { trees: &|trees| early::walk_cost(self.forest, layout, trees), place };
        early::plan(self.forest, self.scale?, &self.base, wanted, &work, features)
    }
}

/// Instructions of a place where a walk may end: the comparison of the margins, in all and for each.
const PLACE: f64 = 30.0;
const PLACE_OF_OBJECT: f64 = 9.0;

/// The parts of a layout with places where walks for a class alone may end, and which these are; `None` where there are none.
pub(super) fn with_early_exit(
    forest: &Forest<'_>,
    leaf: LeafType,
    layout: Layout,
    before: &Parts,
    wanted: &super::EarlyExit,
    features: (Option<&[f32]>, Option<Sentinel>),
) -> Option<(Parts, EarlyExitFound)> {
    let scale = Scale::for_trees(forest, leaf)?;
    let merged = merge(forest, leaf, &scale);
    let walk = Walk::new(forest, leaf, Some(&scale), merged.as_ref());
    let plan = walk.plan(layout, wanted, features)?;
    let parts = walk.parts(layout, &Axes::new(walk.forest), leaf, Some(&plan), &|| before.margin_error)?;
    let mut parts = if before.shared.is_some() { share(&parts, leaf, forest.objects())? } else { parts };
    parts.instructions = instructions(layout, leaf, forest.objects(), &parts);
    Some((parts, plan.found))
}

/// Candidates of code.
pub(super) fn code_with_early_exit(
    forest: &Forest<'_>,
    leaf: LeafType,
    (program, form): (Program, Form),
    wanted: &super::EarlyExit,
    features: (Option<&[f32]>, Option<Sentinel>),
) -> (Program, Option<EarlyExitFound>) {
    let plan = || {
        let scale = Scale::for_trees(forest, leaf)?;
        let merged = merge(forest, leaf, &scale);
        Walk::new(forest, leaf, Some(&scale), merged.as_ref()).plan(Layout::Code, wanted, features)
    };
    match plan().filter(|_| program.may_exit(form)) {
        Some(plan) => (program.with_exits(&plan.order, plan.ends), Some(plan.found)),
        None => (program, None),
    }
}

/// Instructions of the margins in a layout that walks trees.
fn instructions(layout: Layout, leaf: LeafType, objects: usize, parts: &Parts) -> Instructions {
    let Parts { axes, groups, nodes, shared, .. } = parts;
    let is_shared = shared.is_some();
    Instructions::new(&Shape { layout, leaf, objects, axes: axes.len(), groups, nodes, is_shared, below: on_average })
}

fn base_bits(base: f32, leaf: LeafType, scale: &Scale) -> i32 {
    if leaf == LeafType::F32 { base.to_bits().cast_signed() } else { scale.integer(base, 0) }
}
