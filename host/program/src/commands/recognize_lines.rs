//! Touches in and verdicts out of `palpate recognize`, a line each.

use palpate::Result;
use palpate::chip::Entry;
use palpate::error::{Error, Place};
use palpate::output;
use palpate::touches::{Log, Logged, begins_log, text};
use palpate_shared::Touch;
use std::fs::File;
use std::io::{BufRead, BufReader, IsTerminal, Read};
use std::path::Path;

/// Verdict after a touch.
#[derive(serde::Serialize)]
pub(super) struct Line<'a> {
    pub(super) touch: u32,
    pub(super) verdict: &'static str,
    pub(super) object: &'a str,
    pub(super) posterior: f64,
    /// Reason why the touch was not counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) refused: Option<String>,
    /// True where a sequence ends without a name, and nothing but the table was met.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub(super) table_alone: bool,
    /// True where the search for the place ended before it was done: then no object is named, however likely it is.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub(super) exhausted: bool,
    /// The approach that helps most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) next: Option<Entry>,
}

impl Line<'_> {
    pub(super) fn print(&self, json: bool) -> Result<()> {
        if json {
            return super::print_line(self);
        }
        match &self.refused {
            Some(refused) => output::print(&format!("{:4}  not counted: {refused}\n", self.touch))?,
            None if self.table_alone => {
                output::print(&format!("{:4}  {:10}  nothing but the table was met\n", self.touch, self.verdict))?
            }
            None => output::print(&format!(
                "{:4}  {:10}  {} {:.4}{}\n",
                self.touch,
                self.verdict,
                self.object,
                self.posterior,
                if self.exhausted { ", but the search for its place was not finished" } else { "" }
            ))?,
        }
        self.next.as_ref().map_or(Ok(()), |next| output::print(&format!("      {next}\n")))
    }
}

/// Part of a stream of touches.
pub(super) enum Event<'e> {
    /// Another object begins.
    Begin,
    /// A touch, with its place in the file.
    Touch {
        /// The touch.
        touch: &'e Touch,
        /// Its place.
        place: Place,
    },
}

/// Hands on the touches of a file, or of standard input; of lines each before the next is waited for.
pub(super) fn each_of(path: &Path, take: &mut dyn FnMut(Event<'_>) -> Result<()>) -> Result<()> {
    if path.as_os_str() == "-" {
        if std::io::stdin().is_terminal() {
            super::remark(
                "palpate: reading touches from the keyboard: three times in seconds a line, such as 0 0.012 -",
            );
        }
        return each(std::io::stdin().lock(), Path::new("standard input"), take);
    }
    let touches = File::open(path).map_err(|source| Error::io(path, "read the touches", source))?;
    each(touches, path, take)
}

fn each(touches: impl Read, path: &Path, take: &mut dyn FnMut(Event<'_>) -> Result<()>) -> Result<()> {
    let mut reader = BufReader::new(touches);
    let begin = reader.fill_buf().map_err(|source| Error::io(path, "read the touches", source))?;
    if begins_log(begin) {
        return each_of_log(&Log::of(reader, path)?, path, take);
    }
    for line in text::Lines::new(reader, path) {
        match line? {
            (_, None) => take(Event::Begin)?,
            (line, Some(touch)) => take(Event::Touch { touch: &touch, place: Place::line(path, line) })?,
        }
    }
    Ok(())
}

fn each_of_log(log: &Log, path: &Path, take: &mut dyn FnMut(Event<'_>) -> Result<()>) -> Result<()> {
    log.skipped().iter().for_each(super::say);
    let mut before = None;
    for logged in log.touches() {
        let Logged { touch, offset, .. } = logged;
        let object = log.object(logged);
        if object != before {
            take(Event::Begin)?;
        }
        before = object;
        take(Event::Touch { touch, place: Place::byte(path, *offset) })?;
    }
    Ok(())
}
