//! OpenDRIVE text of a draft.

use std::fmt::{Display, Write};

use super::draft::{
    ControllerDraft, Cubic, JunctionDraft, LaneDraft, LineKind, LinkTo, ObjectDraft, Piece,
    RoadDraft, SectionDraft, TownDraft,
};

mod signals;

/// A number with at most nine digits after the point, so that lane ends meet far below a
/// millimetre, and without trailing zeros, so that the text stays small.
struct Number(f64);

impl Display for Number {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let text = format!("{:.9}", self.0);
        let text = text.trim_end_matches('0').trim_end_matches('.');
        f.write_str(if text == "-0" { "0" } else { text })
    }
}

/// Text that grows; writing to a string cannot fail.
struct Out(String);

impl Out {
    fn line(&mut self, text: std::fmt::Arguments<'_>) {
        // The error type of the trait is for other targets than strings.
        let _: Result<(), std::fmt::Error> = self.0.write_fmt(text);
        self.0.push('\n');
    }
}

/// Writes the whole town.
pub(super) fn town(name: &str, draft: &TownDraft) -> String {
    let mut out = Out(String::with_capacity(512 * 1024));
    out.line(format_args!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>"));
    out.line(format_args!("<OpenDRIVE>"));
    let [south, west, north, east] = bounds(draft).map(Number);
    out.line(format_args!(
        "<header revMajor=\"1\" revMinor=\"4\" name=\"{name}\" version=\"1\" \
         date=\"2026-01-01T00:00:00\" north=\"{north}\" south=\"{south}\" east=\"{east}\" \
         west=\"{west}\" vendor=\"Causeway\">"
    ));
    out.line(format_args!(
        "<geoReference><![CDATA[+proj=tmerc +lat_0=0 +lon_0=0 +k=1 +x_0=0 +y_0=0 +datum=WGS84 \
         +units=m +no_defs]]></geoReference>"
    ));
    out.line(format_args!("</header>"));
    let mut next_object_id = 1;
    for draft_road in &draft.roads {
        road(&mut out, draft_road, &mut next_object_id);
    }
    for draft_controller in &draft.controllers {
        controller(&mut out, draft_controller);
    }
    for draft_junction in &draft.junctions {
        junction(&mut out, draft_junction);
    }
    out.line(format_args!("</OpenDRIVE>"));
    out.0
}

/// South, west, north, east: of the ends of all lines, in whole metres.
fn bounds(draft: &TownDraft) -> [f64; 4] {
    let pieces = draft.roads.iter().flat_map(|road| &road.pieces);
    let ends = pieces.flat_map(|piece| [piece.pose().at, piece.pose_at(piece.length_m).at]);
    ends.fold([0.0; 4], |[south, west, north, east], [x, y]| {
        [south.min(y.floor()), west.min(x.floor()), north.max(y.ceil()), east.max(x.ceil())]
    })
}

fn road(out: &mut Out, road: &RoadDraft, next_object_id: &mut u32) {
    let junction = road.junction.map_or(-1, i64::from);
    out.line(format_args!(
        "<road name=\"Road {}\" length=\"{}\" id=\"{}\" junction=\"{junction}\">",
        road.id,
        Number(road.length_m()),
        road.id
    ));
    out.line(format_args!("<link>"));
    link(out, "predecessor", road.predecessor);
    link(out, "successor", road.successor);
    out.line(format_args!("</link>"));
    out.line(format_args!(
        "<type s=\"0\" type=\"town\"><speed max=\"{}\" unit=\"km/h\"/></type>",
        road.limit_kmh
    ));
    out.line(format_args!("<planView>"));
    let mut s = 0.0;
    for piece in &road.pieces {
        geometry(out, s, piece);
        s += piece.length_m;
    }
    out.line(format_args!("</planView>"));
    out.line(format_args!("<elevationProfile>"));
    for rise in &road.rises {
        elevation(out, rise);
    }
    out.line(format_args!("</elevationProfile>"));
    lanes(out, road);
    if !road.objects.is_empty() {
        out.line(format_args!("<objects>"));
        for draft_object in &road.objects {
            object(out, draft_object, *next_object_id);
            *next_object_id += 1;
        }
        out.line(format_args!("</objects>"));
    }
    signals::of_road(out, road);
    out.line(format_args!("</road>"));
}

fn link(out: &mut Out, side: &str, to: LinkTo) {
    match to {
        LinkTo::Junction(id) => {
            out.line(format_args!("<{side} elementType=\"junction\" elementId=\"{id}\"/>"));
        }
        LinkTo::Road { id, at_end } => {
            let contact = if at_end { "end" } else { "start" };
            out.line(format_args!(
                "<{side} elementType=\"road\" elementId=\"{id}\" contactPoint=\"{contact}\"/>"
            ));
        }
    }
}

fn geometry(out: &mut Out, s: f64, piece: &Piece) {
    out.line(format_args!(
        "<geometry s=\"{}\" x=\"{}\" y=\"{}\" hdg=\"{}\" length=\"{}\">",
        Number(s),
        Number(piece.x),
        Number(piece.y),
        Number(piece.heading_rad),
        Number(piece.length_m)
    ));
    if piece.curvature == 0.0 {
        out.line(format_args!("<line/></geometry>"));
    } else {
        // A rounded curvature would move the end of a long arc, so every digit is written.
        out.line(format_args!("<arc curvature=\"{}\"/></geometry>", piece.curvature));
    }
}

fn elevation(out: &mut Out, rise: &Cubic) {
    let [a, b, c, d] = rise.abcd;
    // Rounded cubic coefficients would move the end of a long slope, so every digit is written.
    out.line(format_args!(
        "<elevation s=\"{}\" a=\"{a}\" b=\"{b}\" c=\"{c}\" d=\"{d}\"/>",
        Number(rise.start_s)
    ));
}

fn lanes(out: &mut Out, road: &RoadDraft) {
    out.line(format_args!("<lanes>"));
    for section in &road.sections {
        lane_section(out, section, road.centre_line);
    }
    out.line(format_args!("</lanes>"));
}

fn lane_section(out: &mut Out, section: &SectionDraft, centre_line: bool) {
    let mut lanes: Vec<&LaneDraft> = section.lanes.iter().collect();
    lanes.sort_by_key(|lane| -lane.id);
    let (left, right): (Vec<&LaneDraft>, Vec<&LaneDraft>) =
        lanes.into_iter().partition(|lane| lane.id > 0);
    out.line(format_args!("<laneSection s=\"{}\">", Number(section.start_s)));
    side(out, "left", &left);
    let centre = if centre_line {
        "type=\"solid\" weight=\"standard\" color=\"yellow\" width=\"0.15\""
    } else {
        "type=\"none\" weight=\"standard\" color=\"white\" width=\"0\""
    };
    out.line(format_args!(
        "<center><lane id=\"0\" type=\"none\" level=\"false\">\
         <roadMark sOffset=\"0\" {centre} laneChange=\"none\"/></lane></center>"
    ));
    side(out, "right", &right);
    out.line(format_args!("</laneSection>"));
}

fn side(out: &mut Out, name: &str, lanes: &[&LaneDraft]) {
    if lanes.is_empty() {
        return;
    }
    out.line(format_args!("<{name}>"));
    for draft_lane in lanes {
        lane(out, draft_lane);
    }
    out.line(format_args!("</{name}>"));
}

fn lane(out: &mut Out, lane: &LaneDraft) {
    out.line(format_args!(
        "<lane id=\"{}\" type=\"{}\" level=\"false\">",
        lane.id,
        lane.kind.name()
    ));
    if lane.predecessor.is_some() || lane.successor.is_some() {
        let element = |side: &str, id: Option<i32>| {
            id.map_or_else(String::new, |id| format!("<{side} id=\"{id}\"/>"))
        };
        out.line(format_args!(
            "<link>{}{}</link>",
            element("predecessor", lane.predecessor),
            element("successor", lane.successor)
        ));
    }
    let (line, width_m, change) = match lane.line {
        LineKind::Broken => ("broken", "0.15", "both"),
        LineKind::Solid => ("solid", "0.15", "none"),
        LineKind::Kerb => ("curb", "0.15", "none"),
        LineKind::None => ("none", "0", "none"),
    };
    for width in &lane.widths {
        let [a, b, c, d] = width.abcd;
        out.line(format_args!(
            "<width sOffset=\"{}\" a=\"{}\" b=\"{b}\" c=\"{c}\" d=\"{d}\"/>",
            Number(width.start_s),
            Number(a)
        ));
    }
    out.line(format_args!(
        "<roadMark sOffset=\"0\" type=\"{line}\" weight=\"standard\" color=\"white\" \
         width=\"{width_m}\" laneChange=\"{change}\"/></lane>"
    ));
}

fn object(out: &mut Out, object: &ObjectDraft, id: u32) {
    out.line(format_args!(
        "<object id=\"{id}\" name=\"{}\" type=\"{}\" s=\"{}\" t=\"{}\" zOffset=\"{}\" hdg=\"{}\" \
         pitch=\"0\" roll=\"0\" orientation=\"none\" length=\"{}\" width=\"{}\" height=\"{}\">",
        object.name,
        object.object_type,
        Number(object.s),
        Number(object.t),
        Number(object.z_offset_m),
        Number(object.heading_rad),
        Number(object.length_m),
        Number(object.width_m),
        Number(object.height_m)
    ));
    if !object.outline.is_empty() {
        out.line(format_args!("<outline>"));
        for [u, v] in &object.outline {
            out.line(format_args!(
                "<cornerLocal u=\"{}\" v=\"{}\" z=\"0\" height=\"0\"/>",
                Number(*u),
                Number(*v)
            ));
        }
        out.line(format_args!("</outline>"));
    }
    out.line(format_args!("</object>"));
}

fn controller(out: &mut Out, controller: &ControllerDraft) {
    out.line(format_args!("<controller id=\"{}\" name=\"Phase {0}\">", controller.id));
    for light in &controller.lights {
        out.line(format_args!("<control signalId=\"{light}\" type=\"0\"/>"));
    }
    out.line(format_args!("</controller>"));
}

fn junction(out: &mut Out, junction: &JunctionDraft) {
    out.line(format_args!("<junction id=\"{}\" name=\"Junction {}\">", junction.id, junction.id));
    for (id, connection) in (1..).zip(&junction.connections) {
        out.line(format_args!(
            "<connection id=\"{id}\" incomingRoad=\"{}\" connectingRoad=\"{}\" \
             contactPoint=\"start\">",
            connection.incoming, connection.connecting
        ));
        for (from, to) in &connection.lanes {
            out.line(format_args!("<laneLink from=\"{from}\" to=\"{to}\"/>"));
        }
        out.line(format_args!("</connection>"));
    }
    for (sequence, id) in junction.controllers.iter().enumerate() {
        out.line(format_args!("<controller id=\"{id}\" type=\"0\" sequence=\"{sequence}\"/>"));
    }
    out.line(format_args!("</junction>"));
}
