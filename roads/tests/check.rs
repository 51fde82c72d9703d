//! Faults that can be read over are found and rated.

use roads::{Map, Severity};

fn found(text: &str) -> Vec<(Severity, String)> {
    let map = Map::parse("test", text).unwrap_or_else(|error| panic!("{error}"));
    map.check().diagnostics.iter().map(|one| (one.severity, one.to_string())).collect()
}

fn road(id: u32, x: f64, links: &str, lane_link: &str, shape: &str) -> String {
    format!(
        "<road id=\"{id}\" length=\"50\" junction=\"-1\"><link>{links}</link><planView>\
         <geometry s=\"0\" x=\"{x}\" y=\"0\" hdg=\"0\" length=\"50\">{shape}</geometry></planView>\
         <lanes><laneSection s=\"0\"><center><lane id=\"0\"/></center><right>\
         <lane id=\"-1\" type=\"driving\"><link>{lane_link}</link>\
         <width sOffset=\"0\" a=\"3\" b=\"0\" c=\"0\" d=\"0\"/></lane>\
         </right></laneSection></lanes></road>"
    )
}

fn to_road(id: u32) -> String {
    format!("<successor elementType=\"road\" elementId=\"{id}\" contactPoint=\"start\"/>")
}

#[test]
fn our_town_has_no_fault() {
    let text = roads::town::build("Town10HD_Opt").unwrap();
    let faults = found(&text);
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn a_link_to_a_lane_that_is_not_there_breaks_the_client() {
    let first = road(1, 0.0, &to_road(2), "<successor id=\"-5\"/>", "<line/>");
    let text = format!("<OpenDRIVE>{first}{}</OpenDRIVE>", road(2, 50.0, "", "", "<line/>"));
    let faults = found(&text);
    let named = faults.iter().find(|(_, text)| text.contains("lane -5")).unwrap();
    assert_eq!(named.0, Severity::BreaksClient, "{named:?}");
    assert!(named.1.contains("road 1 at s = 50"), "{named:?}");
}

#[test]
fn a_spiral_without_change_breaks_the_client() {
    let shape = "<spiral curvStart=\"0.01\" curvEnd=\"0.01\"/>";
    let faults = found(&format!("<OpenDRIVE>{}</OpenDRIVE>", road(1, 0.0, "", "", shape)));
    assert!(faults.iter().any(|(severity, text)| {
        *severity == Severity::BreaksClient && text.contains("spiral")
    }));
}

#[test]
fn sections_that_begin_together_or_at_the_end_break_the_client() {
    let text = format!("<OpenDRIVE>{}</OpenDRIVE>", road(1, 0.0, "", "", "<line/>"));
    let (begin, end) = (text.find("<laneSection").unwrap(), text.find("</lanes>").unwrap());
    let broken = |starts: &[&str]| {
        let one = |s: &&str| text[begin..end].replace("s=\"0\"", &format!("s=\"{s}\""));
        let sections: String = starts.iter().map(one).collect();
        let faults = found(&text.replace(&text[begin..end], &sections));
        faults.into_iter().find(|(severity, _)| *severity == Severity::BreaksClient)
    };
    for starts in [&["0", "50"][..], &["0", "60"], &["0", "0"], &["0", "20", "20"]] {
        assert!(broken(starts).unwrap().1.contains("lane sections that begin"), "{starts:?}");
    }
    for starts in [&["0"][..], &["0", "20", "40"], &["0", "49.999"], &["0", "20", "20.0001"]] {
        assert_eq!(broken(starts), None, "{starts:?}");
    }
}

/// Road 1 through junction 100 by road 3 to road 2, with these connections.
fn crossing(connections: &str) -> String {
    let junction = "elementType=\"junction\" elementId=\"100\"";
    let within = to_road(2) + "<predecessor elementType=\"road\" elementId=\"1\"/>";
    let before = road(1, 0.0, &format!("<successor {junction}/>"), "", "<line/>");
    let after = road(2, 100.0, &format!("<predecessor {junction}/>"), "", "<line/>");
    let links = "<predecessor id=\"-1\"/><successor id=\"-1\"/>";
    let through =
        road(3, 50.0, &within, links, "<line/>").replace("junction=\"-1\"", "junction=\"100\"");
    format!(
        "<OpenDRIVE>{before}{through}{after}<junction id=\"100\">{connections}</junction></OpenDRIVE>"
    )
}

/// Some exporters list a connecting road once from each of its ends.
#[test]
fn a_road_that_two_connections_name_ends_the_traffic_manager() {
    let connection = |id: u32, from: u32| {
        format!("<connection id=\"{id}\" incomingRoad=\"{from}\" connectingRoad=\"3\"/>")
    };
    let once = found(&crossing(&connection(0, 1)));
    assert!(once.iter().all(|(severity, _)| *severity == Severity::Suspicious), "{once:?}");
    let twice = found(&crossing(&(connection(0, 1) + &connection(1, 2))));
    let named = twice.iter().find(|(severity, _)| *severity == Severity::BreaksClient).unwrap();
    assert!(named.1.contains("road 1 at s = 50") && named.1.contains("road 3 alone"), "{named:?}");
}

#[test]
fn a_gap_between_lane_ids_breaks_the_client() {
    let whole = road(1, 0.0, "", "", "<line/>");
    let verdict = |id: i32| {
        let own = whole.replace("lane id=\"-1\"", &format!("lane id=\"{id}\""));
        let faults = found(&format!("<OpenDRIVE>{own}</OpenDRIVE>"));
        faults.iter().any(|(severity, text)| {
            *severity == Severity::BreaksClient && text.contains("without gaps")
        })
    };
    assert_eq!([-1, -2, -5].map(verdict), [false, true, true]);
}

#[test]
fn dead_ends_and_gaps_are_suspicious() {
    let first = road(1, 0.0, &to_road(2), "<successor id=\"-1\"/>", "<line/>");
    let text = format!("<OpenDRIVE>{first}{}</OpenDRIVE>", road(2, 50.5, "", "", "<line/>"));
    let faults = found(&text);
    assert!(faults.iter().all(|(severity, _)| *severity == Severity::Suspicious), "{faults:?}");
    assert!(faults.iter().any(|(_, text)| text.contains("gap of 0.500 m")), "{faults:?}");
    assert!(faults.iter().any(|(_, text)| text.contains("road 2") && text.contains("lead on")));
}

#[test]
fn a_lane_section_without_a_length_is_named_with_what_it_does_to_the_route_planner() {
    let whole = road(1, 0.0, "", "", "<line/>");
    let section = &whole[whole.find("<laneSection").unwrap()..whole.find("</lanes>").unwrap()];
    let twice = |start: &str| {
        let second = section.replacen("s=\"0\"", &format!("s=\"{start}\""), 1);
        found(&format!(
            "<OpenDRIVE>{}</OpenDRIVE>",
            whole.replace(section, &(section.to_owned() + &second))
        ))
    };
    let named = |faults: &[(Severity, String)]| {
        faults.iter().filter(|(_, text)| text.contains("route planner")).count()
    };
    assert_eq!(named(&twice("49.9999999")), 1);
    assert_eq!(named(&twice("49.99")), 0);
}

#[test]
fn roads_so_far_away_that_nothing_can_be_spawned_are_named_once() {
    let faults = |x: f64| {
        let roads = road(1, x, "", "", "<line/>") + &road(2, x + 500.0, "", "", "<line/>");
        let faults = found(&format!("<OpenDRIVE>{roads}</OpenDRIVE>"));
        let far = faults.into_iter().filter(|(_, text)| text.contains("nothing can be spawned"));
        far.collect::<Vec<_>>()
    };
    assert_eq!(faults(99_000.0), []);
    let named = faults(500_000.0);
    assert_eq!(named.len(), 1, "{named:?}");
    assert!(named[0].0 == Severity::Suspicious && named[0].1.contains("road 1"), "{named:?}");
}

#[test]
fn a_bend_that_no_car_holds_at_its_limit_is_noted_and_no_fault() {
    // 100 km/h in a curve of 40 m ask for 2.0 g; in one of 120 m for 0.66 g.
    for (radius_m, limit_kmh, notes) in [(40.0, 100, 1), (120.0, 100, 0), (40.0, 60, 0)] {
        let text = format!(
            r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="bend" version="1" north="0" south="0" east="0" west="0"/>
  <road name="bend" length="90" id="3" junction="-1">
    <type s="0" type="town"><speed max="{limit_kmh}" unit="km/h"/></type>
    <planView>
      <geometry s="0" x="0" y="0" hdg="3.0" length="50"><line/></geometry>
      <geometry s="50" x="-49.5" y="7.06" hdg="3.0" length="40">
        <arc curvature="{}"/></geometry>
    </planView>
    <lanes><laneSection s="0">
      <center><lane id="0" type="none" level="false"/></center>
      <right><lane id="-1" type="driving" level="false">
        <width sOffset="0" a="0.02" b="0" c="0" d="0"/></lane></right>
    </laneSection></lanes>
  </road>
</OpenDRIVE>"#,
            1.0 / radius_m
        );
        let map = Map::parse("bend", &text).unwrap();
        let found = map.corners();
        assert_eq!((found.count, found.diagnostics.len()), (notes, notes), "{radius_m} m");
        for note in &found.diagnostics {
            assert_eq!((note.severity, note.road), (Severity::Note, Some(3)));
            assert!((50.0..=90.0).contains(&note.s.unwrap()), "{note}");
            let told = "a radius of 40.0 m, which asks for 2.0 g; 0.8 g hold 64 km/h";
            assert!(note.to_string().contains(told), "{note}");
        }
        assert!(!map.check().diagnostics.iter().any(|fault| fault.severity == Severity::Note));
    }
}
