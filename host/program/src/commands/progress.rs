//! Progress on stderr, where it is a terminal and `--quiet` is not given.

use indicatif::{ProgressBar, ProgressFinish, ProgressStyle};
use palpate::progress::Progress;
use std::process::exit;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// The newest bar, to say how far it came.
static NEWEST: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Has Ctrl-C say how far a command came that goes on with `--resume`.
pub(super) fn tell_when_interrupted() {
    // Without a handler Ctrl-C ends the program as well.
    _ = ctrlc::set_handler(|| {
        let bar = NEWEST.lock().unwrap_or_else(PoisonError::into_inner).take();
        let far = bar.as_ref().and_then(|bar| {
            bar.set_style(ProgressStyle::with_template("").ok()?);
            Some(format!(" at {} of {}, {}", bar.position(), bar.length()?, bar.message()))
        });
        let far = far.unwrap_or_default();
        eprintln!("palpate: interrupted{far}. What is done is kept: repeat the command with --resume.");
        exit(130);
    });
}

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
