//! Stop signs, yield signs and speed limits, and where they count.

mod crossing;

use std::collections::BTreeMap;

use crate::landmarks::Landmark;
use crate::map::Map;
use crate::signals::{Signal, SignalPose};
use crate::trigger::{BoxSize, TriggerBox, driving_lanes};

/// Half the size of the boxes of stop and yield signs, in lane widths.
const STOP_SHARE: f64 = 0.45;
/// Half the size of the boxes of speed limits, in lane widths.
const LIMIT_SHARE: f64 = 0.35;
/// Speed limits that have a blueprint, in km/h: the tens from 10 to 130.
const LIMIT_KMH_MAX: u32 = 130;

/// What a sign says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SignKind {
    /// Stop, then go when the way is free.
    Stop,
    /// Let others go first.
    Yield,
    /// Drive no faster from here on.
    SpeedLimit {
        /// The limit in metres per second.
        limit_mps: f64,
    },
}

impl SignKind {
    /// The blueprint of CARLA's actor for such a sign; `None` for a limit that CARLA has no sign
    /// for.
    #[must_use]
    pub fn blueprint(self) -> Option<String> {
        match self {
            Self::Stop => Some("traffic.stop".to_owned()),
            Self::Yield => Some("traffic.yield".to_owned()),
            Self::SpeedLimit { limit_mps } => {
                let kmh = (limit_mps * 3.6).round();
                (10..=LIMIT_KMH_MAX)
                    .step_by(10)
                    .find(|known| f64::from(*known) == kmh)
                    .map(|kmh| format!("traffic.speed_limit.{kmh}"))
            }
        }
    }
}

/// A sign of the map.
#[derive(Clone, Debug, PartialEq)]
pub struct TrafficSign {
    /// OpenDRIVE id of the signal.
    pub id: String,
    /// What it says.
    pub kind: SignKind,
    /// Where it stands.
    pub pose: SignalPose,
    /// One on every driving lane it applies to, right before its place there.
    pub boxes: Vec<TriggerBox>,
    /// Of a stop or yield sign on a way through a junction: boxes along the ways that cross it.
    pub crossing: Vec<TriggerBox>,
}

impl Map {
    /// All stop signs, yield signs and speed limits, in the order of the file.
    ///
    /// **Cost:** linear in the signals of the map.
    #[must_use]
    pub fn traffic_signs(&self) -> Vec<TrafficSign> {
        self.traffic_signs_within(&mut crossing::Budget::of_map())
    }

    /// Whether every stop and yield sign knows all ways that cross its own.
    pub(crate) fn has_all_crossings(&self) -> bool {
        let mut budget = crossing::Budget::of_map();
        self.traffic_signs_within(&mut budget);
        !budget.is_spent()
    }

    fn traffic_signs_within(&self, left: &mut crossing::Budget) -> Vec<TrafficSign> {
        let landmarks = landmarks_by_signal(self);
        signals_in_order(self)
            .filter_map(|(id, signal)| {
                let kind = sign_kind(&signal.signal_type, &signal.subtype, signal.value)?;
                let share = match kind {
                    SignKind::Stop | SignKind::Yield => STOP_SHARE,
                    SignKind::SpeedLimit { .. } => LIMIT_SHARE,
                };
                let size = |width_m: f64| {
                    let half_m = share * width_m;
                    BoxSize { half_along_m: half_m, half_across_m: half_m, back_m: half_m }
                };
                let places = || landmarks.get(id).into_iter().flatten();
                let boxes = places()
                    .flat_map(|landmark| driving_lanes(self, landmark))
                    .filter_map(|place| TriggerBox::behind(self, place, size))
                    .collect();
                let crossing = match kind {
                    SignKind::Stop | SignKind::Yield => places()
                        .flat_map(|landmark| crossing::boxes(self, landmark, left))
                        .collect(),
                    SignKind::SpeedLimit { .. } => Vec::new(),
                };
                let pose = *self.landmarks.poses.get(id)?;
                Some(TrafficSign { id: id.to_owned(), kind, pose, boxes, crossing })
            })
            .collect()
    }
}

/// Signals with their ids, each once, in the order in which the file first names them.
pub(crate) fn signals_in_order(map: &Map) -> impl Iterator<Item = (&str, &Signal)> {
    let signals = &map.model.signals;
    let mut seen = std::collections::BTreeSet::new();
    signals
        .references
        .iter()
        .map(|reference| reference.signal.as_str())
        .filter(move |id| seen.insert(*id))
        .filter_map(|id| Some((id, signals.definitions.get(id)?)))
}

/// The places where each signal applies, by its id.
pub(crate) fn landmarks_by_signal(map: &Map) -> BTreeMap<&str, Vec<&Landmark>> {
    let mut by_signal: BTreeMap<&str, Vec<&Landmark>> = BTreeMap::new();
    for landmark in &map.landmarks.all {
        by_signal.entry(landmark.id.as_str()).or_default().push(landmark);
    }
    by_signal
}

/// What a signal of this type, subtype and value says; `None` when it is none of these signs.
///
/// **Source:** the client library's traffic manager, which takes every limit for km/h whatever its
/// unit says; a limit without a value is named by its subtype.
pub(crate) fn sign_kind(signal_type: &str, subtype: &str, value: f64) -> Option<SignKind> {
    match signal_type {
        "206" => Some(SignKind::Stop),
        "205" => Some(SignKind::Yield),
        "274" => {
            let named = || subtype.trim().parse().ok().filter(|kmh: &f64| kmh.is_finite());
            let kmh = Some(value).filter(|kmh| *kmh > 0.0).or_else(named)?;
            (kmh > 0.0).then_some(SignKind::SpeedLimit { limit_mps: kmh / 3.6 })
        }
        _ => None,
    }
}
