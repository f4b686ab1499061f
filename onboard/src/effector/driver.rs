//! Edges in, touches and faults out.

use super::debounce::{Change, Debounce, after};
use super::{Edge, EffectorSettings, Fault, Finger};
use palpate_shared::{ContactTime, Touch};

/// State of the effector within a touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// All fingers are open; the next contact begins a touch.
    Waiting,
    /// At least one finger has touched.
    Touching,
    /// All three have touched; some are still closed.
    Complete,
    /// Time ran out before all three touched, or all opened again; some may still be closed.
    TimedOut,
    /// The touch is over, and the fingers have to be open for [`EffectorSettings::rest`]. Also the state at power-up and after a
    /// touch was dropped: then for [`EffectorSettings::release`], since the approach may still be going on.
    Released,
}

/// More than the timers that can run out at one moment: three for each finger and two for the touch.
const MOST_TIMERS: usize = 16;

/// Microseconds by which a time may be older than the one before, and count as now. Less than a counter of 16 bits goes back
/// when it overflows.
const LATEST: u32 = 1 << 15;

/// The driver without pins or a clock: edges and the time go in, touches and faults come out.
///
/// Results depend on the edges and their times alone, not on how often [`Effector::poll`] is called; but a touch
/// with a missing finger, and faults, are only seen at the first call after they are due.
///
/// Cannot fail or panic with any edges.
#[derive(Clone, Debug)]
pub struct Effector {
    settings: EffectorSettings,
    fingers: [Debounce; 3],
    /// First contacts of the touch in progress.
    contacts: [Option<u32>; 3],
    /// The first contact of the last touch that is over.
    began: u32,
    missing_in_a_row: [u16; 3],
    state: State,
    /// An approach may be going on whose beginning nobody has seen: at power-up, and after a touch was dropped.
    unseen: bool,
    now: Option<u32>,
    /// Since when all fingers have been open, as far as anybody asked.
    open_since: Option<u32>,
    touch: Option<Touch>,
    faults: Faults,
}

/// Faults that have not been reported yet, one per kind and finger.
#[derive(Clone, Copy, Debug)]
struct Faults {
    stuck: [bool; 3],
    bouncing: [bool; 3],
    silent: [bool; 3],
    unreadable: [bool; 3],
    lost: Option<Lost>,
}

/// Reason why times are not known.
#[derive(Clone, Copy, Debug)]
enum Lost {
    Overrun,
    Clock,
}

impl Faults {
    const NONE: Self =
        Self { stuck: [false; 3], bouncing: [false; 3], silent: [false; 3], unreadable: [false; 3], lost: None };

    fn take(&mut self) -> Option<Fault> {
        match self.lost.take() {
            Some(Lost::Overrun) => return Some(Fault::Overrun),
            Some(Lost::Clock) => return Some(Fault::Clock),
            None => {}
        }
        Finger::ALL.into_iter().find_map(|finger| {
            let told = |flags: &mut [bool; 3], fault: Fault| core::mem::take(finger.of(flags)).then_some(fault);
            told(&mut self.bouncing, Fault::Bouncing(finger))
                .or_else(|| told(&mut self.stuck, Fault::Stuck(finger)))
                .or_else(|| told(&mut self.silent, Fault::Silent(finger)))
                .or_else(|| told(&mut self.unreadable, Fault::Unreadable(finger)))
        })
    }
}

impl Effector {
    /// A driver that takes its fingers for open; also in a static.
    pub const fn new(settings: EffectorSettings) -> Self {
        Self {
            settings: settings.in_range(),
            fingers: [Debounce::new(); 3],
            contacts: [None; 3],
            began: 0,
            missing_in_a_row: [0; 3],
            state: State::Released,
            unseen: true,
            now: None,
            open_since: None,
            touch: None,
            faults: Faults::NONE,
        }
    }

    /// Waits as these settings say from now on, also in a touch that is in progress.
    pub fn set(&mut self, settings: EffectorSettings) {
        self.settings = settings.in_range();
    }

    /// Microseconds from `now`, the time of the last [`Effector::poll`], until [`Effector::poll`] has something to do
    /// without an edge; `None`: nothing before the next edge.
    pub fn due(&self, now: u32) -> Option<u32> {
        self.until_timer(now)
    }

    /// State of the effector within a touch, at the last call.
    pub const fn state(&self) -> State {
        self.state
    }

    /// The time of the last call, in microseconds on the clock; none before the first. Cannot fail.
    pub const fn now(&self) -> Option<u32> {
        self.now
    }

