//! Progress on stderr, where it is a terminal and `--quiet` is not given.

use indicatif::{ProgressBar, ProgressFinish, ProgressStyle};
use palpate::progress::Progress;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// True once Ctrl-C was pressed.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Has Ctrl-C cancel a call, which then removes what is unfinished; pressed again, it ends the program.
#[cfg(unix)]
pub(super) fn cancel_when_interrupted() {
    let Ok(mut signals) = signal_hook::iterator::Signals::new([signal_hook::consts::SIGINT]) else { return };
    std::thread::spawn(move || {
        let mut pressed = signals.forever();
        pressed.next();
        INTERRUPTED.store(true, Ordering::Relaxed);
        pressed.next();
        std::process::exit(130);
    });
}

#[cfg(not(unix))]
pub(super) fn cancel_when_interrupted() {}

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
        std::mem::replace(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner), bar).finish_and_clear();
    }

    fn advance(&self, steps: u64) {
        self.current().inc(steps);
    }

    fn is_cancelled(&self) -> bool {
        INTERRUPTED.load(Ordering::Relaxed)
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.current().finish_and_clear();
    }
}
