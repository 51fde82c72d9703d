//! Radio between V2X sensors: what is in the air in one tick, and what of it arrives where.

mod loss;

use schemas::{ActorId, AwarenessMessage, CustomMessage, Error, Received, SemanticTag};
use schemas::{StationKind, Vec3};
use serde::{Deserialize, Serialize};

use super::config::Settings;
use super::mount::{Mount, Surroundings};
use super::noise::Noise;
use crate::rays::{Hit, Ray, Stack};
use loss::{Edge, Link, Loss, Sight};

/// Antennas stand this high above what carries them.
const ANTENNA_M: f32 = 0.02;
/// Height of the mast of a road side unit, of which the world knows no size.
const MAST_M: f32 = 6.0;
/// Scenery this near to an antenna carries it.
const CARRIED_M: f32 = 0.5;
/// Strongest power and gain.
const DECIBELS_MAX: f64 = 1_000.0;
/// Farthest distance at which messages are looked at.
const FILTER_M_MAX: f64 = 100_000.0;

/// CARLA's attributes that both V2X sensors have.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Radio {
    power_dbm: f64,
    sensitivity_dbm: f64,
    /// Of both antennas.
    gain_db: f64,
    filter_m: f64,
    loss: Loss,
}

/// Where a message comes from or goes to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Antenna {
    /// The actor that the sensor hangs on, which does not shade it.
    pub host: Option<ActorId>,
    /// World frame.
    position_m: Vec3,
    /// Height of what it stands on.
    foot_m: f32,
}

/// What one sensor sends in one tick.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Transmission {
    pub sensor: ActorId,
    pub antenna: Antenna,
    pub power_dbm: f64,
    pub content: Content,
}

/// What is said.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Content {
    Awareness(AwarenessMessage),
    Texts { channel: String, messages: Vec<CustomMessage> },
}

impl Antenna {
    /// On top of the box of the sensor's host; `None` without host.
    pub(super) fn on_host(mount: &Mount, around: &Surroundings) -> Option<Self> {
        let host = mount.host?;
        let station = (around.station)(host)?;
        let foot_m = station.carrier.world_from_actor.translation.vector.z;
        let is_mast = station.kind == StationKind::RoadSideUnit;
        let above_m = if is_mast { MAST_M } else { ANTENNA_M };
        Some(Self { host: Some(host), position_m: station.carrier.top_m(above_m), foot_m })
    }

    /// At the sensor itself.
    pub(super) fn on_sensor(mount: &Mount, around: &Surroundings) -> Self {
        let position_m = mount.world_from_sensor.translation.vector + Vec3::z() * ANTENNA_M;
        let host = mount.host.and_then(|host| (around.station)(host));
        let foot_m = host.map_or(position_m.z, |station| {
            station.carrier.world_from_actor.translation.vector.z.min(position_m.z)
        });
        Self { host: mount.host, position_m, foot_m }
    }
}

impl Radio {
    pub(super) fn new(settings: Settings) -> Result<Self, Error> {
        let decibels = |id, default| settings.number(id, default, -DECIBELS_MAX..=DECIBELS_MAX);
        Ok(Self {
            power_dbm: decibels("transmit_power", 21.5)?,
            sensitivity_dbm: decibels("receiver_sensitivity", -99.0)?,
            gain_db: decibels("combined_antenna_gain", 10.0)?,
            filter_m: settings.number("filter_distance", 500.0, 0.0..=FILTER_M_MAX)?,
            loss: Loss::new(settings)?,
        })
    }

    pub(super) fn transmission(
        &self,
        sensor: ActorId,
        antenna: Antenna,
        content: Content,
    ) -> Transmission {
        Transmission { sensor, antenna, power_dbm: self.power_dbm, content }
    }

    /// The messages in the air that `wanted` gives and that arrive, in the order of their senders.
    pub(super) fn receive<Message>(
        &self,
        antenna: &Antenna,
        around: &Surroundings,
        noise: &mut Noise,
        wanted: impl Fn(&Transmission) -> Vec<Message>,
    ) -> Vec<Received<Message>> {
        let mut received = Vec::new();
        for sent in around.air {
            let messages = wanted(sent);
            if messages.is_empty() {
                continue;
            }
            let Some(power_dbm) = self.power_dbm(sent, antenna, around, noise) else { continue };
            let power_dbm = power_dbm as f32;
            received.extend(messages.into_iter().map(|message| Received { power_dbm, message }));
        }
        received
    }

    /// What arrives of a transmission; `None` for too little, and from too far.
    fn power_dbm(
        &self,
        sent: &Transmission,
        antenna: &Antenna,
        around: &Surroundings,
        noise: &mut Noise,
    ) -> Option<f64> {
        let (from, to) = (&sent.antenna, antenna);
        let distance_m = f64::from((to.position_m - from.position_m).norm());
        if distance_m >= self.filter_m {
            return None;
        }
        let lower_m = from.foot_m.min(to.foot_m);
        let height_m = |antenna: &Antenna| f64::from(antenna.position_m.z - lower_m);
        let link = Link { distance_m, heights_m: [height_m(from), height_m(to)] };
        let sight = sight(from, to, around);
        let fading_db = noise.normal(self.loss.fading_db(&sight));
        let loss_db = self.loss.mean_db(&link, &sight) + fading_db;
        let power_dbm = sent.power_dbm + self.gain_db - loss_db;
        (power_dbm >= self.sensitivity_dbm).then_some(power_dbm)
    }
}

/// What is between two antennas. Walkers do not count, as in CARLA.
fn sight(from: &Antenna, to: &Antenna, around: &Surroundings) -> Sight {
    let along_m = to.position_m - from.position_m;
    let Some(direction) = along_m.try_normalize(f32::MIN_POSITIVE) else { return Sight::Free };
    let ray = Ray::new(from.position_m, direction);
    let reach_m = along_m.norm();
    let hits = around.sight.scene().all(&ray, reach_m, &mut Stack::new());
    let is_between = |hit: &&Hit| {
        let is_end = match hit.actor {
            Some(_) => hit.actor == from.host || hit.actor == to.host,
            None => hit.distance_m.min(reach_m - hit.distance_m) < CARRIED_M,
        };
        !is_end && hit.tag != SemanticTag::Pedestrians.number()
    };
    let mut edges = Vec::new();
    for hit in hits.iter().filter(is_between) {
        match edge(hit, from, to, around) {
            Some(edge) => edges.push(edge),
            None => return Sight::Blocked,
        }
    }
    if edges.is_empty() { Sight::Free } else { Sight::Vehicles(edges) }
}

/// The roof that a hit belongs to; `None` for what is no vehicle.
fn edge(hit: &Hit, from: &Antenna, to: &Antenna, around: &Surroundings) -> Option<Edge> {
    let station = (around.station)(hit.actor?).filter(|station| station.has_wheels)?;
    let top_m = station.carrier.top_m(0.0);
    let away_m = |antenna: &Antenna| (top_m - antenna.position_m).xy().norm();
    let (before_m, behind_m) = (away_m(from), away_m(to));
    let share = before_m / (before_m + behind_m).max(f32::MIN_POSITIVE);
    let line_m = from.position_m.z + share * (to.position_m.z - from.position_m.z);
    Some(Edge {
        height_m: f64::from(top_m.z - line_m),
        before_m: before_m.into(),
        behind_m: behind_m.into(),
    })
}
