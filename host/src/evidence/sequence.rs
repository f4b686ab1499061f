//! Whole sequences, and the result of each under any threshold.

use super::{Outcome, Totals};

/// Thresholds: the largest sum of the weights of all other objects, the leader's being 1, at which it is named; in Q56.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Odds {
    /// One threshold for all objects.
    All(u64),
    /// One for each object, in the model's order.
    ByObject(Vec<u64>),
}

impl Odds {
    /// True if no object's threshold is looser than that of `other`.
    pub(crate) fn is_as_strict_as(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::All(own), Self::All(other)) => own <= other,
            (Self::All(own), Self::ByObject(others)) => others.iter().all(|other| own <= other),
            (Self::ByObject(own), _) => (0..).zip(own).all(|(object, own)| *own <= other.of(object)),
        }
    }

    /// The threshold of an object; 0, which hardly ever is passed, beyond the last one.
    pub fn of(&self, object: usize) -> u64 {
        match self {
            Self::All(odds) => *odds,
            Self::ByObject(odds) => odds.get(object).copied().unwrap_or(0),
        }
    }

    /// The strictest threshold.
    pub(crate) fn strictest(&self) -> u64 {
        match self {
            Self::All(odds) => *odds,
            Self::ByObject(odds) => odds.iter().copied().min().unwrap_or(0),
        }
    }
}

/// The odds (Q56) of a margin in nats: of how much more evidence the leader has than all others together (S1 − logsumexp
/// of the others). 0 for margins beyond 38 nats, at most 2^56 − 1.
pub fn odds_of(margin: f64) -> u64 {
    (((-margin).exp() * ONE) as u64).min((1 << 56) - 1)
}

/// The margin in nats that odds (Q56) stand for.
pub fn margin_of(odds: u64) -> f64 {
    (ONE / odds as f64).ln()
}

/// 2^56.
const ONE: f64 = 72_057_594_037_927_936.0;

/// A moment of a sequence at which an object led by more than ever before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lead {
    /// The object with the most evidence.
    pub name: usize,
    /// Sum of the weights of the others, in Q56: the recognizer's own integers.
    pub odds: u64,
    /// Touches so far that are evidence.
    pub touches: u32,
    /// Approaches so far.
    pub approaches: u32,
}

/// A sequence of touches of one object, followed until even the strictest threshold was passed or the touches ran out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sequence {
    /// The object that was touched: its index in the model.
    pub object: usize,
    /// Touches at its end that are evidence.
    pub touches: u32,
    /// Approaches at its end.
    pub approaches: u32,
    /// The group that it is of, if it is not independent of all others.
    pub group: Option<usize>,
    leads: Vec<Lead>,
    /// Sequence without what holds names back, once a name was.
    ungated: Option<Vec<Lead>>,
}

impl Sequence {
    /// A sequence of touches of an object, by its index in the model, without any touch yet.
    pub fn new(object: usize) -> Self {
        Self { object, touches: 0, approaches: 0, group: None, leads: Vec::new(), ungated: None }
    }

    /// Sequence as one of a group.
    pub(crate) fn of_group(self, group: Option<usize>) -> Self {
        Self { group, ..self }
    }

    /// Takes in a lead. `may_name` is false where a verdict would be held back, such as by a test for unknown objects: then no
    /// threshold gives a name here.
    pub fn take(&mut self, lead: Lead, may_name: bool) {
        (self.touches, self.approaches) = (lead.touches, lead.approaches);
        if !may_name && self.ungated.is_none() {
            self.ungated = Some(self.leads.clone());
        }
        let gated = may_name.then_some(&mut self.leads);
        for leads in gated.into_iter().chain(&mut self.ungated) {
            let own = leads.iter().rev().find(|earlier| earlier.name == lead.name);
            if own.is_none_or(|own| lead.odds < own.odds) {
                leads.push(lead);
            }
        }
    }

    /// Sequence as if no name had been held back.
    pub(crate) fn ungated(&self) -> Self {
        let leads = self.ungated.as_ref().unwrap_or(&self.leads).clone();
        Self { leads, ungated: None, ..*self }
    }

    /// Takes in that the sequence ended after this approach, whose touch was no evidence.
    pub fn end(&mut self, approaches: u32) {
        self.approaches = self.approaches.max(approaches);
    }

