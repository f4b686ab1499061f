//! A touch's message: JSON and CDR.

use crate::error::{Result, problem};
use crate::touches::files::check_name;
use crate::touches::seconds::{located, touch_of_seconds};
use byteorder::{BigEndian, LittleEndian};
use palpate_shared::Touch;
use serde::Deserialize;

/// Encoding of messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Json,
    Cdr,
    /// CDR of touches by the definition of earlier versions, which has no position.
    CdrBefore,
}

/// `palpate.Touch`.
#[derive(Deserialize)]
struct JsonTouch {
    times: [Option<f64>; 3],
    pose: Option<JsonPose>,
    /// In meters.
    position: Option<[f64; 3]>,
    object: Option<String>,
}

#[derive(Deserialize)]
struct JsonPose {
    direction: [f64; 3],
    alignment: [f64; 3],
}

/// `Touch.msg` up to the object, where it ended before touches had positions.
#[derive(Deserialize)]
struct CdrTouch {
    times: [f64; 3],
    has_pose: bool,
    direction: [f64; 3],
    alignment: [f64; 3],
    object: String,
}

/// All of `Touch.msg`.
#[derive(Deserialize)]
struct CdrLocated {
    touch: CdrTouch,
    has_position: bool,
    position: [f64; 3],
}

impl Encoding {
    /// Decodes a message: a touch, and its object if that is known.
    pub(super) fn read(self, data: &[u8]) -> Result<(Touch, Option<String>)> {
        match self {
            Self::Json => {
                let wrong = |error| problem!("no touch in JSON: {error}");
                touch(serde_json::from_slice(data).map_err(wrong)?)
            }
            Self::Cdr => {
                let CdrLocated { touch, has_position, position } = cdr(data)?;
                felt(touch, has_position.then_some(position))
            }
            Self::CdrBefore => felt(cdr(data)?, None),
        }
    }
}

/// A message behind its header of four bytes, which says how numbers are ordered.
fn cdr<T: serde::de::DeserializeOwned>(data: &[u8]) -> Result<T> {
    let wrong = |why: String| problem!("no touch in CDR: {why}");
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

fn felt(touched: CdrTouch, position: Option<[f64; 3]>) -> Result<(Touch, Option<String>)> {
    let CdrTouch { times, has_pose, direction, alignment, object } = touched;
    touch(JsonTouch {
        times: times.map(|time| (!time.is_nan()).then_some(time)),
        pose: has_pose.then_some(JsonPose { direction, alignment }),
        position,
        object: Some(object),
    })
}

fn touch(message: JsonTouch) -> Result<(Touch, Option<String>)> {
    let JsonTouch { times, pose, position, object } = message;
    let object = object.filter(|object| !object.is_empty());
    object.as_deref().map_or(Ok(()), check_name)?;
    let (direction, alignment) = pose.map(|JsonPose { direction, alignment }| (direction, alignment)).unzip();
    let touch = touch_of_seconds(times, direction, alignment)?;
    let touch = match position {
        Some(meters) => located(touch, meters.map(|meters| 1e3 * meters))?,
        None => touch,
    };
    Ok((touch, object))
}

/// Essence of a definition in ROS 2: its lines without comments and needless spaces, up to those of other messages.
pub(super) fn essence(definition: &[u8]) -> String {
    let text = String::from_utf8_lossy(definition);
    let lines = text.lines().take_while(|line| !line.starts_with("===="));
    let words = lines.map(|line| line.split('#').next().unwrap_or_default().split_whitespace());
    let lines = words.map(|words| words.collect::<Vec<_>>().join(" ")).filter(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join("; ")
}
