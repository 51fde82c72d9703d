//! Replaying recordings of CARLA's format in the world of an endpoint.
//!
//! [`recording::Player`] says what is to be done at which time, in ids of the recording; `cast`
//! finds or makes the actors for it, `orders` turns what is said into commands. Replayed actors
//! have their physics off: they stand where they are put, and others run into them.

mod cast;
mod exact;
mod orders;

use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::Arc;

use recording::{Event, Player, Position, Span, Step};
use roads::MapLayer;
use schemas::{BodyCommand, BonesChange, Command, TrafficLightCommand, WalkerCommand};

use crate::archive::{Known, OpenError, Opened};
use crate::config::AfterReplays;
use crate::dialect::Transform;
use crate::endpoint::Endpoint;
use crate::rpc::Refusal;
use cast::{Cast, Member};
use exact::Exact;
use orders::Said;

/// The replay of one endpoint, if there is one, and how replays are made.
#[derive(Default)]
pub(crate) struct Replayer {
    options: Options,
    running: Option<Replay>,
    /// Where the frames of the recording lie that was replayed last.
    known: Option<Known>,
}

/// How replays are made, the present one and later ones.
#[derive(Clone, Copy, Debug)]
struct Options {
    factor: f64,
    ignores_hero: bool,
    ignores_spectator: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { factor: 1.0, ignores_hero: false, ignores_spectator: true }
    }
}

struct Replay {
    player: Player<BufReader<File>>,
    cast: Cast,
    said: Said,
    follow: Option<Follow>,
    /// The journal beside the recording.
    exact: Option<Exact>,
    /// Whether the lights stood still before.
    lights_were_frozen: bool,
}

/// Whom the spectator follows.
#[derive(Clone, Copy, Debug)]
struct Follow {
    /// In the recording.
    id: u32,
    actor_from_spectator: Transform,
}

/// What a client wants to see replayed.
#[derive(Clone, Debug)]
pub(crate) struct Order {
    pub(crate) name: String,
    /// From the end, if negative.
    pub(crate) start_secs: f64,
    /// To the end, if not above zero.
    pub(crate) duration_secs: f64,
    /// In the recording; 0 for nobody.
    pub(crate) follow_id: u32,
    pub(crate) has_sensors: bool,
    pub(crate) offset: Transform,
}

impl Replayer {
    /// How fast time goes in replays; CARLA takes any number.
    pub(crate) fn set_factor(&mut self, factor: f64) {
        self.options.factor = factor;
    }

    /// Whether replays leave out actors whose role is `hero`.
    pub(crate) fn set_ignores_hero(&mut self, ignores: bool) {
        self.options.ignores_hero = ignores;
    }

    /// Whether replays leave the spectator alone.
    pub(crate) fn set_ignores_spectator(&mut self, ignores: bool) {
        self.options.ignores_spectator = ignores;
    }

    /// Forgets a replay whose world is gone.
    pub(crate) fn drop_replay(&mut self) {
        self.running = None;
    }
}

impl Options {
    /// The end of the answer to `replay_file`.
    fn text(&self, span: Span) -> String {
        use recording::query::Number;
        let [from, to, total] = [span.from_secs, span.to_secs, span.total_secs].map(Number);
        let mut text = format!("Total time recorded: {total}\n");
        let factor = self.factor;
        text += &format!("Replaying from {from} s - {to} s ({total} s) at {factor:.1}x\n");
        if self.ignores_hero {
            text += "Ignoring Hero vehicle\n";
        }
        if self.ignores_spectator {
            text += "Ignoring Spectator camera\n";
        }
        text
    }
}

