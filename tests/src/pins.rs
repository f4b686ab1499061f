//! Fingers that touch in an emulated chip: what its pins are told.

use palpate_shared::Touch;
use rand::RngExt;
use rand::rngs::ChaCha8Rng;

/// Edges as a host plays them: finger, level, time.
#[derive(Default)]
pub struct Edges {
    /// Six bytes for each: see `onboard/firmware/src/pins.rs`.
    pub bytes: Vec<u8>,
}

impl Edges {
    /// A finger opens or closes.
    pub fn edge(&mut self, finger: u8, closed: bool, at: u32) {
        self.bytes.extend([finger, u8::from(closed)]);
        self.bytes.extend(at.to_le_bytes());
    }

    /// Time passes.
    pub fn wait(&mut self, at: u32) {
        self.edge(3, false, at);
    }

    /// The signal that no approach is under way comes, and goes again.
    pub fn over(&mut self, from: u32, to: u32) {
        self.edge(5, true, from);
        self.edge(5, false, to);
    }

    /// The power goes, and comes back.
    pub fn cut(&mut self, at: u32) {
        self.wait(at);
        self.edge(4, false, at);
    }
}

/// From the beginning of one approach to that of the next.
pub const APPROACH: u32 = 1_450_000;

/// The edges that three switches make of an approach and of their release: time, finger, closed. Switches bounce; one in
/// ten loses contact for a while and touches again, and a third finger may come as late as the model allows.
pub fn edges(touch: &Touch, rng: &mut ChaCha8Rng) -> Vec<(u32, u8, bool)> {
    let mut edges = Vec::new();
    let again = rng.random_range(0..10);
    for (finger, time) in (0..3).zip(touch.times()) {
        let Some(time) = time.micros() else { continue };
        let mut at = time;
        edges.push((at, finger, true));
        for _ in 0..rng.random_range(0..4) {
            for closed in [false, true] {
                at += rng.random_range(1..1_000);
                edges.push((at, finger, closed));
            }
        }
        if finger == again {
            // Another contact in the same approach: the first one counts.
            at += rng.random_range(10_000..40_000);
            edges.push((at, finger, false));
            at += rng.random_range(10_000..90_000);
            edges.push((at, finger, true));
        }
        edges.push((1_300_000 + rng.random_range(0..1_000), finger, false));
    }
    edges.sort_unstable();
    edges
}
