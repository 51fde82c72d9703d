//! Frames as a file of the MCAP format, with Foxglove's schemas: what Foxglove, Lichtblick and the
//! `mcap` libraries open.
//!
//! [`Exporter`] takes frames in order and writes what each says to topics; `topics` lists them.
//! Everything is in the frame `map`, as OpenDRIVE has it: metres, radians, z up. Times are
//! simulated ones, from tick 0 of the world on, so that equal recordings give equal files.

mod container;
mod convert;
mod ego;
mod events;
mod map_scene;
mod measured;
mod pictures;
mod scene;
mod schema;
mod topics;

use std::io::{self, Write};
use std::sync::Arc;

use schemas::{ActorId, ActorKind, ActorState, Image, SensorDatum, SharedFrame};
use serde_json::Value;

use container::Writer;
use convert::{nanos, transforms};
pub use pictures::View;
use scene::Scene;
use topics::{Topic, Topics};

/// What an export is about.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// Of the program that exports.
    pub version: String,
    /// The file that is exported.
    pub source: String,
    /// The vehicle of the topics below `/ego`; `None`: the first vehicle there is.
    pub ego: Option<ActorId>,
    /// Whether the frames are those of the world, to the bit, and not rebuilt.
    pub is_exact: bool,
}

/// One file that is being written.
pub struct Exporter<W> {
    out: Out<W>,
    map: Arc<roads::Map>,
    about: About,
    scene: Scene,
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
        let topics = Topics::open(&mut file, about.is_exact)?;
        let name = format!("{}.xodr", map.name());
        file.attach(&name, "application/xml", map.text().as_bytes())?;
        let (out, scene) = (Out { file, topics }, Scene::default());
        Ok(Self { out, map, about, scene, before: None, frames: 0 })
    }

    /// Writes what a frame says. Frames come in the order of their ticks.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn frame(&mut self, frame: &SharedFrame) -> io::Result<()> {
        let now = nanos(frame.sim_secs);
        let ego = self.ego(frame);
        let out = &mut self.out;
        if self.frames == 0 {
            out.json(Topic::Map, now, &map_scene::of(&self.map, now))?;
            let (name, digest, text) = (&frame.map.name, &frame.map.digest, self.map.text());
            let told = serde_json::json!({"name": name, "digest": digest, "text": text});
            out.json(Topic::OpenDrive, now, &told)?;
        }
        let before = self.before.as_ref();
        out.json(Topic::Actors, now, &self.scene.update(frame))?;
        out.json(Topic::Poses, now, &scene::poses(frame))?;
        if before.is_none_or(|before| scene::lights_differ(before, frame)) {
            out.json(Topic::TrafficLights, now, &scene::lights(frame))?;
        }
        if before.is_none_or(|before| before.weather != frame.weather) {
            out.json(Topic::Weather, now, &topics::weather(&frame.weather))?;
        }
        if let Some(before) = before {
            for event in events::between(before, frame) {
                out.json(Topic::Events, now, &event)?;
            }
        }
        out.tell(Topic::Frame, now, &frame.encoded().0)?;
        if let Some(ego) = ego.and_then(|ego| frame.actor(ego)) {
            for (topic, message) in ego::messages(ego, &self.map, now) {
                out.json(topic, now, &message)?;
            }
        }
        self.before = Some(frame.clone());
        self.frames += 1;
        Ok(())
    }

    /// The vehicle of the topics below `/ego` in a frame.
    pub fn ego(&self, frame: &SharedFrame) -> Option<ActorId> {
        let is_vehicle = |actor: &&ActorState| actor.kind == ActorKind::Vehicle;
        let first = || frame.actors.iter().find(is_vehicle).map(|actor| actor.id);
        self.about.ego.or_else(first)
    }

    /// Writes a picture of a frame, with where its camera was and how it sees.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn picture(&mut self, frame: &SharedFrame, view: &View, image: &Image) -> io::Result<()> {
        let Some(place) = view.world_from_optical(frame) else { return Ok(()) };
        let (now, name, out) = (nanos(frame.sim_secs), &view.name, &mut self.out);
        out.json(Topic::Tf, now, &transforms(&view.frame_id(), &place, now))?;
        let calibration = ("foxglove.CameraCalibration", schema::calibration);
        out.named(format!("/{name}/calibration"), calibration, now, &view.calibration(now))?;
        let (schema_name, schema) = view.schema();
        let message = view.message(image, now);
        out.named(format!("/{name}/image"), (schema_name, || schema), now, &message)
    }

    /// Writes what a sensor of this name measured; obstacles and crossed marks are events.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn measured(&mut self, name: &str, datum: &SensorDatum) -> io::Result<()> {
        let now = nanos(datum.sim_secs);
        if let Some(event) = events::of_sensor(datum, name, self.before.as_deref()) {
            return self.out.json(Topic::Events, now, &event);
        }
        let Some(told) = measured::of(datum, name, now) else { return Ok(()) };
        let place = &datum.world_from_sensor;
        self.out.json(Topic::Tf, now, &transforms(name, place, now))?;
        let (path, schema) = (format!("/{name}/{}", told.topic), (told.schema_name, told.schema));
        self.out.named(path, schema, now, &told.message)
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
