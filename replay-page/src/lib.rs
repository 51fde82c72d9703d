//! Frames as one HTML file that plays them in a browser: the map from above, vehicles, people,
//! lights, what happened, and how the ego kept the rules of the road. The file names no other one
//! and asks no server.

mod lights;
mod scores;
mod text;
mod track;

use std::collections::BTreeMap;
use std::io::{self, Write};

use schemas::{ActorId, ActorKind, ActorState, Frame};
use serde_json::{Value, json};

use lights::Lights;
use scores::Scores;
use track::Track;

/// Width at which the map is drawn: its letters are then small beside its roads, and can be read
/// where somebody looks closely.
const MAP_PX: u32 = 10_000;
/// Width at which the whole of it is seen: title, key and scale are read there.
const WHOLE_PX: u32 = 700;
/// Poses of one page, which take some ten bytes each.
const POSES_MAX: usize = 2_000_000;

/// What a page is about.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// Of the program that writes it.
    pub version: String,
    /// Name of the recording.
    pub source: String,
    /// Whom the page follows and scores; without, the first vehicle.
    pub ego: Option<ActorId>,
    /// What clients call actors.
    pub roles: BTreeMap<ActorId, String>,
    /// The places of every so many frames are kept.
    pub every: u32,
}

/// One step of an episode, as a line of JSON tells it.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
pub struct Step {
    /// Simulated seconds after it.
    pub simulation_time: f64,
    /// What was done.
    #[serde(default)]
    pub action: String,
    /// What it was worth.
    #[serde(default)]
    pub reward: f64,
    /// Why the episode ended with it.
    #[serde(default)]
    pub done_reason: Option<String>,
}

/// More than a browser should hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("wanted at most {POSES_MAX} poses of actors, found more: choose a part, or fewer frames")]
pub struct TooLong;

/// A page that is being written.
pub struct Page<'a> {
    map: &'a roads::Map,
    about: About,
    seen: u32,
    poses: usize,
    millis: Vec<i64>,
    tracks: BTreeMap<ActorId, Track>,
    lights: Lights,
    scores: Scores,
    events: Vec<Value>,
    before: Option<Frame>,
}

impl<'a> Page<'a> {
    /// A page without frames.
    pub fn new(map: &'a roads::Map, about: About) -> Self {
        Self {
            map,
            about,
            seen: 0,
            poses: 0,
            millis: Vec::new(),
            tracks: BTreeMap::new(),
            lights: Lights::default(),
            scores: Scores::default(),
            events: Vec::new(),
            before: None,
        }
    }

    /// Adds a frame; they come in the order of their ticks, all of them, so that nothing that
    /// happens is missed.
    ///
    /// # Errors
    /// [`TooLong`].
    pub fn frame(&mut self, frame: &Frame) -> Result<(), TooLong> {
        if let Some(before) = &self.before {
            let happened = mcap_export::events_between(before, frame);
            self.events.extend(
                happened.into_iter().map(
                    |event| json!({"at": millis(frame), "kind": event.kind, "text": event.text}),
                ),
            );
        }
        if self.about.ego.is_none() {
            let is_vehicle = |actor: &&ActorState| actor.kind == ActorKind::Vehicle;
            self.about.ego = frame.actors.iter().find(is_vehicle).map(|ego| ego.id);
        }
        self.scores.frame(frame, millis(frame), self.about.ego);
        if self.seen.is_multiple_of(self.about.every.max(1)) {
            self.keep(frame)?;
        }
        self.seen += 1;
        self.before = Some(frame.clone());
        Ok(())
    }

    fn keep(&mut self, frame: &Frame) -> Result<(), TooLong> {
        let index = self.millis.len();
        self.millis.push(millis(frame));
        for actor in frame.actors.iter().filter(|actor| is_shown(actor)) {
            let track = self.tracks.entry(actor.id).or_insert_with(|| {
                let role = self.about.roles.get(&actor.id).map_or("", String::as_str);
                Track::begin(index, actor, frame.type_of(actor), role)
            });
            track.put(actor);
            self.poses += 1;
        }
        self.lights.frame(frame, index);
        if self.poses > POSES_MAX { Err(TooLong) } else { Ok(()) }
    }

    /// How many frames can be shown.
    pub fn frames(&self) -> usize {
        self.millis.len()
    }

    /// Writes the file, with the steps of the episode.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn finish(self, steps: &[Step], out: &mut impl Write) -> io::Result<()> {
        let tracks: Vec<Value> =
            self.tracks.iter().map(|(id, track)| track.told(id.get())).collect();
        let data = json!({
            "version": self.about.version,
            "source": self.about.source,
            "map": self.map.name(),
            "ego": self.about.ego.map(ActorId::get),
            "millis": self.millis,
            "actors": tracks,
            "lights": self.lights.told(),
            "scores": self.scores.told(),
            "events": self.events,
            "steps": steps,
        });
        let map = roads::picture::draw_with_caption(self.map, MAP_PX, WHOLE_PX);
        out.write_all(text::page(&self.about.source, &map, &data).as_bytes())
    }
}

/// Whether an actor is on the page by itself.
fn is_shown(actor: &ActorState) -> bool {
    let is_body = matches!(actor.kind, ActorKind::Vehicle | ActorKind::Walker | ActorKind::Prop);
    is_body && actor.parent.is_none()
}

fn millis(frame: &Frame) -> i64 {
    (frame.sim_secs * 1_000.0).round() as i64
}

