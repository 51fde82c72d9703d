//! A world as bytes, and back.
//!
//! Layout: magic, version, XXH3 of the rest, map reference and [`State`] in postcard. The version
//! covers the blueprint table and the physics engine as well: bytes of another version are refused,
//! since a world that goes on differently would be worse than none. The checksum catches damage,
//! not malice; structure is checked after decoding, and a tick that still panics is the service's
//! to contain, like every other.

use std::sync::Arc;

use roads::{EnvironmentObject, MapLayer};
use schemas::{Error, ErrorCode, HiddenScenery, MapRef, WorldId, limits};
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use crate::actor::Actor;
use crate::check;
use crate::sensors::Readings;
use crate::town::Town;
use crate::traffic::Lights;
use crate::world::{State, World};

/// "CWSN".
const MAGIC: [u8; 4] = *b"CWSN";
/// Grows with every change of the state, of the blueprints or of the physics engine.
const VERSION: u32 = 26;
/// Magic, version and checksum.
const HEADER_BYTES: usize = 16;
/// About what a world and each of its actors take, rather more than less.
const WORLD_BYTES: usize = 16 * 1024;
const ACTOR_BYTES: usize = 4 * 1024;

#[derive(Serialize)]
struct Body<'a> {
    map: &'a MapRef,
    state: &'a State,
}

#[derive(Deserialize)]
struct OwnedBody {
    map: MapRef,
    state: State,
}

impl World {
    /// The whole state as bytes, for [`restore`](Self::restore) by the same version.
    ///
    /// - **Cost:** microseconds and a few kilobytes for a car and three pedestrians.
    pub fn snapshot(&self) -> Vec<u8> {
        let body = Body { map: self.map_ref(), state: &self.state };
        // A buffer that grows is copied; memory that is not written costs nothing.
        let capacity = WORLD_BYTES + self.state.actors.len() * ACTOR_BYTES;
        let mut header = Vec::with_capacity(capacity);
        header.resize(HEADER_BYTES, 0);
        let mut bytes = postcard::to_extend(&body, header).expect("a vector takes every byte");
        let (header, rest) = bytes.split_at_mut(HEADER_BYTES);
        header[..4].copy_from_slice(&MAGIC);
        header[4..8].copy_from_slice(&VERSION.to_le_bytes());
        header[8..].copy_from_slice(&xxh3_64(rest).to_le_bytes());
        bytes
    }

    /// A world that goes on bit for bit where the snapshot was taken.
    ///
    /// - **Domain:** `town_of` finds the shared part of a map by name and digest.
    ///
    /// # Errors
    /// `TooLarge` or `InvalidMessage` for bytes that are not a snapshot of this version,
    /// `UnknownMap` when `town_of` has none.
    pub fn restore(
        bytes: &[u8],
        id: WorldId,
        epoch: u64,
        town_of: impl FnOnce(&MapRef) -> Option<Arc<Town>>,
    ) -> Result<Self, Error> {
        let OwnedBody { map, state } = decode(bytes)?;
        let town = town_of(&map).filter(|town| *town.map_ref() == map).ok_or_else(|| {
            Error::new(ErrorCode::UnknownMap, "the snapshot's map is not here")
                .wanted("a map of this service, by name and digest")
                .found(format!("{} {}", map.name, map.digest))
        })?;
        check_state(&state, &town)?;
        Ok(Self { id, epoch, town, state, readings: Readings::default() })
    }
}

fn decode(bytes: &[u8]) -> Result<OwnedBody, Error> {
    if bytes.len() > limits::REQUEST_BYTES_MAX {
        return Err(Error::new(ErrorCode::TooLarge, "the snapshot is too large")
            .wanted(format!("at most {} bytes", limits::REQUEST_BYTES_MAX))
            .found(bytes.len()));
    }
    let header = bytes.split_first_chunk::<HEADER_BYTES>();
    let (header, rest) = header.ok_or_else(|| damaged("it is shorter than its header"))?;
    let (magic, header) = header.split_first_chunk::<4>().ok_or_else(|| damaged("no header"))?;
    let (version, checksum) =
        header.split_first_chunk::<4>().ok_or_else(|| damaged("no header"))?;
    if *magic != MAGIC {
        return Err(damaged("it does not begin with CWSN"));
    }
    let version = u32::from_le_bytes(*version);
    if version != VERSION {
        return Err(Error::new(ErrorCode::InvalidMessage, "a snapshot of another version")
            .wanted(VERSION)
            .found(version));
    }
    if *checksum != xxh3_64(rest).to_le_bytes() {
        return Err(damaged("its checksum does not fit"));
    }
    let (body, left) = postcard::take_from_bytes::<OwnedBody>(rest)
        .map_err(|error| damaged(&format!("its body cannot be read: {error}")))?;
    if left.is_empty() { Ok(body) } else { Err(damaged("there are bytes after its end")) }
}

