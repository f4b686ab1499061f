//! Options for which objects to expect, and how often.

use palpate::compile;
use palpate::error::{Error, Result};

/// Objects to expect.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct ExpectedArguments {
    #[command(flatten)]
    prior: PriorArguments,
    /// Only these; other objects cannot be there
    #[arg(long, value_delimiter = ',', value_name = "NAME,…")]
    only: Vec<String>,
}

/// Frequencies with which objects are touched.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct PriorArguments {
    /// Probabilities of objects, such as fork=0.3,spoon=20%; the others share the rest
    #[arg(long, value_delimiter = ',', value_parser = prior, value_name = "NAME=P,…")]
    prior: Vec<(String, f64)>,
}

impl PriorArguments {
    /// The probability of each output; `None` without the option. That of an object that has one for each of its placements is
    /// divided as their `own` weights are.
    pub(crate) fn of(&self, names: &[String], own: &[f64]) -> Result<Option<Vec<f64>>> {
        if self.prior.is_empty() {
            return Ok(None);
        }
        let mut priors = vec![None; names.len()];
        for (name, prior) in &self.prior {
            let outputs = outputs("prior", name, names)?;
            let weight = |output: usize| own.get(output).copied().unwrap_or(1.0);
            let all: f64 = outputs.iter().map(|&output| weight(output)).sum();
            for output in outputs {
                let share = if all > 0.0 { weight(output) / all } else { 0.0 };
                if priors[output].replace(prior * share).is_some() {
                    return Err(Error::setting("prior", name, "each name once"));
                }
            }
        }
        let stated: f64 = priors.iter().flatten().sum();
        let others = priors.iter().filter(|prior| prior.is_none()).count();
        let rest = if others == 0 { 0.0 } else { (1.0 - stated) / others as f64 };
        // Without others it is the proportions that count.
        let is_wrong = if others == 0 { stated <= 0.0 } else { stated > 1.0 };
        if is_wrong {
            let allowed = if others == 0 {
                "numbers of which one is above 0".to_owned()
            } else {
                format!("numbers that are 1 together at most: the other {others} objects share the rest")
            };
            return Err(Error::setting("prior", stated, allowed));
        }
        Ok(Some(priors.into_iter().map(|prior| prior.unwrap_or(rest)).collect()))
    }
}

impl ExpectedArguments {
    /// True if anything else is expected than the model states.
    fn is_given(&self) -> bool {
        !self.prior.prior.is_empty() || !self.only.is_empty()
    }

    /// A weight for each object, for [`Recognizer::reset_to`](palpate_onboard::Recognizer::reset_to); `None` without any
    /// of the options. `own` are the weights that the model itself says.
    pub(crate) fn weights(&self, names: &[String], own: &[f64]) -> Result<Option<Vec<u32>>> {
        if !self.is_given() {
            return Ok(None);
        }
        let mut weights = self.prior.of(names, own)?.unwrap_or_else(|| own.to_vec());
        if !self.only.is_empty() {
            let mut allowed = vec![false; names.len()];
            for name in &self.only {
                outputs("only", name, names)?.into_iter().for_each(|output| allowed[output] = true);
            }
            weights.iter_mut().zip(allowed).filter(|(_, allowed)| !allowed).for_each(|(weight, _)| *weight = 0.0);
        }
        if weights.iter().all(|weight| *weight <= 0.0) {
            return Err(Error::setting("only", self.only.join(","), "an object whose prior is above 0"));
        }
        compile::weights(&weights).map(Some)
    }
}

/// The output of this name, or those of the placements of the object of this name.
fn outputs(option: &'static str, name: &str, names: &[String]) -> Result<Vec<usize>> {
    if let Some(own) = names.iter().position(|known| known == name) {
        return Ok(vec![own]);
    }
    let is_of = |output: &usize| names[*output].rsplit_once('/').is_some_and(|(object, _)| object == name);
    let placements: Vec<usize> = (0..names.len()).filter(is_of).collect();
    match placements.is_empty() {
        true => Err(Error::setting(option, name, format!("objects that the model knows: {}", names.join(", ")))),
        false => Ok(placements),
    }
}

