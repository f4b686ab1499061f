//! Touches and verdicts, to a file that Foxglove shows.

use super::Kind;
use super::message::{touch_json, verdict_json};
use crate::error::{Error, Result};
use crate::touches::logged::LoggedVerdict;
use ::mcap::records::MessageHeader;
use ::mcap::{McapError, WriteOptions};
use palpate_shared::Touch;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{Seek, Write};

/// A second, in the nanoseconds of log times.
const SECOND: u64 = 1_000_000_000;
/// Time from a touch to its verdict in the log.
const AFTER: u64 = 1_000;

/// Writes a log: touches on `/touch` and verdicts on `/verdict`, as JSON.
pub struct Writer<W: Write + Seek> {
    writer: ::mcap::Writer<W>,
    touches: u16,
    verdicts: u16,
    /// The log times of the last message, and of the last touch.
    last: u64,
    touched: u64,
    sequence: u32,
}

impl<W: Write + Seek> Writer<W> {
    /// Begins a log with verdicts about these objects.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn new(out: W, objects: &[String]) -> Result<Self> {
        let library = concat!("palpate ", env!("CARGO_PKG_VERSION"));
        let options = WriteOptions::new().compression(None).library(library);
        let mut writer = options.create(out).map_err(wrong)?;
        let mut channel = |kind: Kind, topic: &str, schema: &Value| -> Result<u16> {
            let [name, _] = kind.names();
            let schema = serde_json::to_vec(schema).map_err(|error| wrong(std::io::Error::from(error).into()))?;
            let schema = writer.add_schema(name, "jsonschema", &schema).map_err(wrong)?;
            writer.add_channel(schema, topic, "json", &BTreeMap::new()).map_err(wrong)
        };
        let touches = channel(Kind::Touch, "/touch", &touch_schema())?;
        let verdicts = channel(Kind::Verdict, "/verdict", &verdict_schema(objects))?;
        Ok(Self { writer, touches, verdicts, last: 0, touched: 0, sequence: 0 })
    }

    /// Adds a touch; without a time, a second after the one before.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn touch(&mut self, touch: &Touch, object: Option<&str>, time: Option<u64>) -> Result<()> {
        let time = time.unwrap_or(self.touched.saturating_add(SECOND));
        self.sequence = self.sequence.wrapping_add(1);
        self.touched = self.write(self.touches, time, touch_json(touch, object))?;
        Ok(())
    }

    /// Adds a verdict about the touches so far.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn verdict(&mut self, verdict: &LoggedVerdict) -> Result<()> {
        self.write(self.verdicts, self.touched.saturating_add(AFTER), verdict_json(verdict)).map(drop)
    }

    /// Ends the log.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(mut self) -> Result<W> {
        self.writer.finish().map_err(wrong)?;
        Ok(self.writer.into_inner())
    }

    /// Writes a message after the last one, and says when.
    fn write(&mut self, channel_id: u16, time: u64, data: Result<Vec<u8>, serde_json::Error>) -> Result<u64> {
        let data = data.map_err(|error| wrong(std::io::Error::from(error).into()))?;
        let time = time.max(self.last.saturating_add(1));
        let header = MessageHeader { channel_id, sequence: self.sequence, log_time: time, publish_time: time };
        self.writer.write_to_known_channel(&header, &data).map_err(wrong)?;
        self.last = time;
        Ok(time)
    }
}

fn wrong(error: McapError) -> Error {
    let error = match error {
        McapError::Io(error) => error,
        other => std::io::Error::other(other),
    };
    Error::io("the log", "write", error)
}

/// Schemas have one type at each place: Foxglove knows no choices between types.
fn touch_schema() -> Value {
    let vector = |says: &str| json!({"type": "array", "items": {"type": "number"}, "description": says});
    json!({
        "title": "palpate.Touch",
        "description": "One approach of the probe",
        "type": "object",
        "properties": {
            "times": vector("Contact times of the three fingers in seconds; null for one that did not touch"),
            "pose": {
                "type": "object",
                "description": "The probe's pose in the object's frame; left out if it is not known",
                "properties": {
                    "direction": vector("Unit vector of the motion"),
                    "alignment": vector("Unit vector along the row of fingers"),
                },
            },
            "position": vector(
                "Lowest point of the middle fingertip at the first contact, in the table's frame, in meters; left out if it is not \
                 known"
            ),
            "object": {"type": "string", "description": "The object that is touched; left out if it is not known"},
        },
    })
}

fn verdict_schema(objects: &[String]) -> Value {
    let posteriors: serde_json::Map<_, _> =
        objects.iter().map(|object| (object.clone(), json!({"type": "number"}))).collect();
    let text = |says: &str| json!({"type": "string", "description": says});
    json!({
        "title": "palpate.Verdict",
        "description": "What the touches so far say",
        "type": "object",
        "properties": {
            "touch": {"type": "integer", "description": "How many touches it rests on"},
            "verdict": text("undecided, recognized, unknown or gave-up"),
            "object": text("The likeliest object"),
            "posterior": {"type": "number", "description": "Its posterior"},
            "refused": text("Why the touch was not counted; left out if it was"),
            "posteriors": {
                "type": "object",
                "description": "The posterior of every object",
                "properties": posteriors,
            },
        },
    })
}
