//! Spellings of older and newer CARLA releases.

use crate::{Blueprint, find};

/// (spelling, id in 0.9.16), ordered by spelling.
const ALIASES: [(&str, &str); 27] = [
    ("vehicle.ambulance.ford", "vehicle.ford.ambulance"),
    ("vehicle.bmw.isetta", "vehicle.micro.microlino"),
    ("vehicle.carlacola.actors", "vehicle.carlamotors.carlacola"),
    ("vehicle.charger2020.charger2020", "vehicle.dodge.charger_2020"),
    ("vehicle.chargercop2020.chargercop2020", "vehicle.dodge.charger_police_2020"),
    ("vehicle.dodge.charger", "vehicle.dodge.charger_2020"),
    ("vehicle.dodge_charger.police", "vehicle.dodge.charger_police"),
    ("vehicle.dodgecop.charger", "vehicle.dodge.charger_police_2020"),
    ("vehicle.firetruck.actors", "vehicle.carlamotors.firetruck"),
    ("vehicle.fuso.mitsubishi", "vehicle.mitsubishi.fusorosa"),
    ("vehicle.harley-davidson.low rider", "vehicle.harley-davidson.low_rider"),
    ("vehicle.lincoln.mkz2017", "vehicle.lincoln.mkz_2017"),
    ("vehicle.lincoln2020.mkz2020", "vehicle.lincoln.mkz_2020"),
    ("vehicle.mercedes-benz.coupe", "vehicle.mercedes.coupe"),
    ("vehicle.mercedesccc.mercedesccc", "vehicle.mercedes.coupe_2020"),
    ("vehicle.mini.cooper", "vehicle.mini.cooper_s_2021"),
    ("vehicle.mini.cooperst", "vehicle.mini.cooper_s"),
    ("vehicle.mustang.mustang", "vehicle.ford.mustang"),
    ("vehicle.sixwheeltruck.sixwheeltruck", "vehicle.carlamotors.european_hgv"),
    ("vehicle.sprinter.mercedes", "vehicle.mercedes.sprinter"),
    ("vehicle.taxi.ford", "vehicle.ford.crown"),
    ("vehicle.ue4.audi.tt", "vehicle.audi.tt"),
    ("vehicle.ue4.bmw.grantourer", "vehicle.bmw.grandtourer"),
    ("vehicle.ue4.chevrolet.impala", "vehicle.chevrolet.impala"),
    ("vehicle.ue4.ford.crown", "vehicle.ford.crown"),
    ("vehicle.ue4.ford.mustang", "vehicle.ford.mustang"),
    ("vehicle.ue4.mercedes.ccc", "vehicle.mercedes.coupe_2020"),
];

/// The spellings that are ids in 0.10.0, ordered.
const OF_0_10: [&str; 15] = [
    "vehicle.ambulance.ford",
    "vehicle.carlacola.actors",
    "vehicle.dodge.charger",
    "vehicle.dodgecop.charger",
    "vehicle.firetruck.actors",
    "vehicle.fuso.mitsubishi",
    "vehicle.mini.cooper",
    "vehicle.sprinter.mercedes",
    "vehicle.taxi.ford",
    "vehicle.ue4.audi.tt",
    "vehicle.ue4.bmw.grantourer",
    "vehicle.ue4.chevrolet.impala",
    "vehicle.ue4.ford.crown",
    "vehicle.ue4.ford.mustang",
    "vehicle.ue4.mercedes.ccc",
];

/// The blueprints that CARLA 0.10.0 has under another id than 0.9.16, under that id, each with the
/// one of [`crate::all`] that it is.
pub fn renamed_in_0_10() -> impl Iterator<Item = (Blueprint, &'static Blueprint)> {
    OF_0_10.iter().filter_map(|id| find(id).map(|blueprint| (blueprint.renamed(id), blueprint)))
}

/// Whether this is an id of CARLA 0.10.0 for what 0.9.16 has under another one.
pub fn is_renamed_in_0_10(id: &str) -> bool {
    OF_0_10.binary_search(&id).is_ok()
}

/// The id that a spelling stands for; any other text stands for itself.
pub(crate) fn canonical(id: &str) -> &str {
    ALIASES.binary_search_by(|&(spelling, _)| spelling.cmp(id)).map_or(id, |index| ALIASES[index].1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spelling_names_a_blueprint_and_is_none_itself() {
        assert!(ALIASES.windows(2).all(|pair| pair[0].0 < pair[1].0));
        for (spelling, id) in ALIASES {
            assert_eq!(crate::find(spelling).map(|found| found.id.as_str()), Some(id));
            assert!(crate::all().iter().all(|blueprint| blueprint.id != spelling), "{spelling}");
        }
    }

    #[test]
    fn what_0_10_renames_is_the_same_under_its_id() {
        assert!(OF_0_10.is_sorted());
        assert_eq!(renamed_in_0_10().count(), OF_0_10.len());
        for (renamed, blueprint) in renamed_in_0_10() {
            assert!(renamed.listed && is_renamed_in_0_10(&renamed.id));
            assert!(!is_renamed_in_0_10(&blueprint.id));
            assert_eq!(renamed.tags.join("."), renamed.id);
            for (told, same) in renamed.attributes.iter().zip(&blueprint.attributes) {
                let is_name = told.id == "ros_name";
                assert_eq!(
                    told.value,
                    if is_name { renamed.id.clone() } else { same.value.clone() }
                );
            }
        }
    }
}
