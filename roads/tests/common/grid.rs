//! A clean map of any size: a ring of short roads, row after row.

use std::fmt::Write;

/// Length of each road in metres.
pub(crate) const ROAD_M: f64 = 30.0;
/// Roads side by side before the next row begins.
const COLUMNS: u32 = 100;

/// OpenDRIVE text with this many roads, numbered from 1.
pub(crate) fn grid(roads: u32) -> String {
    let mut text = String::from("<OpenDRIVE><header/>");
    for id in 1..=roads {
        let (x, y) = (f64::from(id % COLUMNS) * ROAD_M, f64::from(id / COLUMNS) * 20.0);
        let (before, after) = (if id == 1 { roads } else { id - 1 }, id % roads + 1);
        write!(
            text,
            "<road id=\"{id}\" length=\"{ROAD_M}\" junction=\"-1\"><link>\
             <predecessor elementType=\"road\" elementId=\"{before}\" contactPoint=\"end\"/>\
             <successor elementType=\"road\" elementId=\"{after}\" contactPoint=\"start\"/></link>\
             <planView><geometry s=\"0\" x=\"{x}\" y=\"{y}\" hdg=\"0\" length=\"{ROAD_M}\"><line/>\
             </geometry></planView><lanes><laneSection s=\"0\"><center><lane id=\"0\"/></center>\
             <right><lane id=\"-1\" type=\"driving\"><link><predecessor id=\"-1\"/>\
             <successor id=\"-1\"/></link><width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/>\
             </lane></right></laneSection></lanes></road>"
        )
        .expect("writing to a string");
    }
    text.push_str("</OpenDRIVE>");
    text
}
