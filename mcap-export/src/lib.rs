//! Frames as a file of the MCAP format, with Foxglove's schemas: what Foxglove, Lichtblick and the
//! `mcap` libraries open; and what such a file holds.
//!
//! [`Exporter`] takes frames in order and writes what each says to topics; `topics` lists them.
//! Everything is in the frame `map`, as OpenDRIVE has it: metres, radians, z up. Times are
//! simulated ones, from tick 0 of the world on, so that equal recordings give equal files.

mod about;
mod boxes;
mod container;
mod convert;
mod done;
mod ego;
mod events;
mod fixed;
mod grid;
mod map_scene;
mod measured;
mod names;
mod pictures;
mod scene;
mod schema;
mod topic;
mod topics;

use std::io::{self, Write};
use std::sync::Arc;

use schemas::{ActorId, ActorKind, ActorState, Frame, Image, Pose, SensorDatum, SharedFrame, Vec3};
use serde_json::{Value, json};

pub use about::{About, Origin};
use container::Writer;
pub use container::{Item, ReadError, Reader};
use convert::{MAP_FRAME, nanos, transform};
pub use done::Done;
use ego::Way;
pub use events::{Event, between as events_between};
use fixed::Fixed;
pub use names::Names;
use names::{Called, Part};
pub use pictures::View;
use scene::Scene;
use topic::Topic;
use topics::{Has, Topics};

/// The attachment from which a recording goes on.
pub const SNAPSHOT: &str = "world.snapshot";
/// The metadata that say when that was.
pub const ORIGIN: &str = "causeway.origin";
/// The topic of exact frames.
pub const FRAMES: &str = "/causeway/frame";
/// The topic of what was done before them.
pub const COMMANDS: &str = "/causeway/commands";
/// Frames with a role of their own in `/tf`, besides the ego's.
const ROLES_MAX: usize = 32;

/// One file that is being written.
pub struct Exporter<W> {
    out: Out<W>,
    map: Arc<roads::Map>,
    about: About,
    scene: Scene,
    called: Called,
    fixed: Fixed,
    way: Way,
    before: Option<SharedFrame>,
    frames: u64,
}

/// Where messages go.
struct Out<W> {
    file: Writer<W>,
    topics: Topics,
}

impl<W: Write> Out<W> {
    fn tell(&mut self, topic: Topic, now: u64, message: &[u8]) -> io::Result<()> {
        match self.topics.channel(topic) {
            Some(channel) => self.file.message(channel, now, message),
            None => Ok(()),
        }
    }

    fn json(&mut self, topic: Topic, now: u64, message: &Value) -> io::Result<()> {
        self.tell(topic, now, message.to_string().as_bytes())
    }

    /// A message of a camera or sensor.
    fn named(
        &mut self,
        path: String,
        schema: (&str, impl FnOnce() -> Value),
        now: u64,
        message: &Value,
    ) -> io::Result<()> {
        let channel = self.topics.named(&mut self.file, path, schema)?;
        self.file.message(channel, now, message.to_string().as_bytes())
    }
}