/// A name and its probability.
fn prior(text: &str) -> Result<(String, f64), String> {
    let example = || "give a name and a probability, such as fork=0.3".to_owned();
    let (name, share) = text.rsplit_once('=').ok_or_else(example)?;
    let share = super::numbers::number_or_percent(share).map_err(|_| example())?;
    if !(0.0..=1e9).contains(&share) {
        return Err(example());
    }
    Ok((name.to_owned(), share))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Program {
        #[command(flatten)]
        expected: ExpectedArguments,
    }

    fn weights(words: &[&str]) -> Result<Option<Vec<u32>>> {
        let names = ["bowl", "fork", "spoon"].map(String::from);
        let parsed = Program::try_parse_from([&["program"], words].concat()).unwrap();
        parsed.expected.weights(&names, &[1.0; 3])
    }

    #[test]
    fn names_that_are_not_stated_share_the_rest_and_forbidden_ones_weigh_nothing() {
        let all = 1_u32 << 31;
        assert_eq!(weights(&[]).unwrap(), None);
        assert_eq!(weights(&["--only", "spoon,bowl"]).unwrap(), Some(vec![all, 0, all]));
        assert_eq!(weights(&["--prior", "fork=0.5"]).unwrap(), Some(vec![all / 2, all, all / 2]));
        assert_eq!(weights(&["--prior", "fork=50%,bowl=0.5"]).unwrap(), Some(vec![all, all, 0]));
        assert_eq!(weights(&["--prior", "fork=2,bowl=4,spoon=1"]).unwrap(), Some(vec![all, all / 2, all / 4]));
        assert_eq!(weights(&["--prior", "fork=0.5", "--only", "bowl,spoon"]).unwrap(), Some(vec![all, 0, all]));
        assert_eq!(weights(&["--prior", "fork=1e-12"]).unwrap().unwrap()[1], 1);
    }

    #[test]
    fn an_object_that_has_placements_is_all_of_them() {
        let names = ["bowl/+z", "bowl/-z", "fork/+z"].map(String::from);
        let weights = |words: &[&str]| {
            let parsed = Program::try_parse_from([&["program"], words].concat()).unwrap();
            parsed.expected.weights(&names, &[3.0, 1.0, 4.0]).unwrap().unwrap()
        };
        let all = 1_u32 << 31;
        let third = (f64::from(all) / 3.0).round() as u32;
        assert_eq!(weights(&["--only", "bowl"]), [all, third, 0]);
        assert_eq!(weights(&["--only", "bowl/-z,fork"]), [0, all / 4, all]);
        assert_eq!(weights(&["--prior", "bowl=0.4"]), [all / 2, all / 6, all]);
    }

    #[test]
    fn what_cannot_be_expected_is_refused_by_option() {
        for (words, expected) in [
            (&["--prior", "knife=0.3"][..], "prior is knife. Use objects that the model knows: bowl, fork, spoon."),
            (&["--only", "knife"], "only is knife."),
            (&["--prior", "fork=0.8,bowl=0.3"], "prior is 1.1. Use numbers that are 1 together at most"),
            (&["--prior", "fork=0,bowl=0,spoon=0"], "prior is 0."),
            (&["--prior", "fork=0.1,fork=0.2"], "prior is fork. Use each name once."),
            (&["--prior", "fork=0", "--only", "fork"], "only is fork."),
        ] {
            let error = weights(words).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(expected), "{error}");
        }
        for wrong in ["fork", "fork=", "fork=-1", "fork=few"] {
            let error = Program::try_parse_from(["program", "--prior", wrong]).err().unwrap().to_string();
            assert!(error.contains("such as fork=0.3"), "{error}");
        }
    }
}
