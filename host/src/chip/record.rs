//! Recording of the reports of a chip's own fingers into a data set.

use super::{ChipModel, Connection, Transport};
use crate::error::{Error, Kind, Result};
use crate::touches::Recording;
use palpate_shared::Touch;
use palpate_shared::link::{Event, FaultKind, Refusal, VerdictMessage};
use serde::Serialize;
use std::ops::ControlFlow;
use std::time::Duration;

/// Time before the line is tried again.
const RETRY: Duration = Duration::from_millis(500);

/// Something new while touches are recorded.
#[derive(Debug)]
pub enum RecordEvent<'a> {
    /// The chip answers, for the first time or after the line broke.
    Connected {
        /// Its program, if it says so.
        program: Option<&'a str>,
        /// Its model, if it has one.
        model: Option<&'a ChipModel>,
        /// Another program made the newest touches of the data set: this one.
        other: Option<&'a str>,
    },
    /// The line broke; it is tried again and again.
    Lost(&'a Error),
    /// A touch was recorded, or an approach that ended without a contact.
    Touch {
        /// The touch.
        touch: Touch,
        /// Number of touches of the object there are now.
        number: u64,
        /// The chip's verdict; a touch that it does not count is recorded all the same.
        verdict: Result<VerdictMessage, Refusal>,
    },
    /// A touch was not recorded, because it lacks the pose.
    NoPose(Touch),
    /// A finger is faulty.
    Fault {
        /// Kind of the fault.
        kind: FaultKind,
        /// 0, 1 or 2 along the row; 255 if it is not the fault of one finger.
        finger: u8,
    },
    /// The chip reported this number of things lost on the way.
    Missed(u32),
    /// Nothing has happened for a while.
    Idle,
}

/// Results of a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RecordSummary {
    /// The object.
    pub object: String,
    /// Touches that were recorded.
    pub touches: u64,
    /// Touches of the object that the data set holds now.
    pub all_touches: u64,
    /// Number of the recorded touches with no, one, two and three contacts.
    pub contacts: [u64; 4],
    /// Touches that were not recorded because they lack the pose.
    pub without_pose: u64,
    /// Reports of the chip that were lost on the way, touches or others.
    pub missed: u64,
    /// Faults of fingers that the chip reported.
    pub faults: u64,
    /// Times that the line broke.
    pub lost: u64,
    /// Name and version of the chip's program, if it says so.
    pub firmware: Option<String>,
}

/// Records what the chip reports until there are `count` touches or `each` breaks, and passes everything to `each`, in
/// order. When `each` hears of a touch, it is on the disk.
///
/// When the line breaks, `reopen` is called until it succeeds. The chip keeps the last [`EVENTS`](palpate_shared::link::EVENTS) touches and faults that nobody has
/// heard; those before them are counted as missed, unless the chip was without power too. No touch is recorded twice.
///
/// # Errors
/// When the data set cannot be written, an emulated chip ends, or `each` fails. The data set is whole in any case.
pub fn record(
    connection: &mut Connection,
    mut reopen: impl FnMut() -> Result<Transport>,
    recording: &mut Recording,
    count: Option<u64>,
    mut each: impl FnMut(&RecordEvent<'_>) -> Result<ControlFlow<()>>,
) -> Result<RecordSummary> {
    let mut summary = RecordSummary { object: recording.object().into(), ..RecordSummary::default() };
    let mut connected = false;
    let recorded = loop {
        let step = match connected {
            true => listen(connection, recording, count, &mut summary, &mut each),
            false => greet(connection, recording, &mut summary, &mut each),
        };
        connected = true;
        match step {
            Ok(ControlFlow::Continue(())) => {}
            Ok(ControlFlow::Break(())) => break Ok(()),
            Err(error) if error.is(&Kind::Lost) => {
                summary.lost += 1;
                connected = false;
                recording.checkpoint()?;
                match wait(connection, &error, &mut reopen, &mut each) {
                    Ok(ControlFlow::Continue(())) => {}
                    Ok(ControlFlow::Break(())) => break Ok(()),
                    Err(error) => break Err(error),
                }
            }
            Err(error) => break Err(error),
        }
    };
    recording.checkpoint()?;
    recorded?;
    summary.all_touches = recording.all_touches();
    Ok(summary)
}

/// Asks the chip for its program and model.
fn greet(
    connection: &mut Connection,
    recording: &mut Recording,
    summary: &mut RecordSummary,
    each: &mut impl FnMut(&RecordEvent<'_>) -> Result<ControlFlow<()>>,
) -> Result<ControlFlow<()>> {
    let program = connection.program()?;
    let model = connection.model()?;
    let other = recording.made_by(program.clone(), model.as_ref().map(|model| model.info.checksum))?;
    let heard = RecordEvent::Connected { program: program.as_deref(), model: model.as_ref(), other: other.as_deref() };
    let flow = each(&heard);
    summary.firmware = program;
    flow
}

/// Takes the next thing that the chip reports.
fn listen(
    connection: &mut Connection,
    recording: &mut Recording,
    count: Option<u64>,
    summary: &mut RecordSummary,
    each: &mut impl FnMut(&RecordEvent<'_>) -> Result<ControlFlow<()>>,
) -> Result<ControlFlow<()>> {
    if count.is_some_and(|count| summary.touches >= count) {
        return Ok(ControlFlow::Break(()));
    }
    let Some((event, missed)) = connection.hear(Duration::from_millis(50))? else { return each(&RecordEvent::Idle) };
    if missed > 0 {
        summary.missed += u64::from(missed);
        if each(&RecordEvent::Missed(missed))?.is_break() {
            return Ok(ControlFlow::Break(()));
        }
    }
    let (touch, verdict) = match event {
        Event::Touch { touch, verdict, .. } => (Touch::from(&touch), Ok(verdict)),
        Event::Refused { touch, refusal } => (Touch::from(&touch), Err(refusal)),
        Event::Fault { kind, finger } => {
            summary.faults += 1;
            return each(&RecordEvent::Fault { kind, finger });
        }
        // It may have another program or model.
        _ => return greet(connection, recording, summary, each),
    };
    if recording.lacks_pose(&touch) {
        summary.without_pose += 1;
        return each(&RecordEvent::NoPose(touch));
    }
    recording.add(&touch)?;
    summary.touches += 1;
    let contacts = touch.times().iter().filter(|time| !time.is_missing()).count();
    if let Some(counted) = summary.contacts.get_mut(contacts) {
        *counted += 1;
    }
    each(&RecordEvent::Touch { touch, number: recording.all_touches(), verdict })
}

/// Waits until the line is there again.
fn wait(
    connection: &mut Connection,
    error: &Error,
    reopen: &mut impl FnMut() -> Result<Transport>,
    each: &mut impl FnMut(&RecordEvent<'_>) -> Result<ControlFlow<()>>,
) -> Result<ControlFlow<()>> {
    if each(&RecordEvent::Lost(error))?.is_break() {
        return Ok(ControlFlow::Break(()));
    }
    loop {
        match reopen().and_then(|transport| connection.reopen(transport)) {
            Ok(()) => return Ok(ControlFlow::Continue(())),
            Err(error) if error.is(&Kind::Lost) => std::thread::sleep(RETRY),
            Err(error) => return Err(error),
        }
        if each(&RecordEvent::Idle)?.is_break() {
            return Ok(ControlFlow::Break(()));
        }
    }
}