    /// Microseconds from the first contact of the touch in progress, or else of the last one that was returned, to the last
    /// call.
    pub(crate) fn since_contact(&self) -> u32 {
        after(self.now.unwrap_or(self.began), self.origin().unwrap_or(self.began))
    }

    /// The level of each finger as of its last edge: whether it is closed.
    pub fn levels(&self) -> [bool; 3] {
        self.fingers.map(|finger| finger.level())
    }

    /// Takes in an edge. An edge older than the last one, or than the last poll, counts as now; one that is older by more than
    /// 33 ms is a [`Fault::Clock`] while a time is running.
    ///
    /// Returns a touch that was over before the edge, if there was one.
    ///
    /// # Errors
    /// A [`Fault`]. The edge has been taken in nevertheless; [`Effector::poll`] returns what else there is.
    pub fn edge(&mut self, edge: Edge) -> Result<Option<Touch>, Fault> {
        self.advance(edge.at);
        if edge.after_loss {
            self.report(Fault::Overrun);
        }
        let at = self.now.unwrap_or(edge.at);
        edge.finger.of(&mut self.fingers).edge(edge.closed, at);
        self.open_since = None;
        self.result()
    }

    /// Lets time pass until `now`. Call it until it returns `Ok(None)`, at least every 35 minutes (2³¹ µs) unless the
    /// state is [`State::Waiting`]: then the time may pass unnoticed.
    ///
    /// # Errors
    /// A [`Fault`].
    pub fn poll(&mut self, now: u32) -> Result<Option<Touch>, Fault> {
        self.advance(now);
        self.result()
    }

    /// Takes in a fault that was seen elsewhere, as by [`Watcher::sense`](super::Watcher::sense):
    /// [`Effector::poll`] reports it in its turn. [`Fault::Overrun`] and [`Fault::Clock`] drop the touch in progress.
    pub fn report(&mut self, fault: Fault) {
        let faults = &mut self.faults;
        let flag = match fault {
            Fault::Stuck(finger) => finger.of(&mut faults.stuck),
            Fault::Bouncing(finger) => finger.of(&mut faults.bouncing),
            Fault::Silent(finger) => finger.of(&mut faults.silent),
            Fault::Unreadable(finger) => finger.of(&mut faults.unreadable),
            Fault::Overrun => return self.lose(Lost::Overrun),
            Fault::Clock => return self.lose(Lost::Clock),
        };
        *flag = true;
    }

    fn result(&mut self) -> Result<Option<Touch>, Fault> {
        match self.touch.take() {
            Some(touch) => Ok(Some(touch)),
            None => self.faults.take().map_or(Ok(None), Err),
        }
    }

    /// Fires the timers that run out until `now`, in their order.
    fn advance(&mut self, now: u32) {
        let runs = self.until_timer(self.now.unwrap_or(now)).is_some();
        // While no timer runs any amount of time may have passed.
        let back = if runs { after(self.now.unwrap_or(now), now) } else { 0 };
        let Some(mut at) = self.now.filter(|_| back <= LATEST) else {
            if self.now.is_some() {
                self.lose(Lost::Clock);
            }
            // The clock starts here.
            self.fingers.iter_mut().for_each(|finger| finger.start(now));
            (self.now, self.open_since) = (Some(now), Some(now));
            return;
        };
        let mut left = if back > 0 { 0 } else { now.wrapping_sub(at) };
        for _ in 0..MOST_TIMERS {
            let Some(due) = self.until_timer(at).filter(|&due| due <= left) else { break };
            at = at.wrapping_add(due);
            left -= due;
            self.fire(at);
        }
        self.now = Some(at.wrapping_add(left));
    }

    /// Microseconds until the next timer runs out.
    fn until_timer(&self, now: u32) -> Option<u32> {
        let settings = &self.settings;
        let fingers = self.fingers.iter().filter_map(|finger| finger.due(now, settings));
        let state = match self.state {
            State::Waiting => None,
            State::Touching => {
                let deadline = self.deadline().filter(|&d| !self.awaits_contact(d)).map(|d| after(d, now));
                let release = self.all_open().then(|| self.until_open_for(settings.release, now));
                deadline.into_iter().chain(release).min()
            }
            State::Complete | State::TimedOut => self.all_open().then_some(0),
            State::Released if self.all_open() => Some(self.until_open_for(self.rest(), now)),
            State::Released => None,
        };
        fingers.chain(state).min()
    }

