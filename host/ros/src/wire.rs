//! Messages as they travel, field by field as in `host/msg`, `host/srv` and `host/action`.

use palpate::error::TouchesProblem;
use palpate::onboard::shared::{Pose, Q15_ONE, Touch as Felt};
use palpate::touches::{located, touch_of_seconds};
use ros2_client::Message;
use ros2_client::builtin_interfaces::Time;
use serde::{Deserialize, Serialize};
use std::fmt::{Display, Formatter};

/// The package of the definitions.
pub(crate) const PACKAGE: &str = "palpate_msgs";

/// `palpate_msgs/msg/Touch`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Touch {
    pub(crate) times: [f64; 3],
    pub(crate) has_pose: bool,
    pub(crate) direction: [f64; 3],
    pub(crate) alignment: [f64; 3],
    pub(crate) object: String,
    pub(crate) has_position: bool,
    pub(crate) position: [f64; 3],
}

impl Touch {
    /// The touch that it describes.
    ///
    /// # Errors
    /// The number at fault, and the reason.
    pub(crate) fn felt(&self) -> Result<Felt, TouchesProblem> {
        let pose = |vector| self.has_pose.then_some(vector);
        let times = self.times.map(|time| if time.is_nan() { None } else { Some(time) });
        let touch = touch_of_seconds(times, pose(self.direction), pose(self.alignment))?;
        match self.has_position {
            true => located(touch, self.position.map(|meters| 1e3 * meters)),
            false => Ok(touch),
        }
    }
}

impl From<&Felt> for Touch {
    fn from(touch: &Felt) -> Self {
        let times = touch.times().map(|time| time.micros().map_or(f64::NAN, |micros| f64::from(micros) / 1e6));
        let (direction, alignment) = touch.pose().as_ref().map(unit_vectors).unwrap_or_default();
        let position =
            touch.position().map(|position| position.micrometers.map(|micrometers| f64::from(micrometers) / 1e6));
        Self {
            times,
            has_pose: touch.pose().is_some(),
            direction,
            alignment,
            object: String::new(),
            has_position: position.is_some(),
            position: position.unwrap_or_default(),
        }
    }
}

/// Direction and alignment of a pose.
pub(crate) fn unit_vectors(pose: &Pose) -> ([f64; 3], [f64; 3]) {
    let unit = |vector: [i16; 3]| vector.map(|cosine| f64::from(cosine) / f64::from(Q15_ONE));
    (unit(pose.direction), unit(pose.alignment))
}

/// `palpate_msgs/msg/Verdict`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Verdict {
    pub(crate) touch: u32,
    pub(crate) verdict: String,
    pub(crate) object: String,
    pub(crate) posterior: f64,
    pub(crate) refused: String,
    pub(crate) objects: Vec<String>,
    pub(crate) posteriors: Vec<f64>,
}

impl Display for Verdict {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let Self { touch, verdict, object, posterior, refused, .. } = self;
        let count = format!("after {touch} touch{}", if *touch == 1 { "" } else { "es" });
        match (verdict.as_str(), object.as_str()) {
            ("recognized", _) => write!(f, "recognized {object} {count}, posterior {posterior:.4}")?,
            (_, "") => write!(f, "{verdict} {count}")?,
            _ => write!(f, "{verdict} {count}, most likely {object}, posterior {posterior:.4}")?,
        }
        if !refused.is_empty() {
            write!(f, "; not counted: {refused}")?;
        }
        Ok(())
    }
}

/// `palpate_msgs/msg/Evidence`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Evidence {
    pub(crate) touch: u32,
    pub(crate) objects: Vec<String>,
    pub(crate) nats: Vec<f64>,
}

/// `palpate_msgs/msg/Approach`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Approach {
    pub(crate) touch: u32,
    pub(crate) pose: u16,
    pub(crate) direction: [f64; 3],
    pub(crate) alignment: [f64; 3],
    pub(crate) score: f64,
}

/// Objects that may come, and how often: the request of `palpate_msgs/srv/Reset`, and the goal of
/// `palpate_msgs/action/Recognize`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Expected {
    pub(crate) objects: Vec<String>,
    pub(crate) weights: Vec<u32>,
}

/// The response of `palpate_msgs/srv/Reset`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ResetDone {
    pub(crate) success: bool,
    pub(crate) message: String,
}

/// Result and feedback of `palpate_msgs/action/Recognize`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Recognized {
    pub(crate) verdict: Verdict,
}

/// `std_msgs/msg/Bool`.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Bool {
    pub(crate) data: bool,
}

/// `std_msgs/msg/String`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Text {
    pub(crate) data: String,
}

/// `std_msgs/msg/Header`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Header {
    pub(crate) stamp: Time,
    pub(crate) frame_id: String,
}

/// `diagnostic_msgs/msg/DiagnosticArray`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct DiagnosticArray {
    pub(crate) header: Header,
    pub(crate) status: Vec<DiagnosticStatus>,
}

/// `diagnostic_msgs/msg/DiagnosticStatus`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct DiagnosticStatus {
    /// 0 OK, 1 warning, 2 error.
    pub(crate) level: u8,
    pub(crate) name: String,
    pub(crate) message: String,
    pub(crate) hardware_id: String,
    pub(crate) values: Vec<KeyValue>,
}

/// `diagnostic_msgs/msg/KeyValue`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct KeyValue {
    pub(crate) key: String,
    pub(crate) value: String,
}

impl Message for Expected {}
impl Message for ResetDone {}
impl Message for Recognized {}
