//! One CARLA server: connections tell the lobby what clients want, and the endpoint does what the
//! lobby says, one thing at a time. The lobby listens while that is under way.

mod first_steps;
mod late_comers;
mod waking;

use std::collections::BTreeMap;
use std::pin::pin;

use tokio::sync::mpsc;
use tokio::task::{JoinError, JoinHandle};
use tokio::time::Instant;

use crate::calls;
use crate::endpoint::Endpoint;
use crate::figures::Figures;
use crate::lobby::{Again, Call, Do, Event, Job, Lobby, Report, Task};
use crate::rpc::{self, Answer, ConnectionId, Outbox, Payload, Refusal, Ticket};
use crate::visited::VisitedTick;

use first_steps::FirstSteps;
pub(crate) use late_comers::LateComers;

/// What connections tell may wait so far; clients that send more are read more slowly.
pub(crate) const EVENTS_MAX: usize = 1_024;

/// The lobby, and what it needs to act.
pub(crate) struct Server {
    lobby: Lobby,
    told: mpsc::Receiver<rpc::Event>,
    /// Calls that come again.
    again: (mpsc::Sender<Call>, mpsc::Receiver<Call>),
    /// Ticks of a world that clients visit.
    visited: Option<mpsc::Receiver<VisitedTick>>,
    outboxes: BTreeMap<ConnectionId, Outbox>,
    /// Where streams are served.
    stream_port: u16,
    late_comers: LateComers,
    first_steps: FirstSteps,
    figures: Figures,
    /// Clients that the figures know of.
    counted: usize,
}

impl Server {
    /// A server for what these connections tell, whose streams have a port of their own.
    pub(crate) fn new(
        lobby: Lobby,
        told: mpsc::Receiver<rpc::Event>,
        stream_port: u16,
        late_comers: LateComers,
        figures: Figures,
    ) -> Self {
        let again = mpsc::channel(EVENTS_MAX);
        let (outboxes, counted) = (BTreeMap::new(), 0);
        let first_steps = FirstSteps::default();
        Self {
            lobby,
            told,
            again,
            visited: None,
            outboxes,
            stream_port,
            late_comers,
            first_steps,
            figures,
            counted,
        }
    }

    /// Serves until nobody can connect any more.
    pub(crate) async fn run(mut self, mut endpoint: Endpoint) {
        let mut next = None;
        self.visited = endpoint.take_visited();
        let mut hosts = endpoint.site.changes();
        loop {
            let event = match next.take() {
                Some(job) => {
                    let begun = Instant::now();
                    let mut work = pin!(perform(&mut endpoint, job));
                    let event = loop {
                        tokio::select! {
                            report = &mut work => break Some(Event::Done(Box::new(report))),
                            event = self.hear() => match event {
                                // Nothing begins before the report.
                                Some(event) => drop(self.take(event)),
                                None => break None,
                            },
                        }
                    };
                    self.figures.job_seconds.observe(begun.elapsed());
                    event
                }
                None => tokio::select! {
                    event = self.hear() => event,
                    // Of idle endpoints too, between two things that clients ask for.
                    Ok(()) = hosts.changed() => {
                        endpoint.move_away().await;
                        continue;
                    }
                    () = reached(endpoint.move_again_at()) => {
                        endpoint.move_away().await;
                        continue;
                    }
                },
            };
            let Some(event) = event else { return };
            next = self.take(event);
        }
    }

    /// What happens next; `None` when nobody can connect any more.
    async fn hear(&mut self) -> Option<Event> {
        loop {
            let due = self.lobby.due();
            let told = tokio::select! {
                // What clients say comes before what they did not say in time.
                biased;
                told = self.told.recv(), if self.lobby.has_room() => told?,
                call = self.again.1.recv() => return call.map(Event::Called),
                Some(tick) = received(&mut self.visited) => return Some(Event::Ticked(tick)),
                () = reached(due) => return Some(Event::Due),
            };
            if let Some(event) = self.admit(told) {
                return Some(event);
            }
        }
    }

    /// What the lobby hears of what a connection tells; nothing of clients that come too late.
    fn admit(&mut self, told: rpc::Event) -> Option<Event> {
        match told {
            rpc::Event::Connected(client, whereabouts, outbox) => {
                self.outboxes.insert(client, outbox);
                let is_late = self.late_comers.take(client, self.lobby.client_count());
                (!is_late).then_some(Event::Connected(client, whereabouts))
            }
            rpc::Event::Called(ticket, request) => {
                self.first_steps.note_call(ticket.client, &request.method);
                let Some(refusal) = self.late_comers.refusal_of(ticket.client) else {
                    return Some(Event::Called(Call { ticket, request, prepared: None }));
                };
                self.answer(&ticket, &Err(refusal));
                None
            }
            rpc::Event::Disconnected(client) => {
                self.outboxes.remove(&client);
                if self.first_steps.note_end(client) {
                    self.tell_other_version();
                }
                let was_late = self.late_comers.forget(client);
                (!was_late).then_some(Event::Disconnected(client))
            }
        }
    }

