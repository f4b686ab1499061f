//! The functions that the page calls.

use crate::watch::Watch;
use std::cell::RefCell;

#[derive(Default)]
struct Desk {
    input: Vec<u8>,
    /// Bytes for the line.
    line: Vec<u8>,
    /// JSON for the script.
    heard: Vec<u8>,
    watch: Watch,
}

thread_local! {
    static DESK: RefCell<Desk> = RefCell::new(Desk::default());
}

/// Does something with the desk. No function calls another, so it is free.
fn with<T>(act: impl FnOnce(&mut Desk) -> T) -> T {
    DESK.with_borrow_mut(act)
}

/// Does something that sends and hears.
fn exchange(now: f64, act: impl FnOnce(&mut Watch, &[u8], u64, &mut Vec<u8>)) {
    with(|Desk { input, line, heard, watch }| {
        line.clear();
        // Negative times and NaN are 0.
        act(watch, input, now as u64, line);
        input.clear();
        *heard = serde_json::to_vec(&watch.take()).unwrap_or_default();
    });
}

/// Exports functions under their own names.
macro_rules! export {
    ($($(#[$meta:meta])* fn $name:ident($($argument:ident: $kind:ty),*) $(-> $result:ty)? $body:block)*) => {
        $(
            $(#[$meta])*
            // The names are this module's alone: nothing else is linked into it.
            #[allow(unsafe_code)]
            #[unsafe(no_mangle)]
            extern "C" fn $name($($argument: $kind),*) $(-> $result)? $body
        )*
    };
}

export! {
    /// Makes room for `length` bytes of input, which the caller writes there.
    fn input(length: u32) -> *mut u8 {
        with(|desk| {
            desk.input = vec![0; usize::try_from(length).unwrap_or(0)];
            desk.input.as_mut_ptr()
        })
    }

    /// Begins a session of this number, on a line that was just opened.
    fn connect(session: u32, now: f64) {
        exchange(now, |watch, _, now, line| watch.connect(session, now, line));
    }

    /// Takes the input, which came from the line.
    fn receive(now: f64) {
        exchange(now, |watch, input, now, line| watch.receive(input, now, line));
    }

    /// Lets time pass. To be called several times per second.
    fn tick(now: f64) {
        exchange(now, |watch, _, now, line| watch.tick(now, line));
    }

    /// Has the chip forget its touches: another object comes.
    fn reset(now: f64) {
        exchange(now, |watch, _, now, line| watch.reset(now, line));
    }

    /// Bytes for the line.
    fn line() -> *const u8 {
        with(|desk| desk.line.as_ptr())
    }

    /// Number of bytes for the line.
    fn line_length() -> usize {
        with(|desk| desk.line.len())
    }

    /// Happenings as JSON in UTF-8.
    fn heard() -> *const u8 {
        with(|desk| desk.heard.as_ptr())
    }

    /// Number of bytes of that.
    fn heard_length() -> usize {
        with(|desk| desk.heard.len())
    }

    /// Frames that were garbled, too long or of another version, since the page was opened.
    fn garbled() -> f64 {
        with(|desk| desk.watch.garbled() as f64)
    }
}
