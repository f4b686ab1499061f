//! Verdicts and refusals as messages of the link.

use crate::{Refused, Verdict};
use palpate_shared::link::{Decision, Refusal};

/// Converts to the link's message.
pub(super) const fn decision(verdict: Verdict) -> Decision {
    match verdict {
        Verdict::Undecided => Decision::Undecided,
        Verdict::Recognized { object, .. } => Decision::Recognized(object),
        Verdict::Unknown => Decision::Unknown,
        Verdict::GaveUp => Decision::GaveUp,
    }
}

/// Converts to the link's message.
pub(super) const fn refusal(refused: Refused) -> Refusal {
    match refused {
        Refused::Pattern(_) => Refusal::Pattern,
        Refused::Spread => Refusal::Spread,
        Refused::NoPose => Refusal::NoPose,
        Refused::NeedsFeatures | Refused::NeedsTouches | Refused::NeedsSeen | Refused::Guarded(..) => Refusal::Features,
    }
}
