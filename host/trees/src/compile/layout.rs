//! The layouts that a forest may take: each is costed, and one is written.

use super::cells::Cells;
use super::code::{Program, Statements};
use super::forest::Forest;
use super::lowered::Lowered;
use super::parts::Parts;
use super::rounding;
use super::share::Sharing;
use super::table::Table;
use super::{Candidate, Settings};
use crate::error::{CompileProblem, Result};
use palpate_shared::format::{HEADER_LENGTH, Layout, LeafType};

/// A forest as it may be written.
pub(super) struct Layouts<'f> {
    objects: usize,
    /// `None` where leaves do not fit their type.
    lowered: Option<Lowered<'f>>,
    /// The farthest that a margin of the trees can be from the ensemble's.
    margin_error: f32,
    /// A table of equal leaves, if there can be one.
    sharing: Option<Sharing>,
    table: Option<Table>,
    /// The trees as code, if that is asked for and they fit.
    program: Option<Program>,
}

impl<'f> Layouts<'f> {
    /// Finds the facts that the layouts asked for are costed from.
    pub(super) fn new(forest: &Forest<'f>, settings: &Settings, stated: &Statements) -> Self {
        let (objects, leaf) = (forest.objects(), settings.leaf);
        let cells = Cells::new(forest);
        let lowered = Lowered::new(forest, leaf);
        let wants_table = !settings.code && matches!(settings.layout, None | Some(Layout::Grid | Layout::Patterns));
        let wants_trees = !matches!(settings.layout, Some(Layout::Grid | Layout::Patterns));
        let in_table = cells.as_ref().filter(|cells| wants_table && Table::fits(cells, objects, leaf));
        let (margin_error, sums) = match lowered.as_ref().filter(|_| wants_trees) {
            None => (0.0, in_table.map(|cells| rounding::sums(forest, cells))),
            Some(lowered) => {
                rounding::margin_error(forest, cells.as_ref(), leaf, &lowered.rounding, in_table.is_some())
            }
        };
        let table = in_table.zip(sums).and_then(|(cells, sums)| Table::new(cells, sums, leaf));
        let in_code = lowered.as_ref().filter(|_| settings.code && leaf != LeafType::F32);
        let program = in_code.and_then(|lowered| Program::new(lowered, stated));
        let is_shared = wants_trees && settings.shared_leaves != Some(false);
        let sharing = lowered.as_ref().filter(|_| is_shared).and_then(Lowered::sharing);
        Self { objects, lowered, margin_error, sharing, table, program }
    }

    /// Costs of the layout that is asked for, or of all that fit, without the bytes that are the same for all. Errors are in
    /// margins of the trees.
    pub(super) fn candidates(&self, settings: &Settings) -> Result<Vec<Candidate>> {
        let all = || vec![Layout::Complete, Layout::Compact, Layout::Grid, Layout::Patterns];
        let mut candidates = Vec::new();
        if settings.code {
            let layout = Layout::Code;
            let program = self.program.as_ref().ok_or(CompileProblem::DoesNotFit { layout })?;
            return Ok(vec![Candidate {
                layout,
                shared_leaves: false,
                bytes: HEADER_LENGTH + 8 * self.objects + program.flash(),
                instructions: program.instructions(),
                margin_error: self.margin_error,
            }]);
        }
        for layout in settings.layout.map_or_else(all, |layout| vec![layout]) {
            let is_wide =
                layout == Layout::Compact && self.lowered.as_ref().is_some_and(|lowered| !lowered.is_narrow());
            let layout = if is_wide { Layout::Wide } else { layout };
            let before = candidates.len();
            candidates.extend(self.trees_in(layout, settings.shared_leaves));
            candidates.extend(self.table_in(layout));
            if settings.layout.is_some() && candidates.len() == before {
                return Err(CompileProblem::DoesNotFit { layout }.into());
            }
        }
        Ok(candidates)
    }

    /// Trees in a layout, with and without a table of equal leaves; nothing where they do not fit.
    fn trees_in(&self, layout: Layout, shared: Option<bool>) -> impl Iterator<Item = Candidate> {
        let lowered = self.lowered.as_ref().filter(|lowered| lowered.fits(layout));
        let candidate = move |lowered: &Lowered<'_>, sharing: Option<Sharing>| Candidate {
            layout,
            shared_leaves: sharing.is_some(),
            bytes: lowered.bytes(layout, sharing),
            instructions: lowered.instructions(layout, sharing.is_some()),
            margin_error: self.margin_error,
        };
        let plain = lowered.map(|lowered| candidate(lowered, None));
        let sharing = self.sharing;
        let with_table = lowered.zip(sharing).map(|(lowered, sharing)| candidate(lowered, Some(sharing)));
        let (plain, with_table) = match (shared, plain, with_table) {
            (Some(true), _, Some(table)) => (None, Some(table)),
            (None, Some(plain), Some(table)) if table.bytes >= plain.bytes => (Some(plain), None),
            (_, plain, table) => (plain, table),
        };
        plain.into_iter().chain(with_table)
    }

    /// The table, if it has this layout.
    fn table_in(&self, layout: Layout) -> Option<Candidate> {
        let table = self.table.as_ref().filter(|table| table.layout == layout)?;
        Some(Candidate {
            layout,
            shared_leaves: false,
            bytes: table.bytes(),
            instructions: table.instructions(),
            margin_error: table.margin_error,
        })
    }

    /// The chosen layout, and the program if it is code; `None` where it has none of these.
    pub(super) fn write(self, chosen: &Candidate) -> Option<(Parts, Option<Program>)> {
        let Self { objects, lowered, margin_error, table, program, .. } = self;
        match chosen.layout {
            Layout::Grid | Layout::Patterns => Some((table?.write(), None)),
            Layout::Code => {
                let (base, unit) = (vec![0; objects], lowered?.scale.unit);
                Some((Parts { base, unit, margin_error, ..Parts::default() }, Some(program?)))
            }
            layout => Some((lowered?.write(layout, chosen.shared_leaves, margin_error), None)),
        }
    }
}
