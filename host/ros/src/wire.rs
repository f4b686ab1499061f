//! Messages as they travel, field by field as in `host/msg`, `host/srv` and `host/action`.

use palpate::error::Result;
use palpate::onboard::shared::{Pose as FeltPose, Q15_ONE, Touch as Felt};
use palpate::touches::{located, touch_of_seconds};
use ros2_client::Message;
use ros2_client::builtin_interfaces::Time;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
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
    pub(crate) fn felt(&self) -> Result<Felt> {
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
pub(crate) fn unit_vectors(pose: &FeltPose) -> ([f64; 3], [f64; 3]) {
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

/// `geometry_msgs/msg/Pose`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pose {
    /// x, y and z in meters.
    pub(crate) position: [f64; 3],
    /// x, y, z and w.
    pub(crate) orientation: [f64; 4],
}

impl Pose {
    /// A pose on the table: a place in micrometers, and an angle about z in whole turns.
    pub(crate) fn flat(micrometers: [i32; 2], turn: f64) -> Self {
        let [x, y] = micrometers.map(|micrometers| f64::from(micrometers) / 1e6);
        let (sin, cos) = (PI * turn).sin_cos();
        Self { position: [x, y, 0.0], orientation: [0.0, 0.0, sin, cos] }
    }
}

/// `geometry_msgs/msg/PoseWithCovariance`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PoseWithCovariance {
    pub(crate) pose: Pose,
    /// Row by row, of x, y, z and the angles about them; in meters and radians.
    pub(crate) covariance: [[f64; 6]; 6],
}

/// `geometry_msgs/msg/PoseStamped`, and `geometry_msgs/msg/PoseWithCovarianceStamped`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Stamped<P> {
    pub(crate) header: Header,
    pub(crate) pose: P,
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

#[cfg(test)]
mod tests {
    use super::*;
    use ros2_client::dds::rustdds::serialization::{RepresentationIdentifier, to_writer_with_rep_id};

    /// The bytes behind the four of the header, little endian.
    fn cdr(message: &impl Serialize) -> Vec<u8> {
        let mut bytes = Vec::new();
        to_writer_with_rep_id(&mut bytes, message, RepresentationIdentifier::CDR_LE).unwrap();
        bytes
    }

    fn header() -> Header {
        Header { stamp: Time::new(7, 9), frame_id: "table".into() }
    }

    const POSE: Pose = Pose { position: [2.0, -0.5, 0.0], orientation: [0.0, 0.0, 1.0, 0.0] };

    /// Definition of `POSE`, with `header()`.
    #[rustfmt::skip]
    const BYTES: [u8; 80] = [
        7, 0, 0, 0, 9, 0, 0, 0,
        // The name with its end; numbers of 8 bytes begin at a multiple of 8.
        6, 0, 0, 0, b't', b'a', b'b', b'l', b'e', 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0x40, 0, 0, 0, 0, 0, 0, 0xe0, 0xbf, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f, 0, 0, 0, 0, 0, 0, 0, 0,
    ];

    #[test]
    fn a_pose_is_the_bytes_of_geometry_msgs() {
        assert_eq!(cdr(&Stamped { header: header(), pose: POSE }), BYTES);
        let covariance = [0, 1, 2, 3, 4, 5].map(|row| [0, 1, 2, 3, 4, 5].map(|column| f64::from(6 * row + column)));
        let pose = PoseWithCovariance { pose: POSE, covariance };
        let numbers = (0..36).flat_map(|number| f64::from(number).to_le_bytes());
        assert_eq!(cdr(&Stamped { header: header(), pose }), BYTES.into_iter().chain(numbers).collect::<Vec<u8>>());
    }

    #[test]
    fn a_pose_on_the_table_is_in_meters_and_turned_about_z() {
        let Pose { position, orientation: [x, y, z, w] } = Pose::flat([12_300, -4_100], 0.25);
        assert_eq!((position, x, y), ([0.0123, -0.0041, 0.0], 0.0, 0.0));
        assert!((z - 0.5_f64.sqrt()).abs() < 1e-15 && (w - 0.5_f64.sqrt()).abs() < 1e-15);
    }
}
