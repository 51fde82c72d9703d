//! What a log says, frame by frame.

use std::fmt::{self, Write as _};
use std::io::{Read, Write};

use super::number::Number;
use super::physics::write_physics;
use super::{Last, LocalDate, QueryError, write_foot, write_head};
use crate::bytes::Malformed;
use crate::packet::{Kind, Packet};
use crate::reader::{Frame, Reader};
use crate::record::{
    Add, Bones, Box3, Collision, Door, LightState, Rotation, SceneLight, Vector, VehicleControl,
    VehicleLights, light,
};

/// Names of doors, by number.
const DOORS: [&str; 7] =
    ["Front Left", "Front Right", "Rear Left", "Rear Right", "Hood", "Trunk", "All"];

/// Creations, destructions, attachments and collisions of a log; with `is_all` everything it says.
///
/// Doors come last in a frame, and only when there are any: parsers of this text do not expect them
/// where CARLA 0.9.16 writes them.
///
/// # Errors
/// Those of the log and of the sink.
pub fn file_info(
    reader: &mut Reader<impl Read>,
    is_all: bool,
    date: LocalDate<'_>,
    out: &mut impl Write,
) -> Result<(), QueryError> {
    write_head(out, reader.header(), date)?;
    let (mut last, mut text) = (Last::default(), String::new());
    let mut damage = None;
    while let Some(frame) = reader.next_frame()? {
        text.clear();
        if let Err(malformed) = write_frame(&mut text, &frame, is_all) {
            damage = Some((frame.offset, malformed));
            break;
        }
        last.note(&frame.start);
        if is_all || !text.is_empty() {
            let elapsed = Number(frame.start.elapsed_secs);
            writeln!(out, "Frame {} at {elapsed} seconds", frame.start.number)?;
        }
        out.write_all(text.as_bytes())?;
    }
    if let Some((offset, malformed)) = damage {
        reader.end_at(offset, &malformed);
    }
    Ok(write_foot(out, &last, false)?)
}

/// All lines of a frame but the first.
fn write_frame(text: &mut String, frame: &Frame<'_>, is_all: bool) -> Result<(), Malformed> {
    let mut doors = Vec::new();
    for packet in frame.packets() {
        let is_event =
            matches!(packet.kind, Kind::Adds | Kind::Destroys | Kind::Parents | Kind::Collisions);
        if !is_all && !is_event {
            continue;
        }
        match packet.decode()? {
            Packet::Doors(changes) => doors.extend(changes),
            packet => write_packet(text, &packet).expect("a string takes all"),
        }
    }
    if !doors.is_empty() {
        section(text, "Vehicle door animations", &doors, write_door).expect("a string takes all");
    }
    Ok(())
}

fn write_packet(text: &mut String, packet: &Packet) -> fmt::Result {
    match packet {
        Packet::Adds(adds) => adds.iter().try_for_each(|add| write_add(text, add)),
        Packet::Destroys(gone) => {
            gone.iter().try_for_each(|one| writeln!(text, " Destroy {}", one.id))
        }
        Packet::Parents(parents) => parents.iter().try_for_each(|one| {
            writeln!(text, " Parenting {} with {} (parent)", one.child, one.parent)
        }),
        Packet::Collisions(all) => all.iter().try_for_each(|one| write_collision(text, one)),
        Packet::Positions(all) => section(text, "Positions", all, |text, one| {
            let (location, rotation) = (Three::of(one.location), Three::by_roll(one.rotation));
            writeln!(text, "  Id: {} Location: {location} Rotation: {rotation}", one.id)
        }),
        Packet::LightStates(all) => section(text, "State traffic lights", all, write_state),
        Packet::VehicleControls(all) => section(text, "Vehicle animations", all, write_control),
        Packet::WalkerSpeeds(all) => section(text, "Walker animations", all, |text, one| {
            writeln!(text, "  Id: {} speed: {}", one.id, Number::from(one.speed))
        }),
        Packet::VehicleLights(all) => {
            section(text, "Vehicle light animations", all, write_vehicle_lights)
        }
        Packet::SceneLights(all) => section(text, "Scene light changes", all, write_scene_light),
        Packet::Kinematics(all) => section(text, "Dynamic actors", all, |text, one| {
            let linear = Three::of(one.linear_velocity);
            let angular = Three::of(one.angular_velocity);
            writeln!(text, "  Id: {} linear_velocity: {linear} angular_velocity: {angular}", one.id)
        }),
        Packet::BoundingBoxes(all) => section(text, "Actor bounding boxes", all, write_box),
        Packet::TriggerVolumes(all) => section(text, "Actor trigger volumes", all, write_box),
        Packet::PlatformTime(secs) => {
            writeln!(text, " Current platform time: {}", Number(*secs))
        }
        Packet::Physics(all) => section(text, "Physics Control events", all, write_physics),
        Packet::LightTimes(all) => section(text, "Traffic Light time events", all, |text, one| {
            let [green, yellow, red] =
                [one.green_secs, one.yellow_secs, one.red_secs].map(Number::from);
            let id = one.id;
            writeln!(text, "  Id: {id} green_time: {green} yellow_time: {yellow} red_time: {red}")
        }),
        Packet::Bones(all) => {
            section(text, "Walkers Bones", all, write_bones)?;
            writeln!(text)
        }
        _ => Ok(()),
    }
}

