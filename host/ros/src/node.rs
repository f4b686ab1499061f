//! The running node: its topics, and its answers on them.

use crate::chip::{self, ChipEvent, Order};
use crate::clients::{AllClients, Clients};
use crate::decide::Decider;
use crate::follow::{Placed, Step, UNDECIDED};
use crate::open::{Actions, Change, Inputs, Options, Outputs, open, parameters, text};
use crate::participant;
use crate::served::Served;
use crate::switches::Switches;
use crate::thresholds::Thresholds;
use crate::wire::{
    Bool, DiagnosticArray, DiagnosticStatus, Expected, Header, KeyValue, Recognized, ResetDone, Stamped, Text, Touch,
    Verdict,
};
use async_channel::{Receiver, Sender};
use async_signal::{Signal, Signals};
use futures::stream::{self, LocalBoxStream, SelectAll, StreamExt};
use palpate::onboard::effector::{EffectorSettings, Scale};
use palpate::onboard::shared::Touch as Felt;
use ros2_client::action::{CancelHandle, ExecutingGoalHandle, GoalEndStatus, NewGoalHandle};
use ros2_client::builtin_interfaces::Time;
use ros2_client::ros2::LogLevel;
use ros2_client::{Context, Gid, MessageInfo, Node, NodeName, Publisher, ROSTime, RmwRequestId, rosout};
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Time between looks at the switches.
const SWITCHES_EVERY: Duration = Duration::from_millis(20);
/// Time between diagnostics.
const DIAGNOSTICS_EVERY: Duration = Duration::from_secs(1);
/// Time in which a client may ask for the result of its goal, as in rcl.
const RESULT_TIMEOUT: Duration = Duration::from_secs(10);

/// Something for the node to do.
enum Happened {
    Touch(Touch, MessageInfo),
    /// A message of another type than agreed on.
    Malformed(String),
    Reset(RmwRequestId, Expected),
    Goal(NewGoalHandle<Expected>),
    Cancel(CancelHandle),
    Changed(Change),
    Chip(ChipEvent),
    LookAtSwitches,
    Diagnose,
    Signal(Signal),
}

/// Source of verdicts.
enum Recognizing {
    Here(Decider),
    Chip {
        orders: Sender<Order>,
        objects: Vec<String>,
        /// The reason, while the chip cannot be asked.
        trouble: Option<String>,
    },
}

type Goal = ExecutingGoalHandle<Expected>;
type Finished = (Goal, GoalEndStatus, Verdict);

/// Counts for diagnostics.
#[derive(Default)]
struct Counts {
    touches: u64,
    refused: u64,
    malformed: u64,
    lost: u64,
    /// The number of each publisher's last touch.
    last: BTreeMap<Gid, i64>,
    verdicts: u64,
    faults: u64,
    /// Problems since the last diagnostics.
    recent: VecDeque<String>,
}

/// Runs the node until a signal ends it.
///
/// # Errors
/// Why it cannot start, or go on.
pub(crate) fn run(options: Options, signals: Signals) -> Result<(), String> {
    let (changed, changes) = async_channel::unbounded();
    let context = Context::from_domain_participant(participant::join(options.domain)?).map_err(text)?;
    let name = NodeName::new(&options.namespace, &options.name).map_err(text)?;
    let node = context.new_node(name, parameters(&options, changed));
    let mut node = node.map_err(text)?;
    // What was declared is in the options.
    while changes.try_recv().is_ok() {}
    let spinner = node.spinner().map_err(text)?;
    let (inputs, outputs) = open(&mut node, &options)?;
    let (recognizing, heard) = match options.chip {
        None => {
            let model = options.model.clone().ok_or("there is no model")?;
            (Recognizing::Here(Decider::new(model, options.thresholds)?), stream::pending().boxed_local())
        }
        Some((port, baud)) => {
            let model = options.model.clone().map(Served::for_chip).transpose()?;
            let (orders, heard) = chip::start(port, baud, model);
            (
                Recognizing::Chip {
                    orders,
                    objects: Vec::new(),
                    trouble: Some("the chip has not answered yet".into()),
                },
                heard.map(Happened::Chip).boxed_local(),
            )
        }
    };
    let (finished, results) = async_channel::unbounded();
    let mut running = Running {
        node: &node,
        inputs: &inputs,
        outputs: &outputs,
        recognizing,
        switches: Switches::new(settings(options.model.as_ref())),
        thresholds: options.thresholds,
        frame_id: options.frame_id,
        goal: None,
        finished,
        counts: Counts::default(),
    };
    let clients = AllClients::new(&context, &node);
    let happened = happened(&inputs, &clients, changes, heard, signals);
    // Dropped before the node, which then says goodbye to the others.
    let executor = smol::LocalExecutor::new();
    executor.spawn(spinner.spin()).detach();
    executor.spawn(answer(&inputs.actions, &clients.results, results)).detach();
    smol::block_on(executor.run(running.run(happened)))
}

