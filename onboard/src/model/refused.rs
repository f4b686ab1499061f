//! Touches that a model was not trained for, and so cannot take as evidence.

use super::Model;
use core::fmt;
use palpate_shared::format::{Fault, TrainedTouches};
use palpate_shared::{ContactPattern, Touch};

/// Reason why a touch is not evidence. It was not counted, and nothing has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Refused {
    /// The model was not trained on touches with this contact pattern.
    Pattern(ContactPattern),
    /// The last contact came later after the first one than in any touch of the training.
    Spread,
    /// The model needs the probe's pose, and the touch has none.
    NoPose,
    /// The model is over rows of features, which touches cannot be turned into.
    NeedsFeatures,
    /// The model is over touches, and was given a row of features.
    NeedsTouches,
    /// The model states which rows it takes, and was given a row without [`RowsSeen`](crate::RowsSeen), or with too few
    /// features there.
    NeedsSeen,
    /// A feature of the row, by its number from 0, is not as in the rows that the model was calibrated on.
    Guarded(u8, Fault),
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pattern(ContactPattern::None) => {
                "no finger touched, and the model was not trained on such approaches"
            }
            Self::Pattern(ContactPattern::Outer) => {
                "only an outer finger touched, and the model was not trained on such touches"
            }
            Self::Pattern(ContactPattern::Middle) => {
                "only the middle finger touched, and the model was not trained on such touches"
            }
            Self::Pattern(ContactPattern::OuterAndMiddle) => {
                "only the middle and an outer finger touched, and the model was not trained on such touches"
            }
            Self::Pattern(ContactPattern::BothOuter) => {
                "only the outer fingers touched, and the model was not trained on such touches"
            }
            Self::Pattern(ContactPattern::All) => {
                "all three fingers touched, and the model was not trained on such touches"
            }
            Self::Spread => "the contacts are further apart in time than in any touch that the model was trained on",
            Self::NoPose => "the model needs the probe's pose, and the touch has none",
            Self::NeedsFeatures => "the model is over rows of features, not touches",
            Self::NeedsTouches => "the model is over touches, not rows of features",
            Self::NeedsSeen => "the model states which rows it takes: they need a RowsSeen with room for its features",
            Self::Guarded(_, Fault::Outside) => "a feature is outside of what the model was calibrated on",
            Self::Guarded(_, Fault::Missing) => "a feature is missing, which never happened in calibration",
            Self::Guarded(_, Fault::Stuck) => {
                "a feature stayed the same for longer than in any sequence of calibration"
            }
        })
    }
}

impl core::error::Error for Refused {}

impl Model<'_> {
    /// Returns an error unless the touch is one that the model was trained for.
    ///
    /// Cost: a few instructions. Cannot panic.
    ///
    /// # Errors
    /// [`Refused`] says why it is not.
    pub fn accepts(&self, touch: &Touch) -> Result<(), Refused> {
        match self.descriptor() {
            None => Err(Refused::NeedsFeatures),
            Some(_) => Refused::check(&self.trained_touches(), touch),
        }
    }
}

impl Refused {
    /// Returns an error unless a model that was trained on the given touches takes this one as evidence.
    ///
    /// Cost: a few instructions.
    ///
    /// # Errors
    /// [`Refused`] says why it does not.
    pub fn check(trained: &TrainedTouches, touch: &Touch) -> Result<(), Self> {
        let pattern = touch.pattern();
        if !trained.patterns.contains(pattern) {
            Err(Refused::Pattern(pattern))
        } else if touch.spread() > trained.largest_spread {
            Err(Refused::Spread)
        } else if trained.needs_pose && touch.pose().is_none() {
            Err(Refused::NoPose)
        } else {
            Ok(())
        }
    }
}
