//! Problems with evaluating.

use crate::ensemble::object_of;
use crate::error::Problem;
use palpate_shared::Descriptor;

/// Problems with evaluating.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EvaluateProblem {
    /// Margins do not say which probabilities the library predicts.
    #[error("{}", if *is_loaded {
        "the bytes of a loaded model do not say how its library makes probabilities of margins"
    } else {
        "the model's margins do not determine probabilities: it predicts values, or classes of a calibrator or a hinge loss"
    })]
    NoProbabilities {
        /// True if the model was read from its bytes.
        is_loaded: bool,
    },
    /// The model does not know an object of the data set.
    #[error("the model does not know the object {object}, only {}", known.join(", "))]
    UnknownObject {
        /// The object.
        object: String,
        /// The objects that it knows.
        known: Vec<String>,
    },
    /// The model knows an object that was to be one that it does not know.
    #[error("the model knows the object {object}, so it is not a stranger")]
    KnownObject {
        /// The object.
        object: String,
    },
    /// An object that the model knows is not in a data set that must hold all of them.
    #[error("there are no touches of {object}, which the model knows")]
    MissingObject {
        /// The object.
        object: String,
    },
    /// An object has too few touches to say what its touches give.
    #[error("an object has only {found} touches to learn the expected evidence from, or they are all alike")]
    TooFewForMisfit {
        /// Number of touches.
        found: usize,
    },
    /// There are too few sequences to promise a share of false alarms, or too many false alarms at every threshold.
    #[error("{}", too_few_for_alarms(object, *object_sequences, *needed))]
    TooFewForAlarms {
        /// The object with the fewest sequences.
        object: String,
        /// Its sequences.
        object_sequences: usize,
        /// Number of sequences of each object that it takes.
        needed: u64,
    },
    /// The model works on other rows than touches.
    #[error("the model works on rows of features, not on touches")]
    RawFeatures,
    /// The model works on touches instead of other rows.
    #[error("the model is over touches, not over rows of features")]
    OverTouches,
    /// The descriptor needs the probe's pose.
    #[error("the descriptor {} needs the probe's pose, which no touch has", descriptor.name())]
    NoPose {
        /// The descriptor.
        descriptor: Descriptor,
    },
    /// A compiled model and an ensemble are not of the same objects and descriptor.
    #[error("the model was not compiled from this ensemble: its objects or its descriptor differ")]
    OtherModel,
    /// There is nothing to compare models on.
    #[error("there are no touches to compare the models on")]
    NoTouches,
    /// The model has more objects than a recognizer has room for.
    #[error("the model has {objects} objects, and the recognizer has room for {capacity}")]
    TooManyObjects {
        /// Objects of the model.
        objects: usize,
        /// Room of the recognizer.
        capacity: usize,
    },
    /// A compiled model's margins are not its ensemble's.
    #[error(
        "not exported from this ensemble: margins differ by up to {found:.2e} nats, where the model states {stated:.2e} at most"
    )]
    NotExported {
        /// The largest difference, in nats.
        found: f64,
        /// The largest one that the model states.
        stated: f64,
    },
    /// The model has no plan of approaches.
    #[error("the model has no plan of approaches")]
    NoPlan,
    /// Touches with a position are for maps.
    #[error("touches with a position, which a model of trees does not use")]
    Located,
    /// A plan was asked for a model of one object.
    #[error("the model has one object: there is nothing to distinguish it from")]
    OneObjectToPlan,
    /// A plan needs approaches, also those that missed.
    #[error("the data set holds full touches only, without the approaches in between")]
    NoApproaches,
    /// A plan needs approaches to every object.
    #[error("the data set has no approaches to {object}")]
    NoneOf {
        /// The object.
        object: String,
    },
    /// A plan needs the probe's pose.
    #[error("there are approaches to {object} without the probe's pose")]
    NoPoseOf {
        /// The object.
        object: String,
    },
    /// There are too few approaches in a pose.
    #[error("only {found} approaches to {object} are in one of the poses, and a plan needs {needed}")]
    FewInPose {
        /// The object.
        object: String,
        /// The fewest approaches in a pose.
        found: usize,
        /// Smallest number allowed.
        needed: usize,
    },
    /// A line is not a touch.
    #[error("{detail}")]
    Touch {
        /// Description of the fault.
        detail: String,
    },
}

