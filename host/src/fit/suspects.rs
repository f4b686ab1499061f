//! Recordings that look wrong: of another object than their name says, of two objects, of a probe that was changed.
//!
//! Another object is compared under the probe that fits the other recordings, the right one under the probe that fits
//! all. If the touches are the right object's, the likelihood ratio of a wrong one against it exceeds e^x, at whatever
//! touch one stops, with a probability of at most e^−x (Ville's inequality). That holds for one start and one share of
//! the touches; where they are unknown the ratio's mean over all of them is compared, which is a martingale too
//! (Robbins' method of mixtures), and not its maximum. At [`CERTAIN`] nats a comparison gives a false alarm with a
//! probability of 6·10⁻⁶: three for each recording and rival, a few hundred in all, in one of 500 fits.
//!
//! That is for densities that are known. These come from simulated touches and a fitted probe, so it says how little chance
//! alone does, not how often a sound recording is named: touches that the simulation does not know, such as grazing ones,
//! can make it look wrong. The other thresholds ([`CERTAIN_PROBE`], [`UNLIKE`]) are by experience.

use super::Evidence;
use super::candidate::Hypothesis;
use super::likelihood::Explained;
use super::observed::Observed;
use super::search::{self, Best};
use super::words::offset;
use crate::ensemble::object_of;
use crate::error::Result;
use crate::in_order::in_order;
use crate::progress::{self, Progress};
use rayon::prelude::*;
use serde::Serialize;
use std::fmt;

/// Number of nats by which another explanation of a recording must be better.
const CERTAIN: f64 = 12.0;
/// The threshold for another probe, which has seven numbers to suit the touches: by Wilks' theorem twice the gain of a probe
/// that is not another one is chi squared with seven degrees of freedom, and passes 44 with a probability of 2·10⁻⁷.
const CERTAIN_PROBE: f64 = 22.0;
/// The fewest touches that say anything about a part of a recording.
const LEAST: usize = 20;
/// Number of standard errors by which touches must be less likely than under the fit to be like no object.
const UNLIKE: f64 = 7.0;

/// Suspicion about the recording of an object.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "problem", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Suspect {
    /// It is of another object.
    OtherObject {
        /// The object that the recording is named after.
        object: String,
        /// The object whose touches they look like.
        looks_like: String,
    },
    /// A part of it is of another object.
    TwoObjects {
        /// The object by whose name it goes.
        object: String,
        /// The object whose touches are among them.
        other: String,
        /// The first touch of the other object, counted from 1, if they are in a row; else none.
        from: Option<usize>,
        /// The last touch of the other object, if they are in a row.
        to: Option<usize>,
        /// The share of the other object's touches.
        share: f64,
    },
    /// The probe was changed on the way.
    Changed {
        /// The object.
        object: String,
        /// About the first touch after the change, counted from 1.
        from: usize,
        /// The probe before and after, in words.
        what: String,
    },
    /// It was made by another probe than the other recordings.
    OtherProbe {
        /// The object.
        object: String,
        /// The parameters of the probe by the other recordings and by this one, in words.
        what: String,
    },
    /// Its touches are unlike those of any object.
    Unlike {
        /// The object by whose name it goes.
        object: String,
        /// Number of standard errors by which they are less likely than the object's.
        errors: f64,
    },
}

impl fmt::Display for Suspect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OtherObject { object, looks_like } => {
                write!(f, "{object}: these look like touches of the {looks_like}. Check the name of the recording")
            }
            Self::TwoObjects { object, other, from: Some(from), to: Some(to), .. } => {
                write!(f, "{object}: touches {from} to {to} look like the {other}'s. Divide the recording")
            }
            Self::TwoObjects { object, other, share, .. } => {
                write!(
                    f,
                    "{object}: about {:.0} % of the touches look like the {other}'s. Record it again",
                    100.0 * share
                )
            }
            Self::Changed { object, from, what } => {
                write!(
                    f,
                    "{object}: from about touch {from} on, the probe is another one ({what}). Was it moved or bent? Record again with one probe"
                )
            }
            Self::OtherProbe { object, what } => {
                write!(
                    f,
                    "{object}: made by another probe than the other recordings ({what}). Record all with one probe"
                )
            }
            Self::Unlike { object, .. } => write!(
                f,
                "{object}: these look like touches of none of the objects. Is the mesh the object's, its size and the probe's measures right?"
            ),
        }
    }
}

