//! Problems with calibrating.

use super::terms::Terms;
use super::walk::{Tally, allowed, binomial_tail};
use crate::error::Variant;
use palpate_base::wording::two_digits;

/// The probability with which a forecast number of approaches is enough, if the simulation is right.
pub(super) const LIKELY: f64 = 0.8;
/// The factor between numbers of approaches that a forecast tries, and how many it tries.
pub(super) const GROWTH: f64 = 1.05;
pub(super) const GROWN: i32 = 160;

/// Problems with calibrating.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateProblem {
    /// Even without any error the sequences would not be enough to promise the rate.
    #[error("{found} names given{} are too few to promise {} %: at least {needed} are needed, none of them wrong{}", of_object(object), percent(*rate), in_touches(*supplied, *found, *needed))]
    TooFew {
        /// The object whose names are too few, if the promise is for each.
        object: Option<String>,
        /// The promised rate.
        rate: f64,
        /// Names given.
        found: u64,
        /// Names needed, if none is wrong.
        needed: u64,
        /// Supply that the sequences were drawn from, if it was used up.
        supplied: Option<Supplied>,
    },
    /// No threshold keeps the promise.
    #[error("{}", seen(object, *rate, Tally { wrong: *wrong, all: *given }, *needed, ""))]
    NotKept {
        /// The object that is named, or touched, if the promise is for each.
        object: Option<String>,
        /// The promised rate.
        rate: f64,
        /// Wrong names, at the threshold that was nearest to keeping it.
        wrong: u64,
        /// Names given.
        given: u64,
        /// The names with which as many wrong ones would do.
        needed: Option<u64>,
        /// Change that would keep it, where that is known.
        remedy: Option<Box<Remedy>>,
    },
    /// With a test of strangers no threshold as strict as without it was tested.
    #[error("with the test of strangers no threshold keeps {} % that is as strict as without it", percent(*rate))]
    Looser {
        /// The promised rate.
        rate: f64,
    },
    /// Folds of a training do not belong to the model, or are fewer than two.
    #[error("the folds have other features or classes than the model, or are fewer than two")]
    FoldDiffers,
    /// There are too few sequences of rows, or groups of them, for a promise, even without any error.
    #[error("{} are too few to promise {} %: at least {needed} are needed, none of them wrong; {}", how_many(*found, object, *groups, *names_in), percent(*rate), could(*possible))]
    TooFewSequences {
        /// The class whose names are too few, if the promise is for each.
        object: Option<String>,
        /// The promised rate.
        rate: f64,
        /// Sequences, or groups, or the names that were given in some.
        found: u64,
        /// The sequences, or groups, that the names were given in, where it is names that are too few.
        names_in: Option<u64>,
        /// Number needed.
        needed: u64,
        /// The least rate that as many as there are could promise, if any below one half.
        possible: Option<f64>,
        /// True if it is groups that are too few.
        groups: bool,
    },
    /// There are too few sequences of rows for a test of strangers.
    #[error("{found} {} are too few for a test of strangers with at most {} % false alarms: at least {needed} are needed, as a part of them tests it", what(*groups), percent(*alarms))]
    TooFewForTest {
        /// Sequences, or groups.
        found: u64,
        /// About as many as are needed.
        needed: u64,
        /// The share of false alarms.
        alarms: f64,
        /// True if it is groups.
        groups: bool,
    },
    /// Rows of known classes often do not fit them.
    #[error("of the {found} sequences that test for strangers more than {} % end as unknown at every threshold", percent(*alarms))]
    TooManyAlarms {
        /// Sequences that the test was tested on.
        found: u64,
        /// The share of false alarms.
        alarms: f64,
    },
    /// No threshold keeps the promise on sequences of rows.
    #[error("{}", seen(object, *rate, Tally { wrong: *wrong, all: *given }, *needed, &format!(" in {units} {}", what(*groups))))]
    NotKeptByRows {
        /// The class that is named, or right, if the promise is for each.
        object: Option<String>,
        /// The promised rate.
        rate: f64,
        /// Wrong names.
        wrong: u64,
        /// Names given.
        given: u64,
        /// The names with which as many wrong ones would do; none where groups count, and not names.
        needed: Option<u64>,
        /// Sequences, or groups, that were tested on.
        units: u64,
        /// True if the promise is for groups.
        groups: bool,
    },
    /// Sequences of some classes are missing.
    #[error("there is no sequence of {}", objects.join(", "))]
    MissingSequences {
        /// Classes that the model knows and no sequence is of.
        objects: Vec<String>,
    },
    /// Recordings do not support the rate.
    #[error("{}", not_supported(object, *rate, *tally, *needed, forecast))]
    NotSupported {
        /// The object that is named, or touched, if the promise is for each.
        object: Option<String>,
        /// The promised rate.
        rate: f64,
        /// Wrong names of those given on the recordings at the first threshold that is tested; the most names given at any,
        /// where they are too few.
        tally: Tally,
        /// Names needed, if none is wrong.
        needed: u64,
        /// Recordings that would be enough, and the rate for which these are.
        forecast: Box<Forecast>,
    },
    /// The data set lacks objects of the model.
    #[error("the data set has no touches of {}", objects.join(", "))]
    Missing {
        /// Objects that the model knows and the data set does not have.
        objects: Vec<String>,
    },
    /// Recordings lack objects of the model, or placements of them.
    #[error("nothing is recorded of {}", objects.join(", "))]
    MissingRecordings {
        /// Outputs that the model has and no recording is of.
        objects: Vec<String>,
    },
    /// The touches are those that the model was trained on.
    #[error("the model was trained on these touches of {}: a promise calibrated on them would not hold for others", objects.join(", "))]
    TrainedOn {
        /// The objects.
        objects: Vec<String>,
    },
    /// There are no objects to choose between.
    #[error("the model knows only one object: there is nothing to mistake it for")]
    OneObject,
}

