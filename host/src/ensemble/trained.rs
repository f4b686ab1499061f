//! The touches that an ensemble was trained on.

use palpate_shared::format::{Counted, PatternShares, TrainedTouches};
use palpate_shared::{ContactPattern, Patterns};
use serde::{Deserialize, Serialize};

/// The touches that an ensemble was trained on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stated", into = "Stated")]
pub struct Trained {
    /// Patterns, the largest spread, and whether a pose is needed: what is evidence to every model made of the ensemble.
    pub touches: TrainedTouches,
    /// The share of each contact pattern among all approaches, in the order of the patterns' codes, each object weighted
    /// equally; `None` if the data set holds no approaches.
    pub shares: Option<[f64; 6]>,
}

impl Trained {
    /// Statement of the chip's model about [`Trained::shares`].
    pub(crate) fn pattern_shares(&self) -> Option<PatternShares> {
        // `as` saturates.
        self.shares.map(|shares| PatternShares(shares.map(|share| (share * 65_535.0).round() as u16)))
    }
}

/// [`Trained`] in files.
#[derive(Serialize, Deserialize)]
struct Stated {
    counted: String,
    patterns: Vec<String>,
    needs_pose: bool,
    largest_spread: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    shares: Option<[f64; 6]>,
}

impl From<Trained> for Stated {
    fn from(Trained { touches, shares }: Trained) -> Self {
        Self {
            counted: touches.counted.name().into(),
            patterns: touches.patterns.iter().map(|pattern| pattern.name().into()).collect(),
            needs_pose: touches.needs_pose,
            largest_spread: touches.largest_spread,
            shares,
        }
    }
}

impl TryFrom<Stated> for Trained {
    type Error = String;

    fn try_from(stated: Stated) -> Result<Self, String> {
        let counted = Counted::ALL.iter().copied().find(|counted| counted.name() == stated.counted);
        let counted = counted.ok_or_else(|| format!("{:?} is not full, contacts or all", stated.counted))?;
        let pattern = |name: &String| {
            let pattern = ContactPattern::ALL.into_iter().find(|pattern| pattern.name() == name);
            pattern.filter(|pattern| counted.patterns().contains(*pattern)).ok_or_else(|| format!("pattern {name:?}"))
        };
        let patterns = stated.patterns.iter().map(pattern).collect::<Result<Patterns, _>>()?;
        if patterns.is_empty() {
            return Err("no pattern".into());
        }
        if let Some(share) = stated.shares.into_iter().flatten().find(|share| !(0.0..=1.0).contains(share)) {
            return Err(format!("the share {share}"));
        }
        let Stated { needs_pose, largest_spread, shares, .. } = stated;
        Ok(Self { touches: TrainedTouches { patterns, counted, needs_pose, largest_spread }, shares })
    }
}