    fn fire(&mut self, now: u32) {
        for finger in Finger::ALL {
            while let Some(change) = finger.of(&mut self.fingers).fire(now, &self.settings) {
                self.change(finger, change);
            }
        }
        let state = self.state;
        match state {
            State::Touching => {
                let timed_out = self.deadline().is_some_and(|d| !self.awaits_contact(d) && is_past(d, now));
                let released = self.all_open() && self.open_for(self.settings.release, now);
                if timed_out || released || self.contacts.iter().all(Option::is_some) {
                    self.finish();
                }
            }
            State::Complete | State::TimedOut if self.all_open() => self.state = State::Released,
            State::Released if self.all_open() && self.open_for(self.rest(), now) => {
                self.state = State::Waiting;
                self.unseen = false;
            }
            _ => {}
        }
    }

    fn change(&mut self, finger: Finger, change: Change) {
        match change {
            Change::Closed(at) if matches!(self.state, State::Waiting | State::Touching) => {
                self.state = State::Touching;
                finger.of(&mut self.contacts).get_or_insert(at);
            }
            Change::Closed(_) | Change::Opened => {}
            Change::Stuck => *finger.of(&mut self.faults.stuck) = true,
            Change::Bouncing => {
                *finger.of(&mut self.faults.bouncing) = true;
                self.abandon();
            }
        }
    }

    /// Drops the touch in progress, if there is one; the fingers have to open before the next.
    fn abandon(&mut self) {
        if matches!(self.state, State::Waiting | State::Touching) {
            self.contacts = [None; 3];
            self.state = State::Released;
            self.unseen = true;
        }
    }

    /// Drops the touch in progress; also where there was none, one may have begun with what was lost.
    fn lose(&mut self, what: Lost) {
        self.abandon();
        self.unseen = true;
        self.faults.lost = Some(what);
    }

    /// Time that all fingers have to be open before a touch can begin. In an approach they may be for up to `release`.
    const fn rest(&self) -> u32 {
        let EffectorSettings { rest, release, .. } = self.settings;
        if self.unseen && release > rest { release } else { rest }
    }

    fn all_open(&self) -> bool {
        self.fingers.iter().all(Debounce::is_open)
    }

    /// True if the open fingers have been open for this long, counted from the first time that this is asked.
    fn open_for(&mut self, time: u32, now: u32) -> bool {
        after(now, *self.open_since.get_or_insert(now)) >= time
    }

    /// Microseconds until [`Effector::open_for`] is true.
    fn until_open_for(&self, time: u32, now: u32) -> u32 {
        self.open_since.map_or(0, |since| after(since.wrapping_add(time), now))
    }

    /// The first contact of the touch in progress.
    fn origin(&self) -> Option<u32> {
        self.contacts.iter().flatten().copied().reduce(|a, b| if is_past(a, b) { a } else { b })
    }

    /// Time at which the touch in progress times out.
    fn deadline(&self) -> Option<u32> {
        self.origin().map(|origin| origin.wrapping_add(self.settings.timeout))
    }

    /// True if a finger that has not touched yet began to close before the deadline and has not settled.
    fn awaits_contact(&self, deadline: u32) -> bool {
        let awaited = |(finger, contact): (&Debounce, &Option<u32>)| {
            contact.is_none() && finger.closing_since().is_some_and(|since| !is_past(deadline, since))
        };
        self.fingers.iter().zip(&self.contacts).any(awaited)
    }

    fn finish(&mut self) {
        let Some(origin) = self.origin() else { return };
        let times = self.contacts.map(|contact| match contact.map(|at| after(at, origin)) {
            Some(time) if time < self.settings.timeout => ContactTime::from_micros(time),
            _ => ContactTime::MISSING,
        });
        self.contacts = [None; 3];
        self.began = origin;
        let touch = Touch::new(times);
        self.state = if touch.is_full() { State::Complete } else { State::TimedOut };
        for (finger, time) in Finger::ALL.into_iter().zip(times) {
            let missing = finger.of(&mut self.missing_in_a_row);
            *missing = if time.is_missing() { missing.saturating_add(1) } else { 0 };
            if self.settings.silent_after > 0 && *missing >= self.settings.silent_after {
                *missing = 0;
                *finger.of(&mut self.faults.silent) = true;
            }
        }
        self.touch = Some(touch);
    }
}

/// True if `at` is not after `now`, for times less than 2³¹ apart.
const fn is_past(at: u32, now: u32) -> bool {
    now.wrapping_sub(at) >> 31 == 0
}
