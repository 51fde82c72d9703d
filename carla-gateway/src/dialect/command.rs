//! Commands of a batch: `[[index, fields]]`.

use std::fmt;

use serde::de::{self, SeqAccess, Visitor};
use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::version::{Either, either};
use super::{AckermannControl, ActorDescription, ActorRef, Location, Opt, Transform, Vector3D};
use super::{PhysicsControl, VehicleControl, WalkerControl};

/// An actor to be made, and what to do with it then; in those commands the id 0 is the new actor.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SpawnActor {
    pub(crate) description: ActorDescription,
    pub(crate) transform: Transform,
    pub(crate) parent: Opt<ActorRef>,
    /// Clients of 0.10 name none.
    pub(crate) socket: String,
    pub(crate) do_after: Vec<BatchCommand>,
}

#[derive(Deserialize)]
struct OldSpawn {
    description: ActorDescription,
    transform: Transform,
    parent: Opt<ActorRef>,
    #[expect(dead_code, reason = "often uninitialised memory: batches attach rigidly")]
    attachment: u8,
    socket: String,
    do_after: Vec<BatchCommand>,
}

#[derive(Deserialize)]
struct NewSpawn {
    description: ActorDescription,
    transform: Transform,
    parent: Opt<ActorRef>,
    do_after: Vec<BatchCommand>,
}

impl<'de> Deserialize<'de> for SpawnActor {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(match either::<D, OldSpawn, NewSpawn>(deserializer, 6, 4)? {
            Either::Old(OldSpawn { description, transform, parent, socket, do_after, .. }) => {
                Self { description, transform, parent, socket, do_after }
            }
            Either::New(NewSpawn { description, transform, parent, do_after }) => {
                Self { description, transform, parent, socket: String::new(), do_after }
            }
        })
    }
}

/// One command of a batch.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum BatchCommand {
    Spawn(Box<SpawnActor>),
    Destroy(ActorRef),
    Control(ActorRef, VehicleControl),
    Ackermann(ActorRef, AckermannControl),
    WalkerControl(ActorRef, WalkerControl),
    Physics(ActorRef, Box<PhysicsControl>),
    Transform(ActorRef, Transform),
    WalkerState(ActorRef, Transform, f32),
    TargetVelocity(ActorRef, Vector3D),
    TargetAngularVelocity(ActorRef, Vector3D),
    Impulse(ActorRef, Vector3D),
    Force(ActorRef, Vector3D),
    AngularImpulse(ActorRef, Vector3D),
    Torque(ActorRef, Vector3D),
    SimulatePhysics(ActorRef, bool),
    EnableGravity(ActorRef, bool),
    Autopilot(ActorRef, bool),
    DebugTelemetry(ActorRef, bool),
    Lights(ActorRef, u32),
    Location(ActorRef, Location),
    Console(String),
    TrafficLight(ActorRef, u8),
}

impl BatchCommand {
    /// The call that does the same.
    pub(crate) fn function(&self) -> &'static str {
        match self {
            Self::Spawn(_) => "spawn_actor",
            Self::Destroy(_) => "destroy_actor",
            Self::Control(..) => "apply_control_to_vehicle",
            Self::Ackermann(..) => "apply_ackermann_control_to_vehicle",
            Self::WalkerControl(..) => "apply_control_to_walker",
            Self::Physics(..) => "apply_physics_control",
            Self::Transform(..) => "set_actor_transform",
            Self::WalkerState(..) => "set_walker_state",
            Self::TargetVelocity(..) => "set_actor_target_velocity",
            Self::TargetAngularVelocity(..) => "set_actor_target_angular_velocity",
            Self::Impulse(..) => "add_actor_impulse",
            Self::Force(..) => "add_actor_force",
            Self::AngularImpulse(..) => "add_actor_angular_impulse",
            Self::Torque(..) => "add_actor_torque",
            Self::SimulatePhysics(..) => "set_actor_simulate_physics",
            Self::EnableGravity(..) => "set_actor_enable_gravity",
            Self::Autopilot(..) => "set_actor_autopilot",
            Self::DebugTelemetry(..) => "show_vehicle_debug_telemetry",
            Self::Lights(..) => "set_vehicle_light_state",
            Self::Location(..) => "set_actor_location",
            Self::Console(_) => "console_command",
            Self::TrafficLight(..) => "set_traffic_light_state",
        }
    }
}

impl<'de> Deserialize<'de> for BatchCommand {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        struct Object {
            command: Tagged,
        }
        let Object { command: Tagged(command) } = Object::deserialize(deserializer)?;
        Ok(command)
    }
}

struct Tagged(BatchCommand);

impl<'de> Deserialize<'de> for Tagged {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(Union).map(Tagged)
    }
}

struct Union;

