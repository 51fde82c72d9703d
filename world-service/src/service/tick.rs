//! Ticks of one world: the way every step of every client takes.

use schemas::WorldId;
use schemas::wire::encode_frame;
use schemas::{
    Command, CommandReply, EncodedFrame, Error, ErrorCode, Frame, Halt, Tenant, Tick, TickItem,
    TickOutcome, limits,
};

use super::{Outlet, Recorded, Simulation};

/// Applies the commands, advances, publishes every frame, and gives the last one.
///
/// # Errors
/// [`ErrorCode::WrongTick`] before anything is changed; [`ErrorCode::WorldQuarantined`].
pub(super) fn tick_world<S: Simulation>(
    world: &mut Recorded<S>,
    tenant: &Tenant,
    item: &TickItem,
    outlet: &impl Outlet<S>,
) -> Result<TickOutcome, Error> {
    check_item(&**world, item)?;
    let begun = world.tick_number();
    let replies = world.run(item.world, &item.commands);
    let (mut collisions, mut sensors) = (Vec::new(), Vec::new());
    let mut frame = None;
    for count in 1..=item.tick_count {
        world.tick(item.world, item.dt_secs)?;
        sensors.extend_from_slice(world.sensors());
        if item.tick_count > 1 {
            collisions.extend_from_slice(world.collisions());
        }
        let is_last = count == item.tick_count;
        if is_last || outlet.has_listeners() {
            let present = world.frame();
            if is_last {
                note_halts(&present, begun);
            }
            let encoded = encode_frame(&present);
            outlet.publish(tenant, item.world, &encoded);
            frame = Some(encoded);
        }
    }
    let frame = frame.unwrap_or_else(|| encode_frame(&world.frame()));
    let due = item.tick_count > 0;
    let cameras_due = if due { world.cameras_due().to_vec() } else { Vec::new() };
    Ok(TickOutcome { frame, replies, collisions, sensors, cameras_due })
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
