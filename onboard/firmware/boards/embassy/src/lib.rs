//! The parts of the board's program that run anywhere, and so are tested on the machine that builds it:
//! `cargo test --lib --target "$(rustc -vV | sed -n 's/^host: //p')"`.
#![no_std]

use core::future::Future;
use embassy_futures::select::{Either3, select3};
use embassy_time::{Duration, Timer};

/// Sleeps until a switch has moved, bytes have come, or `wait` microseconds are over, as many as
/// [`ProbeStation::wait`](palpate_onboard::station::ProbeStation::wait) says; the bytes, if it was they.
pub async fn sleep<B>(moved: impl Future, bytes: impl Future<Output = B>, wait: u32) -> Option<B> {
    match select3(moved, bytes, Timer::after(Duration::from_micros(wait.into()))).await {
        Either3::Second(bytes) => Some(bytes),
        Either3::First(_) | Either3::Third(()) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::convert::Infallible;
    use core::future::{pending, ready};
    use core::pin::pin;
    use core::task::Poll;
    use embassy_futures::poll_once;
    use embassy_time::{Instant, MockDriver};
    use palpate_onboard::effector::Sensed;
    use palpate_onboard::station::{Board, LONGEST_WAIT, NoStorage, ProbeSettings, ProbeStation};

    /// Switches that nobody touches, and no host.
    struct Quiet;

    impl Board for Quiet {
        type Error = Infallible;

        fn sense(&mut self) -> Sensed {
            Sensed::Nothing(Instant::now().as_micros() as u32)
        }

        fn receive(&mut self, _: &mut [u8]) -> Result<usize, Infallible> {
            Ok(0)
        }

        fn send(&mut self, _: &[u8]) -> Result<(), Infallible> {
            Ok(())
        }
    }

    #[test]
    fn a_board_that_nobody_touches_goes_on_after_a_tenth_of_a_second_and_for_hours() {
        let driver = MockDriver::get();
        let settings = ProbeSettings::default();
        let mut station = ProbeStation::<16>::open(&[], NoStorage, settings);
        let (mut sleeps, mut longest) = (0, 0);
        // Longer than the clock takes to go round.
        while Instant::now() < Instant::from_secs(2 * 3_600) {
            assert_eq!(station.step(&mut Quiet), Ok(None));
            let wait = station.wait(Instant::now().as_micros() as u32);
            let mut asleep = pin!(sleep(pending::<()>(), pending::<()>(), wait));
            assert_eq!(poll_once(asleep.as_mut()), Poll::Pending);
            driver.advance(Duration::from_micros(u64::from(wait) - 1));
            assert_eq!(poll_once(asleep.as_mut()), Poll::Pending);
            driver.advance(Duration::from_micros(1));
            assert_eq!(poll_once(asleep.as_mut()), Poll::Ready(None));
            (sleeps, longest) = (sleeps + 1, wait.max(longest));
        }
        assert_eq!((sleeps, longest), (2 * 3_600 + 1, LONGEST_WAIT), "the tenth of a second, then seconds");
        // What comes first ends it.
        assert_eq!(poll_once(pin!(sleep(pending::<()>(), ready(7), LONGEST_WAIT))), Poll::Ready(Some(7)));
        assert_eq!(poll_once(pin!(sleep(ready(()), pending::<u8>(), LONGEST_WAIT))), Poll::Ready(None));
    }
}