/// The touches of a data set that sequences used up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Supplied {
    /// True if it holds approaches, and not full touches only.
    pub approaches: bool,
    /// Number of these that it holds of the object with the fewest.
    pub fewest: u64,
}

/// Changes that would keep a rate that no threshold kept, by the names that were seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Remedy {
    /// Touches, or approaches, of each object with which it is likely to be kept if as large a share of the names is wrong; none
    /// if that share is above the rate, or more are not the matter.
    pub touches: Option<u64>,
    /// Sequences with which it is likely, where the touches were not used up.
    pub sequences: Option<u64>,
    /// True if the touches are approaches.
    pub approaches: bool,
    /// The lowest rate that the names support.
    pub supported: Option<f64>,
    /// The noise that the model was trained for, and that of the touches, where these differ.
    pub noise: Option<[String; 2]>,
}

impl Remedy {
    /// Error for this tally of names, of sequences that used up the `supplied` touches, or of `sequences` that did not.
    pub(crate) fn new(
        tally: Tally,
        &Terms { rate, confidence, .. }: &Terms,
        supplied: Option<Supplied>,
        sequences: usize,
        noise: Option<[String; 2]>,
    ) -> Self {
        // No rate is 0 because none was wrong.
        let error = (tally.wrong as f64 + 0.5) / (tally.all as f64 + 1.0);
        let is_likely = |times: &f64| {
            let all = (tally.all as f64 * times).floor() as u64;
            let wrong = allowed(all, rate, confidence);
            wrong.is_some_and(|wrong| binomial_tail(Tally { wrong, all }, error) >= LIKELY)
        };
        let times = (1..GROWN).map(|step| GROWTH.powi(step)).find(is_likely).filter(|_| error < rate);
        let times_of = |number: f64| times.map(|times| two_digits(number * times));
        let supports = |rate: &f64| binomial_tail(tally, *rate) <= 1.0 - confidence;
        Self {
            touches: supplied.and_then(|supplied| times_of(supplied.fewest as f64)),
            sequences: if supplied.is_none() { times_of(sequences as f64) } else { None },
            approaches: supplied.is_none_or(|supplied| supplied.approaches),
            // In steps that a reader tells apart.
            supported: (1..500).map(|step| f64::from(step) / 1e3).filter(|higher| *higher > rate).find(supports),
            noise,
        }
    }

    /// The advice, as sentences.
    fn sentences(&self) -> String {
        let what = if self.approaches { "approaches" } else { "touches" };
        let higher = match self.supported {
            Some(supported) => format!("promise a higher error rate: these support {} %", percent(supported)),
            None => "promise a higher error rate".into(),
        };
        match (self.touches, self.sequences, &self.noise) {
            (Some(touches), ..) => {
                format!(
                    "About {touches} {what} of each object would do, if as many of the names are wrong. Or {higher}."
                )
            }
            (_, Some(sequences), _) => {
                format!(
                    "About {sequences} sequences would do (--sequences), if as many of the names are wrong. Or {higher}."
                )
            }
            (.., Some([trained, here])) => {
                format!(
                    "Train the model for the noise of these {what}: it was trained for {trained}, and they have {here}. Or {higher}."
                )
            }
            _ => format!(
                "The model was trained for the noise of these {what}, and more of them would not do: {higher}, or train a model that \
                 mistakes fewer."
            ),
        }
    }
}

