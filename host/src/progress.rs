//! Progress on stderr, when it is a terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar for work of `total` steps, drawn on stderr when it is a terminal, else silent. Cleared when finished or
/// dropped.
pub fn bar(what: impl Into<String>, total: u64) -> ProgressBar {
    let bar = ProgressBar::new(total);
    if let Ok(style) = ProgressStyle::with_template("{msg:24} {wide_bar} {human_pos}/{human_len} {eta}") {
        bar.set_style(style);
    }
    bar.with_message(what.into()).with_finish(indicatif::ProgressFinish::AndClear)
}

/// A spinner for work of unknown length, drawn on stderr when it is a terminal, else silent.
pub fn spinner(what: impl Into<String>) -> ProgressBar {
    let spinner = ProgressBar::new_spinner();
    spinner.enable_steady_tick(std::time::Duration::from_millis(100));
    spinner.with_message(what.into()).with_finish(indicatif::ProgressFinish::AndClear)
}