impl<W: Write> Exporter<W> {
    /// Begins a file with the map.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn begin(sink: W, map: Arc<roads::Map>, about: About) -> io::Result<Self> {
        let mut file = Writer::begin(sink, &format!("causeway {}", about.version))?;
        let has = match (&about.origin, about.is_exact) {
            (Some(_), true) => Has::FramesAndCommands,
            (None, true) => Has::Frames,
            (_, false) => Has::Poses,
        };
        let topics = Topics::open(&mut file, about.names, has)?;
        let name = format!("{}.xodr", map.name());
        file.attach(&name, "application/xml", map.text().as_bytes())?;
        if let Some(origin) = &about.origin {
            file.attach(SNAPSHOT, "application/octet-stream", &origin.snapshot)?;
            file.metadata(ORIGIN, &origin.told())?;
        }
        let (out, called) = (Out { file, topics }, Called::by(about.names));
        let (scene, fixed, way) = Default::default();
        Ok(Self { out, map, about, scene, called, fixed, way, before: None, frames: 0 })
    }

    /// Writes what was done before the next frame.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn done(&mut self, frame: &Frame, done: &Done) -> io::Result<()> {
        if done.is_nothing() {
            return Ok(());
        }
        self.out.json(Topic::Commands, nanos(frame.sim_secs), &done.told())
    }

    /// Writes what a frame says. Frames come in the order of their ticks.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn frame(&mut self, frame: &SharedFrame) -> io::Result<()> {
        let now = nanos(frame.sim_secs);
        let ego = self.ego(frame);
        if self.frames == 0 {
            self.tell_map(frame, now)?;
        }
        self.tell_places(frame, now)?;
        let (out, before) = (&mut self.out, self.before.as_ref());
        out.json(Topic::Actors, now, &self.scene.update(frame, &self.about.roles))?;
        out.json(Topic::Poses, now, &scene::poses(frame))?;
        if before.is_none_or(|before| scene::lights_differ(before, frame)) {
            out.json(Topic::TrafficLights, now, &scene::lights(frame))?;
        }
        if before.is_none_or(|before| before.weather != frame.weather) {
            out.json(Topic::Weather, now, &topics::weather(&frame.weather))?;
        }
        if let Some(before) = before {
            for event in events::between(before, frame) {
                out.json(Topic::Events, now, &events::logged(frame.sim_secs, &event))?;
            }
        }
        out.tell(Topic::Frame, now, &frame.encoded().0)?;
        if let Some(ego) = ego.and_then(|ego| frame.actor(ego)) {
            let at = (self.called.ego_frame(), now);
            for (topic, message) in ego::messages(frame, ego, &self.map, at) {
                out.json(topic, now, &message)?;
            }
        }
        self.before = Some(frame.clone());
        self.frames += 1;
        Ok(())
    }

    /// What does not change.
    fn tell_map(&mut self, frame: &Frame, now: u64) -> io::Result<()> {
        let (out, map) = (&mut self.out, &self.map);
        out.json(Topic::Map, now, &map_scene::of(map, now))?;
        let (name, digest) = (&frame.map.name, &frame.map.digest);
        let told = json!({"name": name, "digest": digest, "text": map.text()});
        out.json(Topic::OpenDrive, now, &told)?;
        if self.about.names != Names::Nuscenes {
            return Ok(());
        }
        if let Some(grid) = grid::Grid::of(map) {
            out.json(Topic::Grid, now, &grid.kinds(now))?;
            out.json(Topic::Drivable, now, &grid.drivable(now))?;
        }
        let ego = self.about.ego.and_then(|ego| frame.actor(ego));
        let Some(ego) = ego else { return Ok(()) };
        out.json(Topic::Car, now, &ego::car(ego, self.called.ego_frame(), now))
    }

    /// Where the ego and others with a role are.
    fn tell_places(&mut self, frame: &Frame, now: u64) -> io::Result<()> {
        let ego = self.ego(frame);
        let mut told = Vec::new();
        if let Some(ego) = ego.and_then(|ego| frame.actor(ego)) {
            let frame_id = self.called.ego_frame();
            told.push(transform(MAP_FRAME, frame_id, &ego.world_from_actor, now));
        }
        let others = self.about.heroes.iter().filter(|id| Some(**id) != ego).take(ROLES_MAX);
        for actor in others.filter_map(|id| frame.actor(*id)) {
            let child = format!("actors/{}", actor.id.get());
            told.push(transform(MAP_FRAME, &child, &actor.world_from_actor, now));
        }
        if told.is_empty() {
            return Ok(());
        }
        self.out.json(Topic::Tf, now, &json!({"transforms": told}))
    }

    /// Where a camera or sensor is: on the ego if that carries it, which is told when it changes.
    fn tell_place(
        &mut self,
        name: &str,
        ego_from_it: Option<&Pose>,
        world_from_it: &Pose,
        now: u64,
    ) -> io::Result<()> {
        let Some(ego_from_it) = ego_from_it else {
            let told = json!({"transforms": [transform(MAP_FRAME, name, world_from_it, now)]});
            return self.out.json(Topic::Tf, now, &told);
        };
        if !self.fixed.is_news(name, ego_from_it) {
            return Ok(());
        }
        let told = transform(self.called.ego_frame(), name, ego_from_it, now);
        self.out.json(Topic::TfStatic, now, &json!({"transforms": [told]}))
    }

    /// The vehicle of the topics below `/ego` in a frame.
    pub fn ego(&self, frame: &Frame) -> Option<ActorId> {
        let is_vehicle = |actor: &&ActorState| actor.kind == ActorKind::Vehicle;
        let first = || frame.actors.iter().find(is_vehicle).map(|actor| actor.id);
        self.about.ego.or_else(first)
    }

    /// Where something is on the ego, if that carries it, also on something else.
    fn ego_from(&self, frame: &Frame, it: Option<ActorId>, world_from_it: &Pose) -> Option<Pose> {
        let ego = self.ego(frame)?;
        let mut carrier = it;
        // Who carries whom is a tree in every frame of a world.
        for _ in 0..frame.actors.len() {
            if carrier == Some(ego) {
                return Some(frame.actor(ego)?.world_from_actor.inverse() * world_from_it);
            }
            carrier = frame.actor(carrier?)?.parent;
        }
        None
    }

    /// Writes the way that the ego's agent takes in a frame, if it leads elsewhere than before;
    /// places in metres, from the ego on.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn way(&mut self, frame: &Frame, places_m: &[Vec3]) -> io::Result<()> {
        let now = nanos(frame.sim_secs);
        match self.way.tell(places_m, now) {
            Some(told) => self.out.json(Topic::Path, now, &told),
            None => Ok(()),
        }
    }

    /// Writes a picture of a frame, with where its camera was and how it sees, and `with_boxes`
    /// the outlines of actors.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn picture(
        &mut self,
        frame: &Frame,
        view: &View,
        image: &Image,
        with_boxes: bool,
    ) -> io::Result<()> {
        let Some(place) = view.world_from_optical(frame) else { return Ok(()) };
        let now = nanos(frame.sim_secs);
        let ego_from_it = self.ego_from(frame, view.camera.carrier, &place);
        // Names tell where a camera looks, not how its pictures lie.
        let looks = ego_from_it.map(|optical| optical * pictures::optical_from_camera());
        let name = self.called.name(&view.name, looks.as_ref());
        let frame_id = self.called.optical_frame(&name);
        self.tell_place(&frame_id, ego_from_it.as_ref(), &place, now)?;
        let (part, schema_name, schema) = view.schema();
        let calibration = ("foxglove.CameraCalibration", schema::calibration);
        let told = view.calibration(&frame_id, now);
        let (called, out) = (&self.called, &mut self.out);
        out.named(called.topic(&name, Part::Calibration), calibration, now, &told)?;
        let message = view.message(image, &frame_id, now);
        out.named(called.topic(&name, part), (schema_name, || schema), now, &message)?;
        if !with_boxes {
            return Ok(());
        }
        let told = boxes::of(frame, &view.camera, &place, now);
        let annotations = ("foxglove.ImageAnnotations", schema::annotations);
        out.named(called.topic(&name, Part::Annotations), annotations, now, &told)
    }

    /// Writes what a sensor of this name measured in a frame; obstacles and crossed marks are
    /// events.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn measured(&mut self, frame: &Frame, name: &str, datum: &SensorDatum) -> io::Result<()> {
        let now = nanos(datum.sim_secs);
        let place = &datum.world_from_sensor;
        let ego_from_it = self.ego_from(frame, Some(datum.sensor), place);
        let name = self.called.name(name, ego_from_it.as_ref());
        if let Some(event) = events::of_sensor(datum, &name, Some(frame)) {
            return self.out.json(Topic::Events, now, &event);
        }
        let Some(told) = measured::of(datum, &name, now) else { return Ok(()) };
        // Frames that are passed over do not say where the ego is.
        if self.before.as_ref().is_none_or(|before| before.tick != frame.tick) {
            self.tell_places(frame, now)?;
        }
        self.tell_place(&name, ego_from_it.as_ref(), place, now)?;
        let path = self.called.topic(&name, Part::Measured(told.topic));
        self.out.named(path, (told.schema_name, told.schema), now, &told.message)
    }

    /// How many frames it was given.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Ends the file with its summary and index.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn finish(mut self) -> io::Result<W> {
        let About { version, source, is_exact, .. } = &self.about;
        let mut told = vec![
            ("version", version.clone()),
            ("source", source.clone()),
            ("map", self.map.name().to_owned()),
            ("map_digest", self.map.digest().to_owned()),
            ("exact", is_exact.to_string()),
            ("frames", self.frames.to_string()),
        ];
        if let Some(last) = &self.before {
            told.push(("seed", last.seed.to_string()));
            told.push(("last_tick", last.tick.0.to_string()));
            told.push(("last_state_hash", format!("{:016x}", last.state_hash)));
        }
        self.out.file.metadata("causeway", &told)?;
        self.out.file.finish()
    }
}
