//! Promises that cannot be made: what is wrong, in one of two sentences, and what would do.

use super::terms::Terms;
use super::walk::{Stop, Tally, allowed, binomial_tail};
use crate::error::{Error, Kind, problem};
use palpate_base::wording::two_digits;
use palpate_shared::format::Per;

/// The probability with which a forecast number of approaches is enough, if the simulation is right.
pub(super) const LIKELY: f64 = 0.8;
/// The factor between numbers of approaches that a forecast tries, and how many it tries.
pub(super) const GROWTH: f64 = 1.05;
pub(super) const GROWN: i32 = 160;

impl Stop {
    /// True if there are too few cases to know whether the rate is kept.
    pub(crate) fn is_too_few(&self, rate: f64) -> bool {
        match *self {
            Self::TooFew { .. } => true,
            // A higher share of the cases would have to be wrong to say that it is not.
            Self::TooMany { tally: Tally { wrong, all }, .. } => wrong as f64 <= rate * all as f64,
            Self::Looser => false,
        }
    }

    /// The problem without its remedy: too few cases, or too many bad ones. Both are in words: `cases` such as "names given",
    /// and `bad` such as "wrong".
    pub(crate) fn problem(&self, rate: f64, cases: &str, bad: &str) -> Error {
        let promised = percent(rate);
        let (Tally { wrong, all }, needed) = match *self {
            Self::TooFew { found, needed, .. } => (Tally { wrong: 0, all: found }, Some(needed)),
            Self::TooMany { tally, needed, .. } => (tally, needed),
            Self::Looser => {
                let what = problem!(
                    "with the test of strangers no threshold keeps {promised} % that is as strict as without it"
                );
                return what.fix("Calibrate on more, or without the test.").as_kind(Kind::NotKept);
            }
        };
        if !self.is_too_few(rate) {
            let what = problem!(
                "no threshold that was tested keeps {promised} %: at the best {wrong} of {all} {cases} are {bad}"
            );
            return what.as_kind(Kind::NotKept);
        }
        let most = if wrong == 0 { "none".into() } else { format!("no more than {wrong}") };
        let needed = match needed {
            Some(needed) => format!("at least {needed} are needed, {most} of them {bad}"),
            None => format!("{wrong} of them are {bad}"),
        };
        problem!("{all} {cases} are too few to promise {promised} %: {needed}").as_kind(Kind::TooFew)
    }

    /// Like [`Stop::problem`], of the names given: of the object that they are too few or too often wrong for, if the rate is
    /// promised for each.
    pub(crate) fn of_names(&self, names: &[String], terms: &Terms) -> Error {
        self.problem(terms.rate, &self.cases("names given", names, terms.per), "wrong")
    }

    /// Cases in words, with the object that has the problem if the rate is promised for each.
    pub(crate) fn cases(&self, cases: &str, names: &[String], per: Per) -> String {
        let name = match *self {
            Self::TooFew { position, .. } | Self::TooMany { position, .. } => names.get(position),
            Self::Looser => None,
        };
        name.filter(|_| per != Per::Average).map_or_else(|| cases.into(), |name| format!("{cases} for {name}"))
    }
}

/// A rate in percent, as it is shown.
pub(crate) fn percent(rate: f64) -> f64 {
    (rate * 1e9).round() / 1e7
}

/// The lowest rate that so many cases could promise, none of them wrong: rounded up to two digits, in words.
pub(crate) fn at_best(cases: u64, confidence: f64) -> String {
    let possible = 1.0 - (1.0 - confidence).powf(1.0 / cases.max(1) as f64);
    let digit = 10.0_f64.powf(possible.log10().floor() - 1.0);
    let possible = (possible / digit).ceil() * digit;
    if possible < 0.5 { format!("{} % at best", percent(possible)) } else { "no rate below 50 %".into() }
}

/// The touches of a data set that sequences used up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Supplied {
    /// "approaches", or "touches" if it holds full ones only.
    pub(crate) what: &'static str,
    /// Number of these that there are of the object with the fewest.
    pub(crate) fewest: u64,
}

/// Sequences that a promise was tested on, as far as advice depends on them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tested {
    /// The touches that they used up, if they did.
    pub(crate) supplied: Option<Supplied>,
    /// Number of sequences.
    pub(crate) sequences: usize,
    /// The noise that the model was trained for, and that of the touches, where these differ.
    pub(crate) noise: Option<[String; 2]>,
}

impl Tested {
    /// The problem of names that were given in these sequences, and what would do.
    pub(crate) fn problem(&self, stop: &Stop, names: &[String], terms: &Terms) -> Error {
        let problem = stop.of_names(names, terms);
        match *stop {
            Stop::TooFew { found, needed, .. } => problem.fix(self.more(found, needed, terms.confidence)),
            Stop::TooMany { tally, .. } => problem.fix(self.remedy(tally, terms)),
            Stop::Looser => problem,
        }
    }

    /// Touches of each object that yield the names needed: in proportion.
    fn more(&self, found: u64, needed: u64, confidence: f64) -> String {
        let Some(Supplied { what, fewest }) = self.supplied else {
            return "Allow more sequences, or promise a higher error rate.".into();
        };
        let facts = match found {
            0 => format!("{fewest} {what} of an object give no name."),
            _ => format!(
                "That takes about {} {what} of each object or more; there are {fewest} of one, which support {}.",
                two_digits(fewest as f64 * needed as f64 / found as f64),
                at_best(found, confidence)
            ),
        };
        format!("{facts} Record or capture more touches, or promise a higher error rate.")
    }

