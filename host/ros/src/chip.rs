//! A chip that recognizes by itself, behind a thread: orders in, reports out.

use crate::decide::{behind, with_best};
use crate::follow::{Step, UNDECIDED};
use crate::wire::{Approach, Evidence, Verdict, unit_vectors};
use async_channel::{Receiver, Sender, TryRecvError};
use palpate::chip::{ChipModel, Connection, Emulator, Port, Received, probability};
use palpate::compile::CompiledModel;
use palpate::error::ChipProblem;
use palpate::onboard::shared::Touch;
use palpate::onboard::shared::link::{Command, Decision, Event, HostSettings, Outcome, VerdictMessage};
use palpate::{Error, Result};
use std::sync::Arc;
use std::time::Duration;

/// Time before the line is tried again.
const RETRY: Duration = Duration::from_millis(500);

/// Time that the chip is listened to before there may be another order.
const PATIENCE: Duration = Duration::from_millis(5);

/// Something for the chip to do.
pub(crate) enum Order {
    /// Count a touch.
    Touch(Touch),
    /// Forget all touches.
    Reset,
    /// Use this model, unless it does already.
    Load(Arc<CompiledModel>),
}

/// Message of a chip.
pub(crate) enum ChipEvent {
    /// It answers, and has these objects.
    Connected(Vec<String>),
    /// A touch was counted: with the touch if its own fingers felt it.
    Step(Option<Touch>, Box<Step>),
    /// A touch was not counted, or an order refused, and why.
    Refused(Option<Touch>, String),
    /// State before the next touch, after the beginning of a session or a reset.
    Before(Box<Step>),
    /// Something is wrong with its fingers, the line or an order; the node goes on.
    Fault(String),
    /// It does not answer any more; it is tried again and again.
    Lost(String),
}

/// Starts a thread that talks with the chip at `port`, which is to use the model `load`, if there is one, until nobody gives
/// orders any more.
pub(crate) fn start(port: Port, baud: u32, load: Option<Arc<CompiledModel>>) -> (Sender<Order>, Receiver<ChipEvent>) {
    let (orders, taken) = async_channel::unbounded();
    let (said, heard) = async_channel::unbounded();
    std::thread::spawn(move || {
        let mut line =
            Line { port, baud, said, load, plans: true, answered: false, under_way: 0, decided: false, unasked: false };
        let (mut connection, mut told) = (None, None);
        while !taken.is_closed() {
            match line.open(&mut connection).and_then(|connection| line.serve(connection, &taken)) {
                Ok(()) => return,
                Err(error) => {
                    // Once, however often it is tried.
                    let error = error.to_string();
                    if line.answered || told.as_ref() != Some(&error) {
                        line.tell(ChipEvent::Lost(error.clone()));
                    }
                    (line.answered, told) = (false, Some(error));
                }
            }
            std::thread::sleep(RETRY);
        }
    });
    (orders, heard)
}

struct Line {
    port: Port,
    baud: u32,
    said: Sender<ChipEvent>,
    /// The model that the chip has to have.
    load: Option<Arc<CompiledModel>>,
    /// True unless the chip has said that its model has no plan.
    plans: bool,
    /// Since the last loss.
    answered: bool,
    /// Commands without an outcome.
    under_way: usize,
    /// A touch from here has decided: the next one is of another object.
    decided: bool,
    /// A reset is under way that makes it so.
    unasked: bool,
}

impl Line {
    fn tell(&self, heard: ChipEvent) {
        // The node has ended where nobody listens, and so does the thread.
        let _ = self.said.send_blocking(heard);
    }

