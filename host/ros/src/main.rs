//! A ROS 2 node that recognizes objects by touch, without a ROS installation.

mod chip;
mod clients;
mod decide;
mod follow;
mod node;
mod open;
mod participant;
mod place;
mod served;
mod switches;
mod thresholds;
mod wire;

use async_signal::{Signal, Signals};
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, ValueEnum};
use open::Options;
use palpate::chip::Port;
use ros2_client::{NodeName, ServiceMapping};
use served::Served;
use std::path::PathBuf;
use std::process::ExitCode;
use thresholds::Thresholds;

/// A ROS 2 node that recognizes objects by touch; needs no ROS installation
#[derive(Parser)]
#[command(
    version,
    after_help = "\
Topics under the node's name: touch, switch/first, switch/middle and switch/last in; verdict, verdict_text, evidence, next_approach, measured_touch, and from a model of maps pose, placement and next_pose out. Service: reset. Action: recognize. Parameters: model, error_rate, max_touches, frame_id. docs/guide/ros.md describes them.

Examples:
  palpate-ros model.palpate
  palpate-ros maps.palpate --frame-id table
  palpate-ros --port /dev/ttyACM0
  palpate-ros model.palpate --namespace /left --error-rate 0.001"
)]
struct Arguments {
    /// The model that recognizes; with --port it is loaded into the chip
    #[arg(required_unless_present = "port")]
    model: Option<PathBuf>,
    /// A chip that recognizes: a serial port, or tcp://HOST:PORT
    #[arg(long)]
    port: Option<Port>,
    /// Speed of a serial port, in bits per second
    #[arg(long, default_value = "115200")]
    baud: u32,
    /// The posterior at which to stop is 1 less this; 0: the model's own thresholds
    #[arg(long, value_name = "RATE", default_value = "0", conflicts_with = "port")]
    error_rate: f64,
    /// Touches after which to give up; 0: the model's own limit
    #[arg(long, value_name = "N", default_value = "0", conflicts_with = "port")]
    max_touches: i64,
    /// The frame of poses: that of the positions of touches, for a model of maps
    #[arg(long, value_name = "FRAME", default_value = "table", value_parser = clap::builder::NonEmptyStringValueParser::new())]
    frame_id: String,
    /// The node's name
    #[arg(long, default_value = "palpate")]
    name: String,
    /// The node's namespace
    #[arg(long, default_value = "/")]
    namespace: String,
    /// The DDS domain
    #[arg(long, env = "ROS_DOMAIN_ID", default_value = "0", value_parser = clap::value_parser!(u16).range(..=232))]
    domain: u16,
    /// Also take touches from publishers that are not reliable; lost ones are not sent again then
    #[arg(long)]
    best_effort: bool,
    /// Middleware of the nodes that call the service and the action
    #[arg(long, value_enum, default_value = "fastdds")]
    middleware: Middleware,
}

/// Middleware, each with its own way to say which request a response belongs to.
#[derive(Clone, Copy, ValueEnum)]
enum Middleware {
    /// rmw_fastrtps_cpp, the default of ROS 2
    Fastdds,
    /// rmw_cyclonedds_cpp
    Cyclonedds,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("palpate-ros: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: Arguments) -> Result<(), String> {
    let model = arguments.model.as_deref().map(Served::read).transpose()?;
    let thresholds = Thresholds { error_rate: arguments.error_rate, max_touches: arguments.max_touches };
    let wrong = match &model {
        Some(model) => model.stopping(thresholds).err(),
        None => None,
    };
    let wrong = wrong.or_else(|| NodeName::new(&arguments.namespace, &arguments.name).err().map(|e| e.to_string()));
    if let Some(wrong) = wrong {
        Arguments::command().error(ErrorKind::ValueValidation, wrong).exit();
    }
    let signals = Signals::new([Signal::Int, Signal::Term, Signal::Cont]).map_err(|error| error.to_string())?;
    let options = Options {
        name: arguments.name,
        namespace: arguments.namespace,
        domain: arguments.domain,
        best_effort: arguments.best_effort,
        services: match arguments.middleware {
            Middleware::Fastdds => ServiceMapping::Enhanced,
            Middleware::Cyclonedds => ServiceMapping::Cyclone,
        },
        path: arguments.model.unwrap_or_default(),
        model,
        thresholds,
        frame_id: arguments.frame_id,
        chip: arguments.port.map(|port| (port, arguments.baud)),
    };
    node::run(options, signals)
}
