//! The node's interface: topics with their quality of service, a service, an action and parameters.

use crate::served::Served;
use crate::thresholds::Thresholds;
use crate::wire::{
    Approach, Bool, DiagnosticArray, Evidence, Expected, PACKAGE, Pose, PoseWithCovariance, Recognized, ResetDone,
    Stamped, Text, Touch, Verdict,
};
use async_channel::Sender;
use palpate::chip::Port;
use palpate::onboard::effector::Finger;
use ros2_client::action::{ActionServerQosPolicies, AsyncActionServer};
use ros2_client::qos::{Durability, History};
use ros2_client::{
    ActionTypeName, MessageTypeName, Name, Node, NodeOptions, ParameterValue, Publisher, QosProfile, Server,
    ServiceMapping, ServiceTypeName, Subscription,
};
use serde::Serialize;
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// Touches and edges that wait while others are taken in.
const QUEUE: usize = 1_000;

/// Options of the program.
pub(crate) struct Options {
    pub(crate) name: String,
    pub(crate) namespace: String,
    pub(crate) domain: u16,
    /// Also hear publishers that do not repeat lost messages.
    pub(crate) best_effort: bool,
    pub(crate) services: ServiceMapping,
    /// The model's path; empty without one.
    pub(crate) path: PathBuf,
    pub(crate) model: Option<Served>,
    pub(crate) thresholds: Thresholds,
    /// The frame of poses.
    pub(crate) frame_id: String,
    /// The chip that recognizes; without one this program does.
    pub(crate) chip: Option<(Port, u32)>,
}

/// A parameter that was changed.
pub(crate) enum Change {
    Model(Served),
    ErrorRate(f64),
    MaxTouches(i64),
    FrameId(String),
}

pub(crate) type Actions = AsyncActionServer<Expected, Recognized, Recognized>;

/// Messages to the node.
pub(crate) struct Inputs {
    pub(crate) touches: Subscription<Touch>,
    pub(crate) switches: [(Finger, Subscription<Bool>); 3],
    pub(crate) reset: Server<Expected, ResetDone>,
    pub(crate) actions: Actions,
}

/// Messages of the node.
pub(crate) struct Outputs {
    pub(crate) verdicts: Publisher<Verdict>,
    /// Publisher of the verdict as one line of text, for nodes that do not know the package of the messages.
    pub(crate) texts: Publisher<Text>,
    pub(crate) evidence: Publisher<Evidence>,
    pub(crate) approaches: Publisher<Approach>,
    /// Place and placement of the object, and the next approach, by a model of maps.
    pub(crate) poses: Publisher<Stamped<PoseWithCovariance>>,
    pub(crate) placements: Publisher<Text>,
    pub(crate) next_poses: Publisher<Stamped<Pose>>,
    /// Touches of switches, and of a chip's own fingers.
    pub(crate) measured: Publisher<Touch>,
    pub(crate) diagnostics: Publisher<DiagnosticArray>,
}

/// The node's parameters; those that can be set are sent to `changed`.
pub(crate) fn parameters(options: &Options, changed: Sender<Change>) -> NodeOptions {
    let has_chip = options.chip.is_some();
    let path = options.path.display().to_string();
    let model = options.model.clone();
    let change = move |name: &str, value: &ParameterValue| change(name, value, has_chip, model.as_ref());
    let validate = change.clone();
    NodeOptions::new()
        .declare_parameter("model", ParameterValue::String(path))
        .declare_parameter("error_rate", ParameterValue::Double(options.thresholds.error_rate))
        .declare_parameter("max_touches", ParameterValue::Integer(options.thresholds.max_touches))
        .declare_parameter("frame_id", ParameterValue::String(options.frame_id.clone()))
        .parameter_validator(Box::new(move |name, value| validate(name, value).map(|_| ())))
        .parameter_set_action(Box::new(move |name, value| {
            let change = change(name, value)?;
            // The node has ended where nobody takes it.
            change.map_or(Ok(()), |change| changed.send_blocking(change).map_err(text))
        }))
}

/// The change that a parameter makes; none if it is the empty path of no model.
///
/// # Errors
/// Why the value cannot be used.
fn change(
    name: &str,
    value: &ParameterValue,
    has_chip: bool,
    model: Option<&Served>,
) -> Result<Option<Change>, String> {
    let thresholds = |thresholds: Thresholds| match model {
        _ if has_chip && thresholds != Thresholds::default() => {
            Err("the chip stops as its model says: calibrate the model and load it".into())
        }
        Some(model) => model.stopping(thresholds).map(|_| ()),
        None => Ok(()),
    };
    match (name, value) {
        ("model", ParameterValue::String(path)) if path.is_empty() && has_chip => Ok(None),
        ("model", ParameterValue::String(path)) => {
            let model = Served::read(Path::new(path))?;
            if has_chip {
                model.clone().for_chip()?;
            }
            Ok(Some(Change::Model(model)))
        }
        ("error_rate", &ParameterValue::Double(error_rate)) => {
            thresholds(Thresholds { error_rate, ..Thresholds::default() })?;
            Ok(Some(Change::ErrorRate(error_rate)))
        }
        ("max_touches", &ParameterValue::Integer(max_touches)) => {
            thresholds(Thresholds { max_touches, ..Thresholds::default() })?;
            Ok(Some(Change::MaxTouches(max_touches)))
        }
        ("frame_id", ParameterValue::String(frame)) if frame.is_empty() => {
            Err("frame_id is the name of a frame, such as table".into())
        }
        ("frame_id", ParameterValue::String(frame)) => Ok(Some(Change::FrameId(frame.clone()))),
        _ => Err(format!("{name} is not a parameter of this type")),
    }
}

