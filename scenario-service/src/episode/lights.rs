//! The map's traffic lights as the ego meets them: the next one ahead, and those it runs.

use std::sync::{Arc, OnceLock};

use agents::{Network, RedLights};
use schemas::{ActorState, Frame, TrafficLightColour, Vec3};

/// A light farther ahead than this is not told of, in metres.
const AHEAD_M_MAX: f32 = 50.0;
/// A line counts for whoever heads within about 30° of its traffic, or moves within 60° of it.
const HEADING_COS_MIN: f32 = 0.87;
const MOTION_COS_MIN: f32 = 0.5;
/// A vehicle this far beside a lane is still on it, in metres.
const BESIDE_M: f32 = 0.5;

/// Where the lights of a map hold traffic.
#[derive(Clone, Debug, Default)]
pub(super) struct StopLines {
    lines: Vec<StopLine>,
    /// The ways of the map, made when the ego passes a line that several lights have.
    network: Arc<OnceLock<Network>>,
    /// Red lights of such a line, until it is known which of them hold the ego's way.
    passed: Option<RedLights>,
}

/// The end of one lane before one light, world frame.
#[derive(Clone, Debug)]
struct StopLine {
    /// Position of the light in [`Frame::traffic_lights`].
    light: u32,
    middle_m: Vec3,
    /// Unit vector along the traffic.
    along: Vec3,
    half_width_m: f32,
}

/// A light before the ego.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LightAhead {
    pub(super) colour: TrafficLightColour,
    /// From the ego's front to the stop line, in metres.
    pub(super) distance_m: f32,
}

impl StopLines {
    /// Those of a map's lights, in the order in which frames show them.
    pub(super) fn of(map: &roads::Map) -> Self {
        let lights = map.traffic_lights().lights;
        let boxes = (0..).zip(&lights).flat_map(|(light, found)| {
            found.boxes.iter().map(move |trigger| (light, trigger.front))
        });
        let lines = boxes.map(|(light, front)| {
            let pose: schemas::Pose = map.pose(&front).cast();
            StopLine {
                light,
                middle_m: pose.translation.vector,
                along: pose.rotation * Vec3::x(),
                half_width_m: map.lane(&front).width_m as f32 / 2.0,
            }
        });
        Self { lines: lines.collect(), ..Self::default() }
    }

    /// The nearest light ahead on the ego's lane, as long as that goes straight on.
    pub(super) fn ahead(&self, frame: &Frame, ego: &ActorState) -> Option<LightAhead> {
        let position_m = ego.world_from_actor.translation.vector;
        let forward = ego.world_from_actor.rotation * Vec3::x();
        let ahead = self.lines.iter().filter_map(|line| {
            let to_line_m = line.along.dot(&(line.middle_m - position_m));
            let distance_m = to_line_m - ego.box_half_extent_m.x;
            let is_ahead = (0.0..=AHEAD_M_MAX).contains(&distance_m)
                && forward.dot(&line.along) > HEADING_COS_MIN
                && line.is_in_lane(position_m + line.along * to_line_m);
            let colour = frame.traffic_lights.get(line.light as usize)?.colour;
            is_ahead.then_some(LightAhead { colour, distance_m })
        });
        ahead.min_by(|a, b| a.distance_m.total_cmp(&b.distance_m))
    }

    /// How many lights the ego's middle passed in a step that showed red before it and after it; of
    /// several at one line those count that hold the way that it takes, as soon as it is known.
    pub(super) fn run(
        &mut self,
        map: &roads::Map,
        before: (&Frame, Vec3),
        (after, ego): (&Frame, &ActorState),
    ) -> u32 {
        let is_red = |frame: &Frame, light: usize| {
            frame.traffic_lights.get(light).map(|light| light.colour)
                == Some(TrafficLightColour::Red)
        };
        let stays_red =
            |light: u32| is_red(before.0, light as usize) && is_red(after, light as usize);
        let to_m = ego.world_from_actor.translation.vector;
        let passed = self.lines.iter().filter(|line| line.is_passed(before.1, to_m));
        let mut passed: Vec<u32> = passed.map(|line| line.light).collect();
        passed.dedup();
        let mut red = passed.clone();
        red.retain(|light| stays_red(*light));
        if !passed.is_empty() {
            self.passed = None;
        }
        if passed.len() > 1 && !red.is_empty() {
            let network = self.network.get_or_init(|| Network::new(map));
            red.retain(|light| {
                let all = network.sharing(*light);
                if !all.is_empty() {
                    self.passed = Some(RedLights::of(*light, all, stays_red));
                }
                all.is_empty()
            });
        }
        red.len() as u32 + u32::from(self.runs_passed(ego))
    }

    /// Whether it has become clear that red lights of a line that the ego has passed hold its way.
    fn runs_passed(&mut self, ego: &ActorState) -> bool {
        let Some((red, network)) = self.passed.zip(self.network.get()) else { return false };
        let forward = ego.world_from_actor.rotation * Vec3::x();
        let front_m = ego.world_from_actor.translation.vector + forward * ego.box_half_extent_m.x;
        let runs = red.hold_way(network, &front_m, &forward);
        if runs.is_some() {
            self.passed = None;
        }
        runs == Some(true)
    }
}

impl StopLine {
    fn is_passed(&self, from_m: Vec3, to_m: Vec3) -> bool {
        let way = to_m - from_m;
        let (before_m, along_m) = (self.along.dot(&(self.middle_m - from_m)), self.along.dot(&way));
        if !(0.0 < before_m && before_m <= along_m) || along_m < MOTION_COS_MIN * way.norm() {
            return false;
        }
        self.is_in_lane(from_m + way * (before_m / along_m))
    }

