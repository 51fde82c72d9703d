//! The settings every scenario has, and how a client changes them.

use std::fmt::Write as _;

use schemas::PictureQuality;
use schemas::limits::{FIELD_OF_VIEW_DEG_MAX, IMAGE_SIDE_PX_MAX, PIXELS_PER_JOB_MAX};
use serde_json::{Map, Value};

use super::ScenarioError;
use super::sharing::Sharing;
use super::weather::WeatherChoice;
use crate::limits::{ECHO_CHARS_MAX, EPISODE_STEPS_MAX, IGNORED_KEYS_MAX, TICKS_PER_STEP_MAX};
use crate::openenv::coerce::{self, Bounds};

/// Where the sources of the specification disagree, which of them to follow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Profile {
    /// What the documents promise: speeds, distances, manoeuvres.
    #[default]
    Documented,
    /// The numbers of the reference server.
    Literal,
}

impl Profile {
    /// The word on the wire.
    pub(crate) const fn as_str(self) -> &'static str {
        match self {
            Self::Documented => "documented",
            Self::Literal => "literal",
        }
    }

    /// The inverse of [`as_str`](Self::as_str).
    pub(crate) fn parse(text: &str) -> Option<Self> {
        [Self::Documented, Self::Literal].into_iter().find(|profile| profile.as_str() == text)
    }
}

/// The settings every scenario has.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Common {
    /// As observations report it; changing it renames the episode.
    pub(crate) name: String,
    /// For people.
    pub(crate) description: String,
    /// Steps until an undecided episode is over.
    pub(crate) max_steps: u32,
    /// What the sky does.
    pub(crate) weather: WeatherChoice,
    /// The ego's.
    pub(crate) vehicle_blueprint: String,
    /// The ego's speed at the start.
    pub(crate) initial_speed_kmh: f64,
    /// Pictures, in pixels.
    pub(crate) camera_width: u32,
    /// Pictures, in pixels.
    pub(crate) camera_height: u32,
    /// Horizontal, in degrees.
    pub(crate) camera_fov: f32,
    /// 1 to 100.
    pub(crate) jpeg_quality: u8,
    /// How finely colours are drawn; `None` as the site is told.
    pub(crate) camera_quality: Option<PictureQuality>,
    /// Where; `None` for the default map.
    pub(crate) map_name: Option<String>,
    /// Ticks that one step takes.
    pub(crate) ticks_per_step: u32,
    /// Whether time goes on while no step is asked for.
    pub(crate) realtime: bool,
    /// Manoeuvres as one-tick controls, as the reference server does them.
    pub(crate) raw_controls: bool,
    /// Whether a swerve counts only towards a lane that exists.
    pub(crate) strict_swerve: bool,
    /// Whether no state of the episode can be kept or gone back to.
    pub(crate) sealed: bool,
    /// Whether CARLA's clients may come into its world.
    pub(crate) open_to_carla: bool,
    /// How many egos its world has.
    pub(crate) sharing: Sharing,
    /// Which source the defaults follow.
    pub(crate) profile: Profile,
}

impl Common {
    /// The defaults for a scenario of this name.
    pub(crate) fn new(name: &str, profile: Profile) -> Self {
        Self {
            name: name.to_owned(),
            description: String::new(),
            max_steps: 50,
            weather: WeatherChoice::default(),
            vehicle_blueprint: "vehicle.lincoln.mkz".to_owned(),
            initial_speed_kmh: 0.0,
            camera_width: 640,
            camera_height: 360,
            camera_fov: 90.0,
            jpeg_quality: 75,
            camera_quality: None,
            map_name: None,
            ticks_per_step: 1,
            realtime: false,
            raw_controls: profile == Profile::Literal,
            strict_swerve: profile == Profile::Documented,
            sealed: false,
            open_to_carla: false,
            sharing: Sharing::default(),
            profile,
        }
    }

    /// The map's name.
    pub(crate) fn map_name(&self) -> &str {
        self.map_name.as_deref().unwrap_or("Town10HD_Opt")
    }

