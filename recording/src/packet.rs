//! The packets of a log.

use crate::bytes::{Cursor, Field, Layout, Malformed};
use crate::physics::PhysicsControl;
use crate::record::{
    Add, Biker, Bones, Box3, Collision, Destroy, Door, FrameStart, Kinematics, LightState,
    LightTimes, Parent, Position, SceneLight, VehicleControl, VehicleLights, WalkerSpeed, Weather,
    Wheels,
};

macro_rules! packets {
    ($($(#[$doc:meta])* $name:ident($content:ty) = $id:literal,)*) => {
        /// What a packet is about; the number is that of CARLA 0.9.16.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Kind {
            $($(#[$doc])* $name,)*
            /// Not of CARLA: its readers skip it by size.
            Foreign(u8),
        }

        /// One packet.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Packet {
            $($(#[$doc])* $name($content),)*
            /// A packet that is not of CARLA: its id and its bytes.
            Foreign(u8, Vec<u8>),
        }

        impl Kind {
            /// The number of the packet in a log of version 2.
            pub fn id(self) -> u8 {
                match self {
                    $(Self::$name => $id,)*
                    Self::Foreign(id) => id,
                }
            }

            /// The inverse of [`id`](Self::id).
            pub fn of_id(id: u8) -> Self {
                match id {
                    $($id => Self::$name,)*
                    id => Self::Foreign(id),
                }
            }
        }

        impl Packet {
            /// What it is about.
            pub fn kind(&self) -> Kind {
                match self {
                    $(Self::$name(_) => Kind::$name,)*
                    Self::Foreign(id, _) => Kind::Foreign(*id),
                }
            }

            fn put_body(&self, out: &mut Vec<u8>) {
                match self {
                    $(Self::$name(content) => content.put(out),)*
                    Self::Foreign(_, body) => out.extend_from_slice(body),
                }
            }

            fn take(kind: Kind, cursor: &mut Cursor<'_>) -> Result<Self, Malformed> {
                match kind {
                    $(Kind::$name => Ok(Self::$name(Field::take(cursor)?)),)*
                    Kind::Foreign(id) => {
                        let left = cursor.left();
                        Ok(Self::Foreign(id, cursor.bytes(left)?.to_vec()))
                    }
                }
            }
        }
    };
}

packets! {
    /// Begin of a frame.
    FrameStart(FrameStart) = 0,
    /// End of a frame.
    FrameEnd(()) = 1,
    /// Actors that are there from this frame on.
    Adds(Vec<Add>) = 2,
    /// Actors that are gone from this frame on.
    Destroys(Vec<Destroy>) = 3,
    /// Actors that are attached from this frame on.
    Parents(Vec<Parent>) = 4,
    /// Contacts.
    Collisions(Vec<Collision>) = 5,
    /// Where actors are.
    Positions(Vec<Position>) = 6,
    /// What traffic lights show.
    LightStates(Vec<LightState>) = 7,
    /// What vehicles are told.
    VehicleControls(Vec<VehicleControl>) = 8,
    /// How fast walkers walk.
    WalkerSpeeds(Vec<WalkerSpeed>) = 9,
    /// Which lights of vehicles burn.
    VehicleLights(Vec<VehicleLights>) = 10,
    /// Lamps of the map that changed.
    SceneLights(Vec<SceneLight>) = 11,
    /// How vehicles and walkers move; additional.
    Kinematics(Vec<Kinematics>) = 12,
    /// Boxes about actors; additional.
    BoundingBoxes(Vec<Box3>) = 13,
    /// Wall seconds since the recording began; additional.
    PlatformTime(f64) = 14,
    /// Physics of vehicles; additional.
    Physics(Vec<PhysicsControl>) = 15,
    /// Times of traffic lights; additional.
    LightTimes(Vec<LightTimes>) = 16,
    /// Where signs and lights act; additional.
    TriggerVolumes(Vec<Box3>) = 17,
    /// Never in files.
    FrameCounter(u64) = 18,
    /// Limbs of walkers; additional.
    Bones(Vec<Bones>) = 19,
    /// Seconds that drive clouds and the like.
    VisualTime(f64) = 20,
    /// How wheels stand.
    Wheels(Vec<Wheels>) = 21,
    /// How riders move.
    Bikers(Vec<Biker>) = 22,
    /// Doors that are opened or closed.
    Doors(Vec<Door>) = 23,
    /// The weather, when it changes; of CARLA after 0.9.16, whose readers skip it.
    Weather(Weather) = 24,
}

impl Packet {
    /// Writes the packet as version 2 has it.
    pub fn put(&self, out: &mut Vec<u8>) {
        self.kind().id().put(out);
        let size_at = out.len();
        0u32.put(out);
        let body_at = out.len();
        self.put_body(out);
        let size = u32::try_from(out.len() - body_at).unwrap_or(u32::MAX);
        out[size_at..body_at].copy_from_slice(&size.to_le_bytes());
    }

    /// The packet and how many bytes of the body it leaves.
    pub(crate) fn decode(
        kind: Kind,
        body: &[u8],
        layout: Layout,
    ) -> Result<(Self, usize), Malformed> {
        let mut cursor = Cursor::new(body, layout);
        let packet = Self::take(kind, &mut cursor)?;
        Ok((packet, cursor.left()))
    }
}
