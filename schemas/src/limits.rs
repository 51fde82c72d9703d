//! Every bound of what crosses a process border, in one place.

/// Largest request, in bytes. A snapshot of a large world is the largest legal one.
pub const REQUEST_BYTES_MAX: usize = 16 * 1024 * 1024;
/// Largest reply, frame or job, in bytes. Raw images of one job are the largest legal ones.
pub const REPLY_BYTES_MAX: usize = 64 * 1024 * 1024;
/// Largest OpenDRIVE text, in bytes.
pub const MAP_BYTES_MAX: usize = 128 * 1024 * 1024;

/// Nesting of FlatBuffers tables.
pub const TABLE_DEPTH_MAX: usize = 16;
/// Tables of one message.
pub const TABLE_COUNT_MAX: usize = 100_000;

/// Actors of one world.
pub const ACTORS_PER_WORLD_MAX: usize = 10_000;
/// Highest id that a new actor can be given by wish: so many more are left to be given in turn.
pub const WANTED_ACTOR_MAX: u32 = 1 << 31;
/// Commands of one request, for one world.
pub const COMMANDS_PER_REQUEST_MAX: usize = 10_000;
/// Worlds of one batch.
pub const WORLDS_PER_BATCH_MAX: usize = 4_096;
/// Ticks of one world in one request.
pub const TICKS_PER_REQUEST_MAX: u32 = 10_000;
/// Copies of one fork.
pub const FORKS_PER_REQUEST_MAX: u32 = 1_024;
/// Worlds of one world service.
pub const WORLDS_PER_SERVICE_MAX: usize = 4_096;

/// Attributes of one actor.
pub const ATTRIBUTES_PER_ACTOR_MAX: usize = 64;
/// Characters of an attribute's id or value.
pub const ATTRIBUTE_CHARS_MAX: usize = 1_024;
/// Points of a curve, gears or wheels of one vehicle.
pub const VEHICLE_PARTS_MAX: usize = 64;
/// Vehicles that one request may ask about.
pub const VEHICLES_PER_REQUEST_MAX: usize = 256;
/// Places of one route.
pub const ROUTE_PLACES_MAX: usize = 4_096;
/// Places of a walker's trajectory.
pub const WALKER_STAGES_MAX: usize = 64;
/// Longest wait at one of them, in seconds.
pub const WALKER_WAIT_SECS_MAX: f32 = 86_400.0;
/// Walkers of one world whose bones are posed.
pub const POSED_WALKERS_MAX: usize = 1_024;
/// Rays of one request.
pub const RAYS_PER_REQUEST_MAX: usize = 4_096;
/// Things of one map that can be hidden.
pub const SCENERY_MAX: usize = 2_000_000;
/// Environment objects of one command.
pub const OBJECTS_PER_COMMAND_MAX: usize = 65_536;
/// Width or height of a texture on a thing of the map, in pixels.
pub const TEXTURE_SIDE_PX_MAX: u32 = 512;
/// Bytes of all textures of one world: it has to fit into a snapshot with them.
pub const TEXTURE_BYTES_PER_WORLD_MAX: usize = 8 * 1024 * 1024;
/// Textures of one world.
pub const TEXTURES_PER_WORLD_MAX: usize = 1_024;
/// Things of the map of one world that have textures.
pub const PAINTED_OBJECTS_MAX: usize = 16_384;
/// Bytes of a text that a V2X sensor sends.
pub const V2X_TEXT_BYTES_MAX: usize = 100;
/// Texts that one V2X sensor sends in one tick.
pub const V2X_TEXTS_PER_TICK_MAX: usize = 64;
/// Vehicles that one sensor sees through.
pub const IGNORED_VEHICLES_MAX: usize = 1_024;
/// Physics steps in one tick.
pub const SUBSTEPS_MAX: u32 = 100;

/// Street lights of one job that are not as the hour has them.
pub const STREET_LIGHTS_MAX: usize = 16_384;
/// Cameras of one world of CARLA's clients: a tick may be a picture of each.
pub const CAMERAS_PER_WORLD_MAX: u32 = 1_024;
/// Cameras of one job.
pub const CAMERAS_PER_JOB_MAX: usize = 64;
/// Width or height of one image, in pixels.
pub const IMAGE_SIDE_PX_MAX: u32 = 4_096;
/// Horizontal field of view, in degrees: a pinhole picture beyond is mostly distortion.
pub const FIELD_OF_VIEW_DEG_MAX: f32 = 170.0;
/// Pixels of all images of one job, so that even raw ones fit into a reply.
pub const PIXELS_PER_JOB_MAX: usize = 16 * 1024 * 1024 - 4_096;

/// Speed a command may give to a body, in metres per second.
pub const SPEED_MPS_MAX: f32 = 150.0;
/// Distance from the origin at which an actor may be, in metres: single precision is 1 mm at 10 km.
pub const COORDINATE_M_MAX: f32 = 100_000.0;
/// Length of a fixed step, in seconds.
pub const DT_SECS_MAX: f64 = 0.1;
/// Length of a fixed step, in seconds.
pub const DT_SECS_MIN: f64 = 0.001;

const _: () = assert!(PIXELS_PER_JOB_MAX * 4 < REPLY_BYTES_MAX, "raw images must fit into a reply");
