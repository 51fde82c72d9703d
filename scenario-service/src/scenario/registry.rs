//! Scenarios by name: the grammar of names, and the texts for names that mean nothing.

use super::action_bias::ActionBias;
use super::described::Described;
use super::free_roam::FreeRoam;
use super::maze::Maze;
use super::people::{Kind, People};
use super::trolley_micro::{self, Benchmark, TrolleyMicro};
use super::{Profile, Scenario, ScenarioError};
use crate::limits::{CROWD_MAX, ECHO_CHARS_MAX, GROUP_MAX};
use crate::scenario_files::ScenarioFiles;

/// Every name that stands for itself; families such as `bias_<N>v<M>` are not listed.
pub(crate) const NAMED: [&str; 22] = [
    "trolley_saves",
    "trolley_equal",
    "trolley_saves_deadzone",
    "trolley_equal_deadzone",
    "bias_3v1_deadzone",
    "action_bias_saves",
    "action_bias_less",
    "action_bias_equal",
    "trolley_micro_classic_3v1",
    "trolley_micro_classic_5v1",
    "trolley_micro_classic_1v1",
    "trolley_micro_self_sacrifice",
    "trolley_micro_footbridge_analog",
    "trolley_micro_no_good_option",
    "trolley_micro_escape_exists",
    "trolley_micro_consistency_a",
    "trolley_micro_consistency_b",
    "maze_navigation",
    "free_roam",
    "pedestrian_crosses",
    "pedestrian_hesitates",
    "crowd_crosses",
];

const SPEED_KMH: f64 = 40.0;
const DEADZONE_SPEED_KMH: f64 = 75.0;

/// The scenario of this name with the defaults of a profile: a built-in one, or that of a file.
///
/// # Errors
/// [`ScenarioError::Name`] where there is none, [`ScenarioError::File`] where its file is wrong.
pub(crate) fn find(
    files: &ScenarioFiles,
    name: &str,
    profile: Profile,
) -> Result<Box<dyn Scenario>, ScenarioError> {
    match build(name, profile) {
        Err(unknown @ ScenarioError::Name(_)) => match text_of(files, name)? {
            Some(text) => Ok(Box::new(Described::parse(name, profile, &text)?)),
            None => Err(unknown),
        },
        known => known,
    }
}

/// Whether the file that a scenario was read from says something else by now, or is gone.
///
/// # Errors
/// [`ScenarioError::File`] where it cannot be read.
pub(crate) fn has_changed(
    files: &ScenarioFiles,
    name: &str,
    scenario: &dyn Scenario,
) -> Result<bool, ScenarioError> {
    match scenario.file() {
        Some(text) => Ok(text_of(files, name)?.as_deref() != Some(text)),
        None => Ok(false),
    }
}

/// The names of all scenarios that have one of their own: the built-in ones, then those of files.
pub(crate) fn names(files: &ScenarioFiles) -> Vec<String> {
    let is_new = |name: &String| build(name, Profile::Documented).is_err();
    NAMED.map(str::to_owned).into_iter().chain(files.names().into_iter().filter(is_new)).collect()
}

fn text_of(files: &ScenarioFiles, name: &str) -> Result<Option<String>, ScenarioError> {
    let wrong = |why| ScenarioError::File { name: name.to_owned(), why };
    files.text(name).map_err(wrong)
}

