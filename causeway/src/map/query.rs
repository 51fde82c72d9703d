//! `causeway map query`: questions to a map as lines of JSON, answers likewise, many places at
//! once.
//!
//! Places, angles and columns are those of CARLA's client: metres, x east, y south, z up; degrees,
//! yaw clockwise.

use std::io::{BufRead, BufReader, BufWriter, Read, Write};

use nalgebra::Point3;
use roads::{LaneMark, LaneTypes, Map, Waypoint};
use serde::Deserialize;
use serde_json::{Value, json};

use super::MapFailure;
use super::source::Which;

/// Bytes of one question: some 300,000 points.
const QUESTION_BYTES_MAX: u64 = 16 * 1024 * 1024;
/// Places of one answer: some 300 MB of text.
const PLACES_MAX: usize = 1_000_000;
/// How far on and back the places of the last two columns are, in metres.
const STEP_M: f64 = 2.0;

/// What each place of an answer tells, in this order.
const COLUMNS: [&str; 21] = [
    "road",
    "section",
    "lane",
    "s",
    "x",
    "y",
    "z",
    "pitch",
    "yaw",
    "roll",
    "width",
    "type",
    "lane_change",
    "junction",
    "rht",
    "left",
    "right",
    "left_mark",
    "right_mark",
    "next2",
    "prev2",
];