/// Rates that recordings support, and recordings that a rate takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Forecast {
    /// Approaches that were recorded to the object with the fewest.
    pub approaches: usize,
    /// The lowest rate that so many are likely to support, where one is known.
    pub supported: Option<f64>,
    /// The approaches that are likely to support the rate, as far as the simulation is right; none where it says of no number
    /// that it is enough.
    pub enough: Option<Enough>,
}

/// Recordings that are likely to be enough. Objects that are hard to distinguish take more approaches, and as many sequences.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Enough {
    /// Approaches to all objects.
    pub all: u64,
    /// Approaches to the object that takes the fewest, and its name.
    pub least: (u64, String),
    /// Touches of the object that takes the most.
    pub most: (u64, String),
}

impl Variant for CalibrateProblem {
    fn fix(&self) -> String {
        match self {
            Self::TooFewSequences { groups: true, .. } => {
                "Record more groups, or promise a higher error rate; more sequences of the same groups do not help."
            }
            Self::TooFewSequences { .. } => "Record more sequences, or promise a higher error rate.",
            Self::TooFewForTest { .. } => "Record more, or calibrate without the test.",
            Self::TooManyAlarms { .. } => {
                "Train the model on rows like these, so that they fit their classes, or calibrate without the test."
            }
            Self::FoldDiffers => "Train the model of each fold as the model itself, on sequences of every class.",
            Self::Looser { .. } => "Calibrate on more, or without the test.",
            Self::NotKeptByRows { wrong, given, rate, .. } if is_too_few(Tally { wrong: *wrong, all: *given }, *rate) => {
                "Record more sequences, or promise a higher error rate."
            }
            Self::NotKeptByRows { .. } => {
                "Promise a higher error rate, give sequences of more rows, or train the model on rows like these."
            }
            Self::MissingSequences { .. } => "Add sequences of them.",
            Self::TooFew { supplied: None, .. } => "Allow more sequences, or promise a higher error rate.",
            Self::TooFew { supplied: Some(_), .. } => "Record or capture more touches, or promise a higher error rate.",
            Self::NotKept { remedy: Some(remedy), .. } => return remedy.sentences(),
            Self::NotKept { remedy: None, .. } => {
                "Train the model for the noise of these touches, or promise a higher error rate; more touches of the \
                 calibration may also help."
            }
            Self::NotSupported { tally, needed, .. } if tally.all < *needed => "Record more, or promise a higher error rate.",
            Self::NotSupported { .. } => {
                "Promise a higher error rate, record more, or bring the simulation nearer to the recordings: fit the probe \
                 (`palpate probe fit`), or adjust the model to other recordings (`palpate train --teach`)."
            }
            Self::Missing { .. } => "Capture them too, with another seed than the training's.",
            Self::MissingRecordings { objects } if objects.iter().any(|object| object.contains('/')) => {
                "Record it too: `palpate data record --object OBJECT/PLACEMENT`, or --object OBJECT where the robot does not know \
                 how it lies."
            }
            Self::MissingRecordings { .. } => "Record it too: a promise is for all objects of the model.",
            Self::TrainedOn { .. } => "Calibrate on others: capture them with another seed (--seed), or record more.",
            Self::OneObject => "Give a model of two or more objects.",
        }
        .into()
    }
}

fn what(groups: bool) -> &'static str {
    if groups { "groups of sequences" } else { "sequences" }
}

fn how_many(found: u64, object: &Option<String>, groups: bool, names_in: Option<u64>) -> String {
    let of = of_object(object);
    match names_in {
        Some(all) if groups => format!("names given{of} in as many as {found} of {all} groups of sequences"),
        Some(all) => format!("{found} names given{of} in {all} sequences"),
        None => format!("{found} {}", what(groups)),
    }
}

fn could(possible: Option<f64>) -> String {
    match possible {
        None => "as many could promise nothing".into(),
        Some(rate) => format!("as many could promise {} %", percent(rate)),
    }
}

/// True if a higher share of these names would have to be wrong to say that the rate is not kept.
fn is_too_few(Tally { wrong, all }: Tally, rate: f64) -> bool {
    wrong as f64 <= rate * all as f64
}

/// Statement of what was seen where no threshold was kept.
fn seen(object: &Option<String>, rate: f64, tally: Tally, needed: Option<u64>, units: &str) -> String {
    let (Tally { wrong, all }, of, rate_text) = (tally, of_object(object), percent(rate));
    if !is_too_few(tally, rate) {
        return format!(
            "no threshold that was tested keeps {rate_text} %: at the best {wrong} of {all} names given{of}{units} are wrong"
        );
    }
    let needed = needed.map_or_else(String::new, |needed| {
        format!(": with {wrong} wrong it takes {needed}, and fewer the fewer are wrong")
    });
    format!("{all} names given{of}{units}, {wrong} wrong, are too few to know whether {rate_text} % is kept{needed}")
}

