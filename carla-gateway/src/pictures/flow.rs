//! Optical flow from depth, ids and the movement of everything since the last frame.

use std::collections::BTreeMap;

use schemas::{DEPTH_MAX_M, Pose, TagId, Vec3};

/// How much further away the sky is than anything that is drawn.
const SKY_FACTOR: f32 = 1.0e3;
/// Nearer to the plane of the camera, a point has no place in the picture.
const NEAR_M: f32 = 1.0e-3;

/// Where everything was and is.
#[derive(Clone, Debug, Default)]
pub(crate) struct Movement {
    /// Of actors by id: the pose before, after taking back the pose now.
    pub(crate) before_from_now: BTreeMap<u32, Pose>,
    /// Of people whose limbs swing: what moves by itself.
    pub(crate) limbs: BTreeMap<u32, Vec<Segment>>,
}

/// A part of a body that is nearest to its own middle line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    /// Ends of that line, in the world.
    pub(crate) ends_m: [Vec3; 2],
    /// The pose before, after taking back the pose now.
    pub(crate) before_from_now: Pose,
}

impl Segment {
    fn distance_squared(&self, point_m: &Vec3) -> f32 {
        let [from, to] = self.ends_m;
        let along = to - from;
        let share = (point_m - from).dot(&along) / along.norm_squared().max(1.0e-9);
        (from + along * share.clamp(0.0, 1.0) - point_m).norm_squared()
    }
}

/// A camera in two frames.
pub(crate) struct View {
    pub(crate) world_from_camera: Pose,
    pub(crate) world_from_camera_before: Pose,
    pub(crate) width_px: u32,
    pub(crate) height_px: u32,
    pub(crate) horizontal_fov_rad: f32,
}

/// How far what a pixel shows moved to the right and up since the last frame, row by row. The
/// picture is 2 wide and 2 high, as in CARLA. What was behind the camera has not moved.
///
/// - **Domain:** `depths` and `ids` as [`schemas::ImageEncoding`] packs them; pixels that are
///   missing in either are left out.
pub(crate) fn flow(view: &View, movement: &Movement, depths: &[u8], ids: &[u8]) -> Vec<[f32; 2]> {
    let half_px = Vec3::new(0.0, view.width_px as f32, view.height_px as f32) / 2.0;
    let focal_px = half_px.y / (view.horizontal_fov_rad / 2.0).tan();
    let camera_before_from_world = view.world_from_camera_before.inverse();
    let still = camera_before_from_world * view.world_from_camera;
    let moved: BTreeMap<u32, Pose> = movement
        .before_from_now
        .iter()
        .map(|(id, before_from_now)| {
            (*id, camera_before_from_world * before_from_now * view.world_from_camera)
        })
        .collect();
    let mut last = (0, &still);
    let (depths, _) = depths.as_chunks::<4>();
    let (ids, _) = ids.as_chunks::<4>();
    let pixels = depths.iter().zip(ids).enumerate();
    pixels
        .map(|(at, (depth, id))| {
            let (row, column) = (at as u32 / view.width_px, at as u32 % view.width_px);
            let right_px = column as f32 + 0.5 - half_px.y;
            let down_px = row as f32 + 0.5 - half_px.z;
            let depth_m = f32::from_le_bytes(*depth);
            let ahead_m = if depth_m >= DEPTH_MAX_M { depth_m * SKY_FACTOR } else { depth_m };
            let point_m = Vec3::new(1.0, -right_px / focal_px, -down_px / focal_px) * ahead_m;
            let id = TagId::unpack(*id).id;
            if id != last.0 {
                last = (id, moved.get(&id).unwrap_or(&still));
            }
            let before_m = match movement.limbs.get(&id) {
                Some(limbs) => limb_before(view, &camera_before_from_world, limbs, &point_m),
                None => last.1.transform_point(&point_m.into()).coords,
            };
            if before_m.x < NEAR_M {
                return [0.0, 0.0];
            }
            let right_before_px = -before_m.y / before_m.x * focal_px;
            let down_before_px = -before_m.z / before_m.x * focal_px;
            [(right_px - right_before_px) / half_px.y, (down_before_px - down_px) / half_px.z]
        })
        .collect()
}