/// Questions, and what an answer holds.
const QUESTIONS: &str = "\
One question a line on standard input, as JSON; one answer a line:
  {\"project\": {\"points\": [[X, Y, Z], ...], \"lanes\": MASK}}  nearest place on such a lane, or null
  {\"inside\": {\"points\": [[X, Y, Z], ...], \"lanes\": MASK}}   the same, null beside that lane
  {\"at\": {\"places\": [[ROAD, LANE, S], ...]}}                  that place, or null
  {\"generate\": {\"step_m\": 2.0}}                              places on all driving lanes
  {\"topology\": {}}                                           starts of lanes that follow each other
MASK is carla.LaneType's number, 2 (driving) where it is left out. Metres and degrees, y to the south,
as in CARLA. An answer has columns and rows; the topology has pairs of [road, section, lane, s]. A
question that cannot be answered gets {\"error\": REASON}.";

/// Which map to ask.
#[derive(Debug, clap::Args)]
#[command(after_help = QUESTIONS)]
pub(super) struct Args {
    #[command(flatten)]
    which: Which,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum Question {
    Project(Points),
    Inside(Points),
    At { places: Vec<(u32, i32, f64)> },
    Generate { step_m: f64 },
    Topology {},
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Points {
    points: Vec<[f64; 3]>,
    #[serde(default = "driving")]
    lanes: u32,
}

fn driving() -> u32 {
    2
}

/// Answers until standard input ends.
pub(super) fn run(args: &Args) -> Result<(), MapFailure> {
    let source = args.which.text()?;
    let map = Map::parse(&source.name, &source.xodr)?;
    let mut questions = BufReader::new(std::io::stdin().lock());
    let mut answers = BufWriter::new(std::io::stdout().lock());
    serve(&map, &mut questions, &mut answers).map_err(MapFailure::Output)
}

fn serve(
    map: &Map,
    questions: &mut impl BufRead,
    answers: &mut impl Write,
) -> Result<(), std::io::Error> {
    loop {
        let mut line = Vec::new();
        let read = questions.by_ref().take(QUESTION_BYTES_MAX).read_until(b'\n', &mut line)?;
        if read == 0 {
            return Ok(());
        }
        if read as u64 == QUESTION_BYTES_MAX && line.last() != Some(&b'\n') {
            questions.skip_until(b'\n')?;
            refuse(answers, &format!("wanted at most {QUESTION_BYTES_MAX} bytes a question"))?;
        } else if !line.trim_ascii().is_empty() {
            match serde_json::from_slice(&line) {
                Ok(question) => answer(map, question, answers)?,
                Err(cause) => refuse(answers, &cause.to_string())?,
            }
        }
        answers.flush()?;
    }
}

fn refuse(answers: &mut impl Write, reason: &str) -> Result<(), std::io::Error> {
    writeln!(answers, "{}", json!({ "error": reason }))
}

fn answer(map: &Map, question: Question, answers: &mut impl Write) -> Result<(), std::io::Error> {
    let find = |Points { points, lanes }: Points, find: Find| {
        let types = LaneTypes::from_bits(lanes);
        let point = |[x, y, z]: [f64; 3]| Point3::new(x, -y, z);
        points.into_iter().map(|at| find(map, point(at), types)).collect::<Vec<_>>()
    };
    let places = match question {
        Question::Project(points) => find(points, Map::nearest),
        Question::Inside(points) => find(points, Map::inside),
        Question::At { places } => {
            places.into_iter().map(|(road, lane, s)| map.waypoint(road, lane, s)).collect()
        }
        Question::Generate { step_m } => match map.generate_waypoints(step_m) {
            Ok(places) => places.into_iter().map(Some).collect(),
            Err(refused) => return refuse(answers, &refused.to_string()),
        },
        Question::Topology {} => return topology(map, answers),
    };
    if places.len() > PLACES_MAX {
        let reason = format!("wanted at most {PLACES_MAX} places, found {}", places.len());
        return refuse(answers, &reason);
    }
    write!(answers, "{{\"columns\":{},\"rows\":[", json!(COLUMNS))?;
    for (index, place) in places.iter().enumerate() {
        let comma = if index == 0 { "" } else { "," };
        write!(answers, "{comma}{}", place.map_or(Value::Null, |place| row(map, &place)))?;
    }
    writeln!(answers, "]}}")
}

type Find = fn(&Map, Point3<f64>, LaneTypes) -> Option<Waypoint>;

fn topology(map: &Map, answers: &mut impl Write) -> Result<(), std::io::Error> {
    let pairs: Vec<Value> =
        map.topology().iter().map(|(from, to)| json!([ident(from), ident(to)])).collect();
    writeln!(answers, "{}", json!({ "pairs": pairs }))
}

fn ident(place: &Waypoint) -> Value {
    json!([place.road, place.section, place.lane, place.s])
}

/// The columns of one place.
fn row(map: &Map, place: &Waypoint) -> Value {
    let lane = map.lane(place);
    let pose = map.lane_pose(place);
    let point = pose.map_or_else(Point3::origin, |pose| pose.point);
    let pitch_deg = pose.map_or(0.0, |pose| pose.pitch_rad.to_degrees());
    let yaw_deg = upper_half(pose.map_or(0.0, |pose| -pose.heading_rad.to_degrees()));
    let key = |beside: Option<Waypoint>| beside.map(|at| (at.road, at.section, at.lane));
    let idents = |places: Vec<Waypoint>| places.iter().map(ident).collect::<Vec<_>>();
    json!([
        place.road,
        place.section,
        place.lane,
        place.s,
        point.x,
        // Positive zero, which -0.0 would not be.
        0.0 - point.y,
        point.z,
        upper_half(pitch_deg),
        yaw_deg,
        0.0,
        lane.width_m,
        lane.lane_type as u32,
        lane.lane_change as u32,
        lane.junction_id,
        lane.is_right_hand_traffic,
        key(map.left(place)),
        key(map.right(place)),
        lane.left_mark.map(mark),
        lane.right_mark.map(mark),
        idents(map.next(place, STEP_M)),
        idents(map.previous(place, STEP_M)),
    ])
}

fn mark(mark: LaneMark) -> Value {
    json!([mark.mark_type as u32, mark.color as u32, mark.lane_change as u32, mark.width_m])
}

/// The angle above -180 and up to 180 degrees.
fn upper_half(degrees: f64) -> f64 {
    180.0 - (180.0 - degrees).rem_euclid(360.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn town() -> Map {
        Map::parse("Town02", &roads::town::build("Town02").unwrap()).unwrap()
    }

    fn ask(map: &Map, questions: &str) -> Vec<Value> {
        let mut answers = Vec::new();
        serve(map, &mut questions.as_bytes(), &mut answers).unwrap();
        let lines = String::from_utf8(answers).unwrap();
        lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }

    fn of(row: &Value, column: &str) -> Value {
        row[COLUMNS.iter().position(|name| *name == column).unwrap()].clone()
    }

    #[test]
    fn a_place_found_by_its_point_is_the_one_found_by_its_road_lane_and_s() {
        let map = town();
        let every = ask(&map, "{\"generate\": {\"step_m\": 50.0}}")[0]["rows"].clone();
        assert!(every.as_array().unwrap().len() > 20, "{every}");
        for row in every.as_array().unwrap() {
            let at = json!({"at": {"places": [[of(row, "road"), of(row, "lane"), of(row, "s")]]}});
            let point =
                json!({"project": {"points": [[of(row, "x"), of(row, "y"), of(row, "z")]]}});
            let answers = ask(&map, &format!("{at}\n{point}\n"));
            let same = &answers[0]["rows"][0];
            for column in ["road", "section", "lane", "width", "left", "right", "rht"] {
                assert_eq!(of(same, column), of(row, column), "{column}");
            }
            // The client library rounds s to single precision.
            let off_m = of(same, "s").as_f64().unwrap() - of(row, "s").as_f64().unwrap();
            assert!(off_m.abs() < 1e-4, "{same} {row}");
            let projected = &answers[1]["rows"][0];
            for axis in ["x", "y", "z"] {
                let off = of(projected, axis).as_f64().unwrap() - of(row, axis).as_f64().unwrap();
                assert!(off.abs() < 0.6, "{projected} {row}");
            }
        }
    }

    #[test]
    fn what_is_not_there_is_null_and_what_is_no_question_is_told() {
        let map = town();
        let answers = ask(
            &map,
            "{\"inside\": {\"points\": [[1e9, 0, 0], [-1e308, 1e308, 0]]}}\n\
             {\"at\": {\"places\": [[4000000, 1, 0.0]]}}\n\
             \n\
             {\"nearest\": []}\n\
             {\"project\": {\"points\": [[1, 2]]}}\n\
             {\"generate\": {\"step_m\": 0}}\n\
             {\"generate\": {\"step_m\": 0.0001}}\n\
             {\"topology\": {}}",
        );
        assert_eq!(answers.len(), 7, "{answers:?}");
        assert_eq!(answers[0]["rows"], json!([null, null]));
        assert_eq!(answers[1]["rows"], json!([null]));
        for refused in &answers[2..6] {
            assert!(refused["error"].is_string(), "{refused}");
        }
        assert!(!answers[6]["pairs"].as_array().unwrap().is_empty());
    }

    #[test]
    fn a_question_without_an_end_is_refused_and_the_next_one_answered() {
        let long = " ".repeat(usize::try_from(QUESTION_BYTES_MAX).unwrap() + 7);
        let answers = ask(&town(), &format!("{long}\n{{\"topology\": {{}}}}\n"));
        assert!(answers[0]["error"].as_str().unwrap().contains("bytes"), "{}", answers[0]);
        assert!(answers[1]["pairs"].is_array());
    }

    #[test]
    fn angles_are_above_minus_180_and_up_to_180_degrees() {
        for (angle, wanted) in [(180.0, 180.0), (-180.0, 180.0), (190.0, -170.0), (360.0, 0.0)] {
            assert!((upper_half(angle) - wanted).abs() < 1e-9, "{angle}");
        }
    }
}
