//! Recording what a chip reports.

use super::LineOptions;
use crate::commands::probe::ProbeArguments;
use crate::commands::remark;
use palpate::chip::{Port, RecordEvent, RecordSummary, record};
use palpate::output::{print, print_json};
use palpate::touches::{Listing, Origin, Recording};
use palpate::{Error, Result};
use palpate_shared::Touch;
use palpate_shared::format::Length;
use palpate_shared::link::{Decision, FaultKind, Refusal, VerdictMessage};
use std::ops::ControlFlow;
use std::path::Path;
use std::time::SystemTime;

/// With which probe touches are recorded.
#[derive(clap::Args)]
pub(crate) struct RecordArguments {
    #[command(flatten)]
    probe: ProbeArguments,
    /// With the probe's direction and alignment; refuses touches without
    #[arg(long)]
    pose: bool,
    /// With the hand's position, in the table's frame; refuses touches without
    #[arg(long)]
    position: bool,
}

impl RecordArguments {
    /// True if positions are to be recorded.
    pub(crate) fn has_position(&self) -> bool {
        self.position
    }

    /// Opens the data set; its warnings go to stderr.
    ///
    /// # Errors
    /// Errors of [`Recording::open`], and when the probe file cannot be used.
    pub(crate) fn open(&self, directory: &Path, object: &str, source: &str, began: SystemTime) -> Result<Recording> {
        let origin = self.origin(directory)?;
        let recording = Recording::open(directory, object, Some(&origin), source, began)?;
        recording.warnings().iter().for_each(|warning| remark(&format!("palpate: warning: {warning}")));
        Ok(recording)
    }

    /// Origin of the touches that are recorded into a directory.
    pub(crate) fn origin(&self, directory: &Path) -> Result<Origin> {
        let (probe, unit) = match self.probe.read()? {
            Some(file) => (file.probe, file.unit),
            None => {
                let there = Listing::read(directory)?.map(|listing| listing.origin);
                let base = there.unwrap_or_default();
                (base.probe, base.unit)
            }
        };
        if self.position && unit != Length::Millimeter {
            return Err(Error::setting("position", "given", "it with --probe FILE whose unit is mm"));
        }
        Ok(Origin { position: self.position, ..Origin::recorded(probe, unit, self.pose || self.position) })
    }
}

/// Records what a chip reports until there are `count` touches, and prints each.
pub(crate) fn from_chip(
    (options, port): (&LineOptions, &Port),
    mut recording: Recording,
    directory: &Path,
    count: Option<u64>,
    json: bool,
) -> Result<()> {
    let mut connection = options.open(port)?;
    let reopen = || options.transport(port);
    let mut names = Vec::new();
    let object = recording.object().to_owned();
    let summarized = record(&mut connection, reopen, &mut recording, count, |heard| {
        match heard {
            RecordEvent::Connected { program, model, other } => {
                names = model.map(|model| model.names.clone()).unwrap_or_default();
                if let (Some(program), Some(other)) = (program, other) {
                    remark(&format!("palpate: warning: {other} made the newest touches here, now it is {program}"));
                }
                let program = program.unwrap_or("a chip that does not say which program it runs");
                let until = count.map_or("Ctrl-C ends".to_owned(), |count| format!("{count} touches"));
                let text = format!("recording {object} into {}: {program}; {until}\n", directory.display());
                say(json, &text)?;
            }
            RecordEvent::Lost(error) => remark(&format!("palpate: {error} Waiting for it.")),
            RecordEvent::Touch { touch, number, verdict } => {
                say(json, &format!("{}\n", line(*number, touch, said(verdict, &names).as_deref())))?;
            }
            RecordEvent::NoPose(_) => remark("palpate: warning: a touch without a pose was not recorded"),
            RecordEvent::Fault { kind, finger } => remark(&format!("palpate: warning: {}", fault(*kind, *finger))),
            RecordEvent::Missed(missed) => {
                remark(&format!("palpate: warning: {missed} reports of the chip were lost on the way"));
            }
            RecordEvent::Idle => {}
        }
        Ok(ControlFlow::Continue(()))
    })?;
    if json {
        return print_json(&summarized);
    }
    let RecordSummary { contacts, missed, without_pose, .. } = summarized;
    let mut text = summary(&recording, directory, contacts);
    if missed + without_pose > 0 {
        text += &format!("not recorded: {without_pose} touches without a pose, {missed} reports lost on the way\n");
    }
    print(&text)
}

/// Lines for people; nothing where a program reads.
fn say(json: bool, text: &str) -> Result<()> {
    if json { Ok(()) } else { print(text) }
}

/// Additions of a recording, with the number of touches that have no, one, two and three contacts.
pub(crate) fn summary(recording: &Recording, directory: &Path, contacts: [u64; 4]) -> String {
    let [none, one, two, three] = contacts;
    let (object, touches, all) = (recording.object(), recording.touches(), recording.all_touches());
    let (lying, of) = match recording.placement() {
        Some(placement) => (format!("/{placement}"), format!("of {object}")),
        None => (String::new(), "of it".into()),
    };
    let missed = if none > 0 { format!(", {none} none") } else { String::new() };
    format!(
        "recorded {touches} {} of {object}{lying} into {}, which holds {all} {of} now\ncontacts: {three} have three, {two} \
         two, {one} one{missed}\n",
        if touches == 1 { "touch" } else { "touches" },
        directory.display()
    )
}

/// A touch as a line: contact times in milliseconds, and what the chip says to it.
fn line(number: u64, touch: &Touch, said: Option<&str>) -> String {
    let times = touch.times().map(|time| match time.micros() {
        Some(micros) => format!(" {:9.3}", f64::from(micros) / 1e3),
        None => format!(" {:>9}", "-"),
    });
    let said = said.map(|said| format!("  {said}")).unwrap_or_default();
    format!("{number:5}{} ms{said}", times.concat())
}

/// Answer of the chip to a touch; nothing if it has no model.
fn said(verdict: &Result<VerdictMessage, Refusal>, names: &[String]) -> Option<String> {
    let name = |object: u8| names.get(usize::from(object)).map_or("?", String::as_str);
    match verdict {
        Err(Refusal::NoModel) => None,
        Err(refusal) => Some(format!("recorded, but not evidence: {refusal}")),
        Ok(verdict) => Some(match verdict.decision {
            Decision::Recognized(object) => format!("recognized {} after {} touches", name(object), verdict.touches),
            Decision::Unknown => "unknown, fits no object".into(),
            Decision::GaveUp => format!("gave up, most likely {}", name(verdict.best)),
            _ => format!("perhaps {}", name(verdict.best)),
        }),
    }
}

fn fault(kind: FaultKind, finger: u8) -> String {
    if finger < 3 { format!("finger {}: {kind}", finger + 1) } else { kind.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_touch_is_a_line_of_milliseconds_with_a_dash_for_a_missing_contact() {
        let touch = Touch::new([31_200, 0, u32::MAX].map(palpate_shared::ContactTime::from_micros));
        assert_eq!(line(7, &touch, None), "    7    31.200     0.000         - ms");
        assert_eq!(line(7, &touch, Some("perhaps cup")), "    7    31.200     0.000         - ms  perhaps cup");
    }
}
