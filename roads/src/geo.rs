//! Geographic places: the spherical transverse Mercator projection of the client library.

use nalgebra::Point3;

use crate::map::Map;

/// Radius of the sphere times the scale of the projection, in metres.
const SCALED_RADIUS_M: f64 = 0.9996 * 6_378_137.0;
/// Origin of maps without a usable `geoReference`, in degrees.
const DEFAULT_ORIGIN_DEG: [f64; 2] = [42.0, 2.0];

/// A place on the earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeoPlace {
    /// Degrees north.
    pub latitude_deg: f64,
    /// Degrees east.
    pub longitude_deg: f64,
    /// Height in metres.
    pub altitude_m: f64,
}

impl Map {
    /// The geographic place of a point of the map.
    ///
    /// **Source:** the client library, which does not turn its mirrored y back: our y, which points
    /// north, is counted southward here.
    #[must_use]
    pub fn geo_place(&self, point: &Point3<f64>) -> GeoPlace {
        let [latitude_rad, longitude_rad] = self.geo_origin_rad();
        let (x, y) = (point.x / SCALED_RADIUS_M, -point.y / SCALED_RADIUS_M);
        let d = y + latitude_rad;
        GeoPlace {
            latitude_deg: (d.sin() / x.cosh()).asin().to_degrees(),
            longitude_deg: (longitude_rad + x.sinh().atan2(d.cos())).to_degrees(),
            altitude_m: point.z,
        }
    }

    /// The point of the map at a geographic place: the inverse of [`Map::geo_place`].
    #[must_use]
    pub fn point_at(&self, place: &GeoPlace) -> Point3<f64> {
        let [latitude0_rad, longitude0_rad] = self.geo_origin_rad();
        let latitude_rad = place.latitude_deg.to_radians();
        let east_rad = place.longitude_deg.to_radians() - longitude0_rad;
        let x = (latitude_rad.cos() * east_rad.sin()).atanh();
        let y = latitude_rad.tan().atan2(east_rad.cos()) - latitude0_rad;
        Point3::new(x * SCALED_RADIUS_M, -y * SCALED_RADIUS_M, place.altitude_m)
    }

    fn geo_origin_rad(&self) -> [f64; 2] {
        let origin_deg = match (self.model.latitude_deg, self.model.longitude_deg) {
            (Some(latitude_deg), Some(longitude_deg)) => [latitude_deg, longitude_deg],
            _ => DEFAULT_ORIGIN_DEG,
        };
        origin_deg.map(f64::to_radians)
    }
}
