//! The first difference of two frames.

use std::fmt::{self, Debug};

use schemas::{ActorId, Frame, Tick};

/// Where a replay differs from its journal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The first tick that differs.
    pub tick: Tick,
    /// Its first actor that does; `None` for what belongs to no actor.
    pub actor: Option<ActorId>,
    /// What of it.
    pub field: &'static str,
    /// As written.
    pub recorded: String,
    /// As it came out now.
    pub replayed: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tick, actor, field, recorded, replayed } = self;
        write!(f, "{tick}, ")?;
        if let Some(actor) = actor {
            write!(f, "{actor}, ")?;
        }
        write!(f, "{field}: recorded {recorded}, replayed {replayed}")
    }
}

/// Field, recorded, replayed.
type Values = (&'static str, String, String);

fn values(field: &'static str, recorded: &impl Debug, replayed: &impl Debug) -> Values {
    (field, format!("{recorded:?}"), format!("{replayed:?}"))
}

/// The first of these fields in which two values differ.
macro_rules! first_of {
    ($a:expr, $b:expr; $($field:ident),+) => {
        None$(.or_else(|| {
            ($a.$field != $b.$field).then(|| values(stringify!($field), &$a.$field, &$b.$field))
        }))+
    };
}

/// Actors first: what differs for the world as a whole mostly follows from one of them.
pub(super) fn difference(recorded: &Frame, replayed: &Frame) -> Option<Difference> {
    if recorded == replayed {
        return None;
    }
    let found = |actor, (field, recorded_value, replayed_value): Values| Difference {
        tick: recorded.tick,
        actor,
        field,
        recorded: recorded_value,
        replayed: replayed_value,
    };
    for actor in &recorded.actors {
        let Some(other) = replayed.actor(actor.id) else {
            return Some(found(Some(actor.id), values("actor", &"there", &"not there")));
        };
        let first: Option<Values> = first_of!(actor, other;
            kind, type_index, parent, control, walker, gear, world_from_actor, linear_velocity_mps,
            angular_velocity_radps, linear_acceleration_mps2, road_wheel_rad, box_centre_m,
            box_half_extent_m, colour_rgb, lights, doors, failure, speed_limit_mps, traffic_light,
            gait_rad);
        let any = || (actor != other).then(|| values("state", actor, other));
        if let Some(first) = first.or_else(any) {
            return Some(found(Some(actor.id), first));
        }
    }
    if let Some(new) = replayed.actors.iter().find(|actor| recorded.actor(actor.id).is_none()) {
        return Some(found(Some(new.id), values("actor", &"not there", &"there")));
    }
    let whole: Option<Values> = first_of!(recorded, replayed;
        tick, dt_secs, sim_secs, seed, map, weather, types, collisions, traffic_lights, agents,
        halted, rules_broken, walker_poses, state_hash);
    let whole = whole.unwrap_or_else(|| values("frame", recorded, replayed));
    Some(found(None, whole))
}
