//! What can be wrong with calibrating.

/// What can be wrong with calibrating.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateProblem {
    /// Even without any error the sequences would not be enough to promise the rate.
    #[error("{found} names given{} are too few to promise {} %: at least {needed} are needed", of_object(object), percent(*rate))]
    TooFew {
        /// The object whose names are too few, if the promise is for each.
        object: Option<String>,
        /// The promised rate.
        rate: f64,
        /// Names given.
        found: u64,
        /// Names needed, if none is wrong.
        needed: u64,
    },
    /// No threshold keeps the promise.
    #[error("no threshold keeps {} %: at the strictest {wrong} of {given} names{} are wrong", percent(*rate), of_object(object))]
    NotKept {
        /// The object that is named, or touched, if the promise is for each.
        object: Option<String>,
        /// The promised rate.
        rate: f64,
        /// Wrong names.
        wrong: u64,
        /// Names given.
        given: u64,
    },
    /// The data set lacks objects of the model.
    #[error("the data set has no touches of {}", objects.join(", "))]
    Missing {
        /// Objects that the model knows and the data set does not have.
        objects: Vec<String>,
    },
    /// There are no objects to choose between.
    #[error("the model knows one object only, which it cannot take for another")]
    OneObject,
}

impl CalibrateProblem {
    /// What to do about it, as a sentence.
    pub fn fix(&self) -> String {
        match self {
            Self::TooFew { .. } => "Capture more touches, allow more sequences, or promise a higher error rate.",
            Self::NotKept { .. } => {
                "Train the model for the noise of these touches, or promise a higher error rate; more touches of the \
                 calibration may also help."
            }
            Self::Missing { .. } => "Capture them too, with another seed than the training's.",
            Self::OneObject => "Give a model of two or more objects.",
        }
        .into()
    }
}

fn percent(rate: f64) -> f64 {
    (rate * 1e9).round() / 1e7
}

fn of_object(object: &Option<String>) -> String {
    object.as_ref().map_or_else(String::new, |object| format!(" for {object}"))
}
