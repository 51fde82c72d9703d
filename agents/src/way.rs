//! The shortest ways from a place to others as points, for whoever measures a drive against one.

use roads::{Map, Waypoint};
use schemas::{Pose, Vec3};

use crate::network::{Lane, LanePoint, Network, Place, Stop};
use crate::path::Leg;
use crate::route::{self, Reach};

/// A place on a way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WayPoint {
    /// From the start of the way.
    pub at_m: f32,
    /// Middle of the lane, or of the change between two lanes, on the ground.
    pub point_m: Vec3,
    /// Of the way, counter-clockwise from x; jumps by whole turns may occur between points.
    pub heading_rad: f32,
    /// Positive to the left.
    pub curvature_per_m: f32,
    /// 0 where none is known.
    pub limit_mps: f32,
    /// The junction that the lane leads through.
    pub junction: Option<u32>,
    /// The place on the lane; on that before, while the way changes to another.
    pub on: Waypoint,
}

/// A place on a lane, as the ends of ways are.
#[derive(Clone, Copy, Debug)]
pub struct Spot(Place);

/// The shortest ways from one spot, over lanes and allowed lane changes.
#[derive(Debug)]
pub struct Ways<'n> {
    network: &'n Network,
    reach: Reach,
}

impl Network {
    /// The spot of a vehicle; `None` beside all lanes.
    #[must_use]
    pub fn spot(&self, map: &Map, pose: &Pose) -> Option<Spot> {
        self.vehicle_place(map, pose).map(Spot)
    }

    /// - **Cost:** that of a search through all lanes, for all goals together.
    #[must_use]
    pub fn ways(&self, from: Spot) -> Ways<'_> {
        Ways { network: self, reach: route::reach(self, from.0) }
    }
}

impl<'n> Ways<'n> {
    /// The way to one goal; `None` where none leads there.
    #[must_use]
    pub fn to(&self, goal: Spot) -> Option<Way<'n>> {
        let (_, legs) = self.reach.plan(self.network, goal.0)?;
        Some(Way { network: self.network, legs, end: goal.0 })
    }
}

/// The shortest way to one goal.
#[derive(Debug)]
pub struct Way<'n> {
    network: &'n Network,
    legs: Vec<Leg>,
    end: Place,
}

impl Way<'_> {
    /// How long it is.
    #[must_use]
    pub fn length_m(&self) -> f32 {
        self.legs.iter().map(|leg| leg.length_m().max(0.0)).sum()
    }

    /// Whether it leads over lanes of a roundabout's ring.
    #[must_use]
    pub fn is_around_ring(&self) -> bool {
        self.legs.iter().any(|leg| self.network.lane(leg.lane).is_some_and(|lane| lane.is_ring))
    }

    /// Whether a light holds whoever drives it; of several that have one line those do that speak
    /// to the way that it takes behind that.
    #[must_use]
    pub fn is_held_by(&self, light: u32) -> bool {
        let why = Stop::Light(light);
        let legs = self.legs.iter().enumerate().filter(|(_, leg)| leg.onto.is_none());
        let passed = legs.filter_map(|(index, leg)| {
            let on_leg = |at_m: f32| (leg.from_m..=leg.to_m).contains(&at_m);
            let lane = self.network.lane(leg.lane)?;
            let is_passed = lane.stops.iter().any(|line| line.why == why && on_leg(line.at_m));
            let next = self.legs.get(index + 1).map(|next| next.lane);
            is_passed.then(|| lane.holds(why, next))
        });
        let passed: Vec<bool> = passed.collect();
        passed.is_empty() || passed.contains(&true)
    }

    /// Headings along it, where its lanes have points and where it goes from one to the next, each
    /// with the junction there: what is enough to tell its turns.
    pub fn headings(&self) -> impl Iterator<Item = (f32, Option<u32>)> + '_ {
        self.legs.iter().flat_map(move |leg| {
            let lane = self.network.lane(leg.lane);
            let within = lane.map_or(&[][..], |lane| lane.between(leg.from_m, leg.to_m));
            let ends = [leg.from_m, leg.to_m].map(|at_m| leg.point(self.network, at_m));
            let changes = leg.onto.is_some();
            let within = within.iter().filter_map(move |point| match changes {
                true => leg.point(self.network, point.at_m),
                false => Some(*point),
            });
            let points = ends[0].into_iter().chain(within).chain(ends[1]);
            points.map(move |point| (point.heading_rad, lane.and_then(|lane| lane.junction)))
        })
    }

    /// One point every `step_m` and one at its end.
    ///
    /// - **Domain:** `step_m` above 0.
    #[must_use]
    pub fn points(&self, step_m: f32) -> Vec<WayPoint> {
        let mut points = Vec::new();
        let (mut at_m, mut done_m) = (0.0, 0.0);
        for leg in &self.legs {
            let length_m = leg.length_m().max(0.0);
            let Some(lane) = self.network.lane(leg.lane) else { continue };
            while at_m < done_m + length_m {
                let on_lane_m = leg.from_m + at_m - done_m;
                let point = leg.point(self.network, on_lane_m);
                points.extend(point.map(|point| way_point(&point, at_m, lane, on_lane_m)));
                at_m += step_m;
            }
            done_m += length_m;
        }
        if let Some(lane) = self.network.lane(self.end.lane) {
            points.push(way_point(&lane.at(self.end.at_m), done_m, lane, self.end.at_m));
        }
        points
    }
}

fn way_point(point: &LanePoint, at_m: f32, lane: &Lane, on_lane_m: f32) -> WayPoint {
    WayPoint {
        at_m,
        point_m: point.point_m,
        heading_rad: point.heading_rad,
        curvature_per_m: point.curvature_per_m,
        limit_mps: point.limit_mps,
        junction: lane.junction,
        on: lane.waypoint(on_lane_m),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_leads_from_start_to_goal_in_even_steps_without_jumps() {
        let text = roads::town::build("Town03_Opt").unwrap();
        let map = Map::parse("Town03_Opt", &text).unwrap();
        let network = Network::new(&map);
        let places = network.places(60.0);
        // The way between them changes no lane within a few metres.
        let (start, goal) = (places[0], places[places.len() * 11 / 13]);
        let [from, to] = [&start, &goal].map(|place| network.spot(&map, place).unwrap());
        let found = network.ways(from).to(to).unwrap();
        let way = found.points(1.0);
        assert!((way[way.len() - 1].at_m - found.length_m()).abs() < 0.01);
        let ends = [(&start, way[0]), (&goal, way[way.len() - 1])];
        for (place, point) in ends {
            assert!((place.translation.vector - point.point_m).norm() < 0.5, "{point:?}");
        }
        for pair in way.windows(2) {
            let step_m = pair[1].at_m - pair[0].at_m;
            let apart_m = (pair[1].point_m - pair[0].point_m).norm();
            assert!(step_m <= 1.001 && (apart_m - step_m).abs() < 0.2, "{pair:?}");
        }
        assert!(way.iter().any(|point| point.junction.is_some()));
    }
}
