//! Who plays whom in a replay.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use recording::{Add, Attribute, Class, Index, Parent};
use schemas::{ActorId, Attachment, AttachmentKind, BodyCommand, BodySwitch, Command, Pose, Vec3};

use super::orders::{location_of, pose_at};
use crate::catalogue;
use crate::dialect::{ActorDescription, AttributeValue};
use crate::endpoint::Endpoint;
use crate::episode::Episode;
use crate::rpc::Refusal;

/// Where new actors come into the world, as in CARLA: above everything, side by side.
const HEIGHT_M: f32 = 1_000.0;
const SPACING_M: f32 = 30.0;
const ROW_LENGTH: usize = 100;

/// An actor of a recording, and who plays it.
#[derive(Clone, Debug)]
pub(super) struct Member {
    /// In the world.
    pub(super) id: ActorId,
    pub(super) class: Class,
    pub(super) is_attached: bool,
    /// Whether it stood in the world already.
    was_there: bool,
}

impl Member {
    /// Whether its physics is off while it is replayed.
    pub(super) fn has_physics(&self) -> bool {
        matches!(self.class, Class::VEHICLE | Class::WALKER)
    }
}

/// Who plays whom, by ids of the recording.
pub(super) struct Cast {
    members: BTreeMap<u32, Member>,
    index: Arc<Index>,
    has_sensors: bool,
}

/// An actor that is about to enter.
pub(super) struct Entry {
    add: Arc<Add>,
    /// In the recording.
    parent: Option<u32>,
}

/// An actor that is being spawned.
struct Entering {
    add: Arc<Add>,
    is_attached: bool,
    /// Whether it is to have the id of the recording.
    has_wish: bool,
    command: Command,
}

impl Entry {
    pub(super) fn new(add: Arc<Add>) -> Self {
        Self { add, parent: None }
    }
}

/// Notes on whom one of those hangs that are about to enter; who is in the world already stays
/// as it is.
pub(super) fn attach(waiting: &mut [Entry], parent: &Parent) {
    if let Some(entry) = waiting.iter_mut().find(|entry| entry.add.id == parent.child) {
        entry.parent = Some(parent.parent);
    }
}

impl Cast {
    pub(super) fn new(index: Arc<Index>, has_sensors: bool) -> Self {
        Self { members: BTreeMap::new(), index, has_sensors }
    }

    /// Of the recording.
    pub(super) fn index(&self) -> &Index {
        &self.index
    }

    pub(super) fn member(&self, id: u32) -> Option<&Member> {
        self.members.get(&id)
    }

    pub(super) fn members(&self) -> impl Iterator<Item = &Member> {
        self.members.values()
    }

    pub(super) fn remove(&mut self, id: u32) -> Option<Member> {
        self.members.remove(&id)
    }

    /// Whether an actor of the recording is replayed.
    pub(super) fn takes(&self, add: &Add, ignores_hero: bool, ignores_spectator: bool) -> bool {
        let is_hero = |one: &Attribute| one.name == "role_name" && one.value == "hero";
        let is = |prefix| add.blueprint.starts_with(prefix);
        !(ignores_hero && add.attributes.iter().any(is_hero)
            || ignores_spectator && is("spectator")
            || !self.has_sensors && is("sensor."))
    }

    /// Who of the living plays an actor: the light or sign at its place, the spectator, or one of
    /// the same id and blueprint that plays nobody else.
    fn living(&self, episode: &Episode, add: &Add) -> Option<ActorId> {
        if add.blueprint == "spectator" {
            return episode.spectator;
        }
        if add.blueprint.starts_with("traffic.") {
            let place = whole(location_of(add));
            let stands_there = |actor: &&schemas::ActorState| {
                let is_sign = matches!(
                    actor.kind,
                    schemas::ActorKind::TrafficLight | schemas::ActorKind::TrafficSign
                );
                is_sign && whole(super::orders::centimetres(&actor.world_from_actor)) == place
            };
            return episode.frame.actors.iter().find(stands_there).map(|actor| actor.id);
        }
        let id = ActorId::new(add.id)?;
        let is_same = episode.actor(id)?.description.type_id == add.blueprint;
        let plays_already = self.members.values().any(|member| member.id == id);
        (is_same && !plays_already && episode.state(id).is_some()).then_some(id)
    }