#[cfg(test)]
mod tests {
    use schemas::{Collision, MapRef, Pose, RulesBroken, Vec3, WorldId};

    use super::*;

    fn id(number: u32) -> ActorId {
        ActorId::new(number).unwrap()
    }

    fn frame(sim_secs: f64, cars: &[(u32, f32)]) -> Frame {
        let state = |&(number, x): &(u32, f32)| {
            let pose = Pose::translation(x, 2.0, 0.0);
            ActorState::at_rest(id(number), ActorKind::Vehicle, 0, pose)
        };
        let map = MapRef { name: "Town01".to_owned(), digest: String::new() };
        Frame {
            sim_secs,
            types: vec!["vehicle.audi.tt".to_owned()],
            actors: cars.iter().map(state).collect(),
            ..Frame::empty(WorldId::new(1).unwrap(), map)
        }
    }

    fn page_of(frames: &[Frame], about: About, steps: &[Step]) -> (String, Value) {
        let map = roads::Map::parse("Town01", &roads::town::build("Town01").unwrap()).unwrap();
        let mut page = Page::new(&map, about);
        frames.iter().for_each(|frame| page.frame(frame).unwrap());
        let mut out = Vec::new();
        page.finish(steps, &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let (_, rest) = text.split_once("<script type=\"application/json\" id=\"data\">").unwrap();
        let (data, _) = rest.split_once("</script>").unwrap();
        let data = serde_json::from_str(data).unwrap();
        (text, data)
    }

    #[test]
    fn lines_of_lanes_are_known_by_their_colour() {
        let (text, _) = page_of(&[frame(0.0, &[])], About::default(), &[]);
        let (_, rest) = text.split_once("LANE_LINE = \"").unwrap();
        let (colour, _) = rest.split_once('"').unwrap();
        assert!(text.contains(&format!(" stroke=\"{colour}\"")), "{colour}");
    }

    #[test]
    fn the_key_of_the_map_is_read_where_the_whole_of_it_is_seen() {
        let (page, _) = page_of(&[frame(0.0, &[(7, 0.0)])], About::default(), &[]);
        let (_, rest) = page.split_once("viewBox=\"").unwrap();
        let numbers = rest.split_once('"').unwrap().0.split(' ').map(|it| it.parse().unwrap());
        let [_, top, width, height]: [f64; 4] = numbers.collect::<Vec<_>>().try_into().unwrap();
        // North is up: the strip with the key is below the land, whose top is as far from the map.
        let map = roads::Map::parse("Town01", &roads::town::build("Town01").unwrap()).unwrap();
        let (min, max) = map.bounds().unwrap();
        let land = max.y - min.y + 2.0 * (-top - max.y);
        let strip_px = (height - land) / width * f64::from(WHOLE_PX);
        assert!(strip_px >= 64.0, "{strip_px} pixels");
    }

    #[test]
    fn places_are_kept_of_every_nth_frame_and_what_happens_of_all() {
        let mut frames: Vec<Frame> =
            (0..5u8).map(|k| frame(f64::from(k) * 0.05, &[(7, f32::from(k))])).collect();
        frames[3].collisions.push(Collision {
            actor: id(7),
            other: None,
            started: true,
            position_m: Vec3::zeros(),
            impulse_ns: Vec3::zeros(),
            closing_speed_mps: 4.0,
        });
        let broken = RulesBroken {
            actor: id(7),
            red_lights: 1,
            stop_signs: 0,
            right_of_way: 0,
            crossings: 0,
        };
        frames[4].rules_broken.push(broken);
        let (_, data) = page_of(&frames, About { every: 2, ..About::default() }, &[]);
        assert_eq!(data["millis"], json!([0, 100, 200]));
        assert_eq!(data["actors"][0]["x"], json!([0, 200, 200]));
        assert_eq!(data["ego"], 7);
        let event = &data["events"][0];
        assert_eq!((&event["at"], &event["kind"]), (&json!(150), &json!("collision")));
        let kept = json!([[0, 0, 0, 0, 0, 0], [150, 1, 0, 0, 0, 0], [200, 1, 1, 0, 0, 0]]);
        assert_eq!(data["scores"], kept);
    }

    #[test]
    fn names_of_strangers_end_no_script() {
        let roles = [(id(7), "</script><script>alert(1)".to_owned())].into();
        let about = About { roles, source: "<b>&\"name".to_owned(), every: 1, ..About::default() };
        let (text, data) = page_of(&[frame(0.0, &[(7, 0.0)])], about, &[]);
        assert!(!text.contains("<script>alert") && !text.contains("<b>&"));
        assert_eq!(data["actors"][0]["role"], "</script><script>alert(1)");
    }

    #[test]
    fn a_page_names_no_other_file_and_no_server() {
        let (text, _) = page_of(&[frame(0.0, &[(7, 0.0)])], About::default(), &[]);
        let apart_from_names = text.replace("http://www.w3.org/2000/svg", "");
        assert!(!apart_from_names.contains("http:") && !apart_from_names.contains("https:"));
        assert!(!text.contains(" src=") && !text.contains("@@"));
    }

    #[test]
    fn steps_of_an_episode_are_on_it() {
        let line = r#"{"simulation_time": 1.5, "action": "observe", "reward": 0.5, "x": 1}"#;
        let step: Step = serde_json::from_str(line).unwrap();
        let (_, data) = page_of(&[frame(0.0, &[])], About::default(), &[step]);
        assert_eq!(data["steps"][0]["reward"], 0.5);
        assert_eq!(data["ego"], Value::Null);
    }
}
