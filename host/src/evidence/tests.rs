//! Both seams, with a supplier and a follower that know neither touches nor rows.

use super::*;

/// Counts words: the class whose initial they have leads by as many nats as it has more of them. Nothing is known of 'z'.
#[derive(Default)]
struct Words {
    counts: [u32; 2],
    is_strange: bool,
}

impl Words {
    fn margin(&self) -> f64 {
        f64::from(self.counts[0].abs_diff(self.counts[1]))
    }
}

impl Follower for Words {
    type Step = str;

    fn reset(&mut self) {
        *self = Self::default();
    }

    fn push(&mut self, word: &str) -> Verdict {
        match word.chars().next() {
            Some('a') => self.counts[0] += 1,
            Some('b') => self.counts[1] += 1,
            _ => self.is_strange = true,
        }
        match self.margin() {
            _ if self.is_strange => Verdict::Unknown,
            3.0.. => Verdict::GaveUp,
            _ => Verdict::Undecided,
        }
    }

    fn leader(&self) -> usize {
        usize::from(self.counts[1] > self.counts[0])
    }

    fn rivals(&self) -> u64 {
        odds_of(self.margin())
    }

    fn familiarity(&self) -> Familiarity {
        if self.is_strange { Familiarity::Stranger } else { Familiarity::Known }
    }

    fn propose(&self, poses: &mut dyn Iterator<Item = u16>) -> Option<u16> {
        poses.nth(self.leader())
    }
}

/// Sentences of a class each; a sentence that ends with a comma goes on, and an empty word is no evidence.
struct Sentences<'s> {
    coming: std::slice::Iter<'s, (usize, &'s str)>,
    words: Vec<&'s str>,
    ends: Vec<(u32, bool)>,
}

impl<'s> Sentences<'s> {
    fn new(sentences: &'s [(usize, &'s str)]) -> Self {
        Self { coming: sentences.iter(), words: Vec::new(), ends: Vec::new() }
    }
}

impl Supplier<Words> for Sentences<'_> {
    type Error = Infallible;

    fn step(&mut self, _: &Words) -> Result<Option<Option<&str>>, Infallible> {
        Ok(self.words.pop().map(|word| (!word.is_empty()).then_some(word)))
    }
}

impl Sequences<Words> for Sentences<'_> {
    fn begin(&mut self) -> Result<Option<Sequence>, Infallible> {
        let Some(&(class, sentence)) = self.coming.next() else { return Ok(None) };
        self.words = sentence.split(' ').rev().collect();
        Ok(Some(Sequence::new(class)))
    }

    fn end(&mut self, steps: u32, is_whole: bool) -> bool {
        self.ends.push((steps, is_whole));
        is_whole || self.coming.len() > 0
    }
}

#[test]
fn any_supplier_and_any_follower_make_sequences_that_thresholds_end() {
    let mut supplier = Sentences::new(&[(0, "a  a b a a"), (1, "b a"), (0, "b b b"), (1, "b z b"), (1, "a")]);
    let limit = Limit { margin: 2.0, max_touches: 4 };
    let Ok(found) = sequences(&mut supplier, &mut Words::default(), usize::MAX, limit);
    // The last one's steps ran out, and it does not count.
    let counted: Vec<_> = found.iter().map(|of| (of.object, of.touches, of.approaches)).collect();
    assert_eq!(counted, [(0, 2, 3), (1, 2, 2), (0, 2, 2), (1, 2, 2)]);
    assert_eq!(supplier.ends, [(3, true), (2, false), (2, true), (2, true), (1, false)]);
    let named = |margin: f64| -> Vec<_> {
        let odds = Odds::All(odds_of(margin));
        found.iter().map(|of| of.given(&odds).map(|lead| (lead.name, lead.approaches))).collect()
    };
    assert_eq!(named(2.0), [Some((0, 3)), None, Some((1, 2)), None]);
    assert_eq!(named(1.0), [Some((0, 1)), Some((1, 1)), Some((1, 1)), Some((1, 1))]);
    let mut supplier = Sentences::new(&[(0, "b a a b a a a"); 9]);
    let Ok(found) = sequences(&mut supplier, &mut Words::default(), 3, limit);
    assert_eq!(
        found.iter().map(|of| of.touches).collect::<Vec<_>>(),
        [4; 3],
        "up to the limit, as many as are asked for"
    );
}

#[test]
fn an_outcome_is_that_of_the_followers_own_thresholds() {
    let of = |sentence: &str| {
        let words = sentence.split(' ').map(|word| (!word.is_empty()).then_some(word));
        let Ok(outcome) = outcome(&mut Given::new(words), &mut Words::default());
        (outcome.touches, outcome.approaches, outcome.unknown)
    };
    assert_eq!(of("a  a a a"), (3, 4, false));
    assert_eq!(of("a  zebra b"), (2, 3, true));
    assert_eq!(of("a b "), (2, 3, false));
}

/// Words by initial, as the follower proposes them.
struct Proposed {
    words: [&'static str; 2],
    left: usize,
}

impl Supplier<Words> for Proposed {
    type Error = Infallible;

    fn step(&mut self, follower: &Words) -> Result<Option<Option<&str>>, Infallible> {
        let pose = follower.propose(&mut (0..2)).filter(|_| self.left > 0);
        self.left = self.left.saturating_sub(1);
        Ok(pose.map(|pose| Some(self.words[usize::from(pose)])))
    }
}

#[test]
fn a_step_may_depend_on_the_followers_state() {
    let mut leaders = Vec::new();
    let mut supplier = Proposed { words: ["b", "a"], left: 4 };
    let Ok(is_enough) = follow(&mut supplier, &mut Words::default(), |follower, _| {
        leaders.push(follower.leader());
        false
    });
    assert_eq!((is_enough, leaders), (false, vec![1, 0, 1, 0]));
}
