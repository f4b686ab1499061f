//! Outputs as XGBoost has them.

use super::objective::Link;
use super::schema::{LossParameters, Objective, SoftmaxParameters};
use crate::ensemble::{Ensemble, Output};

/// Outputs of an ensemble, as its file states them.
pub(super) struct Outputs {
    /// Groups of trees, or values in a leaf that has several.
    pub(super) groups: usize,
    /// The object of the first group: 1 for a binary model, whose trees are for the second class.
    first: usize,
    pub(super) objective: Objective,
    pub(super) base_score: String,
    /// 0 for models with one group, or targets.
    pub(super) num_class: String,
    pub(super) num_target: String,
}

impl Outputs {
    /// A regression for one output; a binary model for two outputs if the first one's margin is 0; else a group per output.
    pub(super) fn of(ensemble: &Ensemble) -> Self {
        let margins = &ensemble.base_margins;
        let is_binary = ensemble.schema().is_none()
            && ensemble.objects.len() == 2
            && margins[0].to_bits() == 0
            && ensemble.trees.iter().all(|tree| tree.output == Output::One(1));
        let one = |name: &str, first: usize, base: f32| Self {
            groups: 1,
            first,
            objective: Objective {
                name: name.into(),
                softmax_multiclass_param: None,
                reg_loss_param: Some(LossParameters { scale_pos_weight: "1".into() }),
            },
            base_score: format!("{base:E}"),
            num_class: "0".into(),
            num_target: "1".into(),
        };
        if is_binary {
            // Where no probability stands for the margin that is added up from, the raw margin has to.
            return match probability(margins[1]) {
                Some(base) => one("binary:logistic", 1, base),
                None => one("binary:logitraw", 1, margins[1]),
            };
        }
        if let [base] = margins[..] {
            return one("reg:squarederror", 0, base);
        }
        let groups = ensemble.objects.len();
        if ensemble.prediction().targets {
            let own = one("reg:squarederror", 0, 0.0);
            return Self { groups, base_score: base_score(margins), num_target: groups.to_string(), ..own };
        }
        let num_class = groups.to_string();
        Self {
            groups,
            first: 0,
            objective: Objective {
                name: "multi:softprob".into(),
                softmax_multiclass_param: Some(SoftmaxParameters { num_class: num_class.clone() }),
                reg_loss_param: None,
            },
            base_score: base_score(margins),
            num_class,
            num_target: "1".into(),
        }
    }

    /// The group of trees with this output.
    pub(super) fn group(&self, output: Output) -> u64 {
        match output {
            Output::One(object) => u64::try_from(object.saturating_sub(self.first)).unwrap_or(u64::MAX),
            Output::Each => 0,
        }
    }
}

/// One number where all margins start equal (every version reads that), else a list.
fn base_score(margins: &[f32]) -> String {
    match margins {
        [first, rest @ ..] if rest.iter().all(|margin| margin.to_bits() == first.to_bits()) => format!("{first:E}"),
        _ => format!("[{}]", margins.iter().map(|margin| format!("{margin:E}")).collect::<Vec<_>>().join(",")),
    }
}

/// The probability whose margin is exactly this one, if one is.
fn probability(margin: f32) -> Option<f32> {
    let near = (1.0 / (1.0 + (-f64::from(margin)).exp())) as f32;
    let mut candidates = vec![near];
    let (mut below, mut above) = (near, near);
    for _ in 0..8 {
        (below, above) = (below.next_down(), above.next_up());
        candidates.extend([below, above]);
    }
    let is_exact = |base: &f32| *base > 0.0 && *base < 1.0 && Link::Logit.margin(*base).to_bits() == margin.to_bits();
    // A margin of 0 is that of one half, with either sign.
    if margin == 0.0 { Some(0.5) } else { candidates.into_iter().find(is_exact) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_probability_is_one_whose_margin_is_the_very_number() {
        for base in [0.5_f32, 0.1, 0.9, 0.123_456_7, 0.999, 1e-6] {
            let margin = Link::Logit.margin(base);
            let found = probability(margin).unwrap();
            assert_eq!(Link::Logit.margin(found).to_bits(), margin.to_bits(), "{base}");
        }
        assert_eq!(probability(0.0), Some(0.5));
        for margin in [300.0, -300.0, 1e-30] {
            assert_eq!(probability(margin), None, "{margin}");
        }
    }
}