    /// Its outcome under thresholds.
    pub(crate) fn outcome(&self, odds: &Odds) -> Outcome {
        let lead = self.given(odds);
        let recognized = lead.map(|lead| lead.name);
        Outcome {
            touches: lead.map_or(self.touches, |lead| lead.touches) as usize,
            approaches: lead.map_or(self.approaches, |lead| lead.approaches) as usize,
            recognized,
            output: recognized,
            unknown: false,
        }
    }

    /// The first moment at which a threshold is passed, as a recognizer with these thresholds would stop.
    pub fn given(&self, odds: &Odds) -> Option<&Lead> {
        self.leads.iter().find(|lead| lead.odds <= odds.of(lead.name))
    }

    /// The moments at which an object led by more than it ever had before.
    #[cfg(test)]
    pub(crate) fn leads(&self) -> &[Lead] {
        &self.leads
    }
}

/// Totals over sequences under thresholds.
pub(crate) fn totals<'s>(sequences: impl IntoIterator<Item = &'s Sequence>, odds: &Odds) -> Totals {
    Totals::of(sequences.into_iter().map(|sequence| (sequence.object, sequence.outcome(odds))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lead(name: usize, odds: u64, touches: u32) -> Lead {
        Lead { name, odds, touches, approaches: 2 * touches }
    }

    #[test]
    fn margins_and_odds_are_each_others_inverse() {
        for margin in [0.1, 1.0, 4.595, 12.0, 30.0] {
            assert!((margin_of(odds_of(margin)) - margin).abs() < 1e-3, "{margin}");
        }
        assert_eq!((odds_of(50.0), odds_of(-1.0), odds_of(0.0)), (0, (1 << 56) - 1, (1 << 56) - 1));
    }

    #[test]
    fn a_sequence_stops_at_the_first_look_that_passes_the_threshold_of_its_name() {
        let mut sequence = Sequence::new(1);
        for step in [(0, 90, 1), (0, 70, 2), (1, 80, 3), (0, 75, 4), (1, 60, 5), (1, 20, 6)] {
            sequence.take(lead(step.0, step.1, step.2), true);
        }
        let given = |odds| sequence.given(&odds).map(|lead| (lead.name, lead.touches));
        assert_eq!(given(Odds::All(90)), Some((0, 1)));
        assert_eq!(given(Odds::All(70)), Some((0, 2)));
        assert_eq!(given(Odds::All(69)), Some((1, 5)));
        assert_eq!(given(Odds::All(19)), None);
        assert_eq!(given(Odds::ByObject(vec![10, 80])), Some((1, 3)));
        assert_eq!(given(Odds::ByObject(vec![10])), None);
        // 75 was no record of its name.
        assert_eq!(sequence.leads().len(), 5);
        assert_eq!((sequence.touches, sequence.approaches), (6, 12));
        sequence.end(15);
        assert_eq!((sequence.touches, sequence.approaches), (6, 15));
    }

    #[test]
    fn a_verdict_that_is_held_back_is_given_at_the_next_moment_at_which_it_may_be() {
        let mut sequence = Sequence::new(0);
        sequence.take(lead(0, 10, 1), false);
        sequence.take(lead(0, 50, 2), true);
        assert_eq!(sequence.given(&Odds::All(60)).map(|lead| lead.touches), Some(2));
        assert_eq!(sequence.given(&Odds::All(10)), None);
        let ungated = sequence.ungated();
        assert_eq!(ungated.given(&Odds::All(10)).map(|lead| lead.touches), Some(1));
        assert_eq!((ungated.object, ungated.touches, ungated.leads().len()), (0, 2, 1));
    }

    #[test]
    fn thresholds_are_as_strict_as_others_if_that_of_each_object_is() {
        let by = |odds: [u64; 2]| Odds::ByObject(odds.to_vec());
        for (own, other, expected) in [
            (Odds::All(5), Odds::All(5), true),
            (Odds::All(6), Odds::All(5), false),
            (by([5, 3]), by([5, 4]), true),
            (by([5, 5]), by([6, 4]), false),
            (Odds::All(4), by([5, 4]), true),
            (Odds::All(5), by([5, 4]), false),
            (by([5, 4]), Odds::All(5), true),
            (by([5, 6]), Odds::All(5), false),
        ] {
            assert_eq!(own.is_as_strict_as(&other), expected, "{own:?} {other:?}");
        }
    }
}