    /// Takes the settings every scenario has.
    ///
    /// # Errors
    /// [`ScenarioError::Config`] for a value outside its domain.
    pub(crate) fn configure(&mut self, overrides: &mut Overrides<'_>) -> Result<(), ScenarioError> {
        overrides.text("name", &mut self.name)?;
        overrides.text("description", &mut self.description)?;
        overrides.integer("max_steps", &mut self.max_steps, 1, EPISODE_STEPS_MAX)?;
        if let Some(value) = overrides.take("weather") {
            self.weather = WeatherChoice::from_json(value)?;
        }
        overrides.text("vehicle_blueprint", &mut self.vehicle_blueprint)?;
        if !self.vehicle_blueprint.starts_with("vehicle.") {
            return Err(ScenarioError::Config {
                key: "vehicle_blueprint".to_owned(),
                wanted: "a vehicle such as vehicle.lincoln.mkz".to_owned(),
                found: format!("{:?}", self.vehicle_blueprint),
            });
        }
        let speeds = Bounds { min: 0.0, max: 200.0 };
        overrides.number("initial_speed_kmh", &mut self.initial_speed_kmh, speeds)?;
        overrides.integer("camera_width", &mut self.camera_width, 1, IMAGE_SIDE_PX_MAX)?;
        overrides.integer("camera_height", &mut self.camera_height, 1, IMAGE_SIDE_PX_MAX)?;
        let pixels = self.camera_width as usize * self.camera_height as usize;
        if pixels > PIXELS_PER_JOB_MAX {
            return Err(ScenarioError::Config {
                key: "camera_width".to_owned(),
                wanted: format!("so that a picture has at most {PIXELS_PER_JOB_MAX} pixels"),
                found: format!("{} by {}", self.camera_width, self.camera_height),
            });
        }
        let mut fov = f64::from(self.camera_fov);
        let fovs = Bounds { min: 1.0, max: f64::from(FIELD_OF_VIEW_DEG_MAX) };
        overrides.number("camera_fov", &mut fov, fovs)?;
        self.camera_fov = fov as f32;
        let mut quality = u32::from(self.jpeg_quality);
        overrides.integer("jpeg_quality", &mut quality, 1, 100)?;
        self.jpeg_quality = quality as u8;
        if let Some(value) = overrides.take("camera_quality") {
            self.camera_quality = match value {
                Value::Null => None,
                Value::String(name) if name == "low" => Some(PictureQuality::Low),
                Value::String(name) if name == "high" => Some(PictureQuality::High),
                other => return Err(wrong("camera_quality", "low, high or null", other)),
            };
        }
        if let Some(value) = overrides.take("map_name") {
            self.map_name = match value {
                Value::Null => None,
                Value::String(name) if !name.is_empty() => Some(name.clone()),
                other => return Err(wrong("map_name", "the name of a map or null", other)),
            };
        }
        overrides.integer("ticks_per_step", &mut self.ticks_per_step, 1, TICKS_PER_STEP_MAX)?;
        overrides.boolean("realtime", &mut self.realtime)?;
        overrides.boolean("sealed", &mut self.sealed)?;
        overrides.boolean("open_to_carla", &mut self.open_to_carla)?;
        self.sharing.configure(overrides)?;
        overrides.boolean("raw_controls", &mut self.raw_controls)
    }
}

/// The members of a client's `scenario_config`, each taken at most once.
pub(crate) struct Overrides<'a> {
    values: &'a Map<String, Value>,
    taken: Vec<&'static str>,
}

impl<'a> Overrides<'a> {
    /// All of them, none taken.
    pub(crate) fn new(values: &'a Map<String, Value>) -> Self {
        Self { values, taken: Vec::new() }
    }

