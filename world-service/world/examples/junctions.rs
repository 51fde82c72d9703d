//! How many vehicles of our traffic pass each junction of a town.
//!
//! `cargo run --release -p world --example junctions -- Town10HD_Opt 100 15` drives 100 vehicles
//! for 15 simulated minutes and prints, as JSON, passes by the OpenDRIVE id of the junction and the
//! mean speed. It drives on for as long again and prints the roads outside of junctions that each
//! vehicle took, with a minus for lanes to the right of the reference line.
#![allow(clippy::unwrap_used, reason = "an example stops at the first surprise")]

use std::collections::BTreeMap;
use std::sync::Arc;

use roads::{LaneTypes, Map};
use schemas::{ActorId, ActorKind, Command, Frame, TrafficCommand, WorldId};
use world::{Town, World, WorldConfig};

const DT_SECS: f64 = 0.05;
const TICKS_PER_MINUTE: u32 = 1_200;
/// Nobody gets through a junction between two looks.
const TICKS_PER_LOOK: u32 = 4;

fn main() {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap_or_else(|| "Town10HD_Opt".to_owned());
    let count: u32 = args.next().map_or(100, |count| count.parse().expect("a number of vehicles"));
    let minutes: u32 = args.next().map_or(30, |minutes| minutes.parse().expect("minutes"));
    let text = roads::town::build(&name).expect("one of our towns");
    let map = Arc::new(Map::parse(&name, &text).unwrap());
    let id = WorldId::new(1).unwrap();
    let town = Arc::new(Town::new(Arc::clone(&map)));
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: DT_SECS, map: town };
    let mut world = World::with_traffic(config).unwrap();
    world.apply(&Command::Traffic(TrafficCommand::Spawn { count, behaviour: None })).unwrap();

    let mut tally = Tally::default();
    for tick in 1..=2 * minutes * TICKS_PER_MINUTE {
        world.tick().unwrap();
        if tick.is_multiple_of(TICKS_PER_LOOK) {
            tally.look(&world.frame(), &map, tick <= minutes * TICKS_PER_MINUTE);
        }
    }
    tally.print();
}

/// Where vehicles have been.
#[derive(Default)]
struct Tally {
    inside: BTreeMap<ActorId, u32>,
    passes: BTreeMap<u32, u32>,
    routes: BTreeMap<ActorId, Vec<String>>,
    sum_mps: f64,
    samples: u32,
}

impl Tally {
    fn look(&mut self, frame: &Frame, map: &Map, counts: bool) {
        for actor in frame.actors.iter().filter(|actor| actor.kind == ActorKind::Vehicle) {
            if counts {
                self.sum_mps += f64::from(actor.linear_velocity_mps.norm());
                self.samples += 1;
            }
            let here: nalgebra::Vector3<f64> =
                nalgebra::convert(actor.world_from_actor.translation.vector);
            let Some(place) = map.nearest(here.into(), LaneTypes::DRIVING) else { continue };
            let lane = map.lane(&place);
            if lane.is_junction {
                let junction = lane.junction_id.unwrap_or_default();
                if self.inside.insert(actor.id, junction) != Some(junction) && counts {
                    *self.passes.entry(junction).or_default() += 1;
                }
                continue;
            }
            self.inside.remove(&actor.id);
            let sign = if place.lane < 0 { "-" } else { "" };
            let road = format!("\"{sign}{}\"", place.road);
            let route = self.routes.entry(actor.id).or_default();
            if route.last() != Some(&road) {
                route.push(road);
            }
        }
    }

    fn print(&self) {
        let passes = self.passes.iter().map(|(id, count)| format!("\"{id}\": {count}"));
        let routes = self.routes.values().map(|roads| format!("[{}]", roads.join(", ")));
        println!(
            "{{\"mean_mps\": {:.3}, \"passes\": {{{}}}, \"routes\": [{}]}}",
            self.sum_mps / f64::from(self.samples.max(1)),
            passes.collect::<Vec<_>>().join(", "),
            routes.collect::<Vec<_>>().join(",\n")
        );
    }
}
