//! `signal` and `signalReference` elements, as the client library wants them.

use std::f64::consts::PI;

use super::{Number, Out};
use crate::town::draft::{RoadDraft, SignalDraft, SignalKind};

/// Height of signs above the ground, in metres.
const SIGN_M: f64 = 2.0;

/// What the client library reads of a kind of signal.
struct Dialect {
    name: String,
    signal_type: u32,
    value: Option<u32>,
    z_offset_m: f64,
    dynamic: &'static str,
    /// Metres.
    height: &'static str,
}

impl Dialect {
    fn of(kind: SignalKind) -> Self {
        let sign = |name: String, signal_type, value| Self {
            name,
            signal_type,
            value,
            z_offset_m: SIGN_M,
            dynamic: "no",
            height: "0.6",
        };
        match kind {
            SignalKind::Light => Self {
                name: "Signal_3Light_Post01".to_owned(),
                signal_type: 1_000_001,
                value: None,
                z_offset_m: 0.0,
                dynamic: "yes",
                height: "1",
            },
            SignalKind::Stop => sign("Sign_Stop".to_owned(), 206, None),
            SignalKind::Yield => sign("Sign_Yield".to_owned(), 205, None),
            SignalKind::SpeedLimit { kmh } => sign(format!("Speed_{kmh}"), 274, Some(kmh)),
        }
    }
}

pub(super) fn of_road(out: &mut Out, road: &RoadDraft) {
    if road.signals.is_empty() && road.held_by.is_none() {
        return;
    }
    out.line(format_args!("<signals>"));
    for draft in &road.signals {
        signal(out, draft);
    }
    if let Some((id, [outer, inner])) = road.held_by.zip(road.driving_right()) {
        // Lanes of connecting roads run along s, so they are negative.
        out.line(format_args!(
            "<signalReference id=\"{id}\" s=\"0\" t=\"0\" orientation=\"-\">\
             <validity fromLane=\"{outer}\" toLane=\"{inner}\"/></signalReference>"
        ));
    }
    out.line(format_args!("</signals>"));
}

fn signal(out: &mut Out, signal: &SignalDraft) {
    let dialect = Dialect::of(signal.kind);
    let (orientation, turned_rad) = if signal.lane_sign < 0 { ("-", 0.0) } else { ("+", PI) };
    let (subtype, unit, text) = match dialect.value {
        Some(kmh) => (kmh.to_string(), "unit=\"km/h\" ", kmh.to_string()),
        None => ("-1".to_owned(), "", String::new()),
    };
    out.line(format_args!(
        "<signal id=\"{}\" name=\"{}\" s=\"{}\" t=\"{}\" zOffset=\"{}\" hOffset=\"{}\" \
         pitch=\"0\" roll=\"0\" orientation=\"{orientation}\" dynamic=\"{}\" \
         country=\"OpenDRIVE\" type=\"{}\" subtype=\"{subtype}\" value=\"{subtype}\" \
         {unit}text=\"{text}\" height=\"{}\" width=\"0.6\">",
        signal.id,
        dialect.name,
        Number(signal.s),
        Number(signal.t),
        Number(dialect.z_offset_m),
        Number(turned_rad),
        dialect.dynamic,
        dialect.signal_type,
        dialect.height
    ));
    let [first, last] = signal.lanes;
    let [from, to] = match (signal.kind, signal.lane_sign) {
        (SignalKind::Light, _) => [0, 0],
        (_, sign) if sign < 0 => [-last, -first],
        _ => [first, last],
    };
    out.line(format_args!("<validity fromLane=\"{from}\" toLane=\"{to}\"/></signal>"));
}
