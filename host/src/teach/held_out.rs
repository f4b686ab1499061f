//! Predictions of columns for touches that they were not fitted on.

use super::Smoothing;
use super::balance::Held;
use super::column::{Part, fit};
use super::rows::{Leaves, Rows, log_sum};
use crate::ensemble::Ensemble;
use crate::error::Result;
use crate::evidence::Drawer;
use crate::in_order::in_order;
use crate::probe::noise::Noise;
use crate::progress::{self, Progress};
use crate::random::Purpose;
use crate::with;
use palpate_shared::{Descriptor, Touch};
use rayon::prelude::*;

/// Copies of recorded touches under jitter, for each object and all of its touches together.
const COPIES: usize = 12_000;
/// Largest number of copies of a touch.
const MOST_COPIES: usize = 64;

/// A recorded object.
pub(super) struct Recorded {
    /// The touches as recorded.
    plain: Rows,
    /// Repeated under jitter, for each of [`super::JITTERS`].
    jittered: Vec<Rows>,
    /// For each touch its place in a random order, over their number: from 0 to 1.
    place: Vec<f64>,
}

/// Division of touches: into `parts` parts, each of which is held out once, while `used` others are fitted on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Division {
    pub(super) parts: usize,
    pub(super) used: usize,
}

impl Division {
    /// The part that something at a place from 0 to 1 is in.
    pub(super) fn part(self, place: f64) -> usize {
        ((place * self.parts as f64) as usize).min(self.parts - 1)
    }

    /// True if a part is fitted on while another one is held out.
    pub(super) fn uses(self, part: usize, held_out: usize) -> bool {
        (1..=self.used).any(|step| (held_out + step) % self.parts == part)
    }
}

/// Everything that columns are fitted on.
pub(super) struct Material {
    leaves: Leaves,
    /// The touches of each object that the trees know.
    known: Vec<Rows>,
    recorded: Vec<Recorded>,
}

/// Noise that stands for what few touches have not shown: 30 % and 10 ms on times, 8° on the pose, times `factor`.
pub fn jitter(factor: f64) -> Noise {
    with!(
        Noise::default(),
        deviation = (10_000.0 * factor).into(),
        speed_error = (0.3 * factor).min(0.9),
        pose = 8.0 * factor
    )
}

/// `touches`, repeated under jitter: touch i is a copy of touch i modulo their number.
pub(super) fn repeated(name: &str, touches: &[Touch], factor: f64, seed: u64) -> Vec<Touch> {
    let copies = COPIES.div_ceil(touches.len().max(1)).min(MOST_COPIES);
    let many: Vec<Touch> = std::iter::repeat_n(touches, copies).flatten().copied().collect();
    jitter(factor).add(name, &many, seed)
}

/// For each of `count` touches of an object its place in a random order, over their number.
pub(super) fn places(name: &str, count: usize, seed: u64) -> Vec<f64> {
    let mut places: Vec<f64> = (0..count).map(|place| place as f64 / count as f64).collect();
    Drawer { purpose: Purpose::Teach, name, seed }.shuffle(u64::MAX, &mut places);
    places
}

/// Place of a touch of an object that the trees know: spread evenly, by the golden ratio.
fn known_place(source: u32) -> f64 {
    (f64::from(source) * 0.618_033_988_749_894_9).fract()
}

impl Material {
    pub(super) fn new(
        ensemble: &Ensemble,
        descriptor: Descriptor,
        known: &[Vec<Touch>],
        recorded: &[(&str, &[Touch])],
        seed: u64,
    ) -> Self {
        let leaves = Leaves::of(ensemble);
        let rows = |touches: &[Touch], given| Rows::new(ensemble, &leaves, descriptor, touches, given);
        let recorded = recorded.iter().map(|&(name, touches)| Recorded {
            plain: rows(touches, touches.len()),
            jittered: super::JITTERS.map(|jitter| rows(&repeated(name, touches, jitter, seed), touches.len())).into(),
            place: places(name, touches.len(), seed),
        });
        let recorded = recorded.collect();
        let known = known.iter().map(|touches| rows(touches, touches.len())).collect();
        Self { leaves, known, recorded }
    }

    /// Touches of a recorded object that are evidence.
    pub(super) fn evidence(&self, recorded: usize) -> usize {
        self.recorded[recorded].plain.count()
    }

