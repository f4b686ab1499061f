//! The resolution of the timer that recorded touches, found from their times.

use palpate_shared::Touch;

/// Resolutions that are looked for, in microseconds.
const RANGE: [f64; 2] = [20.0, 60_000.0];
/// Times are used up to this many ticks: the farther, the more exactly must the resolution be known.
const TICKS: f64 = 40.0;
/// Mean resultant length of the times' phases within a tick, above which there is a timer.
const CLOSE: f64 = 0.93;
/// Times that it takes to tell.
const LEAST: usize = 24;

/// Evidence of the times about the timer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Timer {
    /// Its resolution in microseconds.
    Found(f64),
    /// A resolution finer than those searched.
    Fine,
    /// There are too few times to tell.
    Unknown,
}

/// The largest resolution that divides nearly all times. Rayleigh's test: on whole ticks the unit vectors at
/// 2π · time / resolution all point the same way.
pub(super) fn timer<'a>(touches: impl IntoIterator<Item = &'a Touch>) -> Timer {
    let times = touches.into_iter().flat_map(|touch| touch.times()).filter_map(|time| time.micros());
    let mut times: Vec<f64> = times.filter(|micros| *micros > 0).map(f64::from).collect();
    times.sort_by(f64::total_cmp);
    let mut resolution = RANGE[1];
    let mut enough = false;
    while resolution >= RANGE[0] {
        let near = &times[..times.partition_point(|time| *time <= TICKS * resolution)];
        // Times of less than a tick say nothing: where all of them are, none is a multiple.
        if near.len() >= LEAST {
            enough = true;
            if closeness(near, resolution) > CLOSE {
                // Coming from above, and with times of few ticks, this is the side of the peak.
                let finer = (-600..=20).map(|step| resolution * (1.0 + 2e-4 * f64::from(step)));
                let best = finer.max_by(|a, b| closeness(near, *a).total_cmp(&closeness(near, *b)));
                return Timer::Found(usual(best.unwrap_or(resolution)));
            }
        }
        resolution /= 1.0 + 0.2 / TICKS;
    }
    if enough { Timer::Fine } else { Timer::Unknown }
}

/// The shortest time between readings that is looked for, in microseconds.
const READINGS: f64 = 5_000.0;
/// Mean resultant length above which times cluster: readings that come up to 3 of 10 ms late have .73, and the recordings of 5 robots
/// that are read every millisecond or two at most .24.
const CLUSTERED: f64 = 0.5;
/// Least number of times, and of readings in each: fewer are near each other by the objects' shapes.
const MANY: usize = 100;
const FROM: f64 = 3.0;

/// The time between readings of the contacts in microseconds, if they are so rare that contact times cluster about its
/// multiples despite jitter; none if the timer itself is as coarse.
pub(super) fn readings<'a>(touches: impl IntoIterator<Item = &'a Touch>, timer: Timer) -> Option<f64> {
    let ticks = match timer {
        Timer::Found(micros) => micros,
        Timer::Fine | Timer::Unknown => 0.0,
    };
    let times = touches.into_iter().flat_map(|touch| touch.times()).filter_map(|time| time.micros());
    let mut times: Vec<f64> = times.filter(|micros| *micros > 0).map(f64::from).collect();
    times.sort_by(f64::total_cmp);
    let mut interval = RANGE[1];
    while interval >= READINGS.max(2.5 * ticks) {
        let at = |interval: f64| {
            let [from, to] =
                [FROM, TICKS].map(|readings| times.partition_point(|time| *time <= (readings - 0.5) * interval));
            let near = &times[from..to];
            if near.len() < MANY { 0.0 } else { closeness(near, interval) }
        };
        if at(interval) > CLUSTERED {
            let finer = (-600..=20).map(|step| interval * (1.0 + 2e-4 * f64::from(step)));
            return finer.max_by(|a, b| at(*a).total_cmp(&at(*b))).map(usual);
        }
        interval /= 1.0 + 0.2 / TICKS;
    }
    None
}

fn closeness(times: &[f64], resolution: f64) -> f64 {
    let angles = times.iter().map(|time| std::f64::consts::TAU * time / resolution);
    let (cos, sin) = angles.fold((0.0, 0.0), |(cos, sin), angle| {
        let (s, c) = libm::sincos(angle);
        (cos + c, sin + s)
    });
    f64::hypot(cos, sin) / times.len().max(1) as f64
}

/// The nearest number of two digits, if it is within the resolution of the search.
fn usual(resolution: f64) -> f64 {
    let power = 10.0_f64.powf(resolution.log10().floor() - 1.0);
    let rounded = (resolution / power).round() * power;
    if (rounded / resolution - 1.0).abs() < 6e-3 { rounded } else { resolution }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probe::noise::Noise;
    use crate::with;

    /// Touches whose times are spread over some hundred milliseconds.
    fn touches(count: u32, timer: f64) -> Vec<Touch> {
        let spread = |index: u32| Touch::from_micros([0, 7_919 * index % 90_001, 104_729 * index % 210_011]);
        let touches: Vec<Touch> = (1..=count).map(spread).collect();
        with!(Noise::gaussian(1_500.0), timer).add("plate", &touches, 1)
    }

    #[test]
    fn the_resolution_is_that_of_the_timer_and_not_a_part_of_it() {
        // The finer the timer, the fewer times are so short that a whole number of its ticks is exact enough.
        let cases = [(100.0, 3_000), (976.5625, 300), (1_000.0, 300), (2_500.0, 300), (10_000.0, 300), (20_000.0, 300)];
        for (resolution, count) in cases {
            let Timer::Found(found) = timer(&touches(count, resolution)) else { panic!("{resolution}: not found") };
            assert!((found / resolution - 1.0).abs() < 6e-3, "{resolution}: {found}");
        }
        assert_eq!(timer(&touches(300, 1_000.0)), Timer::Found(1_000.0));
    }

    #[test]
    fn readings_that_jitter_are_found_and_times_that_are_read_often_have_none() {
        // Readings every 10 ms, up to 3 ms late, by a clock of 1 ms.
        let late = |index: u32| index * 7_919 % 3_001;
        let read = |index: u32, micros: u32| (micros.div_ceil(10_000) * 10_000 + late(index)) / 1_000 * 1_000;
        let touch = |(index, touch): (u32, &Touch)| {
            let times = touch.times().map(|time| time.micros().unwrap());
            Touch::from_micros([1, 2, 3].map(|finger| read(3 * index + finger, 50_000 + times[finger as usize - 1])))
        };
        let seldom: Vec<Touch> = (0..).zip(&touches(900, 0.0)).map(touch).collect();
        let found = timer(&seldom);
        assert_eq!(found, Timer::Found(1_000.0));
        let interval = readings(&seldom, found).unwrap();
        assert!((interval / 10_000.0 - 1.0).abs() < 0.01, "{interval}");
        for resolution in [0.0, 1_000.0, 2_000.0, 10_000.0] {
            let often = touches(900, resolution);
            assert_eq!(readings(&often, timer(&often)), None, "{resolution}");
        }
    }

    #[test]
    fn times_without_a_timer_have_none_and_few_times_say_nothing() {
        assert_eq!(timer(&touches(300, 0.0)), Timer::Fine);
        assert_eq!(timer(&touches(9, 1_000.0)), Timer::Unknown);
        assert_eq!(timer(&[]), Timer::Unknown);
    }
}
