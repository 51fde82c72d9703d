//! Sensors in test worlds, and what they gave.

use schemas::{ActorId, Attachment, AttachmentKind, Attribute, Command, Error, SensorCommand};
use schemas::{LidarPoint, Measurement, Pose, Scan, SemanticLidarPoint, SensorDatum, Vec3};
use world::World;

pub(crate) fn try_sensor(
    world: &mut World,
    blueprint: &str,
    parent: Option<ActorId>,
    pose: Pose,
    attributes: &[(&str, &str)],
) -> Result<ActorId, Error> {
    let attribute =
        |(id, value): &(&str, &str)| Attribute { id: (*id).into(), value: (*value).into() };
    let spawned = world.apply(&Command::SpawnActor {
        blueprint: blueprint.to_owned(),
        reference_from_actor: pose,
        linear_velocity_mps: Vec3::zeros(),
        attributes: attributes.iter().map(attribute).collect(),
        attachment: parent.map(|parent| Attachment { parent, kind: AttachmentKind::Rigid }),
        id: None,
    });
    spawned.map(|id| id.expect("a spawn is answered with an id"))
}

/// A sensor to which somebody listens; the pose is in the parent's frame if there is one.
pub(crate) fn sensor(
    world: &mut World,
    blueprint: &str,
    parent: Option<ActorId>,
    pose: Pose,
    attributes: &[(&str, &str)],
) -> ActorId {
    let sensor = try_sensor(world, blueprint, parent, pose, attributes).unwrap();
    world.apply(&Command::Sensor(SensorCommand::Listen { sensor, on: true })).unwrap();
    sensor
}

/// What one sensor measured in the last tick.
pub(crate) fn data_of(world: &World, sensor: ActorId) -> Vec<SensorDatum> {
    world.sensors().iter().filter(|datum| datum.sensor == sensor).cloned().collect()
}

pub(crate) fn only(world: &World, sensor: ActorId) -> SensorDatum {
    let data = data_of(world, sensor);
    assert_eq!(data.len(), 1, "{data:?}");
    data.into_iter().next().unwrap()
}

pub(crate) fn scan(world: &World, sensor: ActorId) -> Scan<LidarPoint> {
    match only(world, sensor).measurement {
        Measurement::Lidar(scan) => scan,
        other => panic!("no lidar: {other:?}"),
    }
}

pub(crate) fn semantic_scan(world: &World, sensor: ActorId) -> Scan<SemanticLidarPoint> {
    match only(world, sensor).measurement {
        Measurement::SemanticLidar(scan) => scan,
        other => panic!("no semantic lidar: {other:?}"),
    }
}
