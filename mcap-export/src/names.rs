//! What topics and frames are called.

use std::collections::BTreeMap;

use schemas::{Pose, Vec3};

use crate::topic::Topic;

/// Whose names a file has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Names {
    /// Those of this project.
    #[default]
    Causeway,
    /// Those that `foxglove/nuscenes2mcap` gives the nuScenes data set, so that layouts made for it
    /// show these files.
    Nuscenes,
}

/// A part of what a camera or sensor tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Compressed,
    Raw,
    Calibration,
    Annotations,
    /// By the word that this project has for it.
    Measured(&'static str),
}

/// The names of one file.
#[derive(Debug, Default)]
pub(crate) struct Called {
    names: Names,
    /// Names of cameras and sensors, by those of this project.
    given: BTreeMap<String, String>,
}

impl Called {
    pub(crate) fn by(names: Names) -> Self {
        Self { names, given: BTreeMap::new() }
    }

    /// The frame of the ego, at ground level under the centre of its box.
    pub(crate) fn ego_frame(&self) -> &'static str {
        match self.names {
            Names::Causeway => "ego",
            Names::Nuscenes => "base_link",
        }
    }

    /// The name of a camera or sensor, which is also that of its frame; `own` is this project's,
    /// and `ego_from_it` is where the ego carries it.
    pub(crate) fn name(&mut self, own: &str, ego_from_it: Option<&Pose>) -> String {
        let Some(ego_from_it) = ego_from_it.filter(|_| self.names == Names::Nuscenes) else {
            return own.to_owned();
        };
        if let Some(given) = self.given.get(own) {
            return given.clone();
        }
        let mut name = nuscenes_name(own, ego_from_it);
        if self.given.values().any(|given| *given == name) {
            name = format!("{name}_{}", own.rsplit('/').next().unwrap_or_default());
        }
        self.given.insert(own.to_owned(), name.clone());
        name
    }

    /// The frame of the pictures of a camera of this name.
    pub(crate) fn optical_frame(&self, name: &str) -> String {
        match self.names {
            Names::Causeway => format!("{name}_optical"),
            Names::Nuscenes => name.to_owned(),
        }
    }

    /// A topic of a camera or sensor of this name.
    pub(crate) fn topic(&self, name: &str, part: Part) -> String {
        let word = match (self.names, part) {
            (Names::Causeway, Part::Compressed | Part::Raw) => "image",
            (Names::Causeway, Part::Calibration) => "calibration",
            (Names::Nuscenes, Part::Compressed) => "image_rect_compressed",
            (Names::Nuscenes, Part::Raw) => "image_rect",
            (Names::Nuscenes, Part::Calibration) => "camera_info",
            (_, Part::Annotations) => "annotations",
            (Names::Causeway, Part::Measured(word)) => word,
            // One topic each, called as its sensor.
            (Names::Nuscenes, Part::Measured(_)) => return format!("/{name}"),
        };
        format!("/{name}/{word}")
    }
}

/// The name of a topic that is no camera's or sensor's; `None`: it is not in such a file.
pub(crate) fn path(names: Names, topic: Topic) -> Option<&'static str> {
    if names == Names::Nuscenes {
        match topic {
            Topic::TfStatic => return Some("/tf"),
            Topic::Map => return Some("/semantic_map"),
            Topic::Grid => return Some("/map"),
            Topic::Drivable => return Some("/drivable_area"),
            Topic::Actors => return Some("/markers/annotations"),
            Topic::Car => return Some("/markers/car"),
            Topic::Odometry => return Some("/odom"),
            Topic::Pose => return Some("/pose"),
            Topic::Fix => return Some("/gps"),
            Topic::State => return Some("/diagnostics"),
            _ => {}
        }
    }
    Some(match topic {
        Topic::Tf => "/tf",
        Topic::TfStatic => "/tf_static",
        Topic::Map => "/map",
        Topic::OpenDrive => "/map/opendrive",
        Topic::Actors => "/actors",
        Topic::Poses => "/actors/poses",
        Topic::TrafficLights => "/traffic_lights",
        Topic::Odometry => "/ego/odometry",
        Topic::Pose => "/ego/pose",
        Topic::Fix => "/ego/fix",
        Topic::State => "/ego/state",
        Topic::Path => "/ego/path",
        Topic::Events => "/events",
        Topic::Weather => "/weather",
        Topic::Frame => crate::FRAMES,
        Topic::Commands => crate::COMMANDS,
        Topic::Grid | Topic::Drivable | Topic::Car => return None,
    })
}

/// As in nuScenes: the kind and where it looks, as `cam_front_left`.
fn nuscenes_name(own: &str, ego_from_it: &Pose) -> String {
    let words: Vec<&str> = own.split('/').collect();
    let ahead = ego_from_it.rotation * Vec3::x();
    let side = direction(ahead.y.atan2(ahead.x));
    match words[..] {
        ["ego", "lidar", _] => "lidar_top".to_owned(),
        ["ego", "radar", _] => format!("radar_{side}"),
        ["ego", kind, _] => kind.to_owned(),
        // Cameras that an export brings itself.
        ["ego", camera] => format!("cam_{camera}"),
        _ => format!("cam_{side}"),
    }
}

/// Between the directions of the six cameras of nuScenes: 0°, ±55°, ±110° and 180°.
fn direction(yaw_rad: f32) -> &'static str {
    let yaw_deg = yaw_rad.to_degrees();
    match (yaw_deg.abs(), yaw_deg > 0.0) {
        (..=27.5, _) => "front",
        (..=82.5, true) => "front_left",
        (..=82.5, false) => "front_right",
        (..=145.0, true) => "back_left",
        (..=145.0, false) => "back_right",
        _ => "back",
    }
}

#[cfg(test)]
mod tests {
    use schemas::{Translation3, UnitQuaternion};

    use super::*;

    fn turned(yaw_deg: f32) -> Pose {
        let turn = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), yaw_deg.to_radians());
        Pose::from_parts(Translation3::identity(), turn)
    }

    #[test]
    fn cameras_are_called_by_where_they_look_and_no_name_is_given_twice() {
        let mut called = Called::by(Names::Nuscenes);
        let sides = [(0.0, "cam_front"), (55.0, "cam_front_left"), (-110.0, "cam_back_right")];
        for (index, (yaw_deg, name)) in sides.into_iter().enumerate() {
            let own = format!("cameras/{index}");
            assert_eq!(called.name(&own, Some(&turned(yaw_deg))), name);
        }
        assert_eq!(called.name("cameras/9", Some(&turned(5.0))), "cam_front_9");
        assert_eq!(called.name("cameras/0", Some(&turned(180.0))), "cam_front");
        assert_eq!(called.name("ego/lidar/13", Some(&turned(0.0))), "lidar_top");
        assert_eq!(called.name("actors/4/lidar/14", None), "actors/4/lidar/14");
        let topic = called.topic("cam_front", Part::Compressed);
        assert_eq!(topic, "/cam_front/image_rect_compressed");
        assert_eq!(called.topic("lidar_top", Part::Measured("points")), "/lidar_top");
    }

    #[test]
    fn names_of_this_project_stay_as_they_are() {
        let mut called = Called::default();
        assert_eq!(called.name("ego/lidar/13", Some(&turned(90.0))), "ego/lidar/13");
        let measured = called.topic("ego/lidar/13", Part::Measured("points"));
        assert_eq!(measured, "/ego/lidar/13/points");
        assert_eq!(called.optical_frame("ego/top"), "ego/top_optical");
    }
}
