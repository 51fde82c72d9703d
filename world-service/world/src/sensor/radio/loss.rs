//! What a radio signal loses between two antennas, in dB.

use nalgebra::{ComplexField, RealField};
use schemas::Error;
use serde::{Deserialize, Serialize};

use super::super::config::Settings;

/// Metres per second.
const LIGHT_SPEED_MPS: f64 = 299_792_458.0;
/// Relative permittivity of the road, as CARLA takes it.
const ROAD_PERMITTIVITY: f64 = 1.02;
/// Formulas of distances have no end towards 0.
const DISTANCE_M_MIN: f64 = 0.1;

/// What lies between two antennas.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Sight {
    /// Nothing.
    Free,
    /// Vehicles only.
    Vehicles(Vec<Edge>),
    /// At least one thing that is no vehicle.
    Blocked,
}

/// The roof of a vehicle between two antennas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Edge {
    /// Above the straight line between the antennas.
    pub height_m: f64,
    /// From the one antenna, on the ground.
    pub before_m: f64,
    /// To the other.
    pub behind_m: f64,
}

/// The places of two antennas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Link {
    pub distance_m: f64,
    /// Above the lower of the two stations.
    pub heights_m: [f64; 2],
}

/// Where the roads are, which decides how fast signals fade.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Area {
    Highway,
    Rural,
    Urban,
}

/// CARLA's models.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Model {
    /// Of measurements: WINNER+.
    Winner,
    /// Of rays.
    Geometric,
}

/// CARLA's attributes of the propagation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Loss {
    model: Model,
    area: Area,
    frequency_ghz: f64,
    /// Of the log-distance model, for blocked paths.
    exponent: f64,
    reference_m: f64,
    /// `None`: as ETSI measured.
    fading_db: Option<f64>,
}

impl Loss {
    pub(super) fn new(settings: Settings) -> Result<Self, Error> {
        let area = [("highway", Area::Highway), ("rural", Area::Rural), ("urban", Area::Urban)];
        let model = [("winner", Model::Winner), ("geometric", Model::Geometric)];
        let custom_db = settings.number("custom_fading_stddev", 0.0, 0.0..=100.0)?;
        Ok(Self {
            model: settings.choice("path_loss_model", &model)?,
            area: settings.choice("scenario", &area)?,
            frequency_ghz: settings.number("frequency_ghz", 5.9, 0.01..=1_000.0)?,
            exponent: settings.number("path_loss_exponent", 2.7, 0.0..=100.0)?,
            reference_m: settings.number("d_ref", 1.0, 0.01..=10_000.0)?,
            fading_db: (!settings.flag("use_etsi_fading", true)?).then_some(custom_db),
        })
    }

    /// The loss without fading.
    pub(super) fn mean_db(&self, link: &Link, sight: &Sight) -> f64 {
        let distance_m = link.distance_m.max(DISTANCE_M_MIN);
        let edges_db = match sight {
            Sight::Vehicles(edges) => {
                edges.iter().map(|edge| self.knife_edge_db(edge)).fold(0.0, f64::max)
            }
            _ => 0.0,
        };
        let path_db = match (self.model, sight) {
            (Model::Winner, sight) => self.winner_db(distance_m, *sight == Sight::Blocked),
            (Model::Geometric, Sight::Free) => self.two_ray_db(distance_m, link.heights_m),
            (Model::Geometric, Sight::Vehicles(_)) => self.free_space_db(distance_m),
            (Model::Geometric, Sight::Blocked) => {
                let decades = log10(distance_m / self.reference_m);
                self.free_space_db(self.reference_m) + 10.0 * self.exponent * decades
            }
        };
        path_db + edges_db
    }

    /// Standard deviation of the fading.
    ///
    /// - **Source:** ETSI TR 103 257-1 V1.1.1, table 6; rural is the middle of the others.
    pub(super) fn fading_db(&self, sight: &Sight) -> f64 {
        self.fading_db.unwrap_or(match (sight, self.area) {
            (Sight::Blocked, _) => 6.8,
            (Sight::Free, Area::Highway) => 3.3,
            (Sight::Free, Area::Rural) => 4.25,
            (Sight::Free, Area::Urban) => 5.2,
            (Sight::Vehicles(_), Area::Highway) => 3.8,
            (Sight::Vehicles(_), Area::Rural) => 4.55,
            (Sight::Vehicles(_), Area::Urban) => 5.3,
        })
    }

    /// - **Source:** ETSI TR 103 257-1 V1.1.1, after WINNER+ D5.3.
    fn winner_db(&self, distance_m: f64, is_blocked: bool) -> f64 {
        let (d, f) = (log10(distance_m), log10(self.frequency_ghz));
        match self.area {
            _ if is_blocked => 36.85 + 30.0 * d + 18.9 * f,
            Area::Highway => 32.4 + 20.0 * d + 20.0 * f,
            Area::Rural | Area::Urban => 38.77 + 16.7 * d + 18.2 * f,
        }
    }

    /// - **Source:** Friis, "A note on a simple transmission formula", 1946.
    fn free_space_db(&self, distance_m: f64) -> f64 {
        20.0 * log10(4.0 * f64::pi() * distance_m / self.wave_m())
    }