/// Recordings that nothing is wrong with as far as is known, and the fit to them.
struct Sound<'a> {
    evidence: &'a Evidence<'a>,
    is_sound: Vec<bool>,
    best: Best,
}

impl Sound<'_> {
    /// True if there is no other recording.
    fn is_only(&self) -> bool {
        self.count() == 1 && self.evidence.plate.is_none()
    }

    fn count(&self) -> usize {
        self.is_sound.iter().filter(|is_sound| **is_sound).count()
    }

    /// Log-likelihood of a candidate under all sound recordings but this one.
    fn others(&self, candidate: &Hypothesis, index: usize) -> f64 {
        self.evidence.log_likelihood(candidate, |other| other != index && self.is_sound[other])
    }

    /// Goes on without a recording.
    fn leave_out(&mut self, index: usize) {
        self.is_sound[index] = false;
        let likelihood = |candidate: &Hypothesis| self.evidence.log_likelihood(candidate, |other| self.is_sound[other]);
        self.best = search::best(&likelihood, Some(self.best.candidate));
    }
}

/// Something that looks wrong, and by how many nats.
struct Found {
    index: usize,
    suspect: Suspect,
    nats: f64,
}

impl Found {
    /// Wrong names come first: they make the fit wrong, and with it any statement about the probe of the others.
    fn rank(&self) -> (bool, f64) {
        (matches!(self.suspect, Suspect::OtherObject { .. } | Suspect::TwoObjects { .. }), self.nats)
    }
}

/// Everything that looks wrong, in the order of the recordings. One wrong recording makes others look wrong beside it: the
/// worst is named and left out, until the others agree.
pub(super) fn suspects(evidence: &Evidence<'_>, best: &Best, progress: &dyn Progress) -> Result<Vec<Suspect>> {
    let mut sound = Sound { evidence, is_sound: vec![true; evidence.recordings.len()], best: *best };
    let mut named: Vec<Found> = Vec::new();
    while sound.count() > 0 {
        let one = |index: usize| -> Result<Option<Found>> {
            progress::check(progress)?;
            let found = if sound.is_sound[index] { suspect(&sound, index) } else { None };
            Ok(found.map(|(suspect, nats)| Found { index, suspect, nats }))
        };
        let found = in_order((0..evidence.recordings.len()).into_par_iter().map(one))?;
        let worst = found.into_iter().flatten().max_by(|a, b| {
            let ((a_name, a_nats), (b_name, b_nats)) = (a.rank(), b.rank());
            a_name.cmp(&b_name).then(a_nats.total_cmp(&b_nats))
        });
        let Some(worst) = worst else { break };
        sound.leave_out(worst.index);
        named.push(worst);
    }
    named.sort_by_key(|found| found.index);
    Ok(named.into_iter().map(|found| found.suspect).collect())
}

