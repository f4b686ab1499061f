//! Verdicts that go on: events in a stream of rows that states neither where they begin nor where they end.

use super::evidence;
use super::expected::is_possible;
use super::recognizer::{Recognizer, State, Verdict, unit};
use super::strangers;
use crate::model::Model;
use palpate_shared::format::Events;

impl<const N: usize> Recognizer<'_, N> {
    /// Class that holds in a stream of a model with [events](crate::Model::events), by its number: the background between
    /// events. `None` before the first that is sure, and for other models.
    pub const fn ongoing(&self) -> Option<u8> {
        self.state().ongoing.class()
    }
}

impl<const N: usize> State<N> {
    /// Takes in a row by its evidence, for a model with events. Before the row no class is behind the leader by more than the
    /// model's memory, as if a class changed to any other at that cost in each row (Viterbi 1967; for two classes Page's
    /// cumulative sum, 1954). An object of weight 0 stays one.
    pub(super) fn add_event(&mut self, model: &Model<'_>, margins: &[i32], events: &Events) -> Verdict {
        self.begin(model);
        let evidence = self.evidence_mut(model);
        let most = evidence.iter().copied().max().unwrap_or(0);
        let least = -i64::from(events.memory);
        for evidence in evidence.iter_mut().filter(|evidence| is_possible(**evidence)) {
            *evidence = evidence.saturating_sub(most).max(least);
        }
        evidence.iter_mut().zip(margins).for_each(|(sum, &margin)| *sum = sum.saturating_add(margin.into()));
        let best = strangers::leader(model, evidence);
        // What is not known may lead.
        let is_known = !strangers::is_background(model, evidence, best.1);
        let odds = self.stopping().odds_of(best.0, model);
        let rivals = evidence::rivals(self.evidence(model), best, odds, unit(model)).filter(|_| is_known);
        let leader = u8::try_from(best.0).unwrap_or(u8::MAX);
        let is_verdict = self.ongoing.take(events, leader, rivals.is_some());
        self.event(leader, rivals.filter(|_| is_verdict));
        self.verdict()
    }
}