pub(crate) fn percent(rate: f64) -> f64 {
    (rate * 1e9).round() / 1e7
}

/// Estimate, in words, of the touches of each object that yield the names needed: in proportion.
fn in_touches(supplied: Option<Supplied>, found: u64, needed: u64) -> String {
    let Some(Supplied { approaches, fewest }) = supplied else { return String::new() };
    let what = if approaches { "approaches" } else { "touches" };
    if found == 0 {
        return format!(", and {fewest} {what} of an object give no name");
    }
    let enough = fewest as f64 * needed as f64 / found as f64;
    // Of as many names, none wrong, with the usual confidence.
    let supported = 1.0 - 0.05_f64.powf(1.0 / found as f64);
    format!(
        ", which takes about {} {what} of each object or more; there are {fewest} of one, which support {} % at best",
        two_digits(enough),
        percent((supported * 1e3).ceil() / 1e3)
    )
}

fn not_supported(object: &Option<String>, rate: f64, tally: Tally, needed: u64, forecast: &Forecast) -> String {
    let (of, rate) = (of_object(object), percent(rate));
    let what = match tally.all < needed {
        true => format!(
            "{} names given{of} on the recordings are too few to promise {rate} %: at least {needed} are needed, none of them wrong",
            tally.all
        ),
        false => format!(
            "{} of {} names given{of} on the recordings are wrong, too many to promise {rate} %",
            tally.wrong, tally.all
        ),
    };
    let supported = forecast.supported.map(|supported| {
        format!("; {} recorded approaches to each object support about {} %", forecast.approaches, percent(supported))
    });
    let enough = forecast.enough.as_ref().map(|Enough { all, least, most }| {
        format!(
            "; {rate} % takes about {all} in all, from {} to {} to {} to {}, if the simulation is right",
            least.0, least.1, most.0, most.1
        )
    });
    format!("{what}{}{}", supported.unwrap_or_default(), enough.unwrap_or_default())
}

fn of_object(object: &Option<String>) -> String {
    object.as_ref().map_or_else(String::new, |object| format!(" for {object}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn remedy(wrong: u64, all: u64, noise: Option<[String; 2]>) -> Remedy {
        let supplied = Some(Supplied { approaches: true, fewest: 60_000 });
        Remedy::new(Tally { wrong, all }, &TERMS, supplied, 0, noise)
    }

    const TERMS: Terms = Terms { rate: 0.01, confidence: 0.95, per: super::super::Per::Average };

    #[test]
    fn the_advice_of_a_rate_that_is_not_kept_is_computed_from_the_names_that_were_seen() {
        // 6 of 785 are a share below 1 %, and too many to show it: as large a share of more names does.
        let few = remedy(6, 785, None);
        let enough = few.touches.unwrap();
        let times = enough as f64 / 60_000.0;
        let tally = Tally { wrong: (6.0 * times).round() as u64, all: (785.0 * times).round() as u64 };
        assert!(binomial_tail(tally, 0.01) <= 0.05, "{tally:?}");
        assert!((12.0..40.0).contains(&times), "{enough}");
        let said = few.sentences();
        assert!(said.starts_with(&format!("About {enough} approaches of each object would do")), "{said}");
        assert!(said.contains("these support 1.6 %") && !said.contains("noise"), "{said}");
        assert!(binomial_tail(Tally { wrong: 6, all: 785 }, 0.016) <= 0.05);
        // The fewer are wrong, the fewer do.
        assert!(remedy(4, 785, None).touches.unwrap() < enough);
    }

    #[test]
    fn a_model_that_was_trained_for_the_noise_of_the_touches_is_not_to_be_trained_for_it() {
        let same = remedy(14, 785, None);
        assert_eq!(same.touches, None, "a share above the rate stays above it");
        let said = same.sentences();
        assert!(
            said.starts_with("The model was trained for the noise of these approaches") && said.contains("2.8 %"),
            "{said}"
        );
        let other = remedy(14, 785, Some(["no noise".into(), "noise of 5 ms".into()])).sentences();
        assert!(
            other.starts_with("Train the model for the noise")
                && other.contains("trained for no noise, and they have noise of 5 ms"),
            "{other}"
        );
        let sequences = Remedy::new(Tally { wrong: 6, all: 785 }, &TERMS, None, 1_000, None);
        assert!(sequences.sentences().contains("sequences would do (--sequences)"), "{sequences:?}");
    }
}
