//! Boxes that change the friction of the tyres of vehicles inside them: CARLA's
//! `static.trigger.friction`.

use schemas::{ActorId, Attribute, Error, Vec3};

use crate::actor::{Actor, Altered, FRICTION_MAX, Vehicle};
use crate::attributes;
use crate::blueprint::Blueprint;
use crate::check;
use crate::overlap::OrientedBox;
use crate::world::State;

const ID: &str = "static.trigger.friction";
/// CARLA gives the half sizes in centimetres.
const M_PER_CM: f32 = 0.01;
const EXTENT_CM_MAX: f32 = 1.0e6;

struct Trigger {
    id: ActorId,
    bounds: OrientedBox,
    friction: f32,
}

/// # Errors
/// `InvalidArgument` for attributes that no trigger can have.
pub(crate) fn check(blueprint: &Blueprint, given: &[Attribute]) -> Result<(), Error> {
    if blueprint.id != ID {
        return Ok(());
    }
    check::range("friction", number(given, "friction"), 0.0, FRICTION_MAX, "")?;
    for id in ["extent_x", "extent_y", "extent_z"] {
        check::range(id, number(given, id), 0.0, EXTENT_CM_MAX, "cm")?;
    }
    Ok(())
}

/// A number that was given, or the blueprint's own; NaN for what is none.
fn number(given: &[Attribute], id: &str) -> f32 {
    let own = || blueprints::find(ID)?.attribute(id).map(|attribute| attribute.value.as_str());
    let text = attributes::value(given, id).or_else(own);
    text.and_then(|text| text.parse().ok()).unwrap_or(f32::NAN)
}

impl State {
    /// Gives the tyres of every vehicle the friction of the trigger it is in, and back their own
    /// when it is in none any more.
    pub(crate) fn heed_triggers(&mut self) {
        let triggers: Vec<Trigger> =
            self.actors.iter().filter_map(|actor| self.trigger(actor)).collect();
        for actor in &mut self.actors {
            let Some(body) = actor.rigid() else { continue };
            let blueprint = actor.blueprint();
            let Some(vehicle) = actor.vehicle_mut() else { continue };
            if triggers.is_empty() && vehicle.altered.is_none() {
                continue;
            }
            let pose = self.physics.state(body).world_from_body;
            let bounds = OrientedBox::new(&pose, blueprint);
            let inside = triggers.iter().find(|trigger| trigger.bounds.overlaps(&bounds));
            if vehicle.heed(inside) {
                // What stood on a slope may slide now.
                self.physics.wake(body);
            }
        }
    }

    fn trigger(&self, actor: &Actor) -> Option<Trigger> {
        if actor.blueprint().id != ID {
            return None;
        }
        let [x, y, z] =
            ["extent_x", "extent_y", "extent_z"].map(|id| number(&actor.attributes, id));
        let bounds = OrientedBox::of(&self.pose_of(actor), Vec3::new(x, y, z) * M_PER_CM);
        Some(Trigger { id: actor.id, bounds, friction: number(&actor.attributes, "friction") })
    }
}

impl Vehicle {
    /// Whether anything changed.
    fn heed(&mut self, trigger: Option<&Trigger>) -> bool {
        if self.altered.as_ref().map(|altered| altered.by) == trigger.map(|trigger| trigger.id) {
            return false;
        }
        let mut physics = self.tuning.fit().physics.clone();
        if let Some(altered) = self.altered.take() {
            for (wheel, friction) in physics.wheels.iter_mut().zip(altered.before) {
                wheel.tyre_friction = friction;
            }
        }
        if let Some(trigger) = trigger {
            let before = physics.wheels.iter().map(|wheel| wheel.tyre_friction).collect();
            self.altered = Some(Altered { by: trigger.id, before });
            for wheel in &mut physics.wheels {
                wheel.tyre_friction = trigger.friction;
            }
        }
        self.tuning = self.tuning.with(physics);
        true
    }
}