impl Endpoint {
    /// Begins a replay, in place of one that is under way; poses come with the next tick. The
    /// answer is CARLA's text, also for files that are missing or no recordings.
    ///
    /// The first time it only has the recording opened, which may take seconds; the call comes
    /// again when that is done.
    ///
    /// # Errors
    /// A name that leads nowhere, a file that cannot be read, and those of the world.
    pub(crate) async fn replay(&mut self, order: Order) -> Result<String, Refusal> {
        self.unless_visiting("nothing is replayed")?;
        self.end_recording().await;
        self.stop_replay(false).await?;
        let path = self.recorder.recordings().path_of(&order.name)?;
        let Some(prepared) = self.take_prepared() else {
            let opening = self.recorder.open(path, self.replayer.known.clone())?;
            self.come_again(opening);
            return Ok(String::new());
        };
        let mut text = format!("Replaying File: {}\n", path.display());
        let opened = match found(&path, prepared.opened.map(|opened| *opened))? {
            Ok(opened) => opened,
            Err(why) => return Ok(text + &why),
        };
        self.replayer.known = Some((opened.version.clone(), Arc::clone(&opened.index)));
        let wanted = opened.reader.header().map.clone();
        if wanted != self.short_map_name() {
            if self.load(&wanted, MapLayer::ALL).await.is_err() {
                return Ok(text + &format!("Could not load mapfile {wanted}\n"));
            }
            text += &format!("Loading map {wanted}\nReplayer will start after map is loaded...\n");
        }
        let span = opened.index.span(order.start_secs, order.duration_secs);
        text += &self.replayer.options.text(span);
        self.begin_replay(opened, span, &order).await?;
        Ok(text)
    }

    /// The name by which recordings know the map.
    pub(crate) fn short_map_name(&self) -> String {
        self.episode.as_ref().map_or_else(String::new, |episode| episode.map_name.clone())
    }

    async fn begin_replay(
        &mut self,
        opened: Opened,
        span: Span,
        order: &Order,
    ) -> Result<(), Refusal> {
        let path = order.name.clone();
        let at_start = Arc::clone(&opened.index);
        let begun = Player::begin(opened.reader, &opened.index, span);
        let begun = begun.map_err(|error| Refusal(format!("recording {path:?}: {error}")))?;
        let Some((player, step)) = begun else {
            tracing::warn!(path, "a recording without frames");
            return Ok(());
        };
        let exact = Exact::of(opened.index.journals());
        let lights_were_frozen = {
            let frame = &self.episode()?.frame;
            frame.traffic_lights.iter().any(|light| light.frozen)
        };
        let follow = (order.follow_id != 0)
            .then_some(Follow { id: order.follow_id, actor_from_spectator: order.offset });
        self.pending.push(Command::TrafficLight(TrafficLightCommand::Freeze { frozen: true }));
        let cast = Cast::new(at_start, order.has_sensors);
        let said = Said::default();
        let mut replay = Replay { player, cast, said, follow, exact, lights_were_frozen };
        self.carry_out(&mut replay, step, false).await?;
        self.flush().await?;
        self.replayer.running = Some(replay);
        Ok(())
    }

    /// Goes on with a replay, before the world ticks by so much.
    pub(crate) async fn play(&mut self, tick_secs: f64) -> Result<(), Refusal> {
        let Some(mut replay) = self.replayer.running.take() else { return Ok(()) };
        let step = match replay.player.advance(tick_secs, self.replayer.options.factor) {
            Ok(step) => step,
            Err(error) => {
                tracing::error!(%error, "a replay ends, as its recording cannot be read");
                return self.end_replay(replay).await;
            }
        };
        let has_ended = step.has_ended;
        self.carry_out(&mut replay, step, true).await?;
        if has_ended {
            return self.end_replay(replay).await;
        }
        self.replayer.running = Some(replay);
        Ok(())
    }

    /// Ends the replay, if there is one. Without `keeps_actors` everything that was still to come
    /// happens to actors first, as in CARLA. With it, and a journal beside the recording, the world
    /// goes on as the recorded one was.
    pub(crate) async fn stop_replay(&mut self, keeps_actors: bool) -> Result<(), Refusal> {
        let Some(mut replay) = self.replayer.running.take() else { return Ok(()) };
        if keeps_actors && self.take_over(&replay).await {
            self.episode()?.release_lights();
            return Ok(());
        }
        if !keeps_actors {
            let events = replay.player.remaining(replay.cast.index());
            self.happen(&mut replay.cast, &events).await?;
        }
        self.end_replay(replay).await?;
        self.flush().await
    }

