//! Every bound of the service, in one place.

use std::num::NonZeroUsize;
use std::time::Duration;

/// Sessions at once, unless told otherwise.
pub(crate) const SESSIONS_MAX: u32 = 256;
/// Bytes of a WebSocket message the transport swallows before it gives the connection up.
pub(crate) const TRANSPORT_BYTES_MAX: usize = 16 * 1024 * 1024;
/// Bytes one read of a WebSocket takes at most. The transport clears as many before every read, so
/// a large buffer costs more than the message in it.
pub(crate) const READ_BUFFER_BYTES: usize = 8 * 1024;
/// Bytes of a WebSocket message or HTTP body that are parsed. Larger ones get an error.
pub(crate) const MESSAGE_BYTES_MAX: usize = 2 * 1024 * 1024;
/// Connections at once beside those that have a session; who is silent gives way to who comes.
pub(crate) const GUESTS_MAX: usize = 256;
/// Bytes of the head of a request.
pub(crate) const HEAD_BYTES_MAX: usize = 64 * 1024;
/// Bytes of a message or body beyond which its client needs a place to send on: until it has one it
/// is not read.
pub(crate) const LARGE_BYTES: usize = 64 * 1024;
/// Such places.
pub(crate) const LARGE_MAX: usize = 4;
/// How long a connection may be between two requests, or a head on its way.
pub(crate) const HEAD_WAIT: Duration = Duration::from_secs(30);
/// How long a body may take.
pub(crate) const BODY_WAIT: Duration = Duration::from_secs(30);
/// How long a message that has a place may take.
pub(crate) const LARGE_WAIT: Duration = Duration::from_secs(30);
/// How long a client may take no byte of what it is sent before its connection ends.
pub(crate) const WRITE_WAIT: Duration = Duration::from_secs(30);
/// Characters of an episode or request id.
pub(crate) const ID_CHARS_MAX: usize = 255;
/// Errors reported for one message.
pub(crate) const FIELD_ERRORS_MAX: usize = 64;
/// Characters of a client's own text that are sent back to it.
pub(crate) const ECHO_CHARS_MAX: usize = 256;
/// Ignored configuration keys that are named.
pub(crate) const IGNORED_KEYS_MAX: usize = 64;

/// Ticks of one step.
pub(crate) const TICKS_PER_STEP_MAX: u32 = 200;
/// What passes at most while no step is asked for, where time goes on with that of the wall.
pub(crate) const IDLE_MAX: Duration = Duration::from_secs(30);
/// Of that, ticks that pass at once where guests look on: who steps meanwhile waits for them.
pub(crate) const PACED_TICKS_MAX: u32 = 4;
/// Steps of one episode before it is over.
pub(crate) const EPISODE_STEPS_MAX: u32 = 1_000_000;
/// Collisions listed in one episode's state.
pub(crate) const COLLISIONS_MAX: usize = 1_000;
/// Pedestrians of one group.
pub(crate) const GROUP_MAX: u32 = 50;
/// Vehicles, and pedestrians, of an episode beside the ego.
pub(crate) const CROWD_MAX: u32 = 200;
/// Characters of what a file tells a driver.
pub(crate) const PROMPT_CHARS_MAX: usize = 16 * 1024;
/// Bytes of a scenario's file.
pub(crate) const SCENARIO_BYTES_MAX: usize = 64 * 1024;
/// Files of a folder of scenarios that are listed.
pub(crate) const SCENARIO_FILES_MAX: usize = 1_000;
/// People who cross a road together.
pub(crate) const CROSSING_CROWD_MAX: u32 = 24;
/// Vehicles of one world that sessions of their own drive.
pub(crate) const EGOS_MAX: u32 = 64;
/// Distance within which an actor is near, in metres.
pub(crate) const NEARBY_M: f32 = 50.0;
/// Actors that the text of a scene lists; the list of near actors has them all.
pub(crate) const SCENE_ACTORS_MAX: usize = 10;
/// Parsed maps kept in memory.
pub(crate) const MAPS_MAX: NonZeroUsize = NonZeroUsize::new(16).unwrap();

/// Bytes that all episodes keep to make their worlds again, unless told otherwise.
pub(crate) const RECOVERY_BYTES_MAX: usize = RECOVERY_MIB << 20;
/// The same in MiB.
pub(crate) const RECOVERY_MIB: usize = 256;
/// How long a world outlives this service.
pub(crate) const WORLD_LEASE_MILLIS: u32 = 5_000;
/// How long guests are waited for in a world that took the place of the one that they were in.
pub(crate) const GUEST_LEASE_MILLIS: u32 = 5_000;
/// Answer time of one batch of ticks, whatever is asked.
pub(crate) const TICK_DEADLINE: Duration = Duration::from_secs(10);
/// What every tick of a batch adds to it: a world may be large, and its machine busy.
pub(crate) const TICK_PATIENCE: Duration = Duration::from_millis(250);
/// Answer time of the largest batch: clients of OpenEnv wait a minute, and are told before.
pub(crate) const TICK_DEADLINE_MAX: Duration = Duration::from_secs(55);
/// Answer time of anything else asked of a world.
pub(crate) const WORLD_DEADLINE: Duration = Duration::from_secs(10);
/// How often sessions are searched for idle ones.
pub(crate) const REAP_EVERY: Duration = Duration::from_secs(5);
/// Before a world is moved again that could not be.
pub(crate) const MOVE_AGAIN: Duration = Duration::from_secs(1);

/// States of episodes that a tenant's sessions keep to go on from.
pub(crate) const SAVED_MAX: usize = 256;
/// Sessions that go on from one with a single request.
pub(crate) const FORKS_MAX: u64 = schemas::limits::FORKS_PER_REQUEST_MAX as u64;
/// Bytes of their worlds.
pub(crate) const SAVED_BYTES_MAX: usize = 64 << 20;
/// One that nobody asks for goes after this.
pub(crate) const SAVED_IDLE: Duration = Duration::from_secs(600);
const _: () = assert!(MESSAGE_BYTES_MAX <= TRANSPORT_BYTES_MAX, "what is parsed must fit");