/// Times of the effector for a model.
fn settings(model: Option<&Served>) -> EffectorSettings {
    match model {
        Some(Served::Trees(model)) => EffectorSettings::default().for_model(&model.model(), &Scale::IDENTITY),
        // Switches do not know where the hand is.
        Some(Served::Maps(_)) | None => EffectorSettings::default(),
    }
}

/// Everything that can happen, as it happens.
fn happened<'n>(
    inputs: &'n Inputs,
    clients: &'n AllClients<'n>,
    changes: Receiver<Change>,
    chip: LocalBoxStream<'n, Happened>,
    signals: Signals,
) -> SelectAll<LocalBoxStream<'n, Happened>> {
    let touches = inputs.touches.async_stream().map(|read| match read {
        Ok((touch, info)) => Happened::Touch(touch, info),
        Err(error) => Happened::Malformed(format!("touch: {error}")),
    });
    let resets = inputs.reset.receive_request_stream().then(async |read| {
        clients.reset.wait_until_listening().await;
        match read {
            Ok((id, expected)) => Happened::Reset(id, expected),
            Err(error) => Happened::Malformed(format!("reset: {error}")),
        }
    });
    let goals = stream::unfold(&inputs.actions, move |actions| async move {
        let goal = actions
            .receive_new_goal()
            .await
            .map_or_else(|error| Happened::Malformed(format!("goal of recognize: {error}")), Happened::Goal);
        clients.goals.wait_until_listening().await;
        Some((goal, actions))
    });
    let cancels = stream::unfold(&inputs.actions, move |actions| async move {
        let cancel = actions
            .receive_cancel_request()
            .await
            .map_or_else(|error| Happened::Malformed(format!("cancellation of recognize: {error}")), Happened::Cancel);
        clients.cancellations.wait_until_listening().await;
        Some((cancel, actions))
    });
    stream::select_all([
        touches.boxed_local(),
        resets.boxed_local(),
        goals.boxed_local(),
        cancels.boxed_local(),
        changes.map(Happened::Changed).boxed_local(),
        chip,
        signals.filter_map(async |signal| signal.ok()).map(Happened::Signal).boxed_local(),
        smol::Timer::interval(SWITCHES_EVERY).map(|_| Happened::LookAtSwitches).boxed_local(),
        smol::Timer::interval(DIAGNOSTICS_EVERY).map(|_| Happened::Diagnose).boxed_local(),
    ])
}

/// Sends results, one after another, to clients that ask for them.
async fn answer(actions: &Actions, clients: &Clients<'_>, results: Receiver<Finished>) {
    while let Ok((goal, status, verdict)) = results.recv().await {
        clients.wait_until_listening().await;
        let sent = actions.send_result_response(goal, status, Recognized { verdict });
        let timeout = async {
            smol::Timer::after(RESULT_TIMEOUT).await;
            // Nobody asked: as in rcl, the result is gone.
            Ok(())
        };
        let sent = smol::future::or(sent, timeout).await;
        if let Err(error) = sent {
            eprintln!("palpate-ros: the result of a goal was not sent: {error:?}");
        }
    }
}

/// A node that runs.
struct Running<'n> {
    node: &'n Node,
    inputs: &'n Inputs,
    outputs: &'n Outputs,
    recognizing: Recognizing,
    switches: Switches,
    thresholds: Thresholds,
    frame_id: String,
    goal: Option<Goal>,
    finished: Sender<Finished>,
    counts: Counts,
}

