//! The accuracy that a model trained on simulated touches loses on recorded ones.

use super::entry::Entry;
use super::promise::{Promised, promised};
use super::{Settings, Share, counterparts};
use crate::ensemble::{object_of, train};
use crate::error::Result;
use crate::evaluate::{Candidate, Estimate, Margins, SequentialSettings, objects_of};
use crate::progress::Progress;
use crate::touches::{Dataset, ObjectTouches, folds};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Numbers of approaches after which accuracy is given.
const AT: [usize; 5] = [5, 10, 20, 30, 60];
/// Number of approaches whose accuracy on simulated touches must be reached on recorded ones.
const COST_AT: usize = 20;
/// The least rise of the share of a confusion that is listed.
const MORE: f64 = 0.05;

/// Cost to a model of the difference between recorded and simulated touches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Objects that the model knows; all of the simulated ones.
    pub known: usize,
    /// Accuracy after a number of approaches, on simulated touches that the model was not trained on.
    pub simulated: BTreeMap<usize, Share>,
    /// Accuracy on recorded touches of the same objects.
    pub recorded: BTreeMap<usize, Share>,
    /// Number of approaches behind the accuracy on simulated touches.
    pub after: usize,
    /// After how many approaches the model is right as often on recorded touches; none if it never is.
    pub needed: Option<f64>,
    /// Pairs of objects that are confused more often on recorded touches, by 5 points and two standard errors or more; the most
    /// confused first.
    #[serde(default)]
    pub confused: Vec<Confused>,
    /// Test of a promise; none if there are too few touches to make one, or to test it.
    #[serde(default)]
    pub promise: Option<Promised>,
}

/// An object that is mistaken for another one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Confused {
    /// The object that was touched.
    pub touched: String,
    /// The object that it was mistaken for.
    pub named: String,
    /// The number of touches after which it was.
    pub touches: usize,
    /// The share of the groups of touches for which it was, on simulated touches.
    pub simulated: f64,
    /// This share on recorded ones.
    pub recorded: f64,
}

impl Cost {
    /// Accuracy that is lost on recorded touches after the largest number of approaches that both were measured at, and
    /// that number.
    pub(crate) fn loss(&self) -> Option<(usize, f64)> {
        self.simulated.iter().rev().find_map(|(at, own)| Some((*at, own.value - self.recorded.get(at)?.value)))
    }

    /// The confusions, in a sentence; empty if there are none.
    pub fn confusions(&self) -> String {
        let one = |Confused { touched, named, simulated, recorded, .. }: &Confused| {
            format!("{touched} as {named} ({:.0} %, simulated {:.0} %)", 100.0 * recorded, 100.0 * simulated)
        };
        let all: Vec<String> = self.confused.iter().take(3).map(one).collect();
        let after = self.confused.first().map_or(0, |first| first.touches);
        if all.is_empty() { String::new() } else { format!("Mistaken after {after} touches: {}.", all.join(", ")) }
    }

    /// Cost, in a sentence.
    pub fn sentence(&self) -> String {
        let Self { after, needed, .. } = self;
        match needed {
            Some(needed) if needed - *after as f64 > 0.5 => format!(
                "The accuracy on simulated touches after {after} approaches takes {needed:.0} approaches on recorded ones: {:.0} more.",
                (needed - *after as f64).max(1.0)
            ),
            Some(_) => format!("Its accuracy is as high on recorded touches: no loss after {after} approaches."),
            None => {
                format!("On recorded touches it never reaches its accuracy on simulated ones after {after} approaches.")
            }
        }
    }
}