    /// The place of an actor that is attached, on its carrier. Recordings have that of actors which
    /// were there from the start in the world.
    fn place_of(&self, entry: &Entry, adds: &BTreeMap<u32, Arc<Add>>) -> Pose {
        let pose = pose_at(entry.add.location, entry.add.rotation);
        let carrier = entry.parent.and_then(|parent| adds.get(&parent));
        match carrier.filter(|_| self.index.was_there_at_start(entry.add.id)) {
            Some(carrier) => pose_at(carrier.location, carrier.rotation).inverse() * pose,
            None => pose,
        }
    }
}

/// Each coordinate cut to whole centimetres, as CARLA compares them.
fn whole(place: [f32; 3]) -> [i64; 3] {
    place.map(|number| number as i64)
}

impl Endpoint {
    /// Brings actors into the world, first those that stand on their own.
    pub(super) async fn enter(
        &mut self,
        cast: &mut Cast,
        entries: Vec<Entry>,
    ) -> Result<(), Refusal> {
        let adds: BTreeMap<u32, Arc<Add>> =
            entries.iter().map(|entry| (entry.add.id, Arc::clone(&entry.add))).collect();
        let mut rest = entries;
        while !rest.is_empty() {
            let ids: Vec<u32> = rest.iter().map(|entry| entry.add.id).collect();
            let (later, now): (Vec<Entry>, Vec<Entry>) = rest
                .into_iter()
                .partition(|entry| entry.parent.is_some_and(|parent| ids.contains(&parent)));
            // A circle of carriers has no beginning: its actors stay out.
            if now.is_empty() {
                tracing::warn!(count = later.len(), "actors of a recording carry each other");
                return Ok(());
            }
            rest = later;
            self.enter_together(cast, now, &adds).await?;
        }
        Ok(())
    }

    async fn enter_together(
        &mut self,
        cast: &mut Cast,
        entries: Vec<Entry>,
        adds: &BTreeMap<u32, Arc<Add>>,
    ) -> Result<(), Refusal> {
        let (mut entering, mut wished) = (Vec::new(), BTreeSet::new());
        for entry in entries {
            let add = &entry.add;
            if let Some(id) = cast.living(self.episode()?, add) {
                let member = Member { id, class: add.class, is_attached: false, was_there: true };
                cast.members.insert(add.id, member);
                self.hold_still(id, add.class)?;
                continue;
            }
            let parent = entry.parent.and_then(|parent| Some(cast.member(parent)?.id));
            let (place, attachment) = match parent {
                Some(parent) => {
                    let attachment = Attachment { parent, kind: AttachmentKind::Rigid };
                    (cast.place_of(&entry, adds), Some(attachment))
                }
                None => (waiting_place(entering.len()), None),
            };
            let id = self.wish(add, parent).filter(|id| wished.insert(*id));
            match spawn(add, place, attachment, id) {
                Some(command) => {
                    let (add, is_attached) = (entry.add, parent.is_some());
                    entering.push(Entering { add, is_attached, has_wish: id.is_some(), command });
                }
                None => {
                    let (id, blueprint) = (add.id, &add.blueprint);
                    tracing::debug!(id, blueprint, "an actor of a recording is left out");
                }
            }
        }
        // The others have the ids that are left.
        entering.sort_by_key(|one| !one.has_wish);
        self.spawn_all(cast, entering).await
    }