    /// Says what may have ended a client on the way to its world.
    fn tell_other_version(&self) {
        let (own, other) = (self.lobby.version, self.lobby.version.other());
        tracing::warn!(
            "a client ended before it had its world: this endpoint is for clients of CARLA {}, and \
             those of {} end here; give them one of their own, PORT@{other}",
            own.name(),
            other.name()
        );
    }

    /// Does what the lobby says about an event; gives the job that it begins.
    fn take(&mut self, event: Event) -> Option<Job> {
        let mut job = None;
        let acts = self.lobby.take(event, Instant::now());
        let clients = self.lobby.client_count();
        self.figures.clients.change(clients, std::mem::replace(&mut self.counted, clients));
        for act in acts {
            match act {
                Do::Answer(ticket, answer) => self.answer(&ticket, &answer),
                Do::AnswerLater(ticket, answer) => self.answer_later(ticket, answer),
                Do::CallAgain(ticket, again) => self.call_again(ticket, again),
                Do::Begin(begun) => job = Some(begun),
                Do::Wake(host, port) => drop(tokio::spawn(waking::wake(host, port))),
                Do::BorrowPort(port, client) => {
                    drop(tokio::spawn(client.borrow_port(port, self.stream_port)));
                }
                Do::TellMissing(clients) => {
                    tracing::warn!(clients, "clients that share the clock have not ticked in time");
                }
                Do::TellLoss(loss) => {
                    let (lost_secs, of_secs) = (loss.lost.as_secs_f32(), loss.of.as_secs_f32());
                    tracing::warn!(
                        lost_secs,
                        of_secs,
                        "ticks take longer than their period: the world is slower than time"
                    );
                }
                Do::TellRestless(port) => tracing::warn!(
                    port,
                    "a Traffic Manager is in asynchronous mode while its client ticks, so that cars \
                     are steered at any moment: set_synchronous_mode(True) has it step with each tick"
                ),
            }
        }
        job
    }

    /// Nothing waits for an answer that comes later.
    fn answer_later(&self, ticket: Ticket, answer: JoinHandle<Answer>) {
        let Some(outbox) = self.outboxes.get(&ticket.client).cloned() else { return };
        let figures = self.figures.clone();
        tokio::spawn(async move {
            let answer = joined(answer.await);
            figures.note_answer(&answer);
            outbox.answer(&ticket, &answer);
        });
    }

    /// Nothing waits for what a call needs to be ready.
    fn call_again(&self, ticket: Ticket, Again { request, ready }: Again) {
        let Some(outbox) = self.outboxes.get(&ticket.client).cloned() else { return };
        let calls = self.again.0.clone();
        tokio::spawn(async move {
            match ready.await {
                Ok(prepared) => {
                    let call = Call { ticket, request, prepared: Some(prepared) };
                    // Nobody is served any more otherwise.
                    let _ = calls.send(call).await;
                }
                Err(error) => outbox.answer(&ticket, &joined(Err(error))),
            }
        });
    }

    fn answer(&mut self, ticket: &Ticket, answer: &Answer) {
        self.figures.note_answer(answer);
        if let Err(refusal) = answer
            && self.first_steps.note_refusal(ticket.client)
        {
            tracing::warn!(%refusal, "a client gets no world");
        } else if let (Err(refusal), true) = (answer, ticket.asynchronous) {
            tracing::info!(%refusal, "a call that nobody waits for is refused");
        } else if let (Err(refusal), false) = (answer, self.lobby.version.tells_refusals()) {
            tracing::info!(%refusal, "a call is refused, and its client cannot say why");
        }
        if let Some(outbox) = self.outboxes.get(&ticket.client) {
            outbox.answer(ticket, answer);
        }
    }
}

/// The next of them; without any, never.
async fn received<T>(from: &mut Option<mpsc::Receiver<T>>) -> Option<T> {
    match from {
        Some(from) => from.recv().await,
        None => std::future::pending().await,
    }
}

/// Waits until then; without a time, for ever.
async fn reached(time: Option<Instant>) {
    match time {
        Some(time) => tokio::time::sleep_until(time).await,
        None => std::future::pending().await,
    }
}

/// What a call is answered with that was answered by somebody else.
fn joined(answer: Result<Answer, JoinError>) -> Answer {
    answer.unwrap_or_else(|error| Err(Refusal(format!("there is no answer: {error}"))))
}

/// Does one job.
async fn perform(endpoint: &mut Endpoint, job: Job) -> Report {
    endpoint.begin(job.brief);
    let answer = match job.task {
        Task::Call(request, prepared) => {
            endpoint.bring(prepared);
            let answer = calls::answer(endpoint, &request).await;
            endpoint.pass_on().await;
            let again = endpoint.take_again().map(|ready| Again { request, ready });
            return Report { again, ..endpoint.report(answer) };
        }
        Task::Prepare => endpoint.prepare_tick().await,
        Task::Advance => {
            endpoint.keep_promised_tick().await;
            Ok(Payload::Void)
        }
        Task::TickByItself => endpoint.tick_by_itself().await,
        Task::ShowEpisode => {
            endpoint.show_episode().await;
            Ok(Payload::Void)
        }
        Task::ShowVisited(tick) => endpoint.show_visited(tick).await,
        Task::StandStill => {
            endpoint.show_standstill().await;
            Ok(Payload::Void)
        }
    };
    endpoint.report(answer)
}