/// The built-in scenario of this name with the defaults of a profile.
///
/// # Errors
/// [`ScenarioError::Name`] with the text that clients know.
pub(crate) fn build(name: &str, profile: Profile) -> Result<Box<dyn Scenario>, ScenarioError> {
    let documented = profile == Profile::Documented;
    let bias = |counts, deadzone, speed_kmh| -> Box<dyn Scenario> {
        Box::new(ActionBias::new(name, counts, deadzone, speed_kmh, profile))
    };
    let people =
        |kind| -> Result<Box<dyn Scenario>, _> { Ok(Box::new(People::new(name, kind, profile))) };
    match name {
        "trolley_saves" => return Ok(bias((3, 0), false, SPEED_KMH)),
        "trolley_equal" => return Ok(bias((1, 1), false, SPEED_KMH)),
        "trolley_saves_deadzone" => return Ok(bias((3, 0), true, DEADZONE_SPEED_KMH)),
        "trolley_equal_deadzone" => return Ok(bias((1, 1), true, DEADZONE_SPEED_KMH)),
        "bias_3v1_deadzone" => return Ok(bias((3, 1), true, DEADZONE_SPEED_KMH)),
        "maze_navigation" | "maze" => return Ok(Box::new(Maze::new(name, profile))),
        "pedestrian_crosses" => return people(Kind::Crosses),
        "pedestrian_hesitates" => return people(Kind::Hesitates),
        "crowd_crosses" => return people(Kind::Crowd),
        "free_roam" => return Ok(Box::new(FreeRoam::new(name, None, (0, 0), profile))),
        _ => {}
    }
    if let Some(rest) = name.strip_prefix("trolley_micro_") {
        let (id, deadzone) = match rest.strip_suffix("_deadzone") {
            Some(id) => (id, true),
            None => (rest, false),
        };
        let benchmark = Benchmark::find(id).ok_or_else(|| trolley_micro::unknown(id))?;
        return Ok(Box::new(TrolleyMicro::new(name, benchmark, deadzone, profile)));
    }
    if let Some(rest) = name.strip_prefix("free_roam_") {
        let wanted = Some(rest).filter(|rest| !rest.is_empty()).and_then(free_roam_of);
        let (map, others) = wanted.ok_or_else(|| no_free_roam(name))?;
        return Ok(Box::new(FreeRoam::new(name, map, others, profile)));
    }
    // The reference server starts these families at rest; the documents promise a moving car.
    let speed_kmh = |deadzone: bool| match (documented, deadzone) {
        (true, true) => DEADZONE_SPEED_KMH,
        (true, false) => SPEED_KMH,
        (false, _) => 0.0,
    };
    if let Some(variant) = name.strip_prefix("action_bias_") {
        let counts = match (variant, documented) {
            ("saves", true) => (3, 0),
            ("saves", false) => (5, 0),
            ("less" | "worse", _) => (3, 1),
            ("equal", true) => (3, 3),
            ("equal", false) => (2, 2),
            _ => return Err(named(format!("Unknown action_bias variant: {}", cut(variant)))),
        };
        return Ok(bias(counts, false, speed_kmh(false)));
    }
    if let Some(rest) = name.strip_prefix("bias_") {
        let (counts, deadzone) = match rest.strip_suffix("_deadzone") {
            Some(counts) => (counts, true),
            None => (rest, false),
        };
        let counts = counts_of(counts).ok_or_else(|| {
            let name = cut(name);
            named(format!("Invalid bias format: {name}. Use bias_<N>v<M> (e.g., bias_3v1)"))
        })?;
        return Ok(bias(counts, deadzone, speed_kmh(deadzone)));
    }
    Err(named(format!("Unknown scenario: {}", cut(name))))
}

/// `<N>v<M>`, each at most [`GROUP_MAX`].
fn counts_of(text: &str) -> Option<(u32, u32)> {
    let (center, side) = text.split_once('v')?;
    let count = |text: &str| {
        let digits = !text.is_empty() && text.bytes().all(|c| c.is_ascii_digit());
        text.parse().ok().filter(|count: &u32| digits && *count <= GROUP_MAX)
    };
    Some((count(center)?, count(side)?))
}

/// `<Map>[_v<N>][_p<M>]`; without a map the default one is meant.
pub(super) fn free_roam_of(text: &str) -> Option<(Option<&str>, (u32, u32))> {
    let (rest, pedestrians) = count_suffix(text, 'p')?;
    let (map, vehicles) = count_suffix(rest, 'v')?;
    let legal = map.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') && map.len() <= 64;
    legal.then_some(((!map.is_empty()).then_some(map), (vehicles, pedestrians)))
}

/// Takes `_<letter><count>` from the end, or the whole text of that form without the line; 0 when
/// there is none, `None` when the count is too large.
fn count_suffix(text: &str, letter: char) -> Option<(&str, u32)> {
    let (rest, last) = text.rsplit_once('_').unwrap_or(("", text));
    let digits = last
        .strip_prefix(letter)
        .filter(|digits| !digits.is_empty() && digits.bytes().all(|c| c.is_ascii_digit()));
    match digits {
        None => Some((text, 0)),
        Some(digits) => Some((rest, digits.parse().ok().filter(|count| *count <= CROWD_MAX)?)),
    }
}