/// Finds the suspicion about a recording, and its strength in nats.
fn suspect(sound: &Sound<'_>, index: usize) -> Option<(Suspect, f64)> {
    let (evidence, best) = (sound.evidence, &sound.best);
    let recording = &evidence.recordings[index];
    let (touches, own, name) = (&recording.touches, evidence.of[index], recording.name.to_owned());
    // Touches of one placement after the other look like two objects, and like two probes.
    if touches.len() < LEAST || recording.is_mixed {
        return None;
    }
    let only = sound.is_only();
    let others = |candidate: &Hypothesis| sound.others(candidate, index);
    let rest = if only { *best } else { search::near(&others, &best.candidate) };
    let by = |candidate: &Hypothesis, object: usize| -> Vec<f64> {
        let explained = Explained::new(candidate, &evidence.objects[object], recording.kept);
        touches.iter().map(|touch| explained.log_density(touch)).collect()
    };
    let sum = |values: &[f64]| values.iter().sum::<f64>();
    let mine = by(&best.candidate, own);
    // How likely the touches are as each object's; where there is nothing else to go by, each under the probe that suits it.
    let rivals: Vec<(usize, Vec<f64>)> = (0..evidence.objects.len())
        .filter(|&object| object != own)
        .map(|object| {
            if !only {
                return (object, by(&rest.candidate, object));
            }
            let likelihood = |candidate: &Hypothesis| {
                let explained = Explained::new(candidate, &evidence.objects[object], recording.kept);
                explained.log_likelihood(touches) + candidate.usual()
            };
            (object, by(&search::best(&likelihood, None).candidate, object))
        })
        .collect();
    let whole = rivals.iter().map(|(object, theirs)| (*object, sum(theirs) - sum(&mine)));
    let whole = whole.max_by(|a, b| a.1.total_cmp(&b.1));
    let stretch = rivals.iter().map(|(object, theirs)| (*object, longest_gain(theirs, &mine)));
    let stretch = stretch.max_by(|a, b| a.1.2.total_cmp(&b.1.2));
    let begun = rivals.iter().map(|(object, theirs)| (*object, theirs, begun_anywhere(theirs, &mine)));
    let begun = begun.max_by(|a, b| a.2.total_cmp(&b.2));
    let object = |object: usize| evidence.objects[object].name.clone();
    // With few recordings the others may tell too little about the probe: the name is wrong only if all of them together
    // are likelier with the other one.
    let renamed = |other: usize| {
        let likelihood = |candidate: &Hypothesis| {
            let explained = Explained::new(candidate, &evidence.objects[other], recording.kept);
            others(candidate) + explained.log_likelihood(touches)
        };
        only || search::near(&likelihood, &rest.candidate).log_likelihood - best.log_likelihood > CERTAIN
    };
    if let Some((other, gain)) = whole.filter(|(other, gain)| *gain > CERTAIN && renamed(*other)) {
        // A part of the recording may still be the object's own.
        if let Some((part, (from, to, most))) = stretch.filter(|(_, (from, to, most))| {
            *most > gain + CERTAIN && to - from >= LEAST && touches.len() - (to - from) >= LEAST
        }) {
            return Some((two(name, object(part), (from, to), touches.len()), most));
        }
        return Some((Suspect::OtherObject { object: name, looks_like: object(other) }, gain));
    }
    if let Some((other, theirs, gain)) = begun.filter(|(.., gain)| *gain > CERTAIN) {
        let (from, to, _) = longest_gain(theirs, &mine);
        if to - from >= LEAST / 2 {
            return Some((two(name, object(other), (from, to), touches.len()), gain));
        }
    }
    // Some faces of an object feel alike, and simulated densities are too coarse to say how many touches are of another one.
    let is_of_another = |other: usize| object_of(&evidence.objects[other].name) != object_of(recording.name);
    let mixed = rivals.iter().filter(|(other, _)| is_of_another(*other));
    let mixed = mixed.map(|(other, theirs)| (*other, mixture(theirs, &mine)));
    if let Some((other, (share, gain))) =
        mixed.filter(|(_, (share, gain))| *gain > CERTAIN && *share > 0.05).max_by(|a, b| a.1.1.total_cmp(&b.1.1))
    {
        return Some((Suspect::TwoObjects { object: name, other: object(other), from: None, to: None, share }, gain));
    }
    changed(sound, &rest, index).or_else(|| unlike(evidence, &rest, index, &mine))
}

fn two(object: String, other: String, (from, to): (usize, usize), all: usize) -> Suspect {
    let share = (to - from) as f64 / all as f64;
    Suspect::TwoObjects { object, other, from: Some(from + 1), to: Some(to), share }
}

/// The stretch of touches that another object explains better by the most nats: from, to (excluded), nats. Kadane's
/// algorithm.
fn longest_gain(theirs: &[f64], mine: &[f64]) -> (usize, usize, f64) {
    let (mut best, mut from, mut sum) = ((0, 0, 0.0), 0, 0.0);
    for (index, gain) in theirs.iter().zip(mine).map(|(theirs, mine)| theirs - mine).enumerate() {
        if sum <= 0.0 {
            (from, sum) = (index, 0.0);
        }
        sum += gain;
        if sum > best.2 {
            best = (from, index + 1, sum);
        }
    }
    best
}

/// Number of nats by which another object better explains the touches from an unknown one on, up to that at which it
/// does so best: the logarithm of the likelihood ratio's mean over all starts, each as likely. Its exponential is a
/// martingale if the touches are not the other object's.
fn begun_anywhere(theirs: &[f64], mine: &[f64]) -> f64 {
    let count = mine.len() as f64;
    // The logarithm of the sum over the starts so far; of each of the others the ratio is still 1.
    let (mut begun, mut most) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    for (index, (theirs, mine)) in theirs.iter().zip(mine).enumerate() {
        begun = log_sum(begun, 0.0) + theirs - mine;
        let left = count - (index + 1) as f64;
        most = most.max(log_sum(begun, left.ln()) - count.ln());
    }
    most
}

