//! Producers and one writer, joined by bounded channels.
//!
//! The chunks of all objects form one sequence. Producer p of n computes chunks p, p + n, p + 2n, … and sends them down
//! its own channel; the writer takes one from each channel in turn, which is the sequence again. A producer that is
//! ahead waits, so at most a few chunks are in memory regardless of the number of touches.

use super::{ObjectSummary, Sampler, Settings};
use crate::error::{Error, Result, problem};
use crate::probe::approach::FINGERS;
use crate::progress::{self, Progress};
use crate::touches::{Writer, write_touch};
use crossbeam_channel::{Receiver, Sender, bounded};
use palpate_shared::ContactPattern;
use std::fmt::Display;
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

/// Captures all samples of each object into its file.
pub(super) fn run(
    samplers: &[Sampler<'_>],
    settings: &Settings,
    writer: &mut Writer,
    progress: &dyn Progress,
) -> Result<Vec<ObjectSummary>> {
    let samples = settings.origin.samples();
    progress.begin("touching", Some((samples.end - samples.start) * samplers.len() as u64));
    let chunks = || chunks(samplers.len(), &samples);
    // More threads than chunks would have nothing to do.
    let threads = settings.threads().min(MOST_THREADS).min(chunks().take(MOST_THREADS).count()).max(1);
    std::thread::scope(|scope| {
        let mut channels = Vec::with_capacity(threads);
        let (go, started) = bounded(threads);
        for producer in 0..threads {
            let (sender, receiver) = bounded(AHEAD);
            let chunks = chunks().skip(producer).step_by(threads);
            let started = started.clone();
            let work = move || {
                if started.recv().is_ok() {
                    produce(chunks, samplers, settings, &sender, progress);
                }
            };
            // A system that is out of threads must not end in a panic. The threads that did start end without having
            // worked: nobody tells them to go.
            let started = std::thread::Builder::new().spawn_scoped(scope, work);
            started.map_err(|error| too_few_threads(producer, threads, &error))?;
            channels.push(receiver);
        }
        for _ in 0..threads {
            // There is room for all, and a receiver here.
            _ = go.send(());
        }
        let mut turns = (0..threads).cycle();
        let mut summaries = Vec::with_capacity(samplers.len());
        for file in writer.files() {
            let start = Instant::now();
            let (mut late, mut touching, mut turned_back) = ([0; FINGERS], 0, 0);
            let mut file = file?;
            for part in split(&samples) {
                let turn = turns.next().unwrap_or(0);
                let chunk = receive(&channels[turn])?;
                let touches = part.end - part.start;
                file.write(&chunk.text, touches, chunk.approaches)?;
                late.iter_mut().zip(chunk.late).for_each(|(late, more)| *late += more);
                touching += chunk.touching;
                turned_back += chunk.turned_back;
                progress::advance(progress, touches)?;
            }
            let entry = file.close()?;
            summaries.push(ObjectSummary {
                name: entry.name.clone(),
                touches: entry.touches,
                approaches: entry.approaches,
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

/// The chunks of so many objects, in the order in which they are written.
fn chunks(objects: usize, samples: &Range<u64>) -> impl Iterator<Item = (usize, Range<u64>)> + use<> {
    let parts = split(samples);
    (0..objects).flat_map(move |object| parts.clone().map(move |part| (object, part)))
}

/// The problem of an operating system that refuses a thread.
pub(super) fn too_few_threads(started: usize, asked: usize, refusal: &impl Display) -> Error {
    problem!("the system started only {started} of {asked} threads ({refusal})").fix("Use fewer threads.")
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
    channel.recv().unwrap_or_else(|_| Err(problem!("a worker stopped").fix("Report this as a bug.")))
}
