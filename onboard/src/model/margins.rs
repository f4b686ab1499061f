//! A touch to margins: the evaluator.

use super::{Model, fixed};
use crate::bytes::AlignedTo8;
use crate::layouts::leaves::{BLOCK, Sum};
use crate::layouts::{built_in, preorder, ranks};
use palpate_shared::format::{Group, Layout, Sentinel};
use palpate_shared::{MISSING_FEATURE, Touch};

impl Model<'_> {
    /// The margins of a touch, in [units](Model::unit): one for each object, within ±2^30. `margins` beyond the model's
    /// objects are left alone; if it is shorter, nothing is written and the answer is `false`.
    ///
    /// Cost: the ensemble's; see the layouts. Cannot fail otherwise; a model over rows of features takes every feature
    /// of a touch as missing.
    pub fn margins(&self, touch: &Touch, margins: &mut [i32]) -> bool {
        match self.descriptor() {
            Some(descriptor) => self.margins_of(descriptor.features(touch).as_slice(), margins),
            None => self.margins_of(&[], margins),
        }
    }

    /// The margins of a row of features (see [`Model::margins`]): whole numbers or
    /// [`f32_key`](palpate_shared::format::f32_key)s as [`Model::key`] says,
    /// [`MISSING_FEATURE`](palpate_shared::MISSING_FEATURE) where one is missing, as it is for all features beyond the end of a short row.
    pub fn margins_of(&self, features: &[i32], margins: &mut [i32]) -> bool {
        let Some(margins) = margins.get_mut(..self.object_count()) else { return false };
        margins.fill(0);
        self.margins_in_zeros(features, margins);
        true
    }

    /// [`Model::margins`] where zeros are already, of a model over touches.
    pub(crate) fn touch_in_zeros(&self, touch: &Touch, zeros: &mut [i32]) {
        if let Some(descriptor) = self.descriptor() {
            self.margins_in_zeros(descriptor.features(touch).as_slice(), zeros);
        }
    }

    /// The margins where zeros are already.
    fn margins_in_zeros(&self, features: &[i32], zeros: &mut [i32]) {
        if let Some(zeros) = zeros.get_mut(..self.object_count()) {
            self.sum(features, zeros);
            self.make_fixed(zeros);
        }
    }

    /// Makes Q16 of f32 values' bits.
    #[inline(always)]
    pub(super) fn make_fixed(&self, margins: &mut [i32]) {
        if self.is_float() {
            fixed::make_q16(margins);
        }
    }

    /// The margins of a row of features as the trainer's own f32 values, bit for bit where [`Model::prediction`] states no
    /// scale, and times that scale otherwise; `false`, and nothing written,
    /// unless the model has f32 leaves and `margins` is as long as there are objects.
    #[cfg(feature = "f32-leaves")]
    pub fn f32_margins_of(&self, features: &[i32], margins: &mut [f32]) -> bool {
        let mut bits = [0; 256];
        if !self.is_float() || margins.len() != self.object_count() {
            return false;
        }
        let Some(bits) = bits.get_mut(..margins.len()) else { return false };
        self.sum(features, bits);
        for (margin, bits) in margins.iter_mut().zip(bits) {
            *margin = f32::from_bits(bits.cast_unsigned());
        }
        true
    }

    /// Adds up all trees, in what has to be zeros: in units, or in f32 values' bits. There are as many margins as objects.
    pub(super) fn sum(&self, features: &[i32], margins: &mut [i32]) {
        match self.sentinel() {
            Some(sentinel) => self.sum_without(sentinel, features, margins),
            None => self.sum_as_they_are(features, margins),
        }
    }

    /// Sums the margins of features, including ones that stand for a missing value.
    // Apart: only such a model takes the room for its features on the stack.
    #[inline(never)]
    fn sum_without(&self, sentinel: Sentinel, features: &[i32], margins: &mut [i32]) {
        let mut known = [MISSING_FEATURE; 256];
        known.iter_mut().zip(features).for_each(|(known, &feature)| *known = sentinel.or_missing(feature));
        self.sum_as_they_are(&known, margins);
    }

    fn sum_as_they_are(&self, features: &[i32], margins: &mut [i32]) {
        #[cfg(feature = "code")]
        if self.layout() == Layout::Code {
            return self.call(features, margins);
        }
        self.sum_trees(features, margins);
    }

    /// The margins before any tree, in units or as f32 values' bits.
    #[inline(always)]
    pub(super) fn bases(&self) -> impl Iterator<Item = i32> {
        let (base, _) = self.sections.base_and_priors();
        base.as_chunks().0.iter().map(|base| i32::from_le_bytes(*base))
    }

    /// Adds up all trees.
    fn sum_trees(&self, features: &[i32], margins: &mut [i32]) {
        if !built_in::TREES {
            return;
        }
        let shared = self.shared_leaves();
        let bases = self.bases();
        if self.is_float() {
            // Added in this order: the base, then the trees.
            margins.iter_mut().zip(bases).for_each(|(margin, base)| *margin = base);
            let sum = &mut Sum { margins, leaf: self.sections.leaf, object: None, shared };
            self.add_trees(features, sum);
            return;
        }
        let sum = &mut Sum { margins, leaf: self.sections.leaf, object: None, shared };
        let bias = self.add_trees(features, sum);
        margins.iter_mut().zip(bases).for_each(|(margin, base)| *margin = margin.wrapping_add(base).wrapping_sub(bias));
    }

    /// Adds the leaves of all groups, and says how far every margin is too large. Groups come with the largest shift
    /// first, so that all that was added before is shifted on the way.
    fn add_trees(&self, features: &[i32], sum: &mut Sum<'_>) -> i32 {
        let mut ranks = AlignedTo8([0; 256]);
        let ranks = &mut ranks.0;
        ranks::rank(&self.sections, features, ranks);
        let mut reached = AlignedTo8([0; BLOCK]);
        let (mut nodes, mut leaves) = (self.sections.nodes, self.sections.leaves);
        let (mut shift, mut bias) = (0, 0_i32);
        let shift_all = |margins: &mut [i32], bias: &mut i32, shift: u8| {
            if shift > 0 {
                *bias = bias.wrapping_shl(shift.into());
                margins.iter_mut().for_each(|margin| *margin = margin.wrapping_shl(shift.into()));
            }
        };
        for &bytes in self.sections.groups.as_chunks().0 {
            let Some(group) = Group::from_bytes(bytes) else { continue };
            shift_all(sum.margins, &mut bias, u8::saturating_sub(shift, group.shift));
            shift = group.shift;
            sum.object = group.object;
            match self.sections.layout {
                Layout::Wide if built_in::layout(Layout::Wide) => {
                    let cuts = self.sections.axes_and_cuts().1;
                    preorder::add_wide(cuts, &group, features, &mut reached.0, &mut nodes, &mut leaves, sum);
                }
                Layout::Compact if built_in::layout(Layout::Compact) => {
                    preorder::add_compact(&group, ranks, &mut reached.0, &mut nodes, &mut leaves, sum);
                }
                // Refused when the model was opened.
                _ => {}
            }
            bias = bias.wrapping_add(sum.settle(group.trees));
        }
        shift_all(sum.margins, &mut bias, shift);
        bias
    }
}
