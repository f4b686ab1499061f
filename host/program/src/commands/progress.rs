//! Progress on stderr, where it is a terminal and `--quiet` is not given.

use indicatif::{ProgressBar, ProgressFinish, ProgressStyle};
use palpate::progress::Progress;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// The newest bar, to say how far it came.
static NEWEST: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Has Ctrl-C say how far a command came that goes on with `--resume`.
#[cfg(unix)]
pub(super) fn tell_when_interrupted() {
    // Without this, Ctrl-C ends the program as well.
    let Ok(mut signals) = signal_hook::iterator::Signals::new([signal_hook::consts::SIGINT]) else { return };
    std::thread::spawn(move || {
        signals.forever().next();
        let bar = NEWEST.lock().unwrap_or_else(PoisonError::into_inner).take();
        let far = bar.and_then(|bar| Some(format!(" at {} of {}, {}", bar.position(), bar.length()?, bar.message())));
        eprintln!(
            "\npalpate: interrupted{}. What is done is kept: repeat the command with --resume.",
            far.unwrap_or_default()
        );
        std::process::exit(130);
    });
}

#[cfg(not(unix))]
pub(super) fn tell_when_interrupted() {}

/// Draws the current stage of a long call: a bar where the number of steps is known, else a spinner. Silent where
/// stderr is no terminal; cleared when dropped.
pub(crate) struct Bar(Mutex<ProgressBar>);

impl Bar {
    /// Nothing is drawn before the first stage begins.
    pub(crate) fn new() -> Self {
        Self(Mutex::new(ProgressBar::hidden()))
    }

    /// The bar that is drawn now.
    pub(crate) fn current(&self) -> ProgressBar {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Progress for Bar {
    fn begin(&self, stage: &str, total: Option<u64>) {
        if super::is_quiet() {
            return;
        }
        let bar = match total {
            Some(total) => {
                let bar = ProgressBar::new(total);
                if let Ok(style) = ProgressStyle::with_template("{msg:24} {wide_bar} {human_pos}/{human_len} {eta}") {
                    bar.set_style(style);
                }
                bar
            }
            None => {
                let spinner = ProgressBar::new_spinner();
                spinner.enable_steady_tick(Duration::from_millis(100));
                spinner
            }
        };
        let bar = bar.with_message(stage.to_owned()).with_finish(ProgressFinish::AndClear);
        *NEWEST.lock().unwrap_or_else(PoisonError::into_inner) = Some(bar.clone());
        std::mem::replace(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner), bar).finish_and_clear();
    }

    fn advance(&self, steps: u64) {
        self.current().inc(steps);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.current().finish_and_clear();
    }
}
