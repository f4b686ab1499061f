//! The class of a row from no more trees than it takes.

use super::Model;
use super::margins::Partial;
use crate::layouts::leaves::Sum;
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::{EarlyExit, Layout, Sentinel};

impl Model<'_> {
    /// The class that [`Model::predict_class`] gives, ties and all, from no more groups of trees than it takes: where one
    /// margin leads by more than the trees that are left can change, the walk ends. `palpate export --early-exit` writes
    /// models that say where; in others all trees are walked.
    ///
    /// `room` is for numbers on the way, one for each class; `None` if it is shorter. They are no margins afterwards.
    ///
    /// Cost: that of the trees that are walked, and two passes over the classes at each place. Cannot fail otherwise.
    pub fn class_of(&self, features: &[i32], room: &mut [i32]) -> Option<usize> {
        let is_walked = self.has_trees() && !self.is_float() && self.layout() != Layout::Code;
        if !is_walked || self.early_exits().next().is_none() {
            return self.predict_class(features, room);
        }
        let sums = room.get_mut(..self.object_count())?;
        sums.fill(0);
        let known = match self.sentinel() {
            Some(sentinel) => self.walk_without(sentinel, features, sums),
            None => self.walk(features, sums),
        };
        known.or_else(|| Some(self.best(sums)))
    }

    // Apart: only such a model takes the room for its features on the stack.
    #[inline(never)]
    fn walk_without(&self, sentinel: Sentinel, features: &[i32], sums: &mut [i32]) -> Option<usize> {
        let mut known = [MISSING_FEATURE; 256];
        known.iter_mut().zip(features).for_each(|(known, &feature)| *known = sentinel.or_missing(feature));
        self.walk(&known, sums)
    }

    /// Walks until a class is known. Otherwise `sums` are the margins.
    fn walk(&self, features: &[i32], sums: &mut [i32]) -> Option<usize> {
        let mut exits = self.early_exits();
        let mut next = exits.next();
        let (mut groups, mut class) = (0_u16, None);
        let (leaf, shared) = (self.leaf_type(), self.shared_leaves());
        let bias = self.add_trees(features, &mut Sum { margins: sums, leaf, object: None, shared }, |partial| {
            groups = groups.wrapping_add(1);
            let Some(EarlyExit { bound, .. }) = next.filter(|exit| exit.groups == groups) else { return false };
            next = exits.next();
            class = self.leader(&partial, bound);
            class.is_some()
        });
        if class.is_none() {
            let bases = self.bases();
            sums.iter_mut().zip(bases).for_each(|(sum, base)| *sum = sum.wrapping_add(base).wrapping_sub(bias));
        }
        class
    }

    /// The class whose margin is larger than each other one by more than this.
    fn leader(&self, partial: &Partial<'_>, bound: u32) -> Option<usize> {
        let (mut best, mut most, mut second) = (0, i32::MIN, i32::MIN);
        let sums = partial.margins.iter().zip(self.bases()).take(self.known_count());
        for (class, (&sum, base)) in sums.enumerate() {
            let sum = sum.wrapping_sub(partial.bias).wrapping_shl(partial.shift.into()).wrapping_add(base);
            if sum > most {
                (best, most, second) = (class, sum, most);
            } else {
                second = second.max(sum);
            }
        }
        // Within ±2^30, so that the difference is right as an unsigned number.
        (most.wrapping_sub(second).cast_unsigned() > bound).then_some(best)
    }
}
