//! Small road networks of single lanes, for worlds with lights and signs.
#![allow(unreachable_pub, clippy::unwrap_used, reason = "test code")]

use std::fmt::Write as _;
use std::sync::Arc;

use roads::Map;
use schemas::WorldId;
use world::{Town, World, WorldConfig};

/// One lane 3.5 m wide around a reference line that is one line or arc.
#[derive(Clone, Copy)]
pub struct Way {
    pub id: u32,
    pub from_m: (f64, f64),
    pub heading_rad: f64,
    pub curvature_per_m: f64,
    pub length_m: f64,
    pub junction: i32,
    pub before: Option<u32>,
    pub after: Option<u32>,
    /// Type of a sign at its end.
    pub sign: Option<&'static str>,
    /// Whether its traffic keeps to the left.
    pub keeps_left: bool,
    /// Whether its lane is cut into two sections in the middle.
    pub is_cut: bool,
}

impl Way {
    fn lane(&self) -> i32 {
        if self.keeps_left { 1 } else { -1 }
    }

    fn sections(&self) -> String {
        let lane = self.lane();
        let linked = |tag: &str, is_linked: bool| match is_linked {
            true => format!("<{tag} id=\"{lane}\"/>"),
            false => String::new(),
        };
        let side = if self.keeps_left { "left" } else { "right" };
        let centre = "<center><lane id=\"0\" type=\"none\" level=\"false\"/></center>";
        let section = |from_m: f64, before: bool, after: bool| {
            let links = [linked("predecessor", before), linked("successor", after)].concat();
            let own = format!(
                "<{side}><lane id=\"{lane}\" type=\"driving\" level=\"false\"><link>{links}</link>\
                 <width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane></{side}>"
            );
            let lanes = if self.keeps_left { [own.as_str(), centre] } else { [centre, &own] };
            format!("<laneSection s=\"{from_m}\">{}</laneSection>", lanes.concat())
        };
        let inside = self.junction >= 0;
        match self.is_cut {
            true => section(0.0, inside, true) + &section(self.length_m / 2.0, true, inside),
            false => section(0.0, inside, inside),
        }
    }

    fn xodr(&self) -> String {
        let link = |tag: &str, id: Option<u32>, contact: &str| {
            let to_junction = || self.junction < 0 && tag == "successor";
            id.map_or_else(String::new, |id| match to_junction() {
                true => format!("<{tag} elementType=\"junction\" elementId=\"{id}\"/>"),
                false => format!(
                    "<{tag} elementType=\"road\" elementId=\"{id}\" contactPoint=\"{contact}\"/>"
                ),
            })
        };
        let shape = match self.curvature_per_m {
            0.0 => "<line/>".to_owned(),
            curvature => format!("<arc curvature=\"{curvature}\"/>"),
        };
        let sign = self.sign.map_or_else(String::new, |kind| {
            format!(
                "<signal id=\"9\" name=\"sign\" s=\"{}\" t=\"-3\" zOffset=\"0\" orientation=\"-\" \
                 type=\"{kind}\" subtype=\"-1\" country=\"OpenDRIVE\" value=\"-1\" dynamic=\"no\">\
                 <validity fromLane=\"{1}\" toLane=\"{1}\"/></signal>",
                self.length_m - 1.0,
                self.lane()
            )
        });
        format!(
            "<road name=\"{0}\" length=\"{1}\" id=\"{0}\" junction=\"{2}\" rule=\"{8}\">\
             <link>{3}{4}</link>\
             <planView><geometry s=\"0\" x=\"{5}\" y=\"{6}\" hdg=\"{7}\" length=\"{1}\">{shape}\
             </geometry></planView><lanes><laneOffset s=\"0\" a=\"{9}\" b=\"0\" c=\"0\" d=\"0\"/>\
             {10}</lanes><signals>{sign}</signals></road>",
            self.id,
            self.length_m,
            self.junction,
            link("predecessor", self.before, "end"),
            link("successor", self.after, "start"),
            self.from_m.0,
            self.from_m.1,
            self.heading_rad,
            if self.keeps_left { "LHT" } else { "RHT" },
            -1.75 * f64::from(self.lane()),
            self.sections()
        )
    }
}

/// Roads, and the ways that lead from one to another through junctions.
pub fn world_with(ways: &[Way]) -> (World, Arc<Map>) {
    let mut text = "<?xml version=\"1.0\"?><OpenDRIVE><header revMajor=\"1\" revMinor=\"4\" \
                    name=\"crossing\" version=\"1\" north=\"0\" south=\"0\" east=\"0\" west=\"0\"/>"
        .to_owned();
    text.extend(ways.iter().map(Way::xodr));
    let mut junctions: Vec<i32> =
        ways.iter().map(|way| way.junction).filter(|id| *id >= 0).collect();
    junctions.dedup();
    for junction in junctions {
        write!(text, "<junction id=\"{junction}\" name=\"{junction}\">").unwrap();
        for (index, way) in ways.iter().filter(|way| way.junction == junction).enumerate() {
            let (incoming, id, lane) = (way.before.unwrap(), way.id, way.lane());
            write!(
                text,
                "<connection id=\"{index}\" incomingRoad=\"{incoming}\" connectingRoad=\"{id}\" \
                 contactPoint=\"start\"><laneLink from=\"{lane}\" to=\"{lane}\"/></connection>"
            )
            .unwrap();
        }
        text.push_str("</junction>");
    }
    text.push_str("</OpenDRIVE>");
    let roads = Arc::new(Map::parse("crossing", &text).unwrap());
    let (id, map) = (WorldId::new(1).unwrap(), Arc::new(Town::new(Arc::clone(&roads))));
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map };
    (World::with_traffic(config).unwrap(), roads)
}

/// One that leads straight on, outside of junctions.
pub fn straight(id: u32, from_m: (f64, f64), heading_rad: f64, length_m: f64) -> Way {
    Way {
        id,
        from_m,
        heading_rad,
        curvature_per_m: 0.0,
        length_m,
        junction: -1,
        before: None,
        after: None,
        sign: None,
        keeps_left: false,
        is_cut: false,
    }
}
