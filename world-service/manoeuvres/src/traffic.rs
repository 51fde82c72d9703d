//! The fundamental diagram of the world's own traffic, beside the equilibrium of its model.

use std::fmt::Write;

use agents::Driver;
use schemas::AgentBehaviour::{self, Cautious, Normal};

use crate::Result;
use crate::plot::Plot;
use crate::ring::{Flow, LIMIT_KMH, Ring};

const VEHICLE: &str = "vehicle.tesla.model3";
/// Everybody alike, nobody overtakes.
const ALIKE: Ring = Ring { vehicle: VEHICLE, lane_count: 1, behaviours: &[Normal] };
/// As `SpawnTraffic` mixes drivers.
const MIXED: Ring =
    Ring { vehicle: VEHICLE, lane_count: 2, behaviours: &[Cautious, Normal, Normal] };
/// Vehicles on a lane of 1 km.
const COUNTS: [u32; 14] = [5, 10, 15, 20, 25, 30, 35, 40, 50, 65, 80, 100, 120, 135];
const POINTS: u16 = 300;

/// What `causeway bench traffic` writes.
pub struct TrafficReport {
    /// Markdown.
    pub text: String,
    /// SVG by the name of its file.
    pub plots: Vec<(&'static str, String)>,
}

/// Drives all densities; takes two minutes on one core.
///
/// # Errors
/// The world refused or diverged.
pub fn traffic() -> Result<TrafficReport> {
    let drive = |ring: Ring| COUNTS.iter().map(|count| ring.drive(*count)).collect::<Result<_>>();
    let (alike, mixed): (Vec<Flow>, Vec<Flow>) = (drive(ALIKE)?, drive(MIXED)?);
    let length_m = alike.first().map_or(0.0, |flow| flow.vehicle_length_m);
    let curve = |value: fn(f32, f32) -> f32| {
        let speeds = (0..POINTS).map(|at| LIMIT_KMH * f32::from(at) / f32::from(POINTS));
        let points = speeds.map(|kmh| {
            let density = ALIKE.steady_vehicles_per_km(kmh, length_m);
            (density, value(density, kmh))
        });
        points.collect::<Vec<_>>()
    };
    let points = |flows: &[Flow], value: fn(&Flow) -> f32| {
        flows.iter().map(|flow| (flow.vehicles_per_km, value(flow))).collect::<Vec<_>>()
    };
    let plot = |title, y, curve, value: fn(&Flow) -> f32| {
        let lines = vec![
            ("equilibrium of the model".to_owned(), curve),
            ("one lane, all alike".to_owned(), points(&alike, value)),
            ("two lanes, mixed drivers".to_owned(), points(&mixed, value)),
        ];
        Plot { title, x: "vehicles per km and lane", y, lines }.svg()
    };
    let flow = plot(
        "Flow over density",
        "vehicles per hour and lane",
        curve(|density, kmh| density * kmh),
        |flow| flow.vehicles_per_hour,
    );
    let speed = plot("Speed over density", "km/h", curve(|_, kmh| kmh), |flow| flow.speed_kmh);
    let plots = vec![("flow.svg", flow), ("speed.svg", speed)];
    Ok(TrafficReport { text: table(&alike, &mixed), plots })
}

fn table(alike: &[Flow], mixed: &[Flow]) -> String {
    let mut text = String::from(
        "| vehicles per km and lane | equilibrium, km/h | one lane, km/h | error | vehicles per h \
         | two lanes: equilibrium, km/h | two lanes, km/h | error | vehicles per h and lane | lane changes per min | contacts |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (one, two) in alike.iter().zip(mixed) {
        let steady_kmh = ALIKE.steady_kmh(one.vehicles_per_km, one.vehicle_length_m);
        let error = 100.0 * (one.speed_kmh / steady_kmh - 1.0);
        let mixed_kmh = MIXED.steady_kmh(two.vehicles_per_km, two.vehicle_length_m);
        let mixed_error = 100.0 * (two.speed_kmh / mixed_kmh - 1.0);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {:.0} | {steady_kmh:.1} | {:.1} | {error:+.1} % | {:.0} | {mixed_kmh:.1} | {:.1} \
             | {mixed_error:+.1} % | {:.0} | {} | {} |",
            one.vehicles_per_km,
            one.speed_kmh,
            one.vehicles_per_hour,
            two.speed_kmh,
            two.vehicles_per_hour,
            two.lane_changes,
            one.contacts + two.contacts
        );
    }
    text
}

impl Ring {
    /// Density at which everybody keeps a speed, by the intelligent driver model.
    fn steady_vehicles_per_km(self, speed_kmh: f32, length_m: f32) -> f32 {
        let gap_m = |behaviour: &AgentBehaviour| {
            Driver::steady_gap_m(*behaviour, speed_kmh / 3.6, LIMIT_KMH / 3.6)
        };
        let sum_m: f32 = self.behaviours.iter().map(gap_m).sum();
        1_000.0 / (sum_m / self.behaviours.len() as f32 + length_m)
    }

    /// The speed that everybody keeps at a density, by bisection.
    fn steady_kmh(self, vehicles_per_km: f32, length_m: f32) -> f32 {
        let (mut low, mut high) = (0.0, LIMIT_KMH);
        for _ in 0..40 {
            let middle = f32::midpoint(low, high);
            if self.steady_vehicles_per_km(middle, length_m) > vehicles_per_km {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn traffic_on_a_ring_flows_as_its_model_says() {
        for count in [20, 50] {
            let flow = ALIKE.drive(count).unwrap();
            let steady_kmh = ALIKE.steady_kmh(flow.vehicles_per_km, flow.vehicle_length_m);
            let error = flow.speed_kmh / steady_kmh - 1.0;
            assert!(error.abs() < 0.05 && flow.contacts == 0, "{flow:?}, {error}");
        }
    }

    /// What the second lane seems to cost is the cautious drivers on it.
    #[test]
    fn mixed_drivers_change_lanes_touch_nobody_and_flow_as_their_models_say() {
        let flow = MIXED.drive(25).unwrap();
        assert!(flow.lane_changes > 0 && flow.contacts == 0, "{flow:?}");
        let at = |ring: Ring| ring.steady_kmh(flow.vehicles_per_km, flow.vehicle_length_m);
        let (mixed_kmh, alike_kmh) = (at(MIXED), at(ALIKE));
        let error = flow.speed_kmh / mixed_kmh - 1.0;
        assert!(error.abs() < 0.05 && mixed_kmh < 0.93 * alike_kmh, "{flow:?}, {error}");
    }
}
