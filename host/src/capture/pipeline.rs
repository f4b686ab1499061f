//! Producers and one that takes what they make, joined by bounded channels.
//!
//! The chunks of all objects form one sequence. Producer p of n computes chunks p, p + n, p + 2n, … and sends them down
//! its own channel; the taker receives one from each channel in turn, which is the sequence again. A producer that is
//! ahead waits, so at most a few chunks are in memory regardless of the number of touches.

use super::sample::Drawn;
use super::{ObjectSummary, Sampler, Settings};
use crate::error::{Error, Result, problem};
use crate::progress::{self, Progress};
use crossbeam_channel::{Receiver, Sender, bounded};
use palpate_shared::{ContactPattern, Touch};
use std::fmt::Display;
use std::ops::Range;
use std::time::Instant;

/// Number of samples in a chunk: some milliseconds of work.
const CHUNK: u64 = 256;

/// Number of chunks that a producer may be ahead.
const AHEAD: usize = 8;

/// The most producers, even if more are asked for: together they are ahead by a few megabytes at most.
const MOST_THREADS: usize = 256;

/// Samples of an object that a producer hands on.
pub(super) struct Chunk<T> {
    /// The touches, as the producer packed them.
    pub(super) packed: T,
    /// Counts of them.
    pub(super) counts: ObjectSummary,
}

/// Chunks of one object, in their order.
pub(super) type Chunks<'c, T> = dyn Iterator<Item = Result<Chunk<T>>> + 'c;

/// Captures all samples of each object, chunk by chunk, which producers `pack`. The chunks of each object are given to `take`, with
/// the object's number: it takes all of them, or fails.
pub(super) fn run<T: Send>(
    samplers: &[Sampler<'_>],
    settings: &Settings,
    pack: impl Fn(usize, Range<u64>, Vec<Touch>) -> T + Sync,
    mut take: impl FnMut(usize, &mut Chunks<'_, T>) -> Result<()>,
    progress: &dyn Progress,
) -> Result<Vec<ObjectSummary>> {
    let samples = settings.origin.samples();
    progress.begin("touching", Some((samples.end - samples.start) * samplers.len() as u64));
    let (pack, chunks) = (&pack, || chunks(samplers.len(), &samples));
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
                    let make = |object: usize, samples: Range<u64>| {
                        let pack = |touches| pack(object, samples.clone(), touches);
                        compute(&samplers[object], settings, samples.clone(), pack, progress)
                    };
                    produce(chunks, make, &sender);
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
        for (object, sampler) in samplers.iter().enumerate() {
            let start = Instant::now();
            let mut summary = ObjectSummary { name: sampler.name().into(), ..ObjectSummary::default() };
            let next = |_: Range<u64>| {
                let chunk = receive(&channels[turns.next().unwrap_or(0)])?;
                summary.add(&chunk.counts);
                progress::advance(progress, chunk.counts.touches)?;
                Ok(chunk)
            };
            take(object, &mut split(&samples).map(next))?;
            summaries.push(ObjectSummary { seconds: start.elapsed().as_secs_f64(), ..summary });
        }
        Ok(summaries)
    })
}

/// The samples of one object, chunk by chunk.
fn split(samples: &Range<u64>) -> impl Iterator<Item = Range<u64>> + Clone + use<> {
    let end = samples.end;
    samples.clone().step_by(CHUNK as usize).map(move |start| start..end.min(start + CHUNK))
}

/// The chunks of so many objects, in the order in which they are taken.
fn chunks(objects: usize, samples: &Range<u64>) -> impl Iterator<Item = (usize, Range<u64>)> + use<> {
    let parts = split(samples);
    (0..objects).flat_map(move |object| parts.clone().map(move |part| (object, part)))
}

/// The problem of an operating system that refuses a thread.
fn too_few_threads(started: usize, asked: usize, refusal: &impl Display) -> Error {
    problem!("the system started only {started} of {asked} threads ({refusal})").fix("Use fewer threads.")
}

/// Makes chunks until they are all done, one fails, the capture is cancelled or nobody takes them.
fn produce<T>(
    chunks: impl Iterator<Item = (usize, Range<u64>)>,
    make: impl Fn(usize, Range<u64>) -> Result<Chunk<T>>,
    sender: &Sender<Result<Chunk<T>>>,
) {
    for (object, samples) in chunks {
        let chunk = make(object, samples);
        let failed = chunk.is_err();
        if sender.send(chunk).is_err() || failed {
            return;
        }
    }
}

fn compute<T>(
    sampler: &Sampler<'_>,
    settings: &Settings,
    samples: Range<u64>,
    pack: impl Fn(Vec<Touch>) -> T,
    progress: &dyn Progress,
) -> Result<Chunk<T>> {
    let (mut touches, mut counts) = (Vec::with_capacity(CHUNK as usize), ObjectSummary::default());
    for sample in samples {
        progress::check(progress)?;
        let Drawn { touch, approaches, late, turned_back } = sampler.drawn(sample)?;
        let touching = u64::from(touch.pattern() != ContactPattern::None);
        counts.add(&ObjectSummary { touches: 1, approaches, late, touching, turned_back, ..ObjectSummary::default() });
        touches.push(if settings.origin.pose { touch } else { Touch::new(touch.times()) });
    }
    Ok(Chunk { packed: pack(touches), counts })
}

fn receive<T>(channel: &Receiver<Result<Chunk<T>>>) -> Result<Chunk<T>> {
    // A producer only goes away early by a panic, which the scope passes on.
    channel.recv().unwrap_or_else(|_| Err(problem!("a worker stopped").fix("Report this as a bug.")))
}