    /// The id of the recording, if an actor can have it here.
    fn wish(&self, add: &Add, parent: Option<ActorId>) -> Option<ActorId> {
        let id = ActorId::new(add.id).filter(|id| Some(*id) > parent)?;
        let attributes = add.attributes.iter().map(|one| (one.name.as_str(), one.value.as_str()));
        let lives = self.episode.as_ref()?.frame.actor(id).is_some();
        (!lives && self.given.suits(id, &add.blueprint, attributes)).then_some(id)
    }

    async fn spawn_all(&mut self, cast: &mut Cast, entering: Vec<Entering>) -> Result<(), Refusal> {
        let commands = entering.iter().map(|one| one.command.clone()).collect();
        let replies = self.run_now(commands).await?;
        let mut new = Vec::new();
        for (Entering { add, is_attached, .. }, reply) in entering.into_iter().zip(replies) {
            let (class, blueprint) = (add.class, &add.blueprint);
            match reply {
                Ok(Some(id)) => {
                    let member = Member { id, class, is_attached, was_there: false };
                    cast.members.insert(add.id, member);
                    new.push(id);
                    self.hold_still(id, class)?;
                    if !is_attached {
                        let reference_from_actor = pose_at(add.location, add.rotation);
                        let order = BodyCommand::SetPose { actor: id, reference_from_actor };
                        self.pending.push(Command::Body(order));
                    }
                }
                Ok(None) => {}
                Err(error) => tracing::warn!(blueprint, %error, "an actor is not replayed"),
            }
        }
        if new.is_empty() {
            return Ok(());
        }
        self.flush().await?;
        self.learn(new).await
    }

    /// A replayed vehicle or walker stands where it is put.
    fn hold_still(&mut self, actor: ActorId, class: Class) -> Result<(), Refusal> {
        if matches!(class, Class::VEHICLE | Class::WALKER) {
            let off = BodyCommand::SetSwitch { actor, switch: BodySwitch::Physics, on: false };
            self.pending.push(Command::Body(off));
            self.episode()?.note_physics(actor, false);
        }
        Ok(())
    }

    /// Takes an actor out of the world, but for lights, signs and the spectator.
    pub(super) async fn leave(&mut self, member: &Member) -> Result<(), Refusal> {
        let is_of_map = matches!(member.class, Class::TRAFFIC_LIGHT | Class::TRAFFIC_SIGN);
        let is_spectator = self.episode()?.spectator == Some(member.id);
        if is_spectator || (is_of_map && member.was_there) {
            return Ok(());
        }
        self.run_now(vec![Command::DestroyActor { actor: member.id }]).await?;
        self.forget(member.id);
        Ok(())
    }
}

/// Side by side, so that nobody stands in anybody.
fn waiting_place(index: usize) -> Pose {
    let [x, y] = [index % ROW_LENGTH, index / ROW_LENGTH].map(|at| at as f32 * SPACING_M);
    Pose::translation(x, y, HEIGHT_M)
}

/// The command that makes an actor of the recording; `None` for what cannot be made here.
fn spawn(
    add: &Add,
    place: Pose,
    attachment: Option<Attachment>,
    id: Option<ActorId>,
) -> Option<Command> {
    let described = |attributes: &[Attribute]| ActorDescription {
        uid: 0,
        type_id: add.blueprint.clone(),
        attributes: attributes.iter().map(attribute_of).collect(),
    };
    // An attribute that this server does not take is left out.
    let is_taken =
        |one: &&Attribute| catalogue::order(&described(std::slice::from_ref(one))).is_ok();
    let attributes: Vec<Attribute> = add.attributes.iter().filter(is_taken).cloned().collect();
    let (blueprint, attributes) = catalogue::order(&described(&attributes)).ok()?;
    Some(Command::SpawnActor {
        blueprint: blueprint.id.clone(),
        reference_from_actor: place,
        linear_velocity_mps: Vec3::zeros(),
        attributes,
        attachment,
        id,
    })
}

fn attribute_of(one: &Attribute) -> AttributeValue {
    AttributeValue { id: one.name.clone(), kind: one.kind, value: one.value.clone() }
}
