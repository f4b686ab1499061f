//! Long calls: without the interpreter's lock, stopped by Ctrl-C, with a callback for how far they have come.

use crate::failure::Failure;
use palpate::progress::Progress;
use pyo3::Borrowed;
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::type_hint_identifier;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError, mpsc};
use std::time::Duration;

/// Time between two checks for Python's signals, and between two reports of progress.
const TICK: Duration = Duration::from_millis(50);

/// Function called with a stage's name, the number of steps done, and their total.
pub(crate) struct Callback(Py<PyAny>);

impl<'a, 'py> FromPyObject<'a, 'py> for Callback {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = type_hint_identifier!("palpate._types", "Progress");

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self(object.to_owned().unbind()))
    }
}

/// Progress reported by the workers.
#[derive(Default)]
struct Told {
    stage: Mutex<(String, Option<u64>)>,
    done: AtomicU64,
    cancelled: AtomicBool,
}

impl Progress for Told {
    fn begin(&self, stage: &str, total: Option<u64>) {
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = (stage.to_owned(), total);
        self.done.store(0, Ordering::Relaxed);
    }

    fn advance(&self, steps: u64) {
        self.done.fetch_add(steps, Ordering::Relaxed);
    }

    fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

impl Told {
    fn tell(&self, py: Python<'_>, callback: Option<&Callback>) -> PyResult<()> {
        let Some(Callback(callback)) = callback else { return Ok(()) };
        let (stage, total) = self.stage.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if stage.is_empty() {
            return Ok(());
        }
        callback.call1(py, (stage, self.done.load(Ordering::Relaxed), total)).map(|_| ())
    }
}

/// Does `work` on a thread of its own, while this one waits for signals and calls back: callbacks come from the caller's
/// thread only. What Ctrl-C or the callback raises stops the work, and is raised.
pub(crate) fn long<T: Send>(
    py: Python<'_>,
    callback: Option<&Callback>,
    work: impl FnOnce(&dyn Progress) -> palpate::Result<T> + Send,
) -> Result<T, Failure> {
    let told = Told::default();
    let (sender, receiver) = mpsc::sync_channel(1);
    // Another thread may not share a receiver; this one alone locks it.
    let receiver = Mutex::new(receiver);
    std::thread::scope(|scope| {
        let told = &told;
        let worker = scope.spawn(move || {
            let result = work(told);
            // The receiver outlives this thread.
            _ = sender.send(());
            result
        });
        let mut raised = None;
        loop {
            // A worker that panics drops the sender: that ends the wait too.
            let waited = py.detach(|| receiver.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(TICK));
            if !matches!(waited, Err(mpsc::RecvTimeoutError::Timeout)) {
                break;
            }
            if raised.is_none()
                && let Err(error) = py.check_signals().and_then(|()| told.tell(py, callback))
            {
                told.cancelled.store(true, Ordering::Relaxed);
                raised = Some(error);
            }
        }
        let result = py.detach(|| worker.join()).unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        match (raised, result) {
            (Some(raised), _) => Err(raised.into()),
            (None, Ok(value)) => {
                told.tell(py, callback)?;
                Ok(value)
            }
            (None, Err(error)) => Err(error.into()),
        }
    })
}