    /// Changes that would keep a rate that no threshold kept, by the names that were seen.
    fn remedy(&self, tally: Tally, &Terms { rate, confidence, .. }: &Terms) -> String {
        // No rate is 0 because none was wrong.
        let error = (tally.wrong as f64 + 0.5) / (tally.all as f64 + 1.0);
        let is_likely = |times: &f64| {
            let all = (tally.all as f64 * times).floor() as u64;
            let wrong = allowed(all, rate, confidence);
            wrong.is_some_and(|wrong| binomial_tail(Tally { wrong, all }, error) >= LIKELY)
        };
        let times = (1..GROWN).map(|step| GROWTH.powi(step)).find(is_likely).filter(|_| error < rate);
        let supports = |rate: &f64| binomial_tail(tally, *rate) <= 1.0 - confidence;
        // In steps that a reader tells apart.
        let supported = (1..500).map(|step| f64::from(step) / 1e3).filter(|higher| *higher > rate).find(supports);
        let higher = match supported {
            Some(supported) => format!("promise a higher error rate: these support {} %", percent(supported)),
            None => "promise a higher error rate".into(),
        };
        let what = self.supplied.map_or("approaches", |supplied| supplied.what);
        match (times, self.supplied, &self.noise) {
            (Some(times), Some(Supplied { fewest, .. }), _) => format!(
                "About {} {what} of each object would do, if as many of the names are wrong. Or {higher}.",
                two_digits(fewest as f64 * times)
            ),
            (Some(times), None, _) => format!(
                "About {} sequences would do (--sequences), if as many of the names are wrong. Or {higher}.",
                two_digits(self.sequences as f64 * times)
            ),
            (None, _, Some([trained, here])) => format!(
                "Train the model for the noise of these {what}: it was trained for {trained}, and they have {here}. Or {higher}."
            ),
            (None, _, None) => format!(
                "The model was trained for the noise of these {what}, and more of them would not do: {higher}, or train a model \
                 that mistakes fewer."
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TERMS: Terms = Terms { rate: 0.01, confidence: 0.95, per: Per::Average };

    fn remedy(wrong: u64, all: u64, noise: Option<[String; 2]>) -> String {
        let supplied = Some(Supplied { what: "approaches", fewest: 60_000 });
        Tested { supplied, sequences: 0, noise }.remedy(Tally { wrong, all }, &TERMS)
    }

    /// The approaches to each object that would do.
    fn enough(remedy: &str) -> f64 {
        let number =
            remedy.strip_prefix("About ").and_then(|rest| rest.split_once(" approaches of each object would do"));
        number.unwrap_or_else(|| panic!("{remedy}")).0.parse().unwrap()
    }

    #[test]
    fn the_advice_of_a_rate_that_is_not_kept_is_computed_from_the_names_that_were_seen() {
        // 6 of 785 are a share below 1 %, and too many to show it: as large a share of more names does.
        let said = remedy(6, 785, None);
        let times = enough(&said) / 60_000.0;
        let tally = Tally { wrong: (6.0 * times).round() as u64, all: (785.0 * times).round() as u64 };
        assert!(binomial_tail(tally, 0.01) <= 0.05, "{tally:?}");
        assert!((12.0..40.0).contains(&times), "{said}");
        assert!(said.contains("these support 1.6 %") && !said.contains("noise"), "{said}");
        assert!(binomial_tail(Tally { wrong: 6, all: 785 }, 0.016) <= 0.05);
        // The fewer are wrong, the fewer do.
        assert!(enough(&remedy(4, 785, None)) < enough(&said));
    }

    #[test]
    fn a_model_that_was_trained_for_the_noise_of_the_touches_is_not_to_be_trained_for_it() {
        // A share above the rate stays above it.
        let same = remedy(14, 785, None);
        let expected = "The model was trained for the noise of these approaches, and more of them would not do";
        assert!(same.starts_with(expected) && same.contains("2.8 %"), "{same}");
        let other = remedy(14, 785, Some(["no noise".into(), "noise of 5 ms".into()]));
        assert!(
            other.starts_with("Train the model for the noise")
                && other.contains("trained for no noise, and they have noise of 5 ms"),
            "{other}"
        );
        let tested = Tested { supplied: None, sequences: 1_000, noise: None };
        let said = tested.remedy(Tally { wrong: 6, all: 785 }, &TERMS);
        assert!(said.contains("sequences would do (--sequences)"), "{said}");
    }

    #[test]
    fn too_few_cases_and_too_many_wrong_ones_have_one_sentence_each() {
        let too_many = |wrong, needed| Stop::TooMany { position: 1, tally: Tally { wrong, all: 400 }, needed };
        let names = ["fork".to_owned(), "spoon".to_owned()];
        let said = |stop: Stop, per| {
            let error = stop.of_names(&names, &Terms { per, ..TERMS });
            (error.what().to_owned(), error.kind().clone())
        };
        for (stop, per, expected, kind) in [
            (
                Stop::TooFew { position: 1, found: 40, needed: 299 },
                Per::Name,
                "40 names given for spoon are too few to promise 1 %: at least 299 are needed, none of them wrong",
                Kind::TooFew,
            ),
            (
                too_many(3, Some(773)),
                Per::Average,
                "400 names given are too few to promise 1 %: at least 773 are needed, no more than 3 of them wrong",
                Kind::TooFew,
            ),
            (
                too_many(3, None),
                Per::Average,
                "400 names given are too few to promise 1 %: 3 of them are wrong",
                Kind::TooFew,
            ),
            (
                too_many(14, Some(2_100)),
                Per::Object,
                "no threshold that was tested keeps 1 %: at the best 14 of 400 names given for spoon are wrong",
                Kind::NotKept,
            ),
        ] {
            assert_eq!(said(stop, per), (expected.to_owned(), kind));
        }
        assert_eq!((at_best(240, 0.95), at_best(1, 0.95)), ("1.3 % at best".into(), "no rate below 50 %".into()));
    }
}