/// Accuracy on recorded touches of a model that is trained on simulated ones; none for fewer than two recorded objects.
pub(super) fn cost(
    recorded: &Dataset,
    simulated: &Dataset,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Option<Cost>> {
    if recorded.objects.len() < 2 {
        return Ok(None);
    }
    let split = folds::split(simulated, 0.25, settings.seed)?;
    let recipe = train::Settings { descriptor: settings.descriptor, ..train::Settings::compact() };
    let model = train::train(&split.train, &recipe, progress)?;
    let test = split.test.matching(&model.objects);
    let entries: Vec<Entry> =
        recorded.names().iter().map(|name| Entry::new(name, counterparts(name, simulated))).collect();
    let tested = test.only(|name| entries.iter().any(|entry| entry.share_of(name) > 0.0));
    progress.begin("measuring", None);
    let candidate = || Candidate::Full(&model);
    let margins = [Margins::new(candidate(), &tested)?, Margins::new(candidate(), recorded)?];
    let accuracy = |margins: &Margins<'_>, at: &[usize]| -> Result<BTreeMap<usize, Estimate>> {
        let at: Vec<usize> = at.iter().copied().filter(|at| *at <= margins.fewest_approaches()).collect();
        let sequences =
            SequentialSettings { error_rate: None, max_touches: None, sequences: settings.groups, seed: settings.seed };
        let measured = margins.approaches(&at, &sequences)?;
        let of = |at: &usize| {
            let of_entry = |entry: &Entry| {
                let of = |(name, of): (&String, &BTreeMap<usize, f64>)| {
                    let hits = of.get(at).map_or(0.0, |share| (share * settings.groups as f64).round());
                    (Estimate::share(hits as usize, settings.groups), entry.share_of(name))
                };
                let own = measured.per_object.iter().map(of).filter(|(_, share)| *share > 0.0);
                Estimate::weighted(own.collect::<Vec<_>>().into_iter())
            };
            (*at, Estimate::mean_of(entries.iter().map(of_entry).collect::<Vec<_>>().into_iter()))
        };
        Ok(at.iter().map(of).collect())
    };
    let all: Vec<usize> = (1..=*AT.last().unwrap_or(&1)).collect();
    let [own, other] = margins.each_ref().map(|margins| accuracy(margins, &all));
    let (own, other) = (own?, other?);
    let shown = |of: &BTreeMap<usize, Estimate>| -> BTreeMap<usize, Share> {
        AT.iter().filter_map(|at| Some((*at, Share::of(*of.get(at)?)))).collect()
    };
    let after = COST_AT.min(own.len()).min(other.len()).max(1);
    let wanted = own.get(&after).map_or(1.0, |estimate| estimate.value);
    Ok(Some(Cost {
        known: simulated.objects.len(),
        simulated: shown(&own),
        recorded: shown(&other),
        after,
        needed: needed(&other, wanted),
        confused: confused(&margins, [&tested, recorded], &entries, settings)?,
        promise: promised(&model, [&test, recorded], &entries, settings.seed, progress)?,
    }))
}

/// The confusions that are more frequent on the second data set's touches than on the first's: by [`MORE`], and by two
/// standard errors of the difference of two shares.
fn confused(
    margins: &[Margins<'_>; 2],
    datasets: [&Dataset; 2],
    entries: &[Entry],
    settings: &Settings,
) -> Result<Vec<Confused>> {
    let fewest = margins.iter().map(Margins::fewest_touches).min().unwrap_or(0);
    let touches = fewest.min(*AT.last().unwrap_or(&1));
    if touches == 0 {
        return Ok(Vec::new());
    }
    let has_placements = margins[1].has_placements();
    let columns = &margins[1].objects;
    let names = objects_of(columns, has_placements);
    // Of each object, how often it was named, as a share of an entry's groups.
    let shares = |margins: &Margins<'_>| -> Result<Vec<BTreeMap<String, f64>>> {
        let counts = margins.confusion(touches, settings.groups, settings.seed)?;
        let of_entry = |entry: &Entry| {
            let mut shares: BTreeMap<String, f64> = names.iter().map(|name| (name.clone(), 0.0)).collect();
            for (name, counts) in margins.tested_names.iter().zip(&counts) {
                let share = entry.share_of(name) / settings.groups.max(1) as f64;
                for (column, &count) in columns.iter().zip(counts) {
                    let object = if has_placements { object_of(column) } else { column };
                    shares.entry(object.to_owned()).and_modify(|sum| *sum += share * count as f64);
                }
            }
            shares
        };
        Ok(entries.iter().map(of_entry).collect())
    };
    let [own, other] = margins.each_ref().map(shares);
    let (own, other) = (own?, other?);
    let mut confused = Vec::new();
    for ((entry, own), other) in entries.iter().zip(&own).zip(&other) {
        // As many groups as share no touch.
        let groups = datasets.map(|dataset| {
            let of_entry = dataset.objects.iter().filter(|object| entry.share_of(&object.name) > 0.0);
            let all: usize = of_entry.map(ObjectTouches::len).sum();
            (all / touches).clamp(1, settings.groups.max(1)) as f64
        });
        for named in &names {
            let [simulated, recorded] = [own, other].map(|shares| shares.get(named).copied().unwrap_or(0.0));
            let shared = (simulated * groups[0] + recorded * groups[1]) / (groups[0] + groups[1]);
            let error = (shared * (1.0 - shared) * (1.0 / groups[0] + 1.0 / groups[1])).sqrt();
            if named != entry.object(has_placements) && recorded - simulated >= MORE.max(2.0 * error) {
                let (touched, named) = (entry.name.clone(), named.clone());
                confused.push(Confused { touched, named, touches, simulated, recorded });
            }
        }
    }
    confused.sort_by(|a, b| b.recorded.total_cmp(&a.recorded));
    Ok(confused)
}

/// The number of approaches after which this accuracy is reached, in between two of them by a straight line.
fn needed(accuracy: &BTreeMap<usize, Estimate>, wanted: f64) -> Option<f64> {
    let (mut before, mut least) = (0.0, 0.0);
    for (&at, estimate) in accuracy {
        if estimate.value >= wanted {
            let share = (wanted - least) / (estimate.value - least).max(1e-12);
            return Some(before + share.clamp(0.0, 1.0) * (at as f64 - before));
        }
        (before, least) = (at as f64, estimate.value);
    }
    None
}
