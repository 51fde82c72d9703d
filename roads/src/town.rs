//! Towns of our own, written as OpenDRIVE text.
//!
//! A town is a plan of junctions and streets ([`plan`]). Streets become roads ([`street`]),
//! junctions become connecting roads ([`junction`]), the land between is filled with houses, trees
//! and lamps ([`block`]), and all of it is written down ([`write`]).

mod block;
mod draft;
mod furniture;
mod junction;
mod plan;
mod random;
mod street;
mod write;

use draft::TownDraft;

/// Names of the towns [`build`] knows.
pub fn names() -> impl Iterator<Item = &'static str> {
    ["Town10HD", "Town10HD_Opt"].into_iter()
}

/// The OpenDRIVE text of a generated town; `None` for a name that is not ours.
///
/// **Determinism:** the same name gives the same bytes. A name with `_Opt` gives the same town.
#[must_use]
pub fn build(name: &str) -> Option<String> {
    names().any(|known| known == name).then(|| {
        let plan = plan::inner_city();
        let mut draft = TownDraft::default();
        draft.roads.extend(plan.streets.iter().map(|street| street::road(&plan, street)));
        for node in 0..plan.nodes.len() {
            junction::build(&plan, node, &mut draft);
        }
        furniture::line_streets(&plan, &mut draft);
        block::fill(&plan, &mut draft);
        write::town(name, &draft)
    })
}