    /// Whether a point of the line lies on its lane, on its storey.
    fn is_in_lane(&self, point_m: Vec3) -> bool {
        const STOREY_M: f32 = 3.0;
        let away_m = point_m - self.middle_m;
        away_m.xy().norm() <= self.half_width_m + BESIDE_M && away_m.z.abs() < STOREY_M
    }
}

/// The word in observations.
pub(super) const fn in_words(colour: TrafficLightColour) -> &'static str {
    match colour {
        TrafficLightColour::Red => "red",
        TrafficLightColour::Yellow => "yellow",
        TrafficLightColour::Green => "green",
        TrafficLightColour::Off => "off",
        TrafficLightColour::Unknown => "unknown",
    }
}

#[cfg(test)]
mod tests {
    use schemas::{ActorId, ActorKind, MapRef, TrafficLightState, WorldId, level_pose};

    use super::*;
    use crate::testing;

    /// A frame in which all lights show the same.
    fn frame(count: usize, colour: TrafficLightColour) -> Frame {
        let light = |index: usize| TrafficLightState {
            actor: ActorId::new(1 + index as u32).unwrap(),
            colour,
            group: 0,
            frozen: false,
            elapsed_secs: 0.0,
            green_secs: 10.0,
            yellow_secs: 3.0,
            red_secs: 2.0,
        };
        let map = MapRef { name: "toy".to_owned(), digest: "0".to_owned() };
        let mut frame = Frame::empty(WorldId::new(1).unwrap(), map);
        frame.traffic_lights = (0..count).map(light).collect();
        frame
    }

    fn ego(middle_m: Vec3, heading_rad: f32) -> ActorState {
        let (id, pose) = (ActorId::new(7).unwrap(), level_pose(middle_m, heading_rad));
        let box_half_extent_m = Vec3::new(2.5, 1.0, 0.7);
        let at_rest = ActorState::at_rest(id, ActorKind::Vehicle, 0, pose);
        ActorState { box_half_extent_m, ..at_rest }
    }

    /// How many red lights an ego runs that drives straight on in steps of a length, while the
    /// lights of its way and of the way to the left, which have one line, show these colours.
    fn run_by_who_drives_on(colours: [TrafficLightColour; 2], step_m: f32) -> u32 {
        let text = include_str!("../../../roads/tests/maps/fork.xodr");
        let map = roads::Map::parse("fork", text).unwrap();
        let mut lines = StopLines::of(&map);
        let mut frame = frame(2, TrafficLightColour::Green);
        for (light, colour) in frame.traffic_lights.iter_mut().zip(colours) {
            light.colour = colour;
        }
        let mut from_m = Vec3::new(-30.0, 0.0, 0.0);
        let mut count = 0;
        while from_m.x < 60.0 {
            let to_m = from_m + Vec3::x() * step_m;
            count += lines.run(&map, (&frame, from_m), (&frame, &ego(to_m, 0.0)));
            from_m = to_m;
        }
        count
    }

    #[test]
    fn of_several_lights_at_one_line_that_of_the_own_way_is_run() {
        use TrafficLightColour::{Green, Red};
        for step_m in [0.4, 7.0, 45.0] {
            for (colours, wanted) in
                [([Green, Red], 0), ([Red, Green], 1), ([Red, Red], 1), ([Green, Green], 0)]
            {
                let found = run_by_who_drives_on(colours, step_m);
                assert_eq!(found, wanted, "{colours:?} in steps of {step_m} m");
            }
        }
    }

    #[test]
    fn a_light_is_run_by_whoever_passes_its_line_while_it_stays_red() {
        use TrafficLightColour::{Green, Red};
        let map = testing::map();
        let mut lines = StopLines::of(&map);
        let count = map.traffic_lights().lights.len();
        assert!(lines.lines.len() >= count && count > 10, "{count}");
        let line = lines.lines[0].clone();
        let (from_m, to_m) = (line.middle_m - line.along * 1.5, line.middle_m + line.along);
        let mut run = |before, after, from_m, to_m: Vec3| {
            let ego = ego(to_m, line.along.y.atan2(line.along.x));
            lines.run(&map, (&frame(count, before), from_m), (&frame(count, after), &ego))
        };
        assert_eq!(run(Red, Red, from_m, to_m), 1);
        assert_eq!(run(Red, Green, from_m, to_m), 0);
        assert_eq!(run(Green, Red, from_m, to_m), 0, "it turned while the car was at the line");
        assert_eq!(run(Red, Red, to_m, from_m), 0, "backwards");
        assert_eq!(run(Red, Red, from_m, line.middle_m - line.along * 0.1), 0, "not yet");
        let aside = Vec3::new(-line.along.y, line.along.x, 0.0) * 40.0;
        assert_eq!(run(Red, Red, from_m + aside, to_m + aside), 0, "elsewhere");
    }

    #[test]
    fn the_light_ahead_is_told_with_the_way_left_to_its_line() {
        let map = testing::map();
        let lines = StopLines::of(&map);
        let line = lines.lines[0].clone();
        let heading_rad = line.along.y.atan2(line.along.x);
        let mut ego = ego(line.middle_m - line.along * 20.0, heading_rad);
        let frame = frame(map.traffic_lights().lights.len(), TrafficLightColour::Yellow);
        let ahead = lines.ahead(&frame, &ego).unwrap();
        assert!((ahead.distance_m - 17.5).abs() < 0.01, "{ahead:?}");
        assert_eq!(in_words(ahead.colour), "yellow");
        ego.world_from_actor = level_pose(line.middle_m + line.along * 2.0, heading_rad);
        let beyond = lines.ahead(&frame, &ego);
        assert!(beyond.is_none_or(|ahead| ahead.distance_m > 5.0), "{beyond:?}");
    }
}