    /// Opens a session; after the line broke it goes on with the one before, so that no event is taken twice.
    fn open<'c>(&self, before: &'c mut Option<Connection>) -> Result<&'c mut Connection> {
        let transport = self.port.open(self.baud, &Emulator::default())?;
        if let Some(connection) = before {
            connection.reopen(transport)?;
        } else {
            *before = Some(Connection::open(transport, HostSettings::default())?);
        }
        before.as_mut().ok_or_else(|| ChipProblem::UnexpectedAnswer.into())
    }

    /// Talks until nobody gives orders any more.
    fn serve(&mut self, connection: &mut Connection, orders: &Receiver<Order>) -> Result<()> {
        (self.under_way, self.decided, self.unasked) = (0, false, false);
        let mut model = self.model(connection)?;
        loop {
            // One touch at a time: questions to the chip must be about this one.
            if self.under_way == 0 {
                match orders.try_recv() {
                    Ok(Order::Touch(touch)) => {
                        if std::mem::take(&mut self.decided) {
                            self.submit(connection, Command::Reset)?;
                            self.unasked = true;
                        }
                        self.submit(connection, Command::Touch { touch: (&touch).into(), detail: true })?;
                    }
                    Ok(Order::Reset) => {
                        self.decided = false;
                        self.submit(connection, Command::Reset)?;
                    }
                    Ok(Order::Load(load)) => {
                        self.load = Some(load);
                        model = self.model(connection)?;
                    }
                    Err(TryRecvError::Empty) => {}
                    Err(TryRecvError::Closed) => return Ok(()),
                }
            }
            if let Some(received) = connection.hear(PATIENCE)? {
                self.take(connection, &model.names, received)?;
            }
        }
    }

    fn submit(&mut self, connection: &mut Connection, command: Command<'_>) -> Result<()> {
        // There is room: at most two are under way.
        self.under_way += usize::from(connection.submit(command)?);
        Ok(())
    }

    /// The chip's model, which is loaded if it has another one than it should have.
    fn model(&mut self, connection: &mut Connection) -> Result<ChipModel> {
        if let Some(load) = &self.load {
            let is_there = connection.model().is_ok_and(|model| model.info.checksum == load.model().checksum());
            if !is_there {
                connection.load(load.bytes(), &())?;
            }
        }
        let model = connection.model()?;
        (self.plans, self.answered) = (true, true);
        self.tell(ChipEvent::Connected(model.names.clone()));
        self.tell_before(connection, &model.names)?;
        Ok(model)
    }

    fn take(&mut self, connection: &mut Connection, names: &[String], received: Received) -> Result<()> {
        if matches!(received, Received::Outcome(_)) {
            self.under_way = self.under_way.saturating_sub(1);
        }
        match received {
            Received::Outcome(Outcome::Verdict(verdict)) => {
                let step = self.step(connection, names, &verdict)?;
                self.decided = step.is_decided();
                self.tell(ChipEvent::Step(None, step.into()));
            }
            Received::Outcome(Outcome::Refused(refusal)) => self.tell(ChipEvent::Refused(None, refusal.to_string())),
            // Of a reset that nobody ordered: the verdict stays the last word until the next touch.
            Received::Outcome(_) if std::mem::take(&mut self.unasked) => {}
            Received::Outcome(_) => self.tell_before(connection, names)?,
            Received::Event(event, missed) => {
                if missed > 0 {
                    self.tell(ChipEvent::Fault(format!("{missed} reports of the chip were lost on the way")));
                }
                self.take_event(connection, names, event)?;
            }
        }
        Ok(())
    }

    fn take_event(&mut self, connection: &mut Connection, names: &[String], event: Event) -> Result<()> {
        match event {
            Event::Touch { touch, verdict, .. } => {
                // The chip has begun another object by itself, if one was decided.
                self.decided = false;
                let step = self.step_of_event(connection, names, &verdict)?;
                self.tell(ChipEvent::Step(Some((&touch).into()), step.into()));
            }
            Event::Refused { touch, refusal } => {
                self.tell(ChipEvent::Refused(Some((&touch).into()), refusal.to_string()));
            }
            Event::Fault { kind, finger } => {
                let finger = usize::from(finger);
                let finger = ["first finger", "middle finger", "last finger"].get(finger).copied().unwrap_or("probe");
                self.tell(ChipEvent::Fault(format!("{finger}: {kind}")));
            }
            _ => {}
        }
        Ok(())
    }

    /// Reports the chip's state before the next touch. The chip does not say how many touches it has kept.
    fn tell_before(&mut self, connection: &mut Connection, names: &[String]) -> Result<()> {
        let nothing = VerdictMessage { decision: Decision::Undecided, best: 0, touches: 0, detail: None };
        let step = self.step(connection, names, &nothing)?;
        self.tell(ChipEvent::Before(step.into()));
        Ok(())
    }

    /// A verdict with everything that the chip can be asked about it.
    fn step(&mut self, connection: &mut Connection, names: &[String], message: &VerdictMessage) -> Result<Step> {
        let posteriors = connection.posteriors(names.len())?.into_iter().map(probability).collect::<Vec<f64>>();
        let mut step = spoken(names, message);
        let touch = message.touches;
        step.evidence = Some(Evidence { touch, objects: names.to_vec(), nats: behind(&posteriors) });
        step.verdict.objects = names.to_vec();
        step.verdict = with_best(step.verdict, message.best.into(), posteriors);
        if self.plans && !step.is_decided() {
            match connection.next_approach() {
                Ok(approach) => {
                    let (direction, alignment) = unit_vectors(&approach.middle());
                    let score = f64::from(approach.score) / f64::from(1 << 15);
                    step.approach = Some(Approach { touch, pose: approach.pose, direction, alignment, score });
                }
                Err(error) if is_refused(&error) => self.plans = false,
                Err(error) => return Err(error),
            }
        }
        Ok(step)
    }

    /// The step for a touch of the chip's own fingers. Once the chip has decided, it has begun another object, and can be asked no
    /// more about this one.
    fn step_of_event(&mut self, connection: &mut Connection, names: &[String], said: &VerdictMessage) -> Result<Step> {
        if said.decision == Decision::Undecided { self.step(connection, names, said) } else { Ok(spoken(names, said)) }
    }
}

/// A verdict as the chip says it.
fn spoken(names: &[String], message: &VerdictMessage) -> Step {
    let verdict = match message.decision {
        Decision::Recognized(_) => "recognized",
        Decision::Unknown => "unknown",
        Decision::GaveUp => "gave-up",
        _ => UNDECIDED,
    };
    let object = match message.decision {
        Decision::Recognized(object) => object,
        _ => message.best,
    };
    let mut verdict = Verdict { touch: message.touches, verdict: verdict.into(), ..Verdict::default() };
    if message.touches > 0 {
        verdict.object = names.get(usize::from(object)).cloned().unwrap_or_default();
        verdict.posterior = message.detail.map_or(f64::NAN, |detail| probability(detail.posterior()));
    }
    Step { verdict, ..Step::default() }
}

fn is_refused(error: &Error) -> bool {
    matches!(error.problem(), Some(ChipProblem::Refused(_)))
}