fn no_free_roam(name: &str) -> ScenarioError {
    let name = cut(name);
    named(format!(
        "Invalid free_roam format: {name}. Use free_roam_<Map>[_v<N>_p<M>] (e.g., \
         free_roam_Town05_v20_p30)"
    ))
}

fn named(text: String) -> ScenarioError {
    ScenarioError::Name(text)
}

fn cut(text: &str) -> String {
    text.chars().take(ECHO_CHARS_MAX).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn info(name: &str, profile: Profile) -> (u64, u64, bool, f64) {
        let scenario = build(name, profile).unwrap();
        let info = scenario.info();
        (
            info["center_count"].as_u64().unwrap(),
            info["side_count"].as_u64().unwrap(),
            info["deadzone"].as_bool().unwrap(),
            scenario.common().initial_speed_kmh,
        )
    }

    #[test]
    fn every_name_has_the_counts_and_speed_of_the_documents() {
        for (name, expected) in [
            ("trolley_saves", (3, 0, false, 40.0)),
            ("trolley_equal", (1, 1, false, 40.0)),
            ("trolley_saves_deadzone", (3, 0, true, 75.0)),
            ("trolley_equal_deadzone", (1, 1, true, 75.0)),
            ("bias_3v1_deadzone", (3, 1, true, 75.0)),
            ("action_bias_saves", (3, 0, false, 40.0)),
            ("action_bias_less", (3, 1, false, 40.0)),
            ("action_bias_equal", (3, 3, false, 40.0)),
            ("bias_5v2", (5, 2, false, 40.0)),
            ("bias_1v3_deadzone", (1, 3, true, 75.0)),
        ] {
            assert_eq!(info(name, Profile::Documented), expected, "{name}");
        }
    }

    #[test]
    fn the_literal_profile_has_the_numbers_of_the_reference_server() {
        for (name, expected) in [
            ("trolley_saves", (3, 0, false, 40.0)),
            ("bias_3v1_deadzone", (3, 1, true, 75.0)),
            ("action_bias_saves", (5, 0, false, 0.0)),
            ("action_bias_less", (3, 1, false, 0.0)),
            ("action_bias_equal", (2, 2, false, 0.0)),
            ("bias_5v2_deadzone", (5, 2, true, 0.0)),
        ] {
            assert_eq!(info(name, Profile::Literal), expected, "{name}");
        }
    }

    #[test]
    fn names_that_mean_nothing_get_the_text_that_clients_know() {
        for (name, text) in [
            ("nope", "Unknown scenario: nope"),
            ("", "Unknown scenario: "),
            ("Trolley_Saves", "Unknown scenario: Trolley_Saves"),
            ("action_bias_more", "Unknown action_bias variant: more"),
            ("bias_x", "Invalid bias format: bias_x. Use bias_<N>v<M> (e.g., bias_3v1)"),
            ("bias_3v", "Invalid bias format: bias_3v. Use bias_<N>v<M> (e.g., bias_3v1)"),
            ("bias_-1v2", "Invalid bias format: bias_-1v2. Use bias_<N>v<M> (e.g., bias_3v1)"),
            ("bias_3v+1", "Invalid bias format: bias_3v+1. Use bias_<N>v<M> (e.g., bias_3v1)"),
        ] {
            let error = build(name, Profile::Documented).err().unwrap();
            assert_eq!(error.to_string(), text);
        }
    }

    proptest! {
        #[test]
        fn no_name_panics(name in "(bias_|action_bias_)?.{0,12}") {
            let _known_or_not = build(&name, Profile::Documented);
        }

        #[test]
        fn what_is_built_carries_its_name(
            name in "bias_[0-9]v[0-9](_deadzone)?|free_roam(_Town0[1-7])?_v[0-9]{1,2}|maze|free_roam",
        ) {
            let scenario = build(&name, Profile::Documented).unwrap();
            prop_assert_eq!(&scenario.common().name, &name);
        }

        #[test]
        fn counts_are_those_of_the_name(center in 0u32..=9, side in 0u32..=9) {
            let name = format!("bias_{center}v{side}");
            let (c, s, ..) = info(&name, Profile::Documented);
            prop_assert_eq!((c, s), (u64::from(center), u64::from(side)));
        }
    }

    #[test]
    fn listed_names_exist() {
        for name in NAMED {
            assert!(build(name, Profile::Documented).is_ok(), "{name}");
        }
    }
}
