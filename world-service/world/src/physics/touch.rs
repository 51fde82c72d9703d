//! Who touches whom.

use blueprints::PropModel;
use rapier3d::prelude::{Group, InteractionGroups, InteractionTestMode};

/// Touches everything but what lies flat...
pub(super) const VEHICLE: InteractionGroups = only(Group::GROUP_1, Group::ALL);
/// ...which a car passes over, although its body dips when it brakes and leans in curves.
const FLAT: InteractionGroups = only(Group::GROUP_2, Group::ALL.difference(Group::GROUP_1));
/// People and things that stand.
pub(super) const ANYTHING: InteractionGroups = InteractionGroups::all();

pub(super) fn prop(model: &PropModel) -> InteractionGroups {
    if model.lies_flat() { FLAT } else { ANYTHING }
}

const fn only(memberships: Group, filter: Group) -> InteractionGroups {
    InteractionGroups::new(memberships, filter, InteractionTestMode::And)
}
