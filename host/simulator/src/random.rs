//! Random numbers that depend on a seed and on their purpose only.
//!
//! The touches of a capture have a generator of their own (`palpate::capture::Sampler`).

use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

/// Purposes of random numbers. Each purpose has its own streams, so that drawing more for one changes no other, and
/// what is drawn for two of them at the same seed is independent. A purpose's number is a control character, which no
/// object's name begins with, in front of the name; that of folds, 0, is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Division of touches into training and test.
    Folds = 0,
    /// Gaussian noise on contact times.
    Noise = 1,
    /// Other errors that a sensor and a robot add to a touch.
    Sensor = 7,
    /// Errors that a robot adds to all of its touches.
    Robot = 8,
    /// Groups and sequences of touches that an evaluation draws.
    Groups = 2,
    /// Sequences of touches on which two models are compared.
    Sequences = 3,
    /// Approaches shown on the page of an object.
    View = 4,
    /// Casts by which the simulator is checked.
    Casts = 5,
    /// Groups and sequences of approaches that an evaluation draws.
    Approaches = 10,
    /// The order in which touches are put into sequences of a calibration.
    Calibration = 9,
    /// Approaches that an evaluation draws from those in a pose.
    Active = 16,
    /// The order in which touches are used to calibrate a misfit test.
    Misfit = 11,
    /// Noise that a real probe adds to the touches of a capture.
    Capture = 28,
    /// Touches as a fitted probe would make them.
    Fit = 29,
    /// Recorded touches that are held out together, and groups of them.
    Teach = 18,
    /// Objects on a simulated table, and a hand's approaches to them.
    Table = 30,
    /// Made-up touches for tests.
    Synthetic = 6,
}

/// A generator for sample `index` of `name`: other seeds, purposes, names or indices give other numbers, whatever was
/// drawn before and on whichever thread.
#[must_use]
pub fn generator(seed: u64, purpose: Purpose, name: &str, index: u64) -> ChaCha8Rng {
    // FNV-1a spreads purpose, name and index over 64 bits, which choose one of ChaCha's independent streams.
    let bytes = Some(purpose as u8).filter(|&mark| mark > 0).into_iter().chain(name.bytes()).chain(index.to_le_bytes());
    let stream = bytes
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream);
    random
}