fn section<T>(
    text: &mut String,
    name: &str,
    records: &[T],
    mut write: impl FnMut(&mut String, &T) -> fmt::Result,
) -> fmt::Result {
    writeln!(text, " {name}: {}", records.len())?;
    records.iter().try_for_each(|record| write(text, record))
}

fn write_add(text: &mut String, add: &Add) -> fmt::Result {
    let (class, place) = (add.class.0, Three::of(add.location));
    writeln!(text, " Create {}: {} ({class}) at {place}", add.id, add.blueprint)?;
    add.attributes.iter().try_for_each(|one| writeln!(text, "  {} = {}", one.name, one.value))
}

fn write_collision(text: &mut String, one: &Collision) -> fmt::Result {
    let [hero1, hero2] = [one.is_hero1, one.is_hero2].map(|is| if is { " (hero) " } else { "" });
    let Collision { serial, id1, id2, .. } = one;
    writeln!(text, " Collision id {serial} between {id1}{hero1} with {id2}{hero2}")
}

fn write_door(text: &mut String, one: &Door) -> fmt::Result {
    writeln!(text, "  Id: {}", one.id)?;
    match DOORS.get(usize::from(one.door)) {
        Some(name) => writeln!(text, "  Doors opened:  {name} "),
        // As CARLA, which ends the line only after a name.
        None => write!(text, "  Doors opened: "),
    }
}

fn write_state(text: &mut String, one: &LightState) -> fmt::Result {
    let (frozen, elapsed) = (u8::from(one.is_frozen), Number::from(one.elapsed_secs));
    let (id, state) = (one.id, one.state);
    writeln!(text, "  Id: {id} state: {state} frozen: {frozen} elapsedTime: {elapsed}")
}

fn write_control(text: &mut String, one: &VehicleControl) -> fmt::Result {
    let [steer, throttle, brake] = [one.steer, one.throttle, one.brake].map(Number::from);
    write!(text, "  Id: {} Steering: {steer} Throttle: {throttle} Brake: {brake} ", one.id)?;
    writeln!(text, "Handbrake: {} Gear: {}", u8::from(one.hand_brake), one.gear)
}

fn write_vehicle_lights(text: &mut String, one: &VehicleLights) -> fmt::Result {
    let lit = light::NAMES.iter().filter(|(bit, _)| one.flags & bit != 0);
    let names: Vec<&str> = lit.map(|(_, name)| *name).collect();
    let names = if names.is_empty() { "None".to_owned() } else { names.join(" ") };
    writeln!(text, "  Id: {} {names}", one.id)
}

fn write_scene_light(text: &mut String, one: &SceneLight) -> fmt::Result {
    let is_on = if one.is_on { "True" } else { "False" };
    let [r, g, b, _] = one.colour;
    let (id, intensity, colour) = (one.id, Number::from(one.intensity), Three([r, g, b]));
    writeln!(text, "  Id: {id} enabled: {is_on} intensity: {intensity} RGB_color: {colour}")
}

fn write_box(text: &mut String, one: &Box3) -> fmt::Result {
    let (origin, extent) = (Three::of(one.origin), Three::of(one.extent));
    writeln!(text, "  Id: {} origin: {origin} extension: {extent}", one.id)
}

fn write_bones(text: &mut String, one: &Bones) -> fmt::Result {
    writeln!(text, "  Id: {}", one.id)?;
    one.bones.iter().try_for_each(|bone| {
        let (place, rotation) = (Three::of(bone.location), Three::by_roll(bone.rotation));
        writeln!(text, "     Bone: \"{}\" relative: Loc{place} Rot{rotation}", bone.name)
    })
}

/// Three numbers in brackets.
pub(super) struct Three(pub(super) [f32; 3]);

impl Three {
    pub(super) fn of(Vector { x, y, z }: Vector) -> Self {
        Self([x, y, z])
    }

    fn by_roll(Rotation { roll, pitch, yaw }: Rotation) -> Self {
        Self([roll, pitch, yaw])
    }
}

impl fmt::Display for Three {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.0.map(Number::from);
        write!(f, "({x}, {y}, {z})")
    }
}
