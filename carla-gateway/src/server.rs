//! One CARLA server: connections tell the lobby what clients want, and the endpoint does what the
//! lobby says, one thing at a time. The lobby listens while that is under way.

mod waking;

use std::collections::BTreeMap;
use std::pin::pin;

use tokio::sync::mpsc;
use tokio::task::{JoinError, JoinHandle};
use tokio::time::Instant;

use crate::calls;
use crate::endpoint::Endpoint;
use crate::lobby::{Again, Call, Do, Event, Job, Lobby, Report, Task};
use crate::rpc::{self, Answer, ConnectionId, Outbox, Payload, Refusal, Ticket};

/// What connections tell may wait so far; clients that send more are read more slowly.
pub(crate) const EVENTS_MAX: usize = 1_024;

/// The lobby, and what it needs to act.
pub(crate) struct Server {
    lobby: Lobby,
    told: mpsc::Receiver<rpc::Event>,
    /// Calls that come again.
    again: (mpsc::Sender<Call>, mpsc::Receiver<Call>),
    outboxes: BTreeMap<ConnectionId, Outbox>,
    /// Where streams are served.
    stream_port: u16,
}

impl Server {
    /// A server for what these connections tell, whose streams have a port of their own.
    pub(crate) fn new(lobby: Lobby, told: mpsc::Receiver<rpc::Event>, stream_port: u16) -> Self {
        let again = mpsc::channel(EVENTS_MAX);
        Self { lobby, told, again, outboxes: BTreeMap::new(), stream_port }
    }

    /// Serves until nobody can connect any more.
    pub(crate) async fn run(mut self, mut endpoint: Endpoint) {
        let mut next = None;
        loop {
            let event = match next.take() {
                Some(job) => {
                    let mut work = pin!(perform(&mut endpoint, job));
                    loop {
                        tokio::select! {
                            report = &mut work => break Some(Event::Done(Box::new(report))),
                            event = self.hear() => match event {
                                // Nothing begins before the report.
                                Some(event) => drop(self.take(event)),
                                None => break None,
                            },
                        }
                    }
                }
                None => self.hear().await,
            };
            let Some(event) = event else { return };
            next = self.take(event);
        }
    }

    /// What happens next; `None` when nobody can connect any more.
    async fn hear(&mut self) -> Option<Event> {
        let due = self.lobby.due();
        let is_due = async {
            match due {
                Some(due) => tokio::time::sleep_until(due).await,
                None => std::future::pending().await,
            }
        };
        let told = tokio::select! {
            // What clients say comes before what they did not say in time.
            biased;
            told = self.told.recv(), if self.lobby.has_room() => told?,
            call = self.again.1.recv() => return call.map(Event::Called),
            () = is_due => return Some(Event::Due),
        };
        Some(match told {
            rpc::Event::Connected(client, whereabouts, outbox) => {
                self.outboxes.insert(client, outbox);
                Event::Connected(client, whereabouts)
            }
            rpc::Event::Called(ticket, request) => {
                Event::Called(Call { ticket, request, prepared: None })
            }
            rpc::Event::Disconnected(client) => {
                self.outboxes.remove(&client);
                Event::Disconnected(client)
            }
        })
    }

    /// Does what the lobby says about an event; gives the job that it begins.
    fn take(&mut self, event: Event) -> Option<Job> {
        let mut job = None;
        for act in self.lobby.take(event, Instant::now()) {
            match act {
                Do::Answer(ticket, answer) => self.answer(&ticket, &answer),
                Do::AnswerLater(ticket, answer) => self.answer_later(ticket, answer),
                Do::CallAgain(ticket, again) => self.call_again(ticket, again),
                Do::Begin(begun) => job = Some(begun),
                Do::Wake(host, port) => drop(tokio::spawn(waking::wake(host, port))),
                Do::BorrowPort(port, client) => {
                    drop(tokio::spawn(client.borrow_port(port, self.stream_port)));
                }
                Do::TellLoss(loss) => {
                    let (lost_secs, of_secs) = (loss.lost.as_secs_f32(), loss.of.as_secs_f32());
                    tracing::warn!(
                        lost_secs,
                        of_secs,
                        "ticks take longer than their period: the world is slower than time"
                    );
                }
            }
        }
        job
    }

    /// Nothing waits for an answer that comes later.
    fn answer_later(&self, ticket: Ticket, answer: JoinHandle<Answer>) {
        let Some(outbox) = self.outboxes.get(&ticket.client).cloned() else { return };
        tokio::spawn(async move { outbox.answer(&ticket, &joined(answer.await)) });
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

    fn answer(&self, ticket: &Ticket, answer: &Answer) {
        if let (Err(refusal), true) = (answer, ticket.asynchronous) {
            tracing::debug!(call = ticket.id, %refusal, "a call nobody waits for");
        }
        if let Some(outbox) = self.outboxes.get(&ticket.client) {
            outbox.answer(ticket, answer);
        }
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
    };
    endpoint.report(answer)
}