    /// A member as it is.
    pub(crate) fn take(&mut self, key: &'static str) -> Option<&'a Value> {
        self.taken.push(key);
        self.values.get(key)
    }

    /// The profile asked for, or the present one.
    ///
    /// # Errors
    /// [`ScenarioError::Config`] for anything but the name of a profile.
    pub(crate) fn profile(&mut self, present: Profile) -> Result<Profile, ScenarioError> {
        let Some(value) = self.take("profile") else { return Ok(present) };
        let profile = value.as_str().and_then(Profile::parse);
        profile.ok_or_else(|| wrong("profile", "\"documented\" or \"literal\"", value))
    }

    /// A flag that is off unless set.
    ///
    /// # Errors
    /// [`ScenarioError::Config`] for anything but true and false.
    pub(crate) fn flag(&mut self, key: &'static str) -> Result<bool, ScenarioError> {
        let mut flag = false;
        self.boolean(key, &mut flag)?;
        Ok(flag)
    }

    /// The members nobody took.
    pub(crate) fn ignored(&self) -> Vec<String> {
        let unknown = self.values.keys().filter(|key| !self.taken.contains(&key.as_str()));
        unknown.take(IGNORED_KEYS_MAX).map(|key| cut(key)).collect()
    }

    /// Replaces a text.
    ///
    /// # Errors
    /// [`ScenarioError::Config`] for anything but a text of 1 to 256 characters.
    pub(crate) fn text(
        &mut self,
        key: &'static str,
        target: &mut String,
    ) -> Result<(), ScenarioError> {
        let Some(value) = self.take(key) else { return Ok(()) };
        match value.as_str() {
            Some(text) if (1..=ECHO_CHARS_MAX).contains(&text.chars().count()) => {
                text.clone_into(target);
                Ok(())
            }
            _ => Err(wrong(key, "a text of 1 to 256 characters", value)),
        }
    }

    /// Replaces a flag.
    ///
    /// # Errors
    /// [`ScenarioError::Config`] for anything but true and false.
    pub(crate) fn boolean(
        &mut self,
        key: &'static str,
        target: &mut bool,
    ) -> Result<(), ScenarioError> {
        let Some(value) = self.take(key) else { return Ok(()) };
        *target = value.as_bool().ok_or_else(|| wrong(key, "true or false", value))?;
        Ok(())
    }

    /// Replaces a number, read as leniently as those of actions.
    ///
    /// # Errors
    /// [`ScenarioError::Config`] outside `bounds`.
    pub(crate) fn number(
        &mut self,
        key: &'static str,
        target: &mut f64,
        bounds: Bounds,
    ) -> Result<(), ScenarioError> {
        let Some(value) = self.take(key) else { return Ok(()) };
        *target = coerce::number(key, value, bounds).map_err(|_| {
            wrong(key, &format!("a number from {} to {}", bounds.min, bounds.max), value)
        })?;
        Ok(())
    }

    /// Replaces a whole number, read as leniently as those of actions.
    ///
    /// # Errors
    /// [`ScenarioError::Config`] outside `min` to `max`.
    pub(crate) fn integer(
        &mut self,
        key: &'static str,
        target: &mut u32,
        min: u32,
        max: u32,
    ) -> Result<(), ScenarioError> {
        let Some(value) = self.take(key) else { return Ok(()) };
        let read = coerce::integer(key, value, u64::from(min)).ok();
        *target = read
            .and_then(|read| u32::try_from(read).ok())
            .filter(|read| *read <= max)
            .ok_or_else(|| wrong(key, &format!("a whole number from {min} to {max}"), value))?;
        Ok(())
    }
}

/// The error for a member that is not what it must be.
pub(crate) fn wrong(key: &str, wanted: &str, found: &Value) -> ScenarioError {
    ScenarioError::Config {
        key: key.to_owned(),
        wanted: wanted.to_owned(),
        found: cut(&found.to_string()),
    }
}

fn cut(text: &str) -> String {
    let mut short: String = text.chars().take(ECHO_CHARS_MAX).collect();
    if short.len() < text.len() {
        let _ = write!(short, "…");
    }
    short
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn apply(common: &mut Common, values: Value) -> Result<Vec<String>, ScenarioError> {
        let Value::Object(values) = values else { panic!("the test wants an object") };
        let mut overrides = Overrides::new(&values);
        common.configure(&mut overrides)?;
        Ok(overrides.ignored())
    }

    #[test]
    fn known_settings_are_taken_leniently_and_unknown_ones_are_named() {
        let mut common = Common::new("x", Profile::Documented);
        let ignored = apply(
            &mut common,
            json!({ "max_steps": "7", "camera_width": 1280.0, "weather": "WetNoon", "foo": 1 }),
        );
        assert_eq!(ignored.unwrap(), ["foo"]);
        assert_eq!((common.max_steps, common.camera_width, common.camera_height), (7, 1280, 360));
    }

    #[test]
    fn a_wrong_setting_says_what_was_wanted_and_what_was_found() {
        for (values, text) in [
            (
                json!({ "camera_width": "wide" }),
                "scenario_config.camera_width must be a whole number from 1 to 4096, not \"wide\"",
            ),
            (
                json!({ "camera_fov": 171 }),
                "scenario_config.camera_fov must be a number from 1 to 170, not 171",
            ),
            (
                json!({ "vehicle_blueprint": "walker.pedestrian.0001" }),
                "scenario_config.vehicle_blueprint must be a vehicle such as vehicle.lincoln.mkz, \
                 not \"walker.pedestrian.0001\"",
            ),
            (
                json!({ "raw_controls": "no" }),
                "scenario_config.raw_controls must be true or false, not \"no\"",
            ),
            (
                json!({ "name": "" }),
                "scenario_config.name must be a text of 1 to 256 characters, not \"\"",
            ),
        ] {
            let mut common = Common::new("x", Profile::Documented);
            assert_eq!(apply(&mut common, values).unwrap_err().to_string(), text);
        }
    }
}
