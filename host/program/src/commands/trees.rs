//! The option for how trees are grown: `rounds=100,depth=6,eta=0.3`.

use super::keys::one_of;
use palpate::ensemble::train::{Engine, Settings};
use palpate::with;
use std::str::FromStr;

/// Settings of trees, as one text; those that are left open are a preset's.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Trees {
    rounds: Option<usize>,
    depth: Option<usize>,
    eta: Option<f64>,
    min_child_weight: Option<f64>,
    bins: Option<usize>,
    multi_output: Option<bool>,
    /// 0 leaves leaves as they are.
    leaf_bits: Option<u32>,
    trainer: Option<Engine>,
}

/// Keys, and what each takes.
const KEYS: [(&str, &str); 8] = [
    ("rounds", "a number such as 30"),
    ("depth", "a number such as 6"),
    ("eta", "a number such as 0.3"),
    ("min_child_weight", "a number such as 30"),
    ("bins", "a number such as 256"),
    ("leaves", "each (a value for each object) or one (each object has its own trees)"),
    ("leaf_bits", "a number of bits such as 16, or 0 to leave leaves as they are"),
    ("trainer", "palpate or xgboost"),
];

/// The keys alone.
fn keys() -> impl Iterator<Item = &'static str> {
    KEYS.into_iter().map(|(key, _)| key)
}

impl FromStr for Trees {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut trees = Self::default();
        let known: Vec<&str> = keys().collect();
        for (key, value) in super::keys::pairs(text, &known, "a setting of trees", "rounds=30,depth=6")? {
            let wanted = KEYS.iter().find(|own| own.0 == key).map_or("", |own| own.1);
            trees.set(key, value).ok_or_else(|| format!("{key} is {value:?}; use {wanted}"))?;
        }
        Ok(trees)
    }
}

impl Trees {
    fn set(&mut self, key: &str, value: &str) -> Option<()> {
        match key {
            "rounds" => self.rounds = Some(value.parse().ok()?),
            "depth" => self.depth = Some(value.parse().ok()?),
            "eta" => self.eta = Some(value.parse().ok()?),
            "min_child_weight" => self.min_child_weight = Some(value.parse().ok()?),
            "bins" => self.bins = Some(value.parse().ok()?),
            "leaves" => self.multi_output = Some(one_of(value, [("each", true), ("one", false)]).ok()?),
            "leaf_bits" => self.leaf_bits = Some(value.parse().ok()?),
            _ => self.trainer = Some(one_of(value, [("palpate", Engine::Palpate), ("xgboost", Engine::Xgboost)]).ok()?),
        }
        Some(())
    }

    /// The settings that are given, and `preset` where they are open.
    pub(crate) fn over(&self, preset: Settings) -> Settings {
        with!(
            preset.clone(),
            multi_output = self.multi_output.unwrap_or(preset.multi_output),
            rounds = self.rounds.unwrap_or(preset.rounds),
            depth = self.depth.unwrap_or(preset.depth),
            eta = self.eta.unwrap_or(preset.eta),
            min_child_weight = self.min_child_weight.unwrap_or(preset.min_child_weight),
            bins = self.bins.unwrap_or(preset.bins),
            leaf_bits = self.leaf_bits.map_or(preset.leaf_bits, |bits| (bits > 0).then_some(bits)),
            trainer = self.trainer.unwrap_or(preset.trainer)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_sets_its_own_setting_and_leaves_the_others_to_the_preset() {
        let set = |text: &str| text.parse::<Trees>().unwrap().over(Settings::compact());
        let preset = Settings::compact;
        let all = set("rounds=7,depth=3,eta=0.5,min-child-weight=2,bins=64,leaves=one,leaf_bits=8,trainer=xgboost");
        assert_eq!((all.rounds, all.depth, all.eta, all.min_child_weight), (7, 3, 0.5, 2.0));
        assert_eq!((all.bins, all.multi_output, all.leaf_bits), (64, false, Some(8)));
        assert_eq!(all.descriptor, preset().descriptor);
        assert_eq!((set("leaf_bits=0").bins, set("leaf_bits=0").leaf_bits), (preset().bins, None));
        assert_eq!((set("depth=3").rounds, set("depth=3").depth), (preset().rounds, 3));
    }

    #[test]
    fn what_is_no_setting_of_trees_is_refused_with_what_to_use() {
        for (text, expected) in [
            ("", "\"\" is not a setting of trees; use rounds=30,depth=6"),
            ("rounds", "rounds is \"\"; use a number"),
            ("rounds=-1", "rounds is \"-1\"; use a number such as 30"),
            ("bins=64/16", "bins is \"64/16\"; use a number such as 256"),
            ("leaves=two", "leaves is \"two\"; use each"),
            ("gamma=1", "\"gamma=1\" is not a setting of trees"),
            ("depth=3,depth=4", "depth is given twice"),
            ("different_leaves=128", "\"different_leaves=128\" is not a setting of trees"),
            ("trainer=lightgbm", "trainer is \"lightgbm\"; use palpate or xgboost"),
        ] {
            let error = text.parse::<Trees>().unwrap_err();
            assert!(error.starts_with(expected), "{text}: {error}");
        }
    }
}
