//! All blueprints together.

use std::sync::LazyLock;

use crate::attribute::{Attribute, AttributeKind, common};
use crate::{Blueprint, Class, alias, prop, sensor, traffic, vehicle, walker};

/// Every blueprint, ordered by id, built once; an index into it names one within one version.
pub fn all() -> &'static [Blueprint] {
    static ALL: LazyLock<Vec<Blueprint>> = LazyLock::new(|| {
        let mut all: Vec<Blueprint> = vehicle::blueprints()
            .chain(walker::blueprints())
            .chain(prop::blueprints())
            .chain(sensor::blueprints())
            .chain(traffic::blueprints())
            .chain(bodyless())
            .collect();
        all.sort_by(|a, b| a.id.cmp(&b.id));
        all
    });
    &ALL
}

/// The blueprint with this id or old spelling.
pub fn find(id: &str) -> Option<&'static Blueprint> {
    index_of(id).and_then(get)
}

/// Index in [`all`] of the blueprint with this id or old spelling.
pub fn index_of(id: &str) -> Option<u16> {
    let id = alias::canonical(id);
    let index = all().binary_search_by(|blueprint| blueprint.id.as_str().cmp(id)).ok()?;
    u16::try_from(index).ok()
}

/// The blueprint at an index of [`index_of`].
pub fn get(index: u16) -> Option<&'static Blueprint> {
    all().get(usize::from(index))
}

/// What a client keeps in the world without a body.
fn bodyless() -> impl Iterator<Item = Blueprint> {
    let plain = |id: &str, class: Class| Blueprint::new(id, class, true, common(id, &["default"]));
    let mut trigger = plain("static.trigger.friction", Class::Trigger);
    let number = |id, value| Attribute::open(id, AttributeKind::Float, &[value]);
    trigger.attributes.extend([
        number("friction", "3.5"),
        number("extent_x", "1.0"),
        number("extent_y", "1.0"),
        number("extent_z", "1.0"),
    ]);
    [
        plain("controller.ai.walker", Class::Controller),
        Blueprint::new("spectator", Class::Spectator, false, Vec::new()),
        plain("util.actor.empty", Class::Empty),
        trigger,
    ]
    .into_iter()
}
