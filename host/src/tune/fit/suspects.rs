//! Recordings that look wrong: of another object than their name says, of two objects, of a probe that was changed.
//!
//! Another object is compared under the probe that fits the other recordings, the right one under the probe that fits all.
//! Likelihood ratios of the right object against a wrong one pass e^x with a probability of at most e^−x, wherever in the
//! recording one looks (Ville's inequality), so that a few hundred comparisons at [`CERTAIN`] nats together give a false
//! alarm once in a thousand recordings.

use super::Evidence;
use super::candidate::Candidate;
use super::density::Observed;
use super::likelihood::Explained;
use super::search::{self, Best};
use crate::error::Result;
use crate::progress::{self, Progress};
use rayon::prelude::*;
use serde::Serialize;
use std::fmt;

/// How many nats better another explanation of a recording must be.
const CERTAIN: f64 = 12.0;
/// The same for another probe, which has seven numbers to suit the touches.
const CERTAIN_PROBE: f64 = 22.0;
/// The fewest touches that say anything about a part of a recording.
const LEAST: usize = 20;
/// How many standard errors less likely than under the fit touches must be to be like no object.
const UNLIKE: f64 = 7.0;

/// What looks wrong about the recording of an object.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "problem", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Suspect {
    /// It is of another object.
    OtherObject {
        /// The object by whose name it goes.
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
        /// What the probe was before and is then, in words.
        what: String,
    },
    /// It was made by another probe than the other recordings.
    OtherProbe {
        /// The object.
        object: String,
        /// What the other recordings say about the probe, and what this one does, in words.
        what: String,
    },
    /// Its touches look like those of none of the objects.
    Unlike {
        /// The object by whose name it goes.
        object: String,
        /// How many standard errors less likely they are than the object's.
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
    /// Whether a recording is all that there is to go by.
    fn is_only(&self) -> bool {
        self.count() == 1 && self.evidence.plate.is_none()
    }

    fn count(&self) -> usize {
        self.is_sound.iter().filter(|is_sound| **is_sound).count()
    }

    /// How likely a candidate is by all sound recordings but this one.
    fn others(&self, candidate: &Candidate, index: usize) -> f64 {
        self.evidence.log_likelihood(candidate, |other| other != index && self.is_sound[other])
    }

    /// Goes on without a recording.
    fn leave_out(&mut self, index: usize) {
        self.is_sound[index] = false;
        let likelihood = |candidate: &Candidate| self.evidence.log_likelihood(candidate, |other| self.is_sound[other]);
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
    /// Wrong names come first: they make the fit wrong, and with it what is said about the probe of the others.
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
        let found: Vec<Option<Found>> =
            (0..evidence.recordings.len()).into_par_iter().map(one).collect::<Result<_>>()?;
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

/// What looks wrong about a recording, and by how many nats.
fn suspect(sound: &Sound<'_>, index: usize) -> Option<(Suspect, f64)> {
    let (evidence, best) = (sound.evidence, &sound.best);
    let recording = &evidence.recordings[index];
    let (touches, own, name) = (&recording.touches, evidence.of[index], recording.name.to_owned());
    if touches.len() < LEAST {
        return None;
    }
    let only = sound.is_only();
    let others = |candidate: &Candidate| sound.others(candidate, index);
    let rest = if only { *best } else { search::near(&others, &best.candidate) };
    let by = |candidate: &Candidate, object: usize| -> Vec<f64> {
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
            let likelihood = |candidate: &Candidate| {
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
    let object = |object: usize| evidence.objects[object].name.clone();
    // With few recordings the others may tell too little about the probe: the name is wrong only if all of them together
    // are likelier with the other one.
    let renamed = |other: usize| {
        let likelihood = |candidate: &Candidate| {
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
    if let Some((other, (from, to, gain))) =
        stretch.filter(|(_, (from, to, gain))| *gain > CERTAIN && to - from >= LEAST / 2)
    {
        return Some((two(name, object(other), (from, to), touches.len()), gain));
    }
    let mixed = rivals.iter().map(|(other, theirs)| (*other, mixture(theirs, &mine)));
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

/// The share of touches that are another object's if they are mixed, and how many nats better that explains them.
fn mixture(theirs: &[f64], mine: &[f64]) -> (f64, f64) {
    let mut share = 0.3;
    let odds = || theirs.iter().zip(mine).map(|(theirs, mine)| (theirs - mine).clamp(-40.0, 40.0).exp());
    for _ in 0..100 {
        let sum: f64 = odds().map(|odds| share * odds / (share * odds + 1.0 - share)).sum();
        share = (sum / mine.len().max(1) as f64).clamp(1e-6, 1.0 - 1e-6);
    }
    (share, odds().map(|odds| (share * odds + 1.0 - share).ln()).sum())
}

/// Whether another probe made the recording, or the rest of it, and by how many nats that is likelier.
fn changed(sound: &Sound<'_>, rest: &Best, index: usize) -> Option<(Suspect, f64)> {
    let (evidence, best) = (sound.evidence, &sound.best);
    let recording = &evidence.recordings[index];
    let (touches, name) = (&recording.touches, recording.name.to_owned());
    let explained =
        |candidate: &Candidate| Explained::new(candidate, &evidence.objects[evidence.of[index]], recording.kept);
    let fit = |part: &[Observed]| {
        let likelihood = |candidate: &Candidate| explained(candidate).log_likelihood(part) + candidate.usual();
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

/// What changed, in words.
fn difference(before: &Candidate, after: &Candidate) -> String {
    let mut said = Vec::new();
    let mut say = |what: &str, [before, after]: [f64; 2], least: f64, digits: usize, unit: &str| {
        if (before - after).abs() > least {
            said.push(format!("{what} {before:.digits$}{unit} and then {after:.digits$}{unit}"));
        }
    };
    say("speed factor", [1.0 / before.factor, 1.0 / after.factor], 0.02, 2, "");
    say("second finger late by", [before.late[1], after.late[1]], 1.0, 1, " ms");
    say("third finger late by", [before.late[2], after.late[2]], 1.5, 1, " ms");
    say("noise", [before.noise, after.noise], 1.0, 1, " ms");
    for finger in 0..3 {
        let share = [before.missed[finger], after.missed[finger]].map(|share| 100.0 * share);
        say(&format!("missed by finger {}", finger + 1), share, 3.0, 0, " %");
    }
    if said.is_empty() { "several small differences".into() } else { said.join(", ") }
}

/// Whether the touches are far less likely than the object's own would be, and about how many nats that is.
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
