//! Do houses darken the corners at their feet, and do signs say what they mean?

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

use common::{brightness, camera, draw, frame, job, pixel, project, renderers};
use render_service::{Renderer, TownScene};
use roads::Map;
use schemas::{
    Camera, Frame, HiddenScenery, Image, MapRef, Pose, UnitQuaternion, Vec3, Weather, level_pose,
};

/// A road along x, a house from y = 11 to 19 m beside it, and a stop sign at x = 20 m.
const STREET: &str = r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="6"/>
  <road name="street" length="100" id="1" junction="-1">
    <planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView>
    <lanes><laneSection s="0">
      <center><lane id="0" type="none"/></center>
      <right><lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right>
    </laneSection></lanes>
    <objects>
      <object type="building" id="5" name="house" s="50" t="15" zOffset="0" hdg="0" length="12"
        width="8" height="9" orientation="none"/>
    </objects>
    <signals>
      <signal s="20" t="-5" id="7" name="stop" dynamic="no" orientation="+" zOffset="2" type="206"
        subtype="-1" value="-1" country="DEU" width="0.8" height="0.8"/>
    </signals>
  </road>
</OpenDRIVE>"#;

/// The street and what draws it.
struct Street {
    map: Map,
    scene: Arc<TownScene>,
    renderer: Renderer,
}

impl Street {
    fn drawn_by_all() -> impl Iterator<Item = Self> {
        renderers().map(|renderer| {
            let map = Map::parse("street", STREET).unwrap();
            Self { scene: Arc::new(TownScene::of_map(&map)), map, renderer }
        })
    }

    fn draw(&mut self, camera: &Camera, weather: Weather, hidden: HiddenScenery) -> Image {
        let map = MapRef { name: String::new(), digest: self.map.digest().to_owned() };
        let frame = Frame { map, weather, hidden, ..frame(vec![]) };
        draw(&mut self.renderer, &self.scene, &job(frame, vec![camera.clone()])).remove(0)
    }
}

#[test]
fn the_ground_at_the_foot_of_a_house_is_darker_than_some_metres_before_it() {
    let turn = UnitQuaternion::from_euler_angles(0.0, 0.4, FRAC_PI_2);
    let camera = Camera {
        carrier_from_camera: Pose::from_parts(Vec3::new(50.0, 3.0, 4.0).into(), turn),
        ..camera()
    };
    let weather = Weather { cloudiness_percent: 100.0, ..Weather::CLEAR_NOON };
    for mut street in Street::drawn_by_all() {
        // Grass is not of one colour: as much darker as without the house.
        let mut at = |hidden: HiddenScenery| {
            let image = street.draw(&camera, weather, hidden);
            [10.7, 7.0].map(|y| {
                let (column, row) = project(&camera, &Vec3::new(50.0, y, 0.0));
                brightness(&image, column, row)
            })
        };
        let mut gone = HiddenScenery::default();
        gone.set(0, true);
        let [[near, far], [near_alone, far_alone]] = [at(HiddenScenery::default()), at(gone)];
        assert!(near < 0.9 * near_alone, "{near} with the house, {near_alone} without");
        assert!((far - far_alone).abs() < 0.06 * far_alone, "{far} and {far_alone}");
    }
}

#[test]
fn a_stop_sign_says_so_in_white_on_red() {
    let pose = level_pose(Vec3::new(17.5, -5.0, 2.4), 0.0);
    let camera = Camera { carrier_from_camera: pose, ..camera() };
    for mut street in Street::drawn_by_all() {
        let post = street.map.posts().first().unwrap();
        let middle: Vec3 = post.world_from_carried().translation.vector.cast();
        let half_m = post.carried_half_m.z as f32;
        let image = street.draw(&camera, Weather::CLEAR_NOON, HiddenScenery::default());
        let at = |right: f32, up: f32| {
            let (column, row) = project(&camera, &(middle + Vec3::new(0.0, -right, up)));
            pixel(&image, column, row)
        };
        let is_white = |[red, green, blue]: [i32; 3]| green > 120 && red - green < 60 && blue > 120;
        // The bar and the stem of the T, the middle of the O, below the P's bow.
        let text = [(-0.20, 0.24), (-0.20, 0.0), (0.20, 0.0), (0.65, -0.17)];
        let seen = text.map(|(right, up)| is_white(at(right * half_m, up * half_m)));
        assert_eq!(seen, [true, true, false, false]);
    }
}
