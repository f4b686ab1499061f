//! A chip that recognizes by itself, behind a thread: orders in, reports out.

use crate::decide::{behind, with_best};
use crate::follow::Step;
use crate::wire::{Approach, Evidence, Verdict, unit_vectors};
use async_channel::{Receiver, Sender, TryRecvError};
use palpate::Result;
use palpate::chip::{ChipModel, Connection, Emulator, Port, probability};
use palpate::compile::CompiledModel;
use palpate::onboard::shared::Touch;
use palpate::onboard::shared::link::{Decision, Event, HostSettings, VerdictMessage};
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
        let mut line = Line { port, baud, said, load, plans: true, answered: false, decided: false };
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
    /// A touch from here has decided: the next one is of another object.
    decided: bool,
}

impl Line {
    fn tell(&self, heard: ChipEvent) {
        // The node has ended where nobody listens, and so does the thread.
        let _ = self.said.send_blocking(heard);
    }

    /// Opens a session; after the line broke it goes on with the one before, so that no event is taken twice.
    fn open<'c>(&self, before: &'c mut Option<Connection>) -> Result<&'c mut Connection> {
        let transport = self.port.open(self.baud, &Emulator::default())?;
        Ok(match before {
            Some(connection) => {
                connection.reopen(transport)?;
                connection
            }
            None => before.insert(Connection::open(transport, HostSettings::default())?),
        })
    }

    /// Talks until nobody gives orders any more.
    fn serve(&mut self, connection: &mut Connection, orders: &Receiver<Order>) -> Result<()> {
        self.decided = false;
        let mut model = self.model(connection)?;
        loop {
            match orders.try_recv() {
                Ok(Order::Touch(touch)) => self.touch(connection, &model.names, &touch)?,
                Ok(Order::Reset) => {
                    self.decided = false;
                    connection.reset()?;
                    self.tell_before(connection, &model.names)?;
                }
                Ok(Order::Load(load)) => {
                    self.load = Some(load);
                    model = self.model(connection)?;
                }
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Closed) => return Ok(()),
            }
            let Some((event, missed)) = connection.hear(PATIENCE)? else { continue };
            if missed > 0 {
                self.tell(ChipEvent::Fault(format!("{missed} reports of the chip were lost on the way")));
            }
            if event == Event::Started {
                // Perhaps with another model.
                self.decided = false;
                model = self.model(connection)?;
            }
            self.take_event(connection, &model.names, event)?;
        }
    }

    /// Has the chip count a touch. The verdict of the object before stays the last word until then.
    fn touch(&mut self, connection: &mut Connection, names: &[String], touch: &Touch) -> Result<()> {
        if std::mem::take(&mut self.decided) {
            connection.reset()?;
        }
        match connection.touch(touch)? {
            Ok(verdict) => {
                let step = self.step(connection, names, &verdict)?;
                self.decided = step.is_decided();
                self.tell(ChipEvent::Step(None, step.into()));
            }
            Err(refusal) => self.tell(ChipEvent::Refused(None, refusal.to_string())),
        }
        Ok(())
    }

    /// The chip's model, which is loaded if it has another one than it should have.
    fn model(&mut self, connection: &mut Connection) -> Result<ChipModel> {
        if let Some(load) = &self.load {
            let is_there = connection.model()?.is_some_and(|model| model.info.checksum == load.model().checksum());
            if !is_there {
                connection.load(load.bytes(), &())?;
            }
        }
        let model = connection.must_have_model()?;
        (self.plans, self.answered) = (true, true);
        self.tell(ChipEvent::Connected(model.names.clone()));
        self.tell_before(connection, &model.names)?;
        Ok(model)
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
            match connection.next_approach()? {
                Ok(approach) => {
                    let (direction, alignment) = unit_vectors(&approach.middle());
                    let score = f64::from(approach.score) / f64::from(1 << 15);
                    step.approach = Some(Approach { touch, pose: approach.pose, direction, alignment, score });
                }
                Err(_) => self.plans = false,
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
    let verdict = message.decision.name();
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