impl Running<'_> {
    async fn run(&mut self, mut happened: SelectAll<LocalBoxStream<'_, Happened>>) -> Result<(), String> {
        if let Recognizing::Here(decider) = &self.recognizing {
            self.say(decider.step()).await;
        }
        while let Some(happened) = happened.next().await {
            match happened {
                Happened::Touch(touch, info) => {
                    self.count_lost(&info);
                    self.touch(&touch).await;
                }
                Happened::Malformed(what) => self.malformed(&what),
                Happened::Reset(id, expected) => {
                    let done = self.reset(&expected).await;
                    let message = done.as_ref().err().cloned().unwrap_or_default();
                    let response = ResetDone { success: done.is_ok(), message };
                    self.note(self.inputs.reset.async_send_response(id, response).await);
                }
                Happened::Goal(goal) => self.begin(goal).await,
                Happened::Cancel(cancel) => self.cancel(&cancel).await,
                Happened::Changed(change) => self.change(change).await,
                Happened::Chip(heard) => self.hear(heard).await,
                Happened::LookAtSwitches => self.look_at_switches().await,
                Happened::Diagnose => self.diagnose().await,
                // The event loop of RustDDS ends where a system call is interrupted.
                Happened::Signal(Signal::Cont) => {
                    return Err(
                        "it was stopped, as by Ctrl-Z, which the connection does not survive: start it again".into()
                    );
                }
                Happened::Signal(_) => break,
            }
        }
        Ok(())
    }

    /// Publishers number their messages: those between the last one and this one did not arrive.
    fn count_lost(&mut self, info: &MessageInfo) {
        let number = info.sequence_number();
        if let Some(last) = self.counts.last.insert(info.publisher_gid(), number) {
            let lost = u64::try_from(number.saturating_sub(last).saturating_sub(1)).unwrap_or(0);
            if lost > 0 {
                self.counts.lost += lost;
                self.problem(format!("{lost} touches were lost on the way"));
            }
        }
    }

    async fn look_at_switches(&mut self) {
        let until = now();
        // All that has arrived comes first: no edge is late because this program was.
        for (finger, switch) in &self.inputs.switches {
            loop {
                match switch.take() {
                    Ok(Some((Bool { data }, info))) => {
                        let stamp = info.source_timestamp().or(info.received_timestamp());
                        self.switches.message(*finger, data, stamp.map_or(until, nanos), now());
                    }
                    Ok(None) => break,
                    Err(error) => self.malformed(&format!("switch of {finger}: {error}")),
                }
            }
        }
        for found in self.switches.poll(until) {
            match found {
                Ok(touch) => {
                    let touch = Touch::from(&touch);
                    self.send(&self.outputs.measured, touch.clone()).await;
                    self.touch(&touch).await;
                }
                Err(fault) => self.fault(format!("switches: {fault}")),
            }
        }
    }

    fn malformed(&mut self, what: &str) {
        self.counts.malformed += 1;
        self.problem(format!("a message that cannot be read: {what}"));
    }

    async fn touch(&mut self, message: &Touch) {
        let step = match &mut self.recognizing {
            Recognizing::Here(decider) => decider.touch(message),
            Recognizing::Chip { trouble: Some(trouble), .. } => refused(trouble.clone()),
            Recognizing::Chip { .. } => match message.felt() {
                Ok(touch) => {
                    self.order(Order::Touch(touch));
                    return;
                }
                Err(error) => refused(error.what().to_owned()),
            },
        };
        self.took(step).await;
    }

    fn order(&mut self, order: Order) {
        if let Recognizing::Chip { orders, .. } = &self.recognizing
            && orders.try_send(order).is_err()
        {
            self.problem("the thread that talks with the chip has ended: start the node again".into());
        }
    }

    /// After a touch.
    async fn took(&mut self, step: Step) {
        self.counts.touches += 1;
        self.counts.refused += u64::from(!step.verdict.refused.is_empty());
        if let Some(goal) = &self.goal {
            let feedback = Recognized { verdict: step.verdict.clone() };
            self.note(self.inputs.actions.publish_feedback(goal.clone(), feedback).await);
        }
        if step.is_decided() {
            self.counts.verdicts += 1;
            self.end(GoalEndStatus::Succeeded, step.verdict.clone());
        }
        self.say(step).await;
    }

    async fn say(&self, step: Step) {
        let header = || Header { stamp: Time::now(), frame_id: self.frame_id.clone() };
        // Before the verdict: who acts on it knows where the object is.
        if let Some(Placed { placement, pose }) = step.placed {
            self.send(&self.outputs.placements, Text { data: placement }).await;
            self.send(&self.outputs.poses, Stamped { header: header(), pose }).await;
        }
        self.send(&self.outputs.texts, Text { data: step.verdict.to_string() }).await;
        self.send(&self.outputs.verdicts, step.verdict).await;
        if let Some(evidence) = step.evidence {
            self.send(&self.outputs.evidence, evidence).await;
        }
        if let Some(approach) = step.approach {
            self.send(&self.outputs.approaches, approach).await;
        }
        if let Some(pose) = step.next_pose {
            self.send(&self.outputs.next_poses, Stamped { header: header(), pose }).await;
        }
    }

    async fn send<M: Serialize>(&self, publisher: &Publisher<M>, message: M) {
        if let Err(error) = publisher.async_publish(message).await {
            eprintln!("palpate-ros: a message was not published: {error}");
        }
    }

    async fn reset(&mut self, expected: &Expected) -> Result<(), String> {
        let step = match &mut self.recognizing {
            Recognizing::Here(decider) => decider.reset(expected)?,
            Recognizing::Chip { trouble: Some(trouble), .. } => return Err(trouble.clone()),
            Recognizing::Chip { .. } if *expected != Expected::default() => {
                return Err("a chip keeps its model's own priors: reset it without objects and weights".into());
            }
            Recognizing::Chip { .. } => {
                self.order(Order::Reset);
                return Ok(());
            }
        };
        self.say(step).await;
        Ok(())
    }

    async fn begin(&mut self, new: NewGoalHandle<Expected>) {
        let actions = &self.inputs.actions;
        let allowed = match (&self.goal, actions.get_new_goal(new.clone())) {
            (Some(_), _) => Err("another goal is under way: cancel it first".into()),
            (None, Some(expected)) => self.reset(&expected).await,
            (None, None) => Err("it is gone".into()),
        };
        if let Err(reason) = allowed {
            self.note(actions.reject_goal(new).await);
            self.problem(format!("a goal of recognize was rejected: {reason}"));
            return;
        }
        let started = match actions.accept_goal(new).await {
            Ok(accepted) => actions.start_executing_goal(accepted).await,
            Err(error) => Err(error),
        };
        match started {
            Ok(goal) => self.goal = Some(goal),
            Err(error) => self.problem(format!("a goal of recognize was not started: {error:?}")),
        }
    }

    async fn cancel(&mut self, cancel: &CancelHandle) {
        let mine = self.goal.as_ref().map(|goal| goal.goal_id()).filter(|goal| cancel.contains_goal(goal));
        self.note(self.inputs.actions.respond_to_cancel_requests(cancel, mine.into_iter()).await);
        if mine.is_some() {
            self.end(GoalEndStatus::Canceled, self.verdict());
        }
    }

    /// The verdict so far, if it is known here.
    fn verdict(&self) -> Verdict {
        match &self.recognizing {
            Recognizing::Here(decider) => decider.step().verdict,
            Recognizing::Chip { .. } => Verdict { verdict: UNDECIDED.into(), ..Verdict::default() },
        }
    }

    /// Ends the goal, if there is one.
    fn end(&mut self, status: GoalEndStatus, verdict: Verdict) {
        if let Some(goal) = self.goal.take() {
            self.note(self.finished.try_send((goal, status, verdict)));
        }
    }

    async fn change(&mut self, change: Change) {
        match change {
            Change::ErrorRate(error_rate) => self.thresholds.error_rate = error_rate,
            Change::MaxTouches(max_touches) => self.thresholds.max_touches = max_touches,
            Change::FrameId(frame_id) => {
                self.frame_id = frame_id;
                return;
            }
            Change::Model(_) => {}
        }
        // What was touched counts under other thresholds, or another model, no more.
        self.end(GoalEndStatus::Aborted, self.verdict());
        let decider = match (&self.recognizing, change) {
            (Recognizing::Here(_), Change::Model(model)) => {
                self.switches = Switches::new(settings(Some(&model)));
                Decider::new(model, self.thresholds)
            }
            (Recognizing::Here(decider), _) => decider.under(self.thresholds),
            (Recognizing::Chip { .. }, Change::Model(model)) => {
                return match model.for_chip() {
                    Ok(model) => self.order(Order::Load(model)),
                    Err(reason) => self.problem(reason),
                };
            }
            (Recognizing::Chip { .. }, _) => return,
        };
        match decider {
            Ok(decider) => {
                self.say(decider.step()).await;
                self.recognizing = Recognizing::Here(decider);
            }
            Err(reason) => self.problem(format!("a parameter was not taken over: {reason}")),
        }
    }

    async fn hear(&mut self, heard: ChipEvent) {
        let Recognizing::Chip { objects, trouble, .. } = &mut self.recognizing else { return };
        *trouble = if let ChipEvent::Lost(error) = &heard { Some(error.clone()) } else { None };
        match heard {
            ChipEvent::Connected(names) => {
                *objects = names;
                rosout!((*self.node), LogLevel::Info, "the chip answers");
            }
            ChipEvent::Step(touch, step) => {
                self.measured(touch).await;
                self.took(*step).await;
            }
            ChipEvent::Refused(touch, reason) => {
                self.measured(touch).await;
                self.took(refused(reason)).await;
            }
            ChipEvent::Before(step) => self.say(*step).await,
            ChipEvent::Fault(fault) => self.fault(format!("chip: {fault}")),
            ChipEvent::Lost(error) => self.problem(error),
        }
    }

    async fn measured(&self, touch: Option<Felt>) {
        if let Some(touch) = touch {
            self.send(&self.outputs.measured, Touch::from(&touch)).await;
        }
    }

    fn fault(&mut self, fault: String) {
        self.counts.faults += 1;
        self.problem(fault);
    }

    /// Something that the user should know, and that does not end the node.
    fn problem(&mut self, problem: String) {
        rosout!((*self.node), LogLevel::Warn, "{problem}");
        eprintln!("palpate-ros: {problem}");
        self.counts.recent.push_back(problem);
        if self.counts.recent.len() > 10 {
            self.counts.recent.pop_front();
        }
    }

    /// A failure of the middleware.
    fn note<E: std::fmt::Debug>(&self, result: Result<(), E>) {
        if let Err(error) = result {
            eprintln!("palpate-ros: {error:?}");
        }
    }

    async fn diagnose(&mut self) {
        let recent: Vec<String> = self.counts.recent.drain(..).collect();
        let (objects, trouble, hardware) = match &self.recognizing {
            Recognizing::Here(decider) => (decider.names(), None, ""),
            Recognizing::Chip { objects, trouble, .. } => (objects.clone(), trouble.clone(), "chip"),
        };
        let (level, message) = match (trouble, recent.last()) {
            (Some(trouble), _) => (2, trouble),
            (None, Some(problem)) => (1, problem.clone()),
            (None, None) => (0, "recognizing".to_owned()),
        };
        let Counts { touches, refused, malformed, lost, verdicts, faults, .. } = &self.counts;
        let values = [
            ("objects", objects.join(", ")),
            ("touches", touches.to_string()),
            ("not counted", refused.to_string()),
            ("lost on the way", lost.to_string()),
            ("verdicts", verdicts.to_string()),
            ("messages that cannot be read", malformed.to_string()),
            ("faults", faults.to_string()),
            ("recent problems", recent.join("; ")),
        ];
        let values = values.map(|(key, value)| KeyValue { key: key.into(), value });
        let status = DiagnosticStatus {
            level,
            name: format!("{}: recognition", self.node.fully_qualified_name().trim_start_matches('/')),
            message,
            hardware_id: hardware.into(),
            values: values.into(),
        };
        let header = Header { stamp: Time::now(), frame_id: String::new() };
        self.send(&self.outputs.diagnostics, DiagnosticArray { header, status: vec![status] }).await;
    }
}

/// A touch that was not counted, where nothing is known of those before.
fn refused(reason: String) -> Step {
    let verdict = Verdict { verdict: UNDECIDED.into(), refused: reason, ..Verdict::default() };
    Step { verdict, ..Step::default() }
}

/// Nanoseconds since 1970.
fn nanos(time: ROSTime) -> u64 {
    u64::try_from(time.to_nanos()).unwrap_or(0)
}

fn now() -> u64 {
    nanos(Time::now().into())
}