/// Opens everything under the node's own name: `/palpate/touch` and so on.
pub(crate) fn open(node: &mut Node, options: &Options) -> Result<(Inputs, Outputs), String> {
    let base = format!("{}/{}", options.namespace.trim_end_matches('/'), options.name);
    let name = |name: &str| Name::parse(&format!("{base}/{name}")).map_err(text);
    let reliable = QosProfile::publisher_default().history(History::KeepLast { depth: 10 });
    let latched = reliable.clone().durability(Durability::TransientLocal).history(History::KeepLast { depth: 1 });
    let queued = match options.best_effort {
        true => QosProfile::subscription_default(),
        false => reliable.clone(),
    };
    let queued = queued.history(History::KeepLast { depth: QUEUE });

    let of = |kind| MessageTypeName::new(PACKAGE, kind);
    let touches = subscribe(node, &name("touch")?, of("Touch"), &queued)?;
    let mut switch = |finger, topic| -> Result<_, String> {
        Ok((finger, subscribe(node, &name(topic)?, MessageTypeName::new("std_msgs", "Bool"), &queued)?))
    };
    let [first, middle, last] = Finger::ALL;
    let switches = [switch(first, "switch/first")?, switch(middle, "switch/middle")?, switch(last, "switch/last")?];
    let reset = node
        .create_server(
            options.services,
            &name("reset")?,
            &ServiceTypeName::new(PACKAGE, "Reset"),
            reliable.clone(),
            reliable.clone(),
        )
        .map_err(text)?;
    let qos = ActionServerQosPolicies {
        goal_service: reliable.clone(),
        result_service: reliable.clone(),
        cancel_service: reliable.clone(),
        feedback_publisher: reliable.clone(),
        status_publisher: latched.clone(),
    };
    let actions = node
        .create_action_server(options.services, &name("recognize")?, &ActionTypeName::new(PACKAGE, "Recognize"), qos)
        .map_err(text)?;
    let inputs = Inputs { touches, switches, reset, actions: AsyncActionServer::new(actions) };

    let diagnostics = Name::new("/", "diagnostics").map_err(text)?;
    let array = MessageTypeName::new("diagnostic_msgs", "DiagnosticArray");
    let line = || MessageTypeName::new("std_msgs", "String");
    let of_geometry = |kind| MessageTypeName::new("geometry_msgs", kind);
    let outputs = Outputs {
        verdicts: publish_on(node, &name("verdict")?, of("Verdict"), &latched)?,
        texts: publish_on(node, &name("verdict_text")?, line(), &latched)?,
        evidence: publish_on(node, &name("evidence")?, of("Evidence"), &latched)?,
        approaches: publish_on(node, &name("next_approach")?, of("Approach"), &latched)?,
        poses: publish_on(node, &name("pose")?, of_geometry("PoseWithCovarianceStamped"), &latched)?,
        placements: publish_on(node, &name("placement")?, line(), &latched)?,
        next_poses: publish_on(node, &name("next_pose")?, of_geometry("PoseStamped"), &latched)?,
        measured: publish_on(node, &name("measured_touch")?, of("Touch"), &reliable)?,
        diagnostics: publish_on(node, &diagnostics, array, &reliable)?,
    };
    Ok((inputs, outputs))
}

fn subscribe<M: 'static>(
    node: &mut Node,
    name: &Name,
    of: MessageTypeName,
    qos: &QosProfile,
) -> Result<Subscription<M>, String> {
    let topic = node.create_topic(name, of, qos).map_err(text)?;
    node.create_subscription(&topic, Some(qos.clone())).map_err(text)
}

fn publish_on<M: Serialize>(
    node: &mut Node,
    name: &Name,
    of: MessageTypeName,
    qos: &QosProfile,
) -> Result<Publisher<M>, String> {
    let topic = node.create_topic(name, of, qos).map_err(text)?;
    node.create_publisher(&topic, Some(qos.clone())).map_err(text)
}

/// An error as the caller's own.
pub(crate) fn text(error: impl Display) -> String {
    error.to_string()
}