/// Where a point of a body was, in the axes of the camera before, if it moved as the limb that is
/// nearest to it.
fn limb_before(
    view: &View,
    camera_before_from_world: &Pose,
    limbs: &[Segment],
    point_m: &Vec3,
) -> Vec3 {
    let in_world = view.world_from_camera.transform_point(&(*point_m).into());
    let distance = |limb: &&Segment| limb.distance_squared(&in_world.coords);
    let nearest = limbs.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
    let before = nearest.map_or(in_world, |limb| limb.before_from_now.transform_point(&in_world));
    camera_before_from_world.transform_point(&before).coords
}

#[cfg(test)]
mod tests {
    use schemas::{ActorId, SemanticTag, level_pose};

    use super::*;

    const SIDE_PX: u32 = 101;

    fn view(before: Pose, now: Pose) -> View {
        View {
            world_from_camera: now,
            world_from_camera_before: before,
            width_px: SIDE_PX,
            height_px: SIDE_PX,
            horizontal_fov_rad: std::f32::consts::FRAC_PI_2,
        }
    }

    fn picture<const N: usize>(pixel: [u8; N]) -> Vec<u8> {
        pixel.repeat((SIDE_PX * SIDE_PX) as usize)
    }

    /// Of the pixel in the middle.
    fn middle(view: &View, movement: &Movement, depth_m: f32, id: u32) -> [f32; 2] {
        let depths = picture(depth_m.to_le_bytes());
        let flow = flow(view, movement, &depths, &picture(id.to_le_bytes()));
        assert_eq!(flow.len(), (SIDE_PX * SIDE_PX) as usize);
        flow[(SIDE_PX * SIDE_PX / 2) as usize]
    }

    #[test]
    fn what_stands_moves_against_a_turning_camera_and_far_things_too() {
        let turn_rad = 0.01f32;
        let turned = level_pose(Vec3::zeros(), turn_rad);
        let view = view(Pose::identity(), turned);
        for depth_m in [5.0, DEPTH_MAX_M] {
            let [right, up] = middle(&view, &Movement::default(), depth_m, 0);
            assert!((right - turn_rad.tan()).abs() < 1e-4, "{right}");
            assert!(up.abs() < 1e-6);
        }
    }

    #[test]
    fn what_moves_takes_its_own_way() {
        let lifted = Pose::translation(0.0, 0.0, 0.5);
        let actor = ActorId::new(7).unwrap();
        let movement = Movement {
            before_from_now: [(7, lifted.inverse())].into_iter().collect(),
            ..Movement::default()
        };
        let view = view(Pose::identity(), Pose::identity());
        let car = TagId::of_actor(SemanticTag::Car, actor);
        let [right, up] = middle(&view, &movement, 10.0, car);
        assert!((up - 0.05).abs() < 1e-5 && right.abs() < 1e-6, "{right} {up}");
        let other = TagId::of_actor(SemanticTag::Car, ActorId::new(8).unwrap());
        assert_eq!(middle(&view, &movement, 10.0, other), [0.0, 0.0]);
    }

    #[test]
    fn a_limb_moves_by_itself() {
        let walker = ActorId::new(7).unwrap();
        let arm = |x: f32, before_from_now: Pose| Segment {
            ends_m: [Vec3::new(10.0, 0.0, x), Vec3::new(10.0, 0.0, x + 0.5)],
            before_from_now,
        };
        let lifted = Pose::translation(0.0, 0.0, -0.5);
        let limbs = vec![arm(-0.25, lifted), arm(2.0, Pose::translation(0.0, 3.0, 0.0))];
        let movement =
            Movement { limbs: [(7, limbs)].into_iter().collect(), ..Movement::default() };
        let id = TagId::of_actor(SemanticTag::Pedestrians, walker);
        let [right, up] = middle(&view(Pose::identity(), Pose::identity()), &movement, 10.0, id);
        assert!((up - 0.05).abs() < 1e-5 && right.abs() < 1e-6, "{right} {up}");
    }

    #[test]
    fn what_was_behind_the_camera_has_no_flow() {
        let view = view(Pose::translation(20.0, 0.0, 0.0), Pose::identity());
        assert_eq!(middle(&view, &Movement::default(), 10.0, 0), [0.0, 0.0]);
    }
}
