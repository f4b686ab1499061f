//! Problems with teaching objects from recorded touches.

use crate::error::Variant;
use palpate_shared::Descriptor;
use palpate_shared::format::Counted;

/// Problems with teaching objects from recorded touches.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TeachProblem {
    /// The ensemble is over rows of features.
    #[error("objects are taught by touches, and the ensemble is over rows of features")]
    NotOfTouches,
    /// Leaves have no room for another object.
    #[error("a leaf of the ensemble holds one value, so that no object can be added to its trees")]
    OneValue,
    /// There is nothing to teach.
    #[error("there are no recorded touches")]
    Nothing,
    /// Objects that the ensemble knows have no touches to compare with.
    #[error("there are no touches of {}, which the ensemble knows", objects.join(", "))]
    Missing {
        /// The objects.
        objects: Vec<String>,
    },
    /// A name is taken.
    #[error("{object} is known already: a taught object needs a name that no other object has")]
    Known {
        /// The name.
        object: String,
    },
    /// Partial touches are evidence, but none were recorded.
    #[error(
        "only full touches were recorded, but the model takes {} as evidence: it would learn that the objects never \
         cause other touches",
        match counted { Counted::All => "every approach", _ => "every touch with a contact" }
    )]
    FullTouches {
        /// Touches that are evidence.
        counted: Counted,
    },
    /// The known objects' touches have other noise than the ensemble was trained for.
    #[error("the ensemble was trained for {stated}, and the touches of its objects have {there} already")]
    OtherNoise {
        /// Statement of the ensemble about its training.
        stated: String,
        /// Kind of touches there are.
        there: String,
    },
    /// A pose is missing.
    #[error("touches of {object} have no pose, which the descriptor {} needs", descriptor.name())]
    NoPose {
        /// The object.
        object: String,
        /// The descriptor.
        descriptor: Descriptor,
    },
    /// There are too few touches to hold a part of them out.
    #[error("only {touches} recorded touches of {object} are evidence, and at least {least} are needed")]
    TooFew {
        /// The object.
        object: String,
        /// Its touches that are evidence.
        touches: usize,
        /// Number of touches needed.
        least: usize,
    },
}

impl Variant for TeachProblem {
    fn fix(&self) -> String {
        match self {
            Self::NotOfTouches => "Give an ensemble that was trained on touches.",
            Self::OneValue => "Train with leaves that hold a value for each object, as the preset compact does.",
            Self::Nothing => "Record approaches to the object, one line per approach.",
            Self::Missing { .. } => {
                "Give the data set that the ensemble was trained on, or another one of the same objects."
            }
            Self::Known { .. } => {
                "Fit the probe to recordings of objects that it knows, or rename the recording to teach it as another object."
            }
            Self::FullTouches { .. } => {
                "Record every approach, also those that missed a finger, or train on full touches."
            }
            Self::OtherNoise { .. } => "Give simulated touches without noise, or train again on these.",
            Self::NoPose { .. } => "Record the pose with every touch, or train without.",
            Self::TooFew { .. } => "Record more approaches; 300 are a good start.",
        }
        .into()
    }
}
