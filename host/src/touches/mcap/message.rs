//! The messages: JSON and CDR.

use super::Kind;
use crate::error::TouchesProblem;
use crate::touches::listing::is_file_name;
use crate::touches::logged::{Content, LoggedVerdict};
use crate::touches::{located, touch_of_seconds};
use byteorder::{BigEndian, LittleEndian};
use palpate_shared::{Q15_ONE, Touch};
use serde::{Deserialize, Serialize, Serializer};
use std::collections::BTreeMap;

/// Encoding of messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Json,
    Cdr,
    /// CDR of touches by the definition of earlier versions, which has no position.
    CdrBefore,
}

/// `palpate.Touch`.
#[derive(Deserialize, Serialize)]
pub(super) struct JsonTouch {
    times: [Option<f64>; 3],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pose: Option<JsonPose>,
    /// In meters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    position: Option<[f64; 3]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    object: Option<String>,
}

#[derive(Deserialize, Serialize)]
struct JsonPose {
    direction: [f64; 3],
    alignment: [f64; 3],
}

/// `palpate.Verdict`.
#[derive(Deserialize, Serialize)]
pub(super) struct JsonVerdict {
    touch: u32,
    verdict: String,
    object: String,
    posterior: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    refused: Option<String>,
    #[serde(default)]
    posteriors: Posteriors,
}

/// By the objects' names: in JSON an object, which is written in the order of the model.
#[derive(Default)]
struct Posteriors(Vec<(String, f64)>);

impl<'de> Deserialize<'de> for Posteriors {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        BTreeMap::deserialize(deserializer).map(|pairs| Self(pairs.into_iter().collect()))
    }
}

impl Serialize for Posteriors {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, posterior)| (name, posterior)))
    }
}

/// `Touch.msg`.
#[derive(Deserialize)]
struct CdrTouch {
    times: [f64; 3],
    has_pose: bool,
    direction: [f64; 3],
    alignment: [f64; 3],
    object: String,
}

/// What `Touch.msg` has behind these.
#[derive(Deserialize)]
struct CdrLocated {
    touch: CdrTouch,
    has_position: bool,
    position: [f64; 3],
}

/// `Verdict.msg`.
#[derive(Deserialize)]
struct CdrVerdict {
    touch: u32,
    verdict: String,
    object: String,
    posterior: f64,
    refused: String,
    objects: Vec<String>,
    posteriors: Vec<f64>,
}

impl Encoding {
    /// Decodes a message.
    pub(super) fn read(self, kind: Kind, data: &[u8]) -> Result<Content, TouchesProblem> {
        match (self, kind) {
            (Self::Json, Kind::Touch) => touch(json(data, "touch in JSON")?),
            (Self::Json, Kind::Verdict) => {
                let JsonVerdict { touch, verdict, object, posterior, refused, posteriors } =
                    json(data, "verdict in JSON")?;
                checked(LoggedVerdict { touch, verdict, object, posterior, refused, posteriors: posteriors.0 })
            }
            (Self::Cdr, Kind::Touch) => {
                let CdrLocated { touch, has_position, position } = cdr(data, "touch in CDR")?;
                felt(touch, has_position.then_some(position))
            }
            (Self::CdrBefore, Kind::Touch) => felt(cdr(data, "touch in CDR")?, None),
            (Self::Cdr | Self::CdrBefore, Kind::Verdict) => {
                let CdrVerdict { touch, verdict, object, posterior, refused, objects, posteriors } =
                    cdr(data, "verdict in CDR")?;
                if objects.len() != posteriors.len() {
                    let message = format!("{} objects and {} posteriors", objects.len(), posteriors.len());
                    return Err(TouchesProblem::BadMessage { what: "verdict in CDR", message });
                }
                let posteriors = objects.into_iter().zip(posteriors).collect();
                let refused = Some(refused).filter(|refused| !refused.is_empty());
                checked(LoggedVerdict { touch, verdict, object, posterior, refused, posteriors })
            }
        }
    }
}

fn json<'de, T: Deserialize<'de>>(data: &'de [u8], what: &'static str) -> Result<T, TouchesProblem> {
    serde_json::from_slice(data).map_err(|error| TouchesProblem::BadMessage { what, message: error.to_string() })
}

