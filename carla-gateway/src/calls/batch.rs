//! `apply_batch`: many commands in one round trip, one response each.

use std::future::Future;
use std::pin::Pin;

use schemas::{ActorId, Attachment, AttachmentKind, Command, CommandReply};

use super::method::by_function;
use super::{actor, orders, parts, vehicle};
use crate::allowance::Room;
use crate::dialect::{ActorRef, BatchCommand, BatchResponse};
use crate::endpoint::{Endpoint, check};
use crate::rpc::{Answer, Payload, Refusal, Request};

/// Commands inside commands inside commands.
const DEPTH_MAX: usize = 8;

/// Where the responses of a batch come from.
enum Step {
    /// Known already.
    Done(Result<ActorRef, Refusal>),
    /// The next reply of the world.
    Sent(Sent),
}

/// A command that the world has.
enum Sent {
    Change(ActorRef, &'static str),
    Destroy(ActorId),
    Spawn(Vec<BatchCommand>),
}

pub(super) async fn answer(endpoint: &mut Endpoint, request: &Request) -> Answer {
    let (commands, tick) = request.batch()?;
    let responses = run(endpoint, commands, 0).await?;
    if tick && endpoint.settings().synchronous_mode {
        endpoint.tick_for_caller().await?;
    }
    Payload::bare(&responses)
}

/// Responses for all commands of a batch that cannot be carried out: a Traffic Manager waits for
/// as many as it sent.
pub(super) fn refused(request: &Request, refusal: Refusal) -> Answer {
    let count = request.batch::<BatchCommand>().map_or(0, |(commands, _)| commands.len());
    Payload::bare(&vec![BatchResponse(Err(refusal.0)); count])
}

/// A command, or why it is none.
type Wish = Result<BatchCommand, Refusal>;
type Running<'a> = Pin<Box<dyn Future<Output = Result<Vec<BatchResponse>, Refusal>> + Send + 'a>>;

/// Runs all commands in one request to the world, then those that follow the spawned actors.
fn run(endpoint: &mut Endpoint, commands: Vec<Wish>, depth: usize) -> Running<'_> {
    Box::pin(async move {
        let (mut steps, mut sent) = (Vec::with_capacity(commands.len()), Vec::new());
        let mut room = None;
        for command in commands {
            let command = match command {
                Ok(command) => command,
                Err(refusal) => {
                    steps.push(Step::Done(Err(refusal)));
                    continue;
                }
            };
            let function = command.function();
            let prepared = prepare(endpoint, command, &mut room).await;
            let fitting = prepared.and_then(|it| it.order.iter().try_for_each(check).map(|()| it));
            match fitting {
                Ok(Prepared { order: Some(order), step }) => {
                    sent.push(order);
                    steps.push(step);
                }
                Ok(Prepared { order: None, step }) => steps.push(step),
                Err(refusal) => steps.push(Step::Done(Err(by_name(function, refusal)))),
            }
        }
        let replies = if sent.is_empty() { Vec::new() } else { endpoint.run_now(sent).await? };
        let (responses, followers) = settle(endpoint, steps, replies);
        let spawned: Vec<ActorId> = followers.iter().map(|(id, _)| *id).collect();
        if !spawned.is_empty() {
            endpoint.learn(spawned.clone()).await?;
            endpoint.fit_cars(&spawned).await?;
            endpoint.answer_with_next_frame();
        }
        let next: Vec<Wish> = followers
            .into_iter()
            .flat_map(|(id, commands)| {
                commands.into_iter().map(move |command| Ok(addressed(command, id)))
            })
            .collect();
        if !next.is_empty() && depth < DEPTH_MAX {
            for refusal in run(endpoint, next, depth + 1).await?.iter().filter_map(failed) {
                tracing::debug!(refusal, "a command after a spawn was refused");
            }
        }
        Ok(responses)
    })
}

fn failed(response: &BatchResponse) -> Option<&str> {
    response.0.as_ref().err().map(String::as_str)
}

struct Prepared {
    order: Option<Command>,
    step: Step,
}

