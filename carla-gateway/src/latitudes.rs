//! Which way the latitudes of `sensor.other.gnss` grow.

use roads::{GeoPlace, Map};
use schemas::Measurement;

/// Radius of the earth that CARLA counts with, in metres.
const RADIUS_M: f64 = 6_378_137.0;

/// Which way latitudes grow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Latitudes {
    /// To the south, as in CARLA 0.9.16 and its `transform_to_geolocation`.
    #[default]
    South,
    /// To the north, as in CARLA up to 0.9.15, which most programs that drive by them count with.
    North,
}

impl std::fmt::Display for Latitudes {
    /// As typed.
    fn fmt(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        to.write_str(match self {
            Self::South => "south",
            Self::North => "north",
        })
    }
}

impl Latitudes {
    /// A measurement as clients are told it; `None` where it is told as it was measured.
    pub(crate) fn told(self, map: &Map, measurement: &Measurement) -> Option<Measurement> {
        let Measurement::Gnss { latitude_deg, longitude_deg, altitude_m } = *measurement else {
            return None;
        };
        (self == Self::North).then(|| {
            let place = northward(map, &GeoPlace { latitude_deg, longitude_deg, altitude_m });
            let GeoPlace { latitude_deg, longitude_deg, altitude_m } = place;
            Measurement::Gnss { latitude_deg, longitude_deg, altitude_m }
        })
    }
}

/// The same place by the Mercator projection of CARLA up to 0.9.15.
fn northward(map: &Map, place: &GeoPlace) -> GeoPlace {
    let point = map.point_at(place);
    let origin = map.geo_place(&(point * 0.0));
    let scaled_m = RADIUS_M * origin.latitude_deg.to_radians().cos();
    let half = std::f64::consts::FRAC_PI_4 + origin.latitude_deg.to_radians() / 2.0;
    let north = half.tan().ln() + point.y / scaled_m;
    GeoPlace {
        latitude_deg: 2.0 * north.exp().atan().to_degrees() - 90.0,
        longitude_deg: origin.longitude_deg + (point.x / scaled_m).to_degrees(),
        altitude_m: place.altitude_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(georeference: &str) -> Map {
        let header = format!("<header><geoReference>{georeference}</geoReference></header>");
        let road = r#"<road id="1" length="10" junction="-1"><planView>
            <geometry s="0" x="0" y="0" hdg="0" length="10"><line/></geometry></planView>
            <lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
            <lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>
            </right></laneSection></lanes></road>"#;
        Map::parse("m", &format!("<OpenDRIVE>{header}{road}</OpenDRIVE>")).unwrap()
    }

    fn measured(map: &Map, x_m: f64, y_m: f64) -> Measurement {
        let somewhere = GeoPlace { latitude_deg: 0.0, longitude_deg: 0.0, altitude_m: 5.0 };
        let mut point = map.point_at(&somewhere);
        (point.x, point.y) = (x_m, y_m);
        let GeoPlace { latitude_deg, longitude_deg, altitude_m } = map.geo_place(&point);
        Measurement::Gnss { latitude_deg, longitude_deg, altitude_m }
    }

    #[test]
    fn by_default_they_are_told_as_measured() {
        let map = map("+proj=tmerc +lat_0=0 +lon_0=0");
        assert_eq!(Latitudes::default().told(&map, &measured(&map, 1.0, 2.0)), None);
    }

    /// **Source:** `_location_to_gps` of CARLA's leaderboard, whose routes agents compare with.
    #[test]
    fn to_the_north_as_routes_of_the_leaderboard_are() {
        for (georeference, wanted_deg) in [
            ("+proj=tmerc +lat_0=0 +lon_0=0", [0.002_057_998_095, -0.000_898_315_284]),
            ("+proj=tmerc +lat_0=49 +lon_0=8", [49.002_057_955_577, 7.998_630_740_155]),
        ] {
            let map = map(georeference);
            let told = Latitudes::North.told(&map, &measured(&map, -100.0, 229.095_3));
            let Some(Measurement::Gnss { latitude_deg, longitude_deg, altitude_m }) = told else {
                panic!("{told:?}");
            };
            assert!((latitude_deg - wanted_deg[0]).abs() < 1e-9, "{latitude_deg}");
            assert!((longitude_deg - wanted_deg[1]).abs() < 1e-9, "{longitude_deg}");
            assert!((altitude_m - 5.0).abs() < 1e-9);
        }
    }
}