/// A message behind its header of four bytes, which says how numbers are ordered.
fn cdr<T: serde::de::DeserializeOwned>(data: &[u8], what: &'static str) -> Result<T, TouchesProblem> {
    let wrong = |message: String| TouchesProblem::BadMessage { what, message };
    let Some((&[first, kind, _, _], body)) = data.split_first_chunk() else {
        return Err(wrong(format!("{} bytes, where its header has 4", data.len())));
    };
    let read = match (first, kind) {
        (0, 0) => cdr_encoding::from_bytes::<T, BigEndian>(body),
        (0, 1) => cdr_encoding::from_bytes::<T, LittleEndian>(body),
        _ => return Err(wrong(format!("the header {first:02x} {kind:02x}, where plain CDR has 00 00 or 00 01"))),
    };
    let (message, taken) = read.map_err(|error| wrong(error.to_string()))?;
    // Up to three bytes fill the last word.
    match body.len().saturating_sub(taken) {
        0..=3 => Ok(message),
        more => Err(wrong(format!("{more} bytes more than the definition has"))),
    }
}

/// The longest time that a touch can hold, in seconds.
const LONGEST: f64 = 4294.0;

fn felt(touched: CdrTouch, position: Option<[f64; 3]>) -> Result<Content, TouchesProblem> {
    let CdrTouch { times, has_pose, direction, alignment, object } = touched;
    touch(JsonTouch {
        times: times.map(|time| (!time.is_nan()).then_some(time)),
        pose: has_pose.then_some(JsonPose { direction, alignment }),
        position,
        object: Some(object),
    })
}

fn touch(JsonTouch { times, pose, position, object }: JsonTouch) -> Result<Content, TouchesProblem> {
    let object = object.filter(|object| !object.is_empty());
    if let Some(name) = object.as_ref().filter(|name| !is_file_name(name)) {
        return Err(TouchesProblem::BadName { name: name.clone() });
    }
    // Clocks that count from 1970 are welcome: whole seconds are taken off, which leaves the rest as it is.
    let first = times.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    let start = if first > LONGEST && first.is_finite() { first.floor() } else { 0.0 };
    let times = times.map(|time| time.map(|time| time - start));
    let (direction, alignment) = pose.map(|JsonPose { direction, alignment }| (direction, alignment)).unzip();
    let touch = touch_of_seconds(times, direction, alignment)?;
    let touch = match position {
        Some(meters) => located(touch, meters.map(|meters| 1e3 * meters))?,
        None => touch,
    };
    Ok(Content::Touch(touch, object))
}

fn checked(verdict: LoggedVerdict) -> Result<Content, TouchesProblem> {
    let wrong = |message: String| Err(TouchesProblem::BadMessage { what: "verdict", message });
    if !LoggedVerdict::VERDICTS.contains(&verdict.verdict.as_str()) {
        return wrong(format!("{:?}, where {} are known", verdict.verdict, LoggedVerdict::VERDICTS.join(", ")));
    }
    let posteriors = verdict.posteriors.iter().map(|(_, posterior)| posterior);
    if let Some(posterior) = posteriors.chain([&verdict.posterior]).find(|posterior| !(0.0..=1.0).contains(*posterior))
    {
        return wrong(format!("a posterior of {posterior}"));
    }
    Ok(Content::Verdict(verdict))
}

/// Essence of a definition in ROS 2: its lines without comments and needless spaces, up to those of other messages.
pub(super) fn essence(definition: &[u8]) -> String {
    let text = String::from_utf8_lossy(definition);
    let lines = text.lines().take_while(|line| !line.starts_with("===="));
    let words = lines.map(|line| line.split('#').next().unwrap_or_default().split_whitespace());
    let lines = words.map(|words| words.collect::<Vec<_>>().join(" ")).filter(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join("; ")
}

/// A touch as JSON.
pub(super) fn touch_json(touch: &Touch, object: Option<&str>) -> Result<Vec<u8>, serde_json::Error> {
    let unit = |vector: [i16; 3]| vector.map(|cosine| f64::from(cosine) / f64::from(Q15_ONE));
    serde_json::to_vec(&JsonTouch {
        times: touch.times().map(|time| time.micros().map(|micros| f64::from(micros) / 1e6)),
        pose: touch.pose().map(|pose| JsonPose { direction: unit(pose.direction), alignment: unit(pose.alignment) }),
        position: touch.position().map(|position| position.micrometers.map(|micrometers| f64::from(micrometers) / 1e6)),
        object: object.map(String::from),
    })
}

/// A verdict as JSON.
pub(super) fn verdict_json(verdict: &LoggedVerdict) -> Result<Vec<u8>, serde_json::Error> {
    let LoggedVerdict { touch, verdict, object, posterior, refused, posteriors } = verdict.clone();
    serde_json::to_vec(&JsonVerdict { touch, verdict, object, posterior, refused, posteriors: Posteriors(posteriors) })
}