/// ln (e^a + e^b).
fn log_sum(a: f64, b: f64) -> f64 {
    let most = a.max(b);
    if most == f64::NEG_INFINITY { most } else { most + ((a - most).exp() + (b - most).exp()).ln() }
}

/// Shares that are compared with none.
const SHARES: usize = 20;

/// The likeliest share of touches that are another object's if they are mixed, and how many nats better a mixture explains
/// them: the logarithm of the likelihood ratio's mean over [`SHARES`] shares, each as likely.
fn mixture(theirs: &[f64], mine: &[f64]) -> (f64, f64) {
    let odds: Vec<f64> =
        theirs.iter().zip(mine).map(|(theirs, mine)| (theirs - mine).clamp(-40.0, 40.0).exp()).collect();
    let mut share = 0.3;
    for _ in 0..100 {
        let sum: f64 = odds.iter().map(|odds| share * odds / (share * odds + 1.0 - share)).sum();
        share = (sum / mine.len().max(1) as f64).clamp(1e-6, 1.0 - 1e-6);
    }
    let gain = |share: f64| odds.iter().map(|odds| (share * odds + 1.0 - share).ln()).sum::<f64>();
    let gains = (1..=SHARES).map(|step| gain(step as f64 / SHARES as f64));
    (share, gains.fold(f64::NEG_INFINITY, log_sum) - (SHARES as f64).ln())
}

/// Finds out if another probe made the recording, or the rest of it, and by how many nats that is likelier.
fn changed(sound: &Sound<'_>, rest: &Best, index: usize) -> Option<(Suspect, f64)> {
    let (evidence, best) = (sound.evidence, &sound.best);
    let recording = &evidence.recordings[index];
    let (touches, name) = (&recording.touches, recording.name.to_owned());
    let explained =
        |candidate: &Hypothesis| Explained::new(candidate, &evidence.objects[evidence.of[index]], recording.kept);
    let fit = |part: &[Observed]| {
        let likelihood = |candidate: &Hypothesis| explained(candidate).log_likelihood(part) + candidate.usual();
        search::near(&likelihood, &best.candidate)
    };
    let whole = fit(touches);
    let parts = (1..8).map(|eighth| eighth * touches.len() / 8);
    let parts = parts.filter(|&at| at >= 2 * LEAST && touches.len() - at >= 2 * LEAST);
    let divided = parts.map(|at| {
        let both = [fit(&touches[..at]), fit(&touches[at..])];
        (at, both, both[0].log_likelihood + both[1].log_likelihood - whole.log_likelihood)
    });
    let divided = divided.max_by(|a, b| a.2.total_cmp(&b.2));
    if let Some((_, [before, after], gain)) = divided
        && gain > CERTAIN_PROBE
    {
        // Where exactly: the touch from which on the second probe explains them better.
        let [one, other] = [&before, &after].map(|part| {
            let explained = explained(&part.candidate);
            touches.iter().map(|touch| explained.log_density(touch)).collect::<Vec<f64>>()
        });
        let mut later: f64 = 0.0;
        let mut most = (f64::NEG_INFINITY, 0);
        for (at, (one, other)) in one.iter().zip(&other).enumerate().rev() {
            later += other - one;
            if later > most.0 {
                most = (later, at);
            }
        }
        let what = difference(&before.candidate, &after.candidate);
        return Some((Suspect::Changed { object: name, from: most.1 + 1, what }, gain));
    }
    let gained = whole.log_likelihood + rest.log_likelihood - best.log_likelihood;
    (sound.count() > 1 && gained > CERTAIN_PROBE)
        .then(|| (Suspect::OtherProbe { object: name, what: difference(&rest.candidate, &whole.candidate) }, gained))
}

/// Describes the change in words.
fn difference(before: &Hypothesis, after: &Hypothesis) -> String {
    let mut said = Vec::new();
    let mut say = |is_there: bool, text: String| said.extend(is_there.then_some(text));
    let [one, other] = [before, after].map(|probe| 1.0 / probe.factor);
    say((one - other).abs() > 0.02, format!("speed factor {one:.2} and then {other:.2}"));
    for (finger, name, least) in [(1, "second", 1.0), (2, "third", 1.5)] {
        let [one, other] = [before, after].map(|probe| probe.late[finger]);
        say((one - other).abs() > least, format!("{name} finger {} and then {}", offset(one, 1), offset(other, 1)));
    }
    let [one, other] = [before, after].map(|probe| probe.noise);
    say((one - other).abs() > 1.0, format!("noise {one:.1} ms and then {other:.1} ms"));
    for finger in 0..3 {
        let [one, other] = [before, after].map(|probe| 100.0 * probe.missed[finger]);
        let text = format!("missed by finger {} {one:.0} % and then {other:.0} %", finger + 1);
        say((one - other).abs() > 3.0, text);
    }
    if said.is_empty() { "several small differences".into() } else { said.join(", ") }
}

