//! Forgetting: for objects that may be exchanged, or slip, while they are being touched.

use super::expected::{IMPOSSIBLE, is_possible};
use super::recognizer::{Recognizer, Verdict};
use super::strangers;
use crate::model::{Model, Refused};
use palpate_shared::Touch;

/// Restarts a recognizer where its recent touches contradict the sum of all: for an object that may be exchanged, or slip,
/// while it is being touched.
///
/// For each object it keeps how much recent touches speak for it against the object with the most evidence: the sum of
/// their margins' differences since they last began to, never less than 0 (a cumulative sum, Page 1954). Once that reaches
/// the limit for any object, all touches before those that spoke for this one most are forgotten: the evidence becomes the
/// priors, or the weights of [`Recognizer::reset_to`], and the margins of the touches that are left, which are also all that
/// the model's misfit test counts. An object of weight 0 stays one. With little evidence in a touch a restart comes late, and
/// a verdict that a few touches would have settled may still come first; `palpate evaluate --switch` measures both.
///
/// State: five numbers of 32 bits for each object, and a few more; not part of a snapshot. After a snapshot was restored, a restart begins with the
/// model's priors instead of weights, except those that are 0.
#[derive(Clone, Debug)]
pub struct Forgetting<const N: usize> {
    /// Evidence before any touch.
    start: [i64; N],
    /// Margins of the touches that are kept at a restart.
    recent: [i64; N],
    /// Number of these touches.
    touches: u32,
    /// For each object what recent touches say against the leader, in units of a margin.
    against: [i32; N],
    /// The object with the most of it.
    rival: usize,
    limit: i32,
    restarts: u32,
}

impl<const N: usize> Forgetting<N> {
    /// Forgets once recent touches speak by this many nats for another object; 5 costs little where nothing changes.
    ///
    /// Cost: a few operations in f32. Cannot fail: anything except a number above 0 counts as 0, with which every touch for
    /// another object is a restart.
    pub fn new(model: &Model<'_>, nats: f32) -> Self {
        let mut start = [0; N];
        start.iter_mut().zip(0..).for_each(|(start, object)| *start = model.prior(object).into());
        // Rounds down, and limits to what an i32 holds.
        let limit = (nats / model.unit()) as i32;
        Self { start, recent: [0; N], touches: 0, against: [0; N], rival: 0, limit, restarts: 0 }
    }

    /// Number of times that it has made a recognizer restart.
    pub const fn restarts(&self) -> u32 {
        self.restarts
    }

    /// Forgets recent touches, when another object comes, like [`Recognizer::reset`].
    pub fn reset(&mut self) {
        self.against = [0; N];
        self.touches = 0;
    }

    /// Takes in the margins of a touch beside the evidence before it; whether the recognizer has to restart.
    fn add(&mut self, margins: &[i32; N], evidence: &[i64], leader: usize) -> bool {
        let own = margins.get(leader).copied().unwrap_or(0);
        let (mut most, mut rival) = (0, self.rival);
        for (object, ((against, &margin), &evidence)) in self.against.iter_mut().zip(margins).zip(evidence).enumerate()
        {
            // Margins are within ±2^30. No touch speaks for an object that cannot be there.
            let sum = against.saturating_add(margin.saturating_sub(own)).max(0);
            *against = if is_possible(evidence) { sum } else { 0 };
            if *against > most {
                (most, rival) = (*against, object);
            }
        }
        // From the first touch on for which this object is the one: that of most others began earlier or later.
        if most == 0 || rival != self.rival || self.touches == 0 {
            self.recent = [0; N];
            self.touches = 0;
            self.rival = rival;
        }
        if most > 0 {
            self.recent.iter_mut().zip(margins).for_each(|(sum, &margin)| *sum = sum.saturating_add(margin.into()));
            self.touches = self.touches.saturating_add(1);
        }
        most > 0 && most >= self.limit
    }
}

impl<const N: usize> Recognizer<'_, N> {
    /// Takes in a touch as [`push`](Self::push), and restarts if recent touches contradict the evidence so far.
    ///
    /// Cost: that of `push`, and a few instructions for each object. Cannot fail otherwise.
    ///
    /// # Errors
    /// Errors of `push`.
    pub fn push_forgetting(&mut self, touch: &Touch, forgetting: &mut Forgetting<N>) -> Result<Verdict, Refused> {
        self.model().accepts(touch)?;
        let mut margins = [0; N];
        self.model().margins(touch, &mut margins);
        Ok(self.add_forgetting(&margins, forgetting))
    }

    /// Takes in a row of features like [`push_features`](Self::push_features), and forgets.
    ///
    /// # Errors
    /// Errors of `push_features`.
    pub fn push_features_forgetting(
        &mut self,
        features: &[i32],
        forgetting: &mut Forgetting<N>,
    ) -> Result<Verdict, Refused> {
        let margins = self.margins_of_next(features)?;
        Ok(self.push_margins_forgetting(&margins, forgetting))
    }

    /// Takes in margins that were computed beforehand like [`push_margins`](Self::push_margins), and forgets.
    pub fn push_margins_forgetting(&mut self, margins: &[i32; N], forgetting: &mut Forgetting<N>) -> Verdict {
        if self.model().row_evidence().is_none() {
            return self.add_forgetting(margins, forgetting);
        }
        let mut evidence = *margins;
        self.model().make_evidence(&mut evidence);
        self.add_forgetting(&evidence, forgetting)
    }

    /// Takes in evidence, and forgets: margins, or their evidence by the model's table.
    fn add_forgetting(&mut self, margins: &[i32; N], forgetting: &mut Forgetting<N>) -> Verdict {
        // Events are forgotten by the model's own memory.
        if self.model().events().is_some() {
            return self.add(margins);
        }
        if self.verdict() != Verdict::Undecided {
            return self.verdict();
        }
        let mut priors = [0; N];
        let evidence = self.state().evidence_or_priors(self.model(), &mut priors);
        if self.touches() == 0 {
            forgetting.reset();
            forgetting.start.iter_mut().zip(evidence).for_each(|(start, &evidence)| *start = evidence);
        }
        let leader = strangers::leader(self.model(), evidence).0;
        if forgetting.add(margins, evidence, leader) {
            let mut restarted = [0; N];
            let sums = forgetting.start.iter().zip(&forgetting.recent).zip(evidence);
            for (restarted, ((&start, &recent), &before)) in restarted.iter_mut().zip(sums) {
                *restarted = if is_possible(before) { start.saturating_add(recent) } else { IMPOSSIBLE };
            }
            // This touch is in the sums: it only counts.
            let touches = self.touches();
            let forgotten = touches.saturating_add(1).saturating_sub(forgetting.touches);
            self.state_mut().set(restarted, touches, forgotten, Verdict::Undecided);
            forgetting.reset();
            forgetting.restarts = forgetting.restarts.saturating_add(1);
            return self.add(&[]);
        }
        let verdict = self.add(margins);
        if strangers::leader(self.model(), self.evidence()).0 != leader {
            forgetting.reset();
        }
        verdict
    }
}
