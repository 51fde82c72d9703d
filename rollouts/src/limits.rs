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
/// Starts that are prepared once and then restored.
pub const STARTS: usize = 1_024;
/// Longest time of an episode, in seconds.
pub const HORIZON_SECS_MAX: f32 = 86_400.0;
/// Largest weight of a reward's term.
pub const WEIGHT_MAX: f32 = 1.0e6;