async fn prepare(
    endpoint: &mut Endpoint,
    command: BatchCommand,
    room: &mut Option<Room>,
) -> Result<Prepared, Refusal> {
    let function = command.function();
    match command {
        BatchCommand::Spawn(spawn) => {
            // CARLA attaches rigidly here, whatever the uninitialised field says.
            let parent = spawn.parent.0.map(actor::parent).transpose()?;
            let attachment =
                parent.map(|parent| Attachment { parent, kind: AttachmentKind::Rigid });
            if spawn.description.type_id.starts_with("sensor.camera.") {
                endpoint.need_renderer().await?;
            }
            let episode = endpoint.episode()?;
            let at = parent.map_or(spawn.transform, |parent| {
                parts::on_socket(episode, parent, &spawn.socket, &spawn.transform)
            });
            let room = match room {
                Some(room) => room,
                None => room.insert(endpoint.room()?),
            };
            let order = actor::spawn_command(endpoint, &spawn.description, &at, attachment, room)?;
            Ok(Prepared { order: Some(order), step: Step::Sent(Sent::Spawn(spawn.do_after)) })
        }
        BatchCommand::Destroy(id) => {
            let actor = id.id().ok_or_else(actor::not_found)?;
            let order = Some(Command::DestroyActor { actor });
            Ok(Prepared { order, step: Step::Sent(Sent::Destroy(actor)) })
        }
        BatchCommand::Physics(id, physics) => {
            let order = vehicle::physics_command(endpoint, id, &physics).await?;
            Ok(Prepared { order: Some(order), step: Step::Sent(Sent::Change(id, function)) })
        }
        other => {
            let id = target(&other);
            Ok(match orders::command(endpoint, &other)? {
                Some(order) => {
                    Prepared { order: Some(order), step: Step::Sent(Sent::Change(id, function)) }
                }
                None => Prepared { order: None, step: Step::Done(Ok(id)) },
            })
        }
    }
}

/// Responses in the order of the commands, and what follows each new actor.
fn settle(
    endpoint: &mut Endpoint,
    steps: Vec<Step>,
    replies: Vec<CommandReply>,
) -> (Vec<BatchResponse>, Vec<(ActorId, Vec<BatchCommand>)>) {
    let mut replies = replies.into_iter();
    let (mut responses, mut followers) = (Vec::with_capacity(steps.len()), Vec::new());
    for step in steps {
        let result = match step {
            Step::Done(result) => result,
            Step::Sent(sent) => match (sent, replies.next()) {
                (_, None) => Err(Refusal("the world service gave no reply".to_owned())),
                (Sent::Spawn(after), Some(Ok(Some(id)))) => {
                    followers.push((id, after));
                    Ok(id.into())
                }
                (Sent::Spawn(_), Some(Err(error))) => Err(actor::spawn_refusal(&error)),
                (Sent::Spawn(_), Some(Ok(None))) => {
                    Err(Refusal("Unknown error while trying to spawn actor".to_owned()))
                }
                (Sent::Destroy(id), Some(Ok(_))) => {
                    endpoint.forget(id);
                    Ok(id.into())
                }
                (Sent::Change(id, _), Some(Ok(_))) => Ok(id),
                (Sent::Destroy(_), Some(Err(_))) => Err(actor::not_found()),
                (Sent::Change(id, function), Some(Err(error))) => {
                    Err(by_function(function, &orders::refusal(&error, id)))
                }
            },
        };
        responses.push(BatchResponse(result.map_err(|refusal| refusal.0)));
    }
    (responses, followers)
}

/// The words of a function for why it refuses a command.
fn by_name(function: &str, refusal: Refusal) -> Refusal {
    match function {
        "spawn_actor" | "destroy_actor" => refusal,
        _ => by_function(function, &refusal),
    }
}

/// Whom a command is about.
fn target(command: &BatchCommand) -> ActorRef {
    let mut command = command.clone();
    target_mut(&mut command).copied().unwrap_or_default()
}

/// The same command about the actor that was just spawned, where it says 0.
fn addressed(mut command: BatchCommand, spawned: ActorId) -> BatchCommand {
    if let Some(id) = target_mut(&mut command)
        && *id == ActorRef::NOBODY
    {
        *id = spawned.into();
    }
    command
}

fn target_mut(command: &mut BatchCommand) -> Option<&mut ActorRef> {
    use BatchCommand as C;
    match command {
        C::Spawn(spawn) => spawn.parent.0.as_mut(),
        C::Console(_) => None,
        C::WalkerState(id, ..)
        | C::Destroy(id)
        | C::Control(id, _)
        | C::Ackermann(id, _)
        | C::WalkerControl(id, _)
        | C::Physics(id, _)
        | C::Transform(id, _)
        | C::TargetVelocity(id, _)
        | C::TargetAngularVelocity(id, _)
        | C::Impulse(id, _)
        | C::Force(id, _)
        | C::AngularImpulse(id, _)
        | C::Torque(id, _)
        | C::SimulatePhysics(id, _)
        | C::EnableGravity(id, _)
        | C::Autopilot(id, _)
        | C::DebugTelemetry(id, _)
        | C::Lights(id, _)
        | C::Location(id, _)
        | C::TrafficLight(id, _) => Some(id),
    }
}
