//! A line between a host and a chip that loses, changes, doubles and delays bytes on purpose.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

/// Lets the first connection to `host` and this chip exchange bytes over a bad line, in a thread, until one of them hangs up.
pub fn relay(host: TcpListener, mut chip: TcpStream, faults: Faults, seed: u64) {
    std::thread::spawn(move || {
        let (mut host, _) = host.accept().unwrap();
        for stream in [&host, &chip] {
            stream.set_nodelay(true).unwrap();
            stream.set_nonblocking(true).unwrap();
        }
        let (mut down, mut up) = (BadLine::new(faults, seed), BadLine::new(faults, !seed));
        while pass(&mut host, &mut chip, &mut down) && pass(&mut chip, &mut host, &mut up) {
            std::thread::sleep(Duration::from_micros(300));
        }
        // What waits for the other end ends as well.
        _ = host.shutdown(std::net::Shutdown::Both);
        _ = chip.shutdown(std::net::Shutdown::Both);
    });
}

/// Takes what has come from one end, and sends the other what is due; false once one of them has hung up.
fn pass(from: &mut TcpStream, to: &mut TcpStream, line: &mut BadLine) -> bool {
    let mut buffer = [0; 4096];
    match from.read(&mut buffer) {
        Ok(0) => return false,
        Ok(count) => line.push(&buffer[..count], Instant::now()),
        Err(error) if error.kind() == ErrorKind::WouldBlock => {}
        Err(_) => return false,
    }
    while let Some(bytes) = line.pop(Instant::now()) {
        if to.write_all(&bytes).is_err() {
            return false;
        }
    }
    true
}

/// Faults of a bad line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Faults {
    /// Probability that a byte is lost.
    pub lost: f64,
    /// Probability that one bit of a byte is flipped.
    pub changed: f64,
    /// Probability that bytes sent together arrive twice.
    pub doubled: f64,
    /// Bytes arrive up to this much later, in order.
    pub delay: Duration,
}

/// One direction of a bad line.
#[derive(Debug)]
struct BadLine {
    faults: Faults,
    rng: ChaCha8Rng,
    under_way: VecDeque<(Instant, Vec<u8>)>,
}

impl BadLine {
    /// A line. The same seed does the same to the same bytes, except for effects of the delay.
    fn new(faults: Faults, seed: u64) -> Self {
        Self { faults, rng: ChaCha8Rng::seed_from_u64(seed), under_way: VecDeque::new() }
    }

    /// Puts bytes on the line.
    fn push(&mut self, bytes: &[u8], now: Instant) {
        if bytes.is_empty() {
            return;
        }
        let Self { faults, rng, under_way } = self;
        for _ in 0..if rng.random_bool(faults.doubled) { 2 } else { 1 } {
            let mut arriving = Vec::with_capacity(bytes.len());
            for &byte in bytes {
                if rng.random_bool(faults.lost) {
                    continue;
                }
                let flipped = if rng.random_bool(faults.changed) { 1 << rng.random_range(0..8) } else { 0 };
                arriving.push(byte ^ flipped);
            }
            let due = now + faults.delay.mul_f64(rng.random());
            let last = under_way.back().map_or(now, |(due, _)| *due);
            under_way.push_back((due.max(last), arriving));
        }
    }

    /// Takes bytes that have arrived.
    fn pop(&mut self, now: Instant) -> Option<Vec<u8>> {
        self.under_way.pop_front_if(|(due, _)| *due <= now).map(|(_, bytes)| bytes)
    }
}