fn too_few_for_alarms(object: &str, object_sequences: usize, needed: u64) -> String {
    if (object_sequences as u64) < needed {
        format!(
            "the touches make only {object_sequences} sequences of {object}, and the promise takes at least {needed}"
        )
    } else {
        format!(
            "of {object_sequences} sequences of each object too many end as unknown at every threshold, so the promise takes \
             more sequences"
        )
    }
}

impl Problem for EvaluateProblem {
    fn fix(&self) -> String {
        match self {
            Self::UnknownObject { object, known } if known.iter().any(|known| is_placement_of(known, object)) => {
                "Train it on this placement too (capture with --placements), take it out of the data, or record the object without \
                 its placement (--object OBJECT), to test it however it lies."
            }
            Self::UnknownObject { .. } => "Train it on this object too, or take the object out of the data.",
            Self::KnownObject { .. } => "Take it out of the strangers, or train a model without it.",
            Self::MissingObject { .. } => "Capture touches of every object that the model knows.",
            Self::TooFewForAlarms { object, object_sequences, needed }
                if *object_sequences > 0 && (*object_sequences as u64) < *needed =>
            {
                let times = *needed as f64 / *object_sequences as f64;
                return format!("Capture about {:.1} times as many touches of {object}.", (10.0 * times).ceil() / 10.0);
            }
            Self::NoProbabilities { is_loaded: true } => "Compile its estimator again.",
            Self::NoProbabilities { is_loaded: false } => "Use `predict` or `margins`.",
            Self::TooFewForMisfit { .. } | Self::TooFewForAlarms { .. } => "Capture more touches of every object.",
            Self::OverTouches => "Use `palpate verify` and `palpate evaluate` for models of touches.",
            Self::RawFeatures => {
                "Give it rows of features: `palpate help recognize` and `palpate help evaluate` say how."
            }
            Self::NoPose { .. } => "Capture the touches with their pose.",
            Self::OtherModel | Self::NotExported { .. } => "Give the ensemble that the model was exported from.",
            Self::NoTouches => "Give at least one touch of each object.",
            Self::TooManyObjects { .. } => "Use a model of fewer objects.",
            Self::NoPlan => {
                "Add one: `palpate calibrate MODEL DIR -o OUT --plan 4`, from approaches with pose. An ensemble (JSON) has to be exported first."
            }
            Self::Located => {
                "Make maps of them (`palpate maps train --teach`), or leave the positions out."
            }
            Self::OneObjectToPlan => "Train a model of two objects or more.",
            Self::NoApproaches => "Capture every approach: --approaches N --pose.",
            Self::NoneOf { .. } => "Capture all of the model's objects.",
            Self::NoPoseOf { .. } => "Capture the approaches with their pose: --approaches N --pose.",
            Self::FewInPose { found, needed, .. } => {
                return format!(
                    "Capture {} times as many approaches, or plan fewer rolls.",
                    needed.div_ceil((*found).max(1)).max(2)
                );
            }
            Self::Touch { .. } => "Correct the line.",
        }
        .into()
    }
}

/// True if the first of two different outputs is another placement of the same object.
fn is_placement_of(one: &str, other: &str) -> bool {
    one != object_of(one) && object_of(one) == object_of(other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enough_sequences_with_too_many_alarms_are_not_said_to_be_too_few() {
        let of = |object_sequences| {
            let object = "bowl".to_owned();
            EvaluateProblem::TooFewForAlarms { object, object_sequences, needed: 30 }
        };
        let said = |object_sequences| of(object_sequences).to_string();
        assert!(said(20).contains("only 20 sequences of bowl") && said(20).ends_with("at least 30"));
        assert_eq!(of(20).fix(), "Capture about 1.5 times as many touches of bowl.");
        assert_eq!(of(0).fix(), "Capture more touches of every object.");
        assert!(said(37).starts_with("of 37 sequences of each object too many end as unknown"), "{}", said(37));
    }
}
