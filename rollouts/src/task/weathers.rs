//! In which weathers a task is learnt and tested.

use schemas::{Error, ErrorCode, Weather};
use serde::Deserialize;

use super::impossible;
use crate::limits::WEATHERS_MAX;

/// A spec's words for a task's weathers.
const TRAINING: &str = "training";
const TEST: &str = "test";

/// Weathers of a task, by the names of CARLA's presets.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Weathers {
    /// Those to learn in; none: dry noon.
    training: Vec<String>,
    /// Those to be tested in.
    test: Vec<String>,
}

/// One of CARLA's presets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sky {
    /// Its place among [`Weather::presets`], from 1 on.
    pub number: u32,
    pub weather: Weather,
}

impl Sky {
    /// Friction of roads over that of dry ones.
    pub(crate) fn grip(&self) -> f32 {
        world::grip(&self.weather)
    }

    /// # Errors
    /// `InvalidArgument` with the names that there are.
    fn named(name: &str) -> Result<Self, Error> {
        let found = Weather::presets().zip(1..).find(|(known, _)| *known == name);
        let sky = found.and_then(|(known, number)| {
            Weather::preset(known).map(|weather| Self { number, weather })
        });
        sky.ok_or_else(|| {
            let known: Vec<&str> = Weather::presets().collect();
            impossible("there is no such weather")
                .wanted(format!("{TRAINING}, {TEST}, or {}", known.join(", ")))
                .found(name)
        })
    }
}

impl Weathers {
    pub(super) fn check(&self) -> Result<(), Error> {
        for (what, names) in [("weathers.training", &self.training), ("weathers.test", &self.test)]
        {
            if names.len() > WEATHERS_MAX {
                return Err(impossible(&format!("{what} has too many entries"))
                    .wanted(WEATHERS_MAX)
                    .found(names.len()));
            }
            for name in names {
                Sky::named(name).map_err(|error| Error {
                    message: format!("{what}: {}", error.message),
                    ..error
                })?;
            }
        }
        Ok(())
    }

    /// What a spec asks for: `training` and `test` are the task's, other names CARLA's presets.
    ///
    /// # Errors
    /// `InvalidArgument` for a name that is none, or for what the task does not name.
    pub(crate) fn skies(&self, asked: &[String]) -> Result<Vec<Sky>, Error> {
        let mut skies = Vec::new();
        for name in asked {
            let names = match name.as_str() {
                TRAINING => &self.training,
                TEST => &self.test,
                _ => std::slice::from_ref(name),
            };
            for name in names {
                skies.push(Sky::named(name)?);
            }
            match (names.is_empty(), name.as_str()) {
                (true, TRAINING) => skies.push(Sky::named("ClearNoon")?),
                (true, _) => {
                    return Err(Error::new(
                        ErrorCode::InvalidArgument,
                        "the task names no weathers to be tested in",
                    )
                    .wanted("names of CARLA's presets"));
                }
                (false, _) => {}
            }
        }
        Ok(skies)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(weathers: &Weathers, asked: &[&str]) -> Result<Vec<u32>, String> {
        let asked: Vec<String> = asked.iter().map(|name| (*name).to_owned()).collect();
        let skies = weathers.skies(&asked).map_err(|error| error.to_string())?;
        Ok(skies.iter().map(|sky| sky.number).collect())
    }

    #[test]
    fn words_stand_for_the_weathers_of_the_task_and_names_for_themselves() {
        let named = Weathers {
            training: vec!["ClearNoon".to_owned(), "WetNoon".to_owned()],
            test: vec!["SoftRainSunset".to_owned()],
        };
        assert_eq!(numbers(&named, &["training"]), Ok(vec![1, 3]));
        assert_eq!(numbers(&named, &["test", "training"]), Ok(vec![14, 1, 3]));
        assert_eq!(numbers(&named, &["HardRainNoon"]), Ok(vec![6]));
        let none = Weathers::default();
        assert_eq!(numbers(&none, &["training"]), Ok(vec![1]), "dry noon");
        assert!(numbers(&none, &["test"]).unwrap_err().contains("no weathers to be tested in"));
        assert!(numbers(&none, &["Snow"]).unwrap_err().contains("SoftRainSunset"));
    }

    #[test]
    fn roads_are_as_slippery_as_in_worlds() {
        let grip = |name: &str| Sky::named(name).unwrap().grip();
        assert_eq!((grip("ClearNoon"), grip("CloudySunset")), (1.0, 1.0));
        assert!(grip("HardRainNoon") < grip("WetNoon") && grip("WetNoon") < 1.0);
    }
}
