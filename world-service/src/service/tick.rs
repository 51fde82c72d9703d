//! Ticks of one world: the way every step of every client takes.

use schemas::WorldId;
use schemas::wire::encode_frame;
use schemas::{
    Collision, Command, CommandReply, EncodedFrame, Error, ErrorCode, Frame, Halt, SensorDatum,
    Tenant, Tick, TickItem, TickOutcome, limits,
};

use super::{Outlet, Recorded, Simulation};

/// A request for ticks under way: its commands are applied, and some of its ticks done.
pub(super) struct Progress {
    replies: Vec<CommandReply>,
    collisions: Vec<Collision>,
    sensors: Vec<SensorDatum>,
    /// Of the last tick, where anybody needs it.
    frame: Option<EncodedFrame>,
    begun: Tick,
    done: u32,
}

impl Progress {
    /// Applies the commands of an item that was [checked](check_item).
    pub(super) fn begin<S: Simulation>(world: &mut Recorded<S>, item: &TickItem) -> Self {
        let begun = world.tick_number();
        let replies = world.run(item.world, &item.commands);
        let (collisions, sensors) = (Vec::new(), Vec::new());
        Self { replies, collisions, sensors, frame: None, begun, done: 0 }
    }

    pub(super) fn is_over(&self, item: &TickItem) -> bool {
        self.done >= item.tick_count
    }

    /// Does one tick and publishes its frame.
    ///
    /// # Errors
    /// [`ErrorCode::WorldQuarantined`].
    pub(super) fn advance<S: Simulation>(
        &mut self,
        world: &mut Recorded<S>,
        tenant: &Tenant,
        item: &TickItem,
        outlet: &impl Outlet<S>,
    ) -> Result<(), Error> {
        let kept = world.tick(item.world, item.dt_secs)?;
        self.done += 1;
        self.sensors.extend_from_slice(world.sensors());
        if item.tick_count > 1 {
            self.collisions.extend_from_slice(world.collisions());
        }
        let is_last = self.is_over(item);
        if is_last || outlet.has_listeners() {
            let (present, encoded) = kept.unwrap_or_else(|| {
                let present = world.frame();
                let encoded = encode_frame(&present);
                (present, encoded)
            });
            if is_last {
                note_halts(&present, self.begun);
            }
            outlet.publish(tenant, item.world, &encoded);
            self.frame = Some(encoded);
        }
        Ok(())
    }

    /// What came of it, once it is over.
    pub(super) fn outcome<S: Simulation>(self, world: &Recorded<S>) -> TickOutcome {
        let Self { replies, collisions, sensors, frame, done, .. } = self;
        let frame = frame.unwrap_or_else(|| encode_frame(&world.frame()));
        let cameras_due = if done > 0 { world.cameras_due().to_vec() } else { Vec::new() };
        let told = TickOutcome::new(frame);
        TickOutcome { replies, collisions, sensors, cameras_due, ..told }
    }
}

/// Carries out a [checked](check_item) item in one go.
///
/// # Errors
/// [`ErrorCode::WorldQuarantined`].
pub(super) fn tick_world<S: Simulation>(
    world: &mut Recorded<S>,
    tenant: &Tenant,
    item: &TickItem,
    outlet: &impl Outlet<S>,
) -> Result<TickOutcome, Error> {
    let mut progress = Progress::begin(world, item);
    while !progress.is_over(item) {
        progress.advance(world, tenant, item, outlet)?;
    }
    Ok(progress.outcome(world))
}

fn note_halts(frame: &Frame, begun: Tick) {
    for halt in frame.halted_since(begun) {
        let Halt { tick, actor, reason } = halt;
        let (world, actor, tick) = (frame.world.get(), actor.get(), tick.0);
        tracing::warn!(world, actor, tick, %reason, "an actor was put to rest");
    }
}

/// The first frame of a world, and the replies to the commands that furnished it.
///
/// # Errors
/// That of the first command that is refused.
pub(super) fn furnish<S: Simulation>(
    world: &mut S,
    commands: &[Command],
) -> Result<(EncodedFrame, Vec<CommandReply>), Error> {
    let mut replies = Vec::with_capacity(commands.len());
    for (index, command) in commands.iter().enumerate() {
        let spawned = world.apply(command).map_err(|error| Error {
            message: format!("command {} of {}: {}", index + 1, commands.len(), error.message),
            ..error
        })?;
        replies.push(Ok(spawned));
    }
    Ok((encode_frame(&world.frame()), replies))
}

/// Before anything is changed.
///
/// # Errors
/// [`ErrorCode::WrongTick`], and [`ErrorCode::InvalidArgument`] for a step out of range.
pub(super) fn check_item<S: Simulation>(world: &S, item: &TickItem) -> Result<(), Error> {
    check_tick(world, item)?;
    check_dt(item)
}

fn check_tick<S: Simulation>(world: &S, item: &TickItem) -> Result<(), Error> {
    let found = world.tick_number();
    match item.expected_tick {
        Some(wanted) if wanted != found => Err(wrong_tick(item.world, wanted, found)),
        _ => Ok(()),
    }
}

/// Before the commands, so that a refusal leaves the world as it was.
fn check_dt(item: &TickItem) -> Result<(), Error> {
    let allowed = limits::DT_SECS_MIN..=limits::DT_SECS_MAX;
    match item.dt_secs {
        Some(dt_secs) if !allowed.contains(&dt_secs) => Err(Error::new(
            ErrorCode::InvalidArgument,
            "the step is out of range; nothing was done",
        )
        .wanted(format!("{} to {} s", limits::DT_SECS_MIN, limits::DT_SECS_MAX))
        .found(format!("{dt_secs} s"))),
        _ => Ok(()),
    }
}

fn wrong_tick(world: WorldId, wanted: schemas::Tick, found: schemas::Tick) -> Error {
    Error::new(
        ErrorCode::WrongTick,
        format!("{world} is not at the expected tick; nothing was done"),
    )
    .wanted(wanted)
    .found(found)
}
