//! Towns of our own, written as OpenDRIVE text.
//!
//! A town is a plan of junctions and streets (`plan`), one file per town. Streets become roads
//! (`street`), junctions become connecting roads (`junction`, `movement`) with lights and
//! signs (`priority`), the land between is filled (`block`, `lots`, `furniture`,
//! `crossing`), roads that programs ask for by CARLA's numbers come last (`named`), and all of it
//! is written down (`write`). `roundabout` and `one_way` add larger parts to a plan; `style` draws
//! new plans from a seed.

mod block;
mod clearance;
mod corner;
mod course;
mod crossing;
mod draft;
mod furniture;
mod junction;
mod lots;
mod movement;
mod named;
mod one_way;
mod plan;
mod priority;
mod profile;
pub(crate) mod random;
mod roundabout;
mod street;
mod style;
mod town01;
mod town02;
mod town03;
mod town04;
mod town05;
mod town06;
mod town07;
mod town10;
mod write;

use draft::TownDraft;
use plan::Plan;
use random::Random;

pub use style::Style;

/// What stands where in the land is drawn from this; any number gives a town.
const SEED: u64 = 0x0043_4155_5345_5759;

/// A town's two names and the function that plans it.
type Town = ([&'static str; 2], fn() -> Plan);

/// Every town.
const TOWNS: [Town; 8] = [
    (["Town01", "Town01_Opt"], town01::plan),
    (["Town02", "Town02_Opt"], town02::plan),
    (["Town03", "Town03_Opt"], town03::plan),
    (["Town04", "Town04_Opt"], town04::plan),
    (["Town05", "Town05_Opt"], town05::plan),
    (["Town06", "Town06_Opt"], town06::plan),
    (["Town07", "Town07_Opt"], town07::plan),
    (["Town10HD", "Town10HD_Opt"], town10::plan),
];

/// Names of the towns [`build`] knows.
pub fn names() -> impl Iterator<Item = &'static str> {
    TOWNS.into_iter().flat_map(|(names, _)| names)
}

/// The OpenDRIVE text of a generated town; `None` for a name that is not ours.
///
/// **Determinism:** the same name gives the same bytes. A name with `_Opt` gives the same town.
#[must_use]
pub fn build(name: &str) -> Option<String> {
    let (_, plan) = TOWNS.into_iter().find(|(names, _)| names.contains(&name))?;
    Some(build_plan(name, &plan(), SEED))
}

/// The OpenDRIVE text of a new town: blocks between streets, as drawn from the seed.
///
/// **Domain:** `blocks` along each side, taken as 2 when less and as 10 when more.
/// **Determinism:** the same arguments give the same bytes.
#[must_use]
pub fn build_styled(style: Style, seed: u64, blocks: usize) -> String {
    let name = format!("{style:?}_{seed}_{blocks}");
    build_plan(&name, &style::plan(style, seed, blocks), seed)
}

fn build_plan(name: &str, plan: &Plan, seed: u64) -> String {
    let mut draft = TownDraft::default();
    draft.roads.extend(plan.streets.iter().map(|street| street::road(plan, street)));
    for node in 0..plan.nodes.len() {
        junction::build(plan, node, &mut draft);
    }
    let mut random = Random::new(seed);
    furniture::line_streets(plan, &mut random, &mut draft);
    for (street, road) in plan.streets.iter().zip(&mut draft.roads) {
        crossing::add(street, road);
    }
    block::fill(plan, &mut random, &mut draft);
    lots::build(plan, &mut random, &mut draft);
    for loose in &plan.loose {
        draft.place(loose.at, loose.heading_rad, loose.object.clone());
    }
    named::add(plan, &mut draft);
    write::town(name, &draft)
}