/// # Errors
/// `InvalidMessage` for a state that no world can have.
fn check_state(state: &State, town: &Town) -> Result<(), Error> {
    check::dt(state.dt_secs)?;
    state.step.checked()?;
    let actors = &state.actors;
    if actors.len() > limits::ACTORS_PER_WORLD_MAX {
        return Err(damaged("it has too many actors"));
    }
    let ordered = actors.windows(2).all(|pair| pair[0].id < pair[1].id);
    let known = actors.last().is_none_or(|actor| actor.id.get() < state.next_actor);
    if !ordered || !known {
        return Err(damaged("its actors are not in order"));
    }
    let plan = &town.traffic;
    if state.traffic.as_ref().is_some_and(|lights| !lights.is_consistent(plan)) {
        return Err(damaged("its traffic lights are not those of the map"));
    }
    let fixed_count = if state.traffic.is_some() { plan.count() } else { 0 };
    let first_spawned = u64::from(state.first_actor.get()) + fixed_count as u64;
    let fixed = u64::from(state.first_actor.get())..first_spawned;
    let is_fixed = |actor: &Actor| fixed.contains(&u64::from(actor.id.get()));
    if actors.iter().any(is_fixed) || u64::from(state.next_actor) < first_spawned {
        return Err(damaged("its actors have the ids of lights and signs"));
    }
    let carried = |actor: &Actor| {
        let in_physics = actor.rigid().is_none_or(|body| state.physics.contains(body));
        actor.is_consistent() && in_physics && state.hangs_well(actor)
    };
    let bodies = actors.iter().filter_map(Actor::rigid).count();
    if bodies != state.physics.body_count() || !actors.iter().all(carried) {
        return Err(damaged("an actor and its body do not fit"));
    }
    let gone = state.traffic.iter().flat_map(Lights::gone);
    let are_hidden = gone.flat_map(|gone| plan.places(gone)).all(|at| state.hidden.contains(*at));
    if !is_of_town(&state.hidden, town) || !are_hidden {
        return Err(damaged("it hides what the map has not"));
    }
    if !state.paint.is_consistent(town.roads.scenery().len()) {
        return Err(damaged("it has paint on what the map has not"));
    }
    if !state.fixtures.is_consistent(&town.scenery, &state.hidden, &state.physics) {
        return Err(damaged("its scenery is not that of the map"));
    }
    if !state.halts_fit() {
        return Err(damaged("somebody is at rest who is not there"));
    }
    if !state.poses_fit() {
        return Err(damaged("somebody is posed as no walker can be"));
    }
    if !state.drivers_fit(town) {
        return Err(damaged("a driver is not on the map's lanes"));
    }
    if !state.sensors.is_consistent(state) {
        return Err(damaged("a sensor is not that of its actor"));
    }
    if !state.sim_secs.is_finite()
        || check::weather(&state.weather).is_err()
        || !actors.iter().all(has_numbers)
    {
        return Err(damaged("a value is not a number"));
    }
    state.check().map_err(|_| damaged("a body is nowhere"))
}

/// Whether all values that decide how an actor goes on are numbers.
fn has_numbers(actor: &Actor) -> bool {
    let walker = actor.walker.as_deref();
    let vehicle = actor.vehicle.as_deref();
    vehicle.is_none_or(|vehicle| vehicle.values().all(f32::is_finite))
        && walker.is_none_or(|walker| walker.values().all(f32::is_finite))
        && actor.outside.values().all(f32::is_finite)
}

/// Whether only things of the town are hidden, and all of the layers that are not loaded.
fn is_of_town(hidden: &HiddenScenery, town: &Town) -> bool {
    let is_shown = |object: &EnvironmentObject| {
        object.goes_with(hidden.layers)
            && object.scenery.is_some_and(|place| !hidden.contains(place))
    };
    let objects = || town.roads.environment_objects().iter();
    hidden.places_end() <= town.roads.place_count()
        && hidden.layers & !MapLayer::ALL == 0
        && (hidden.layers == 0 || !objects().any(is_shown))
}

fn damaged(why: &str) -> Error {
    Error::new(ErrorCode::InvalidMessage, "the snapshot is damaged")
        .wanted("bytes from a snapshot of this version")
        .found(why)
}