/// Finds out if the touches are far less likely than the object's own would be, and about how many nats that is.
fn unlike(evidence: &Evidence<'_>, rest: &Best, index: usize, mine: &[f64]) -> Option<(Suspect, f64)> {
    let recording = &evidence.recordings[index];
    let object = &evidence.objects[evidence.of[index]];
    let explained = Explained::new(&rest.candidate, object, recording.kept);
    let [mean, variance] = moments(
        &object
            .redrawn(&rest.candidate, recording.kept)
            .iter()
            .map(|touch| explained.log_density(touch))
            .collect::<Vec<_>>(),
    );
    let [own, _] = moments(mine);
    let errors = (mean - own) / (variance / mine.len() as f64).sqrt();
    (errors > UNLIKE).then(|| (Suspect::Unlike { object: recording.name.to_owned(), errors }, 0.5 * errors * errors))
}

fn moments(values: &[f64]) -> [f64; 2] {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    [mean, values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, generator};
    use crate::tests::repetitions::{assert_rare, repetitions};
    use rand_distr::{Distribution, StandardNormal};

    /// Log-densities of this many touches of the right object, whose densities are known: as another's, which gives numbers
    /// that are larger by `apart`, and as its own.
    fn densities(count: usize, apart: f64, run: u64) -> [Vec<f64>; 2] {
        let mut random = generator(run, Purpose::Synthetic, "suspects", 0);
        let numbers: Vec<f64> = (0..count).map(|_| StandardNormal.sample(&mut random)).collect();
        [apart, 0.0].map(|mean| numbers.iter().map(|number| -0.5 * (number - mean).powi(2)).collect())
    }

    /// `PALPATE_REPETITIONS=200 cargo test --release -p palpate --lib looking_everywhere -- --nocapture` repeats it as often; by
    /// default it does too, in less than a second.
    #[test]
    fn looking_everywhere_in_a_recording_gives_no_more_false_alarms_than_ville_allows() {
        let repetitions = repetitions(200);
        let level = 20.0_f64.ln();
        for apart in [0.3, 0.7, 1.5] {
            let (mut begun, mut longest, mut mixed) = (0, 0, 0);
            for run in 0..repetitions {
                let [theirs, mine] = densities(300, apart, run);
                begun += u64::from(begun_anywhere(&theirs, &mine) > level);
                mixed += u64::from(mixture(&theirs, &mine).1 > level);
                longest += u64::from(longest_gain(&theirs, &mine).2 > level);
            }
            println!("{apart} apart: the maximum over starts passes in {longest} of {repetitions}");
            assert_rare(&format!("starts, {apart} apart"), begun, repetitions, 0.05);
            assert_rare(&format!("shares, {apart} apart"), mixed, repetitions, 0.05);
        }
    }

    #[test]
    fn a_stretch_or_a_share_of_another_objects_touches_is_still_found() {
        // A third of the touches are 3 to the right of the others.
        let mut random = generator(2, Purpose::Synthetic, "suspects", 0);
        let mut of = |is_other: &dyn Fn(usize) -> bool| -> [Vec<f64>; 2] {
            let number = |index: usize| -> f64 {
                let normal: f64 = StandardNormal.sample(&mut random);
                normal + if is_other(index) { 3.0 } else { 0.0 }
            };
            let numbers: Vec<f64> = (0..300).map(number).collect();
            [3.0, 0.0].map(|mean| numbers.iter().map(|number| -0.5 * (number - mean).powi(2)).collect())
        };
        let [theirs, mine] = of(&|index| (100..200).contains(&index));
        assert!(begun_anywhere(&theirs, &mine) > CERTAIN);
        let (from, to, _) = longest_gain(&theirs, &mine);
        assert!(from.abs_diff(100) < 5 && to.abs_diff(200) < 5, "{from} {to}");
        let [theirs, mine] = of(&|index| index % 3 == 0);
        let (share, gain) = mixture(&theirs, &mine);
        assert!((share - 1.0 / 3.0).abs() < 0.07 && gain > CERTAIN, "{share} {gain}");
    }
}