    /// Does what a step says: actors come and go, all are told what the recording says, and those
    /// that stand on their own are moved.
    async fn carry_out(
        &mut self,
        replay: &mut Replay,
        step: Step,
        moves: bool,
    ) -> Result<(), Refusal> {
        self.happen(&mut replay.cast, &step.events).await?;
        if let Some(exact) = &mut replay.exact {
            exact.note(&step.said);
        }
        let cast = &replay.cast;
        self.say(cast, &mut replay.said, &step.said)?;
        for pose in &step.poses {
            let Some(member) = cast.member(pose.id).filter(|member| !member.is_attached) else {
                continue;
            };
            if self.stands_there(member, pose) {
                continue;
            }
            let velocity = step.velocity(pose.id);
            let speed = replay.said.walker_speed(pose.id);
            self.pending.extend(orders::placed(member, pose, velocity, speed));
        }
        if let Some(follow) = replay.follow.filter(|_| moves) {
            self.follow(cast, &step, follow)?;
        }
        Ok(())
    }

    /// Whether something that does not move by itself is where the recording has it already.
    fn stands_there(&self, member: &Member, recorded: &Position) -> bool {
        let state = self.episode.as_ref().and_then(|episode| episode.state(member.id));
        !member.has_physics()
            && state.is_some_and(|state| state.world_from_actor == orders::pose_of(recorded))
    }

    /// Puts the spectator beside whom it follows.
    fn follow(&mut self, cast: &Cast, step: &Step, follow: Follow) -> Result<(), Refusal> {
        let episode = self.episode()?;
        let recorded = step.poses.iter().find(|pose| pose.id == follow.id);
        let member = cast.member(follow.id).map(|member| member.id);
        let living = member.and_then(|id| episode.state(id));
        let carrier = match (recorded, living) {
            (Some(pose), Some(_)) => orders::pose_of(pose),
            (None, Some(state)) => state.world_from_actor,
            (_, None) => return Ok(()),
        };
        if let Some(actor) = episode.spectator {
            let world_from_actor = carrier * follow.actor_from_spectator.ours();
            self.pending.push(Command::Body(BodyCommand::SetPose {
                actor,
                reference_from_actor: world_from_actor,
            }));
        }
        Ok(())
    }

    /// Replayed vehicles and walkers are their own again and stand, or vehicles drive on; lights
    /// take their turns.
    async fn end_replay(&mut self, replay: Replay) -> Result<(), Refusal> {
        tracing::info!("a replay ends");
        self.episode()?.release_lights();
        if !replay.lights_were_frozen {
            self.pending.push(Command::TrafficLight(TrafficLightCommand::Freeze { frozen: false }));
        }
        for walker in &replay.said.posed {
            let change = BonesChange::none();
            self.episode()?.note_bones(*walker, &change);
            self.pending.push(Command::Walker(WalkerCommand::Bones { actor: *walker, change }));
        }
        let drives = self.config.after_replays == AfterReplays::Drive;
        for member in replay.cast.members().filter(|member| member.has_physics()) {
            self.pending.extend(orders::let_go(member, drives));
            self.episode()?.note_physics(member.id, true);
        }
        Ok(())
    }

    /// Carries out what happens to actors.
    async fn happen(&mut self, cast: &mut Cast, events: &[Event]) -> Result<(), Refusal> {
        let options = self.replayer.options;
        let chosen = |add: &recording::Add, cast: &Cast| {
            cast.takes(add, options.ignores_hero, options.ignores_spectator)
        };
        let mut waiting = Vec::new();
        for event in events {
            match event {
                Event::Add(add) if chosen(add, cast) => {
                    waiting.push(cast::Entry::new(Arc::clone(add)));
                }
                Event::Add(_) => {}
                Event::Parent(parent) => cast::attach(&mut waiting, parent),
                Event::Destroy(id) => {
                    self.enter(cast, std::mem::take(&mut waiting)).await?;
                    if let Some(member) = cast.remove(*id) {
                        self.leave(&member).await?;
                    }
                }
            }
        }
        self.enter(cast, waiting).await
    }
}

/// The recording, or CARLA's words for why it is none.
fn found(
    path: &Path,
    opened: Result<Opened, OpenError>,
) -> Result<Result<Opened, String>, Refusal> {
    let told = path.display();
    match opened {
        Ok(opened) => Ok(Ok(opened)),
        Err(OpenError::Foreign) => Ok(Err("File is not a CARLA recorder\n".to_owned())),
        Err(OpenError::Missing) => Ok(Err(format!("File {told} not found on server\n"))),
        Err(OpenError::Io(error)) => Err(Refusal(format!("recording {told}: {error}"))),
    }
}