impl<'de> Visitor<'de> for Union {
    type Value = BatchCommand;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("[index, fields]")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut parts: A) -> Result<BatchCommand, A::Error> {
        use BatchCommand as To;
        let index: u8 = parts.next_element()?.ok_or_else(|| de::Error::invalid_length(0, &self))?;
        let p = &mut parts;
        Ok(match index {
            0 => To::Spawn(fields(p)?),
            1 => to1(p, To::Destroy)?,
            2 => to2(p, To::Control)?,
            3 => to2(p, To::Ackermann)?,
            4 => to2(p, To::WalkerControl)?,
            5 => to2(p, To::Physics)?,
            6 => to2(p, To::Transform)?,
            7 => {
                let (actor, transform, speed) = fields(p)?;
                To::WalkerState(actor, transform, speed)
            }
            8 => to2(p, To::TargetVelocity)?,
            9 => to2(p, To::TargetAngularVelocity)?,
            10 => to2(p, To::Impulse)?,
            11 => to2(p, To::Force)?,
            12 => to2(p, To::AngularImpulse)?,
            13 => to2(p, To::Torque)?,
            14 => to2(p, To::SimulatePhysics)?,
            15 => to2(p, To::EnableGravity)?,
            16 => to2(p, To::Autopilot)?,
            17 => to2(p, To::DebugTelemetry)?,
            18 => to2(p, To::Lights)?,
            19 => to2(p, To::Location)?,
            20 => to1(p, To::Console)?,
            21 => to2(p, To::TrafficLight)?,
            other => return Err(de::Error::custom(format!("no command has the index {other}"))),
        })
    }
}

fn fields<'de, A: SeqAccess<'de>, T: Deserialize<'de>>(parts: &mut A) -> Result<T, A::Error> {
    parts.next_element()?.ok_or_else(|| de::Error::invalid_length(1, &Union))
}

fn to1<'de, A: SeqAccess<'de>, T: Deserialize<'de>>(
    parts: &mut A,
    to: fn(T) -> BatchCommand,
) -> Result<BatchCommand, A::Error> {
    let (field,) = fields(parts)?;
    Ok(to(field))
}

fn to2<'de, A: SeqAccess<'de>, T: Deserialize<'de>>(
    parts: &mut A,
    to: fn(ActorRef, T) -> BatchCommand,
) -> Result<BatchCommand, A::Error> {
    let (actor, field) = fields(parts)?;
    Ok(to(actor, field))
}

/// `[[1, actor id]]` or `[[0, ["message"]]]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct BatchResponse(pub(crate) Result<ActorRef, String>);

impl Serialize for BatchResponse {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_tuple(1)?;
        match &self.0 {
            Ok(actor) => object.serialize_element(&(1u8, actor))?,
            Err(message) => object.serialize_element(&(0u8, (message,)))?,
        }
        object.end()
    }
}

#[cfg(test)]
mod tests {
    use schemas::ActorId;

    use super::*;

    fn named(id: u32) -> ActorRef {
        ActorId::new(id).into()
    }

    #[test]
    fn commands_are_read_by_their_index() {
        let destroy: BatchCommand = rmp_serde::from_slice(&[0x91, 0x92, 1, 0x91, 42]).unwrap();
        assert_eq!(destroy, BatchCommand::Destroy(named(42)));
        let lights: BatchCommand = rmp_serde::from_slice(&[0x91, 0x92, 18, 0x92, 7, 3]).unwrap();
        assert_eq!(lights, BatchCommand::Lights(named(7), 3));
        assert!(rmp_serde::from_slice::<BatchCommand>(&[0x91, 0x92, 99, 0x91, 42]).is_err());
    }

    #[test]
    fn a_spawn_is_read_from_either_client() {
        let (description, place) = ((0, "walker", [(); 0]), ([1.0f32; 3], [0.0f32; 3]));
        let after = [((1, (0,)),)];
        let old = (0, (&description, place, (true, 9), 112, "seat", after));
        let new = (0, (&description, place, (true, 9), after));
        let [old, new] = [rmp_serde::to_vec(&(old,)), rmp_serde::to_vec(&(new,))]
            .map(|bytes| rmp_serde::from_slice(&bytes.unwrap()).unwrap());
        let (BatchCommand::Spawn(old), BatchCommand::Spawn(new)) = (old, new) else {
            panic!("no spawn")
        };
        assert_eq!((&*old.socket, &*new.socket), ("seat", ""));
        assert_eq!(new.do_after, [BatchCommand::Destroy(ActorRef::NOBODY)]);
        assert_eq!(*old, SpawnActor { socket: "seat".to_owned(), ..*new });
    }

    #[test]
    fn responses_have_the_measured_bytes() {
        assert_eq!(rmp_serde::to_vec(&BatchResponse(Ok(named(5)))).unwrap(), [0x91, 0x92, 1, 5]);
        let error = rmp_serde::to_vec(&BatchResponse(Err("no".to_owned()))).unwrap();
        assert_eq!(error, [0x91, 0x92, 0, 0x91, 0xa2, b'n', b'o']);
    }
}
