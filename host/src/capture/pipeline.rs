//! Producers and one writer, joined by bounded channels.
//!
//! The chunks of all objects form one sequence. Producer p of n computes chunks p, p + n, p + 2n, … and sends them down
//! its own channel; the writer takes one from each channel in turn, which is the sequence again. A producer that is
//! ahead waits, so at most a few chunks are in memory regardless of the number of touches.

use super::store::Store;
use super::{ObjectSummary, Sampler, Settings};
use crate::error::{CaptureProblem, Result};
use crate::probe::approach::FINGERS;
use crate::progress::{self, Progress};
use crate::touches::write_touch;
use crossbeam_channel::{Receiver, Sender, bounded};
use palpate_shared::ContactPattern;
use std::ops::Range;
use std::time::Instant;

/// Number of samples in a chunk: some milliseconds of work.
const CHUNK: u64 = 256;

/// Number of chunks that a producer may be ahead.
const AHEAD: usize = 8;

/// The most producers, even if more are asked for: together they are ahead by a few megabytes at most.
const MOST_THREADS: usize = 256;

/// Samples that a producer hands to the writer.
struct Chunk {
    text: String,
    approaches: u64,
    late: [u64; FINGERS],
    touching: u64,
    turned_back: u64,
}

/// Captures everything that the store does not have yet.
pub(super) fn run(
    samplers: &[Sampler<'_>],
    settings: &Settings,
    store: &mut Store,
    progress: &dyn Progress,
) -> Result<Vec<ObjectSummary>> {
    let samples = settings.origin.samples();
    let total = samples.end - samples.start;
    let rest = |object: usize| samples.start + store.entry(object).touches..samples.end;
    let jobs: Vec<(usize, Range<u64>)> = (0..samplers.len()).map(|object| (object, rest(object))).collect();
    progress.begin("touching", Some(total * samplers.len() as u64));
    // More threads than chunks would have nothing to do.
    let threads = settings.threads().min(MOST_THREADS).min(chunks(&jobs).take(MOST_THREADS).count()).max(1);
    std::thread::scope(|scope| {
        let mut channels = Vec::with_capacity(threads);
        let (go, started) = bounded(threads);
        for producer in 0..threads {
            let (sender, receiver) = bounded(AHEAD);
            let chunks = chunks(&jobs).skip(producer).step_by(threads);
            let started = started.clone();
            let work = move || {
                if started.recv().is_ok() {
                    produce(chunks, samplers, settings, &sender, progress);
                }
            };
            // A system that is out of threads must not end in a panic. The threads that did start end without having
            // worked: nobody tells them to go.
            std::thread::Builder::new().spawn_scoped(scope, work).map_err(|error| {
                let message = error.to_string();
                CaptureProblem::Threads { asked: threads, started: producer, message }
            })?;
            channels.push(receiver);
        }
        for _ in 0..threads {
            // There is room for all, and a receiver here.
            _ = go.send(());
        }
        let mut turns = (0..threads).cycle();
        let mut summaries = Vec::with_capacity(samplers.len());
        for (object, samples) in &jobs {
            let start = Instant::now();
            let before = store.entry(*object).clone();
            let (mut late, mut touching, mut turned_back) = ([0; FINGERS], 0, 0);
            progress.advance(before.touches);
            for part in split(samples) {
                let turn = turns.next().unwrap_or(0);
                let chunk = receive(&channels[turn])?;
                let touches = part.end - part.start;
                store.append(*object, chunk.text.as_bytes(), touches, chunk.approaches)?;
                late.iter_mut().zip(chunk.late).for_each(|(late, more)| *late += more);
                touching += chunk.touching;
                turned_back += chunk.turned_back;
                progress::advance(progress, touches)?;
            }
            store.complete(*object)?;
            let entry = store.entry(*object).clone();
            summaries.push(ObjectSummary {
                name: entry.name,
                touches: entry.touches,
                approaches: entry.approaches,
                approaches_now: entry.approaches - before.approaches,
                late,
                touching,
                turned_back,
                seconds: start.elapsed().as_secs_f64(),
            });
        }
        Ok(summaries)
    })
}

/// The samples of one object, chunk by chunk.
fn split(samples: &Range<u64>) -> impl Iterator<Item = Range<u64>> + Clone + use<> {
    let end = samples.end;
    samples.clone().step_by(CHUNK as usize).map(move |start| start..end.min(start + CHUNK))
}

/// The chunks of all objects, in the order in which they are written.
fn chunks(jobs: &[(usize, Range<u64>)]) -> impl Iterator<Item = (usize, Range<u64>)> {
    jobs.iter().flat_map(|(object, samples)| split(samples).map(|part| (*object, part)))
}

/// Computes chunks until they are all done, one fails, the capture is cancelled or the writer is started.
fn produce(
    chunks: impl Iterator<Item = (usize, Range<u64>)>,
    samplers: &[Sampler<'_>],
    settings: &Settings,
    sender: &Sender<Result<Chunk>>,
    progress: &dyn Progress,
) {
    for (object, samples) in chunks {
        let chunk = compute(&samplers[object], settings, samples, progress);
        let failed = chunk.is_err();
        if sender.send(chunk).is_err() || failed {
            return;
        }
    }
}

fn compute(sampler: &Sampler<'_>, settings: &Settings, samples: Range<u64>, progress: &dyn Progress) -> Result<Chunk> {
    let mut chunk = Chunk { text: String::new(), approaches: 0, late: [0; FINGERS], touching: 0, turned_back: 0 };
    for sample in samples {
        progress::check(progress)?;
        let drawn = sampler.drawn(sample)?;
        write_touch(&mut chunk.text, &drawn.touch, settings.origin.pose);
        chunk.approaches += drawn.approaches;
        chunk.late.iter_mut().zip(drawn.late).for_each(|(late, more)| *late += more);
        chunk.touching += u64::from(drawn.touch.pattern() != ContactPattern::None);
        chunk.turned_back += drawn.turned_back;
    }
    Ok(chunk)
}

fn receive(channel: &Receiver<Result<Chunk>>) -> Result<Chunk> {
    // A producer only goes away early by a panic, which the scope passes on.
    channel.recv().unwrap_or_else(|_| Err(CaptureProblem::WorkerStopped.into()))
}