    /// The straight ray and the one that the road reflects.
    ///
    /// - **Source:** Sommer, Joerer, Dressler, "On the applicability of two-ray path loss models
    ///   for vehicular network simulation", 2012.
    fn two_ray_db(&self, distance_m: f64, [one_m, other_m]: [f64; 2]) -> f64 {
        let square = |value: f64| value * value;
        let ground_m = (square(distance_m) - square(one_m - other_m)).max(square(DISTANCE_M_MIN));
        let ground_m = ComplexField::sqrt(ground_m);
        let reflected_m = ComplexField::sqrt(square(ground_m) + square(one_m + other_m));
        let (sine, cosine) = ((one_m + other_m) / reflected_m, ground_m / reflected_m);
        let root = ComplexField::sqrt(ROAD_PERMITTIVITY - square(cosine));
        let gamma = (sine - root) / (sine + root);
        let phase = f64::two_pi() / self.wave_m() * (distance_m - reflected_m);
        let (phase_sine, phase_cosine) = ComplexField::sin_cos(phase);
        let sum = square(1.0 + gamma * phase_cosine) + square(gamma * phase_sine);
        20.0 * log10(4.0 * f64::pi() * ground_m / (self.wave_m() * ComplexField::sqrt(sum)))
    }

    /// Below 0 for a roof far below the line, which loses nothing.
    ///
    /// - **Source:** ITU-R P.526, diffraction at a single knife edge. CARLA measures the height of
    ///   the roof from the ground instead of from the line of sight, which loses more.
    fn knife_edge_db(&self, edge: &Edge) -> f64 {
        let (before_m, behind_m) =
            (edge.before_m.max(DISTANCE_M_MIN), edge.behind_m.max(DISTANCE_M_MIN));
        let zone = 2.0 / self.wave_m() * (1.0 / before_m + 1.0 / behind_m);
        let v = edge.height_m * ComplexField::sqrt(zone);
        let from = v - 0.1;
        6.9 + 20.0 * log10(ComplexField::sqrt(from * from + 1.0) + from)
    }

    fn wave_m(&self) -> f64 {
        LIGHT_SPEED_MPS / (self.frequency_ghz * 1.0e9)
    }
}

fn log10(value: f64) -> f64 {
    ComplexField::log10(value)
}

#[cfg(test)]
mod tests {
    use schemas::Attribute;

    use super::*;

    fn loss(settings: &[(&str, &str)]) -> Loss {
        let attribute = |(id, value): &(&str, &str)| Attribute {
            id: (*id).to_owned(),
            value: (*value).to_owned(),
        };
        let attributes: Vec<Attribute> = settings.iter().map(attribute).collect();
        Loss::new(Settings(&attributes)).unwrap()
    }

    fn link(distance_m: f64) -> Link {
        Link { distance_m, heights_m: [1.5, 1.5] }
    }

    #[track_caller]
    fn near(found: f64, wanted: f64) {
        assert!((found - wanted).abs() < 0.05, "{found} dB instead of {wanted} dB");
    }

    /// Worked out by hand from the formulas of the sources at 5.9 GHz.
    #[test]
    fn losses_are_those_of_the_formulas() {
        let highway = loss(&[]);
        near(highway.mean_db(&link(100.0), &Sight::Free), 32.4 + 40.0 + 15.417);
        near(highway.mean_db(&link(100.0), &Sight::Blocked), 36.85 + 60.0 + 14.569);
        let urban = loss(&[("scenario", "urban")]);
        near(urban.mean_db(&link(10.0), &Sight::Free), 38.77 + 16.7 + 14.030);
        let rays = loss(&[("path_loss_model", "geometric")]);
        near(rays.mean_db(&link(100.0), &Sight::Blocked), 47.86 + 54.0);
        near(rays.mean_db(&link(100.0), &Sight::Vehicles(Vec::new())), 87.86);
    }

    #[test]
    fn a_reflected_ray_adds_and_cancels_about_the_free_loss() {
        let rays = loss(&[("path_loss_model", "geometric")]);
        let excess_db: Vec<f64> = (20..400)
            .map(|distance_m| {
                let distance_m = f64::from(distance_m);
                rays.mean_db(&link(distance_m), &Sight::Free) - rays.free_space_db(distance_m)
            })
            .collect();
        assert!(excess_db.iter().any(|db| *db > 3.0), "never cancels");
        assert!(excess_db.iter().any(|db| *db < -3.0), "never adds");
        assert!(excess_db.iter().all(|db| *db > -6.1), "more than twice the amplitude");
    }

    /// ITU-R P.526: 6 dB where the edge touches the line, more the higher it is, nothing far below.
    #[test]
    fn a_roof_in_the_line_of_sight_costs_six_decibels_and_more_above() {
        let urban = loss(&[]);
        let at = |height_m: f64| {
            let edge = Edge { height_m, before_m: 10.0, behind_m: 10.0 };
            let link = link(20.0);
            let free_db = urban.mean_db(&link, &Sight::Free);
            urban.mean_db(&link, &Sight::Vehicles(vec![edge])) - free_db
        };
        near(at(0.0), 6.03);
        assert!(at(0.5) > at(0.2) && at(0.2) > at(0.0));
        near(at(-1.0), 0.0);
        near(at(-1.0e9), 0.0);
    }

    #[test]
    fn fading_is_as_etsi_measured_or_as_it_is_given() {
        let vehicles = Sight::Vehicles(Vec::new());
        let wanted_db = [
            ("highway", [3.3, 3.8, 6.8]),
            ("rural", [4.25, 4.55, 6.8]),
            ("urban", [5.2, 5.3, 6.8]),
        ];
        for (area, wanted_db) in wanted_db {
            let etsi = loss(&[("scenario", area), ("custom_fading_stddev", "9")]);
            let found_db =
                [&Sight::Free, &vehicles, &Sight::Blocked].map(|sight| etsi.fading_db(sight));
            assert_eq!(found_db, wanted_db, "{area}");
        }
        let custom = loss(&[("use_etsi_fading", "false"), ("custom_fading_stddev", "1.5")]);
        assert_eq!([Sight::Free, vehicles].map(|sight| custom.fading_db(&sight)), [1.5, 1.5]);
        assert_eq!(loss(&[("use_etsi_fading", "false")]).fading_db(&Sight::Free), 0.0);
    }
}
