//! All manoeuvres of all vehicles as a table and plots.

use std::fmt::Write;

use crate::aids::{split_stop, turn_stop};
use crate::corner::{Circle, circle, dwell, sine_steer, step_steer};
use crate::disturb::{drop_from, hold_mm, kerb};
use crate::plot::Plot;
use crate::published::{Known, VEHICLES, measure};
use crate::straight::{coast, start, stop_with_friction};
use crate::switches::Aids;
use crate::track::Rig;
use crate::{Result, model};

const GRAVITY_MPS2: f32 = 9.81;
/// Where handling is tested, unless the vehicle is not that fast.
const HANDLING_KMH: f32 = 80.0;
const LORRY_KMH: f32 = 60.0;
const KERB_M: f32 = 0.12;
const DROP_M: f32 = 0.5;

/// What `causeway bench dynamics` writes.
pub struct Report {
    /// Markdown.
    pub text: String,
    /// SVG by the name of its file.
    pub plots: Vec<(&'static str, String)>,
    /// Steering and answers of one vehicle for other models to repeat, as JSON.
    pub runs: String,
}

/// Lines of one plot.
type Lines = Vec<(String, Vec<(f32, f32)>)>;

/// The lines of all plots, filled vehicle by vehicle.
#[derive(Default)]
struct Curves {
    starts: Lines,
    understeer: Lines,
    steps: Lines,
    sines: Lines,
    friction: Lines,
    kerbs: Lines,
}

/// Drives everything; takes seconds.
///
/// # Errors
/// The world refused or diverged.
pub fn report() -> Result<Report> {
    let mut curves = Curves::default();
    let mut text = String::from("## Beside published figures\n\n");
    text.push_str("| vehicle | manoeuvre | ours | published | error | whose figure |\n");
    text.push_str("|---|---|---|---|---|---|\n");
    for known in &VEHICLES {
        for row in measure(known)? {
            let error = 100.0 * (row.measured / row.published - 1.0);
            line(
                &mut text,
                format!(
                    "| `{}` | {} | {:.2} | {:.2} | {error:+.0} % | {} |",
                    known.id, row.what, row.measured, row.published, row.source
                ),
            );
        }
    }
    text.push_str("\n## Handling\n\n| vehicle | manoeuvre | result |\n|---|---|---|\n");
    for known in &VEHICLES {
        handling(known, &mut curves, &mut text)?;
    }
    text.push_str("\n## Aids\n\n| vehicle | manoeuvre | with | result |\n|---|---|---|---|\n");
    for known in VEHICLES.iter().filter(|known| known.class != "motorcycle") {
        aids(known, &mut text)?;
    }
    text.push_str(
        "\n## Straight on, slopes, kerbs\n\n| vehicle | manoeuvre | result |\n|---|---|---|\n",
    );
    for known in &VEHICLES {
        along(known, &mut curves, &mut text)?;
    }
    Ok(Report { text, plots: curves.plots(), runs: model::runs()?.to_string() })
}

fn handling(known: &Known, curves: &mut Curves, text: &mut String) -> Result<()> {
    let (id, is_lorry) = (known.id, known.class == "lorry");
    let kmh = if is_lorry { LORRY_KMH } else { HANDLING_KMH };
    let mps = kmh / 3.6;
    let mut row =
        |what: &str, result: String| line(text, format!("| `{id}` | {what} | {result} |"));
    let limit = circle(Rig::rolling(id, mps)?, mps)?;
    row(
        &format!("circle at {kmh:.0} km/h"),
        format!(
            "{:.2} g, understeer {:.1} °/g",
            limit.highest_mps2 / GRAVITY_MPS2,
            limit.understeer_deg_per_g
        ),
    );
    curves.understeer.push((known.class.to_owned(), limit.curve()));
    let wanted_mps2 = (0.5 * limit.highest_mps2).min(4.0);
    let answer = step_steer(Rig::rolling(id, mps)?, mps, limit.steer_at(wanted_mps2))?;
    row(
        "step steer (ISO 7401)",
        format!(
            "{:.1} m/s², yaw rate 90 % after {:.2} s, overshoot {:.0} %",
            answer.steady_mps2,
            answer.rise_secs,
            100.0 * answer.overshoot
        ),
    );
    let points = answer.moments.iter().map(|at| (at.secs, at.yaw_radps.to_degrees()));
    curves.steps.push((known.class.to_owned(), points.collect()));
    if known.class == "motorcycle" {
        return Ok(());
    }
    sines(known, mps, limit.steer_at(0.3 * GRAVITY_MPS2), curves, text)
}

fn sines(
    known: &Known,
    mps: f32,
    amplitude: f32,
    curves: &mut Curves,
    text: &mut String,
) -> Result<()> {
    let id = known.id;
    let mut row =
        |what: &str, result: String| line(text, format!("| `{id}` | {what} | {result} |"));
    for scale in [1.5f32, 2.5, 3.5, 4.5, 5.5, 6.5] {
        let answer = sine_steer(Rig::rolling(id, mps)?, scale * amplitude)?;
        row(
            &format!("sine with dwell (ISO 19365), {scale} × the steer of 0.3 g"),
            format!(
                "yaw rate left after 1 s {:.0} %, 1.75 s {:.0} %, {:.2} m aside: {}",
                100.0 * answer.after_1_secs,
                100.0 * answer.after_1_75_secs,
                answer.beside_m,
                if answer.is_stable() { "stable" } else { "spins" }
            ),
        );
        if scale == 2.5 {
            let points = answer.moments.iter().map(|at| (at.secs, at.yaw_radps.to_degrees()));
            curves.sines.push((known.class.to_owned(), points.collect()));
        }
    }
    Ok(())
}

/// With and without anti-lock brakes and stability control.
fn aids(known: &Known, text: &mut String) -> Result<()> {
    let (id, is_lorry) = (known.id, known.class == "lorry");
    let mps = if is_lorry { LORRY_KMH } else { HANDLING_KMH } / 3.6;
    for aids in [Aids::BOTH, Aids::ANTI_LOCK, Aids::NONE] {
        let with = aids.as_str();
        let mut row = |what: &str, result: String| {
            line(text, format!("| `{id}` | {what} | {with} | {result} |"))
        };
        let found = dwell(id, aids, mps)?;
        row(
            "sine with dwell (FMVSS 126)",
            format!("stable up to {} ×, {:.2} m aside", found.stable_to, found.beside_m),
        );
        let found = turn_stop(id, aids)?;
        row(
            "braking in a turn (ISO 7975)",
            format!(
                "{:.2} g, yaw rate after 1 s {:.2} of the circle's, slip up to {:.0}°",
                found.braking_g, found.yaw_share, found.slip_deg
            ),
        );
        let found = split_stop(id, aids)?;
        row(
            "braking on two frictions (UN R13-H)",
            format!(
                "{:.2} g of {:.2} g, steering wheel {:.0}° in 2 s, {:.0}° at most, {:.1} m aside, \
                 {:.0}° off: {}",
                found.braking_g,
                found.wanted_g,
                found.first_deg,
                found.wheel_deg,
                found.aside_m,
                found.yaw_deg,
                if found.passes() { "passes" } else { "fails" }
            ),
        );
    }
    Ok(())
}

fn along(known: &Known, curves: &mut Curves, text: &mut String) -> Result<()> {
    let id = known.id;
    let mut row =
        |what: &str, result: String| line(text, format!("| `{id}` | {what} | {result} |"));
    let (_, speeds) = start(id, known.start.kmh / 3.6)?;
    curves.starts.push((known.class.to_owned(), speeds));
    let (from_kmh, to_kmh) = if known.class == "lorry" { (80.0, 40.0) } else { (100.0, 50.0) };
    let (secs, wanted_secs) = coast(id, from_kmh / 3.6, to_kmh / 3.6)?;
    row(
        &format!("rolls from {from_kmh:.0} to {to_kmh:.0} km/h in neutral"),
        format!("{secs:.1} s, by drag and rolling resistance alone {wanted_secs:.1} s"),
    );
    for share in [0.1f32, 0.2, 0.3] {
        let slid_mm = hold_mm(id, share)?;
        row(
            &format!("brake on a slope of {:.0} %, 60 s", 100.0 * share),
            format!("{slid_mm:.2} mm"),
        );
    }
    let jolt = kerb(id, KERB_M, 15.0 / 3.6)?;
    row(
        "kerb of 12 cm at 15 km/h",
        format!(
            "up to {:.1} g, {:.1}° tilt, settles {:+.0} mm from rest",
            jolt.peak_mps2 / GRAVITY_MPS2,
            jolt.tilt_rad.to_degrees(),
            jolt.height_mm
        ),
    );
    curves.kerbs.push((known.class.to_owned(), jolt.curve));
    let jolt = drop_from(id, DROP_M)?;
    row(
        "drop from 0.5 m",
        format!(
            "up to {:.1} g, rests after {:.1} s at {:+.1} mm",
            jolt.peak_mps2 / GRAVITY_MPS2,
            jolt.settled_secs,
            jolt.height_mm
        ),
    );
    slippery(known, curves, text)
}

fn slippery(known: &Known, curves: &mut Curves, text: &mut String) -> Result<()> {
    let id = known.id;
    let kmh = if known.class == "lorry" { 65.0 } else { 80.0 };
    let mut points = Vec::new();
    for share in [0.1f32, 0.2, 0.35, 0.5, 0.75, 1.0] {
        points.push((1.0 / share, stop_with_friction(id, kmh / 3.6, share)?));
    }
    let dry_m = points.last().map_or(f32::NAN, |point| point.1);
    let told = points.iter().map(|(over, stop_m)| format!("{stop_m:.0} m at {:.2}", 1.0 / over));
    let told = told.collect::<Vec<_>>().join(", ");
    line(text, format!("| `{id}` | {kmh:.0} to 0 km/h by friction | {told} |"));
    let ratios = points.iter().map(|&(over, stop_m)| (over, stop_m / dry_m)).collect();
    curves.friction.push((known.class.to_owned(), ratios));
    Ok(())
}

impl Circle {
    fn curve(&self) -> Vec<(f32, f32)> {
        let moving = self.moments.iter().filter(|moment| moment.sideways_mps2 > 0.2);
        moving
            .map(|moment| (moment.sideways_mps2 / GRAVITY_MPS2, moment.extra_deg(self.wheelbase_m)))
            .collect()
    }
}

impl Curves {
    fn plots(mut self) -> Vec<(&'static str, String)> {
        let ideal = vec![(1.0, 1.0), (10.0, 10.0)];
        self.friction.push(("as 1 over friction".to_owned(), ideal));
        let plot = |title, x, y, lines| Plot { title, x, y, lines }.svg();
        vec![
            ("start.svg", plot("Full throttle", "seconds", "km/h", self.starts)),
            (
                "understeer.svg",
                plot(
                    "Understeer: wheel angle beyond that of a slow curve",
                    "sideways acceleration, g",
                    "degrees",
                    self.understeer,
                ),
            ),
            ("step.svg", plot("Step steer", "seconds", "yaw rate, °/s", self.steps)),
            (
                "sine.svg",
                plot(
                    "Sine with dwell, 2.5 × the steer of 0.3 g",
                    "seconds",
                    "yaw rate, °/s",
                    self.sines,
                ),
            ),
            (
                "friction.svg",
                plot("Braking distance by friction", "1 / friction", "× dry", self.friction),
            ),
            ("kerb.svg", plot("Kerb of 12 cm", "seconds", "height, m", self.kerbs)),
        ]
    }
}

fn line(text: &mut String, line: String) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{line}");
}
