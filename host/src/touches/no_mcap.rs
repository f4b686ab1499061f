//! In place of what reads and writes logs where the feature `mcap` is off: an error that says so.

use super::logged::{Channels, LoggedVerdict, Message};
use crate::error::{Error, Place, Result, TouchesProblem};
use palpate_shared::Touch;
use std::convert::Infallible;
use std::io::{Read, Seek, Write};
use std::marker::PhantomData;
use std::path::Path;

/// No log.
pub(super) fn read(_: impl Read, path: &Path, _: impl FnMut(Message) -> Result<()>) -> Result<Channels> {
    Err(Error::at(Place::file(path), TouchesProblem::NoMcap))
}

/// There is no writer.
pub(super) struct Writer<W> {
    never: Infallible,
    _out: PhantomData<W>,
}

impl<W: Write + Seek> Writer<W> {
    pub(super) fn new(_: W, _: &[String]) -> Result<Self> {
        Err(TouchesProblem::NoMcap.into())
    }

    pub(super) fn touch(&mut self, _: &Touch, _: Option<&str>, _: Option<u64>) -> Result<()> {
        match self.never {}
    }

    pub(super) fn verdict(&mut self, _: &LoggedVerdict) -> Result<()> {
        match self.never {}
    }

    pub(super) fn finish(self) -> Result<W> {
        match self.never {}
    }
}
