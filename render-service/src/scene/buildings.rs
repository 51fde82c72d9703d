//! Corners between houses and the ground: where less of the sky is seen, and what wet ground
//! mirrors.

use std::collections::BTreeMap;

use raster::Occluder;
use schemas::{HiddenScenery, SemanticTag, Vec3};

/// Side of the squares by which houses are found, in metres; what is further away than that
/// darkens hardly a pixel.
const SQUARE_M: f32 = 64.0;
/// Up to this height walls keep the sky from the ground before them, in metres: a whole house would
/// darken its street, which the light of the sky leaves as bright as it is elsewhere.
const CORNER_M: f32 = 2.0;
/// Mean linear reflectance of walls and their windows.
const WALL: [f32; 3] = [0.30, 0.25, 0.21];

/// The houses of a town by the squares that their middles are in.
#[derive(Debug, Default)]
pub(crate) struct Buildings(BTreeMap<[i32; 2], Vec<Building>>);

#[derive(Clone, Copy, Debug)]
struct Building {
    /// In the map's scenery.
    place: u32,
    occluder: Occluder,
}

impl Buildings {
    pub(crate) fn of_map(map: &roads::Map) -> Self {
        let mut squares: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for (place, thing) in map.scenery().iter().enumerate() {
            if thing.label != SemanticTag::Buildings {
                continue;
            }
            let half_m: Vec3 = thing.half_extent_m.cast();
            let middle_m: Vec3 = thing.pose.translation.vector.cast();
            let ahead = (thing.pose.rotation.cast::<f32>() * Vec3::x()).xy().normalize();
            let foot_m = middle_m - Vec3::z() * half_m.z;
            let occluder = Occluder {
                place_m: foot_m.into(),
                ahead: ahead.into(),
                half_m: [half_m.x, half_m.y],
                height_m: CORNER_M.min(2.0 * half_m.z),
                tall_m: 2.0 * half_m.z,
                colour: WALL,
            };
            let building = Building { place: place as u32, occluder };
            squares.entry(square(&middle_m)).or_default().push(building);
        }
        Self(squares)
    }

    /// Those that are not hidden, around a place.
    pub(crate) fn around<'a>(
        &'a self,
        eye_m: &Vec3,
        hidden: &'a HiddenScenery,
    ) -> impl Iterator<Item = Occluder> + 'a {
        let [x, y] = square(eye_m);
        let squares = (x - 1..=x + 1).flat_map(move |x| (y - 1..=y + 1).map(move |y| [x, y]));
        let found = squares.filter_map(|at| self.0.get(&at)).flatten();
        let shown = found.filter(|building| !hidden.contains(building.place));
        shown.map(|building| building.occluder)
    }
}

fn square(place_m: &Vec3) -> [i32; 2] {
    [place_m.x, place_m.y].map(|part| (part / SQUARE_M).floor().clamp(-1e6, 1e6) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn houses_are_found_from_before_them_and_not_from_afar_or_where_they_are_hidden() {
        let text = roads::town::build("Town10HD_Opt").unwrap();
        let map = roads::Map::parse("Town10HD_Opt", &text).unwrap();
        let is_house = |thing: &&roads::SceneryBox| thing.label == SemanticTag::Buildings;
        let count = map.scenery().iter().filter(is_house).count();
        let buildings = Buildings::of_map(&map);
        assert!(count > 0 && buildings.0.values().flatten().count() == count);
        let place = map.scenery().iter().position(|thing| is_house(&thing)).unwrap();
        let house = &map.scenery()[place];
        let before_m: Vec3 = house.pose.translation.vector.cast();
        let found = |eye_m: Vec3, hidden: &HiddenScenery| {
            let here = [before_m.x, before_m.y];
            buildings.around(&eye_m, hidden).filter(|one| one.place_m[..2] == here).count()
        };
        let mut hidden = HiddenScenery::default();
        let beside = [Vec3::x(), -Vec3::x(), Vec3::y(), -Vec3::y()].map(|way| way * SQUARE_M);
        for aside_m in beside.into_iter().chain([Vec3::zeros()]) {
            assert_eq!(found(before_m + aside_m, &hidden), 1, "{aside_m}");
            assert_eq!(found(before_m + 2.0 * aside_m, &hidden), usize::from(aside_m.norm() < 1.0));
        }
        assert_eq!(found(Vec3::repeat(1e12), &hidden), 0);
        hidden.set(place as u32, true);
        assert_eq!(found(before_m, &hidden), 0);
    }
}