    /// Number of objects that the trees know, a background included.
    pub(super) fn known_count(&self) -> usize {
        self.known.len()
    }

    /// Columns of the recorded objects `which`, each smoothed as `smoothings` say, fitted on touches at these places: of
    /// each known object only one in `thin`.
    pub(super) fn columns(
        &self,
        which: &[usize],
        smoothings: &[Smoothing],
        thin: usize,
        is_used: impl Fn(f64) -> bool,
    ) -> Vec<Vec<f64>> {
        let chosen = |rows: &Rows, place: &dyn Fn(u32) -> f64| {
            let of = |&row: &usize| is_used(place(rows.sources[row]));
            (0..rows.count()).filter(of).filter_map(|row| u32::try_from(row).ok()).collect::<Vec<u32>>()
        };
        let known = self.known.iter().map(|rows| Part {
            rows,
            chosen: chosen(rows, &known_place).into_iter().step_by(thin).collect(),
            column: None,
        });
        let recorded = which.iter().zip(smoothings).enumerate().map(|(column, (&index, smoothing))| {
            let object = &self.recorded[index];
            let rows = &object.jittered[smoothing.jitter_index()];
            let place = |source: u32| object.place[source as usize];
            Part { rows, chosen: chosen(rows, &place), column: Some(column) }
        });
        let parts: Vec<Part<'_>> = known.chain(recorded).collect();
        let priors: Vec<f64> = smoothings.iter().map(|smoothing| smoothing.prior).collect();
        fit(&self.leaves, &parts, &priors)
    }

    /// The columns of all recorded objects, fitted on all touches.
    pub(super) fn fitted(&self, smoothings: &[Smoothing]) -> Vec<Vec<f64>> {
        let all: Vec<usize> = (0..self.recorded.len()).collect();
        self.columns(&all, smoothings, 1, |_| true)
    }

    /// The margins of every touch as columns say that were not fitted on it, nor on a copy of it: of the objects that the
    /// trees know, in their order, then of the recorded objects `which`.
    pub(super) fn held_out(
        &self,
        which: &[usize],
        smoothings: &[Smoothing],
        thin: usize,
        division: Division,
        progress: &dyn Progress,
    ) -> Result<Vec<Held>> {
        let one = |held_out: usize| {
            let columns = self.columns(which, smoothings, thin, |place| division.uses(division.part(place), held_out));
            let margins = |rows: &Rows, row: usize| -> Vec<f64> {
                let base = f64::from(crate::ensemble::train::BASE_MARGIN);
                let known = rows.margins(row).iter().copied().map(f64::from);
                known.chain(columns.iter().map(|column| base + rows.sum(row, column))).collect()
            };
            let of = |rows: &Rows, place: &dyn Fn(u32) -> f64| {
                let is_held = |&row: &usize| division.part(place(rows.sources[row])) == held_out;
                let held = (0..rows.count()).filter(is_held).map(|row| (rows.sources[row], margins(rows, row)));
                held.collect::<Vec<_>>()
            };
            let known = self.known.iter().map(|rows| of(rows, &known_place));
            let recorded = which.iter().map(|&index| {
                let object = &self.recorded[index];
                of(&object.plain, &|source| object.place[source as usize])
            });
            let held: Vec<_> = known.chain(recorded).collect();
            progress::advance(progress, 1)?;
            Ok(held)
        };
        let parts: Vec<Vec<_>> = in_order((0..division.parts).into_par_iter().map(one))?;
        let given = self.known.iter().chain(which.iter().map(|&index| &self.recorded[index].plain));
        let mut all: Vec<Held> = given.map(|rows| vec![None; rows.given]).collect();
        for (object, rows) in parts.into_iter().flat_map(|part| part.into_iter().enumerate()) {
            rows.into_iter().for_each(|(source, margins)| all[object][source as usize] = Some(margins));
        }
        Ok(all)
    }
}

/// The softmax loss of held-out touches in nats, each object weighted equally.
pub(super) fn loss(held: &[Held]) -> f64 {
    let of = |(object, held): (usize, &Held)| {
        let evidence = || held.iter().flatten();
        let sum: f64 = evidence().map(|margins| log_sum(margins.iter().copied()) - margins[object]).sum();
        sum / evidence().count().max(1) as f64
    };
    held.iter().enumerate().map(of).sum::<f64>() / held.len().max(1) as f64
}
