//! A page that shows what was measured: figures, tables, and the files behind them.
//!
//! [`Page`] is plain data; [`write()`] puts it and everything behind it into a directory. The short page of
//! `palpate run` is [`short()`], the whole evaluation [`full()`], which the other modules here measure and draw, a figure group a file.

mod cache;
mod calibration;
mod context;
mod cost;
mod cross_validation;
mod density;
mod full;
mod generalization;
mod growth;
mod limit;
mod noise;
mod objects;
mod published;
mod sequential;
mod settings;
pub mod short;
mod simulator;
pub mod statistics;
pub mod view;
mod work;

pub use crate::page::document::{Block, Figure, Page, Section};
pub use crate::page::table::{Cell, Data, Table};
pub use full::{Written, full};
pub use settings::Settings;
pub use short::{Picture, RunMethod, RunResults, short};

use crate::error::Result;
use crate::output::write_bytes;
use std::path::{Path, PathBuf};

/// Writes `page` to `path`, and with [`Page::files`] every figure's SVG and CSV and every table's CSV beside it. The
/// page comes last, each file whole or not at all. Returns what was written.
///
/// # Errors
/// [`crate::Error::Io`] naming the file.
pub fn write(page: &Page, path: &Path) -> Result<Vec<PathBuf>> {
    let mut written = Vec::new();
    let mut put = |path: PathBuf, bytes: &[u8]| -> Result<()> {
        write_bytes(&path, bytes)?;
        written.push(path);
        Ok(())
    };
    if page.files {
        for figure in page.figures() {
            put(path.with_file_name(format!("{}.svg", figure.id)), figure.whole_svg().text.as_bytes())?;
            put(path.with_file_name(format!("{}.csv", figure.id)), &figure.data.csv()?)?;
        }
        for table in page.tables() {
            put(path.with_file_name(format!("{}.csv", table.id)), &table.data.csv()?)?;
        }
    }
    put(path.to_path_buf(), page.html().as_bytes())?;
    Ok(written)
}
