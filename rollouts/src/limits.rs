//! Every bound of a batch of worlds, in one place.

/// Length of a tick, in seconds.
pub const TICK_SECS: f64 = 0.05;
/// Worlds of one batch.
pub const WORLDS_MAX: usize = 16_384;
/// Agents of one world.
pub const AGENTS_PER_WORLD_MAX: usize = 256;
/// Rows, which is agents of all worlds, of one batch.
pub const ROWS_MAX: usize = 65_536;
/// Ticks for which one action holds.
pub const DECISION_TICKS_MAX: u32 = 100;
/// Pairs of a start and a goal that are drawn for a task in a town.
pub const PAIRS_MAX: usize = 256;
/// Starts that are prepared once and then restored, in worlds with nobody but agents.
pub const STARTS: usize = 1_024;
/// The same in worlds with as many others as can be: each takes memory by who is in it.
pub const STARTS_MIN: usize = 32;
/// Longest time of an episode, in seconds.
pub const HORIZON_SECS_MAX: f32 = 86_400.0;
/// Largest weight of a reward's term.
pub const WEIGHT_MAX: f32 = 1.0e6;
/// Cars of a world's own traffic, and people in it.
pub const OTHERS_MAX: usize = 512;
/// Cars that a task lets stand for each agent.
pub const STANDING_MAX: usize = 16;
/// Agents, cars and people of all worlds of a batch.
pub const BODIES_MAX: usize = 262_144;
/// Bytes of a task's text.
pub const TASK_BYTES_MAX: usize = 64 * 1024;
/// Kinds of turns that a task asks for.
pub const TURNS_MAX: usize = 16;
/// Weathers that a task names of each kind, and a spec.
pub const WEATHERS_MAX: usize = 32;
/// Longest way that a task may ask for, in metres.
pub const WAY_M_MAX: f32 = 100_000.0;
