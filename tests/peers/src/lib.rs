//! Palpate's benchmarks against other software, in `benches/`, and what they share: times of contestants that take turns.

use std::sync::LazyLock;
use std::time::Instant;

/// True if this run only shows that everything works.
pub static QUICK: LazyLock<bool> = LazyLock::new(|| std::env::args().any(|argument| argument == "--quick"));

/// The processor time that this thread has had, in seconds; elsewhere than on Linux the time of day. Linux may count it only
/// every few milliseconds: what is timed has to take many of them.
pub fn clock() -> f64 {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    let schedule = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    match schedule.split(' ').next().and_then(|nanoseconds| nanoseconds.parse::<f64>().ok()) {
        Some(nanoseconds) => nanoseconds * 1e-9,
        None => START.elapsed().as_secs_f64(),
    }
}

/// Times of contestants in the same rounds.
pub struct Paired {
    /// Seconds per item: the median of each contestant's rounds.
    pub seconds: Vec<f64>,
    /// Time of each contestant, relative to the first: the median over the rounds; all take turns in each.
    /// A disturbance of a round affects all of them.
    pub ratios: Vec<f64>,
}

/// Times contestants in turns for this many rounds, each about `seconds` long for each; one round if the run is quick. A
/// contestant does as many items as it is asked for.
pub fn paired(rounds: usize, seconds: f64, contestants: &mut [&mut dyn FnMut(usize)]) -> Paired {
    let time = |contestant: &mut dyn FnMut(usize), items: usize| {
        let start = clock();
        contestant(items);
        clock() - start
    };
    let items: Vec<usize> = contestants
        .iter_mut()
        .map(|contestant| {
            let mut items = 1;
            loop {
                let took = time(contestant, items);
                if *QUICK || took > seconds / 2.0 {
                    return items;
                }
                items = if took < seconds / 64.0 { 8 * items } else { (items as f64 * seconds / took).ceil() as usize };
            }
        })
        .collect();
    let rounds = if *QUICK { 1 } else { rounds };
    let mut all = vec![Vec::with_capacity(rounds); contestants.len()];
    for round in 0..rounds {
        for turn in 0..contestants.len() {
            let index = (round + turn) % contestants.len();
            all[index].push(time(contestants[index], items[index]) / items[index] as f64);
        }
    }
    let ratios = all.iter().map(|times| median(times.iter().zip(&all[0]).map(|(time, first)| time / first).collect()));
    Paired { ratios: ratios.collect(), seconds: all.iter().cloned().map(median).collect() }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
