//! What to do when the object may be exchanged, or slip, while it is being touched.

use super::recognizer::{Recognizer, Verdict};
use crate::model::{Model, Refused};
use palpate_shared::Touch;

/// Restarts a recognizer where its recent touches contradict the sum of all: for an object that may be exchanged, or slip,
/// while it is being touched.
///
/// For each object it keeps how much recent touches speak for it against the object with the most evidence: the sum of
/// their margins' differences since they last began to, never less than 0 (a cumulative sum, Page 1954). Once that reaches
/// the limit for any object, these sums and the prior become the evidence. With little evidence in a touch a restart comes late, and a
/// verdict that a few touches would have settled may still come first; `palpate evaluate --switch` measures both.
///
/// State: 4 bytes per object, and 8; not part of a snapshot.
#[derive(Clone, Debug)]
pub struct Forgetting<const N: usize> {
    /// In units of a margin.
    against: [i32; N],
    limit: i32,
    restarts: u32,
}

impl<const N: usize> Forgetting<N> {
    /// Forgets once recent touches speak by this many nats for another object; 5 costs little where nothing changes.
    ///
    /// Cost: a few operations in f32. Cannot fail: what is not a number above 0 counts as 0, with which every touch for
    /// another object is a restart.
    pub fn new(model: &Model<'_>, nats: f32) -> Self {
        // Rounds down, and limits to what an i32 holds.
        Self { against: [0; N], limit: (nats / model.unit()) as i32, restarts: 0 }
    }

    /// How often it has made a recognizer restart.
    pub const fn restarts(&self) -> u32 {
        self.restarts
    }

    /// Forgets what it knows of recent touches: when another object comes, as [`Recognizer::reset`].
    pub fn reset(&mut self) {
        self.against = [0; N];
    }

    /// Takes in the margins of a touch; whether the evidence has to become [`Forgetting::against`].
    fn add(&mut self, margins: &[i32; N], leader: usize, objects: usize) -> bool {
        let own = margins.get(leader).copied().unwrap_or(0);
        let mut most = 0;
        for (against, &margin) in self.against.iter_mut().zip(margins).take(objects) {
            // Margins are within ±2^30.
            *against = against.saturating_add(margin.saturating_sub(own)).max(0);
            most = most.max(*against);
        }
        most > 0 && most >= self.limit
    }
}

impl<const N: usize> Recognizer<'_, N> {
    /// Takes in a touch as [`push`](Self::push), and restarts if recent touches contradict the evidence so far.
    ///
    /// Cost: that of `push`, and about 15 instructions per object. Cannot fail otherwise.
    ///
    /// # Errors
    /// As `push`.
    pub fn push_forgetting(&mut self, touch: &Touch, forgetting: &mut Forgetting<N>) -> Result<Verdict, Refused> {
        self.model().accepts(touch)?;
        let mut margins = [0; N];
        self.model().margins(touch, &mut margins);
        Ok(self.push_margins_forgetting(&margins, forgetting))
    }

    /// The same with margins that were computed beforehand, as [`push_margins`](Self::push_margins).
    pub fn push_margins_forgetting(&mut self, margins: &[i32; N], forgetting: &mut Forgetting<N>) -> Verdict {
        if self.verdict() != Verdict::Undecided {
            return self.verdict();
        }
        let leader = self.best();
        let objects = self.model().object_count();
        if forgetting.add(margins, leader, objects) {
            let mut evidence = [0; N];
            for ((evidence, &against), object) in evidence.iter_mut().zip(&forgetting.against).zip(0..objects) {
                *evidence = i64::from(against).saturating_add(self.model().prior(object).into());
            }
            let touches = self.touches();
            self.state_mut().set(evidence, touches, Verdict::Undecided);
            forgetting.reset();
            forgetting.restarts = forgetting.restarts.saturating_add(1);
            // The touch is in the sums: it only counts.
            return self.push_margins(&[]);
        }
        let verdict = self.push_margins(margins);
        if self.best() != leader {
            forgetting.reset();
        }
        verdict
    }
}
