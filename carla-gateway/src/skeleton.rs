//! Bones of pedestrians under CARLA's names: where the limbs are that cameras see.
//!
//! **Frame:** a bone's own pose is relative to its parent; the component stands on the ground under
//! the walker, x ahead, y left, z up. Limbs hang down along -z.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use schemas::gait::{
    self, ARM_ASIDE_RAD, CHEST_Z, HEAD_Z, HIP_Y, HIP_Z, SHOULDER_Y, SHOULDER_Z, THIGH, UPPER_ARM,
};
use schemas::{ActorState, Limb, Pose, PosedLimb, Translation3, UnitQuaternion, Vec3};

use crate::pictures::Segment;

/// Bones of a custom pose at most.
const CUSTOM_MAX: usize = 256;
/// Heights of the joints of the trunk, in heights of the person.
const HIPS_Z: f32 = 0.53;
const SPINE_Z: f32 = 0.61;
const NECK_Z: f32 = 0.84;
/// Sideways from the spine to the collar bone.
const COLLAR_Y: f32 = 0.03;

/// One bone in a person of height 1.
struct Bone {
    name: String,
    /// Place of its parent in the list; the root is its own.
    parent: usize,
    /// From the joint of the parent, in its axes.
    offset: Vec3,
    swing: Swing,
}

/// What moves a bone.
#[derive(Clone, Copy)]
enum Swing {
    No,
    /// +1 is left.
    Leg(f32),
    Arm(f32),
}

/// Where a bone is.
pub(crate) struct Posed {
    pub(crate) name: &'static str,
    pub(crate) in_world: Pose,
    pub(crate) in_component: Pose,
    pub(crate) in_parent: Pose,
}

/// A pose that a client made, and how much of it shows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Custom {
    relative: BTreeMap<String, Pose>,
    share: f32,
}

impl Custom {
    /// Takes over poses of bones, relative to their parents; unknown names are left out.
    pub(crate) fn set(&mut self, bones: impl IntoIterator<Item = (String, Pose)>) {
        for (name, pose) in bones {
            if bones_of_all().iter().any(|bone| bone.name == name)
                && self.relative.len() < CUSTOM_MAX
            {
                self.relative.insert(name, pose);
            }
        }
    }

    /// Shows it: 0 not at all, 1 alone.
    pub(crate) fn blend(&mut self, share: f32) {
        self.share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
    }

    /// Takes over how the walker is now.
    pub(crate) fn copy(&mut self, walker: &ActorState) {
        let posed = posed(walker, None);
        self.relative =
            posed.into_iter().map(|bone| (bone.name.to_owned(), bone.in_parent)).collect();
    }

    fn blended(&self, name: &str, walked: Pose) -> Pose {
        let Some(wanted) = self.relative.get(name).filter(|_| self.share > 0.0) else {
            return walked;
        };
        let between = walked.translation.vector.lerp(&wanted.translation.vector, self.share);
        let turned = walked.rotation.nlerp(&wanted.rotation, self.share);
        Pose::from_parts(Translation3::from(between), turned)
    }
}

/// All bones of a walker, parents before children.
pub(crate) fn posed(walker: &ActorState, custom: Option<&Custom>) -> Vec<Posed> {
    let height_m = 2.0 * walker.box_half_extent_m.z;
    let foot_m = walker.box_centre_m - Vec3::z() * walker.box_half_extent_m.z;
    let world_from_component = walker.world_from_actor * Translation3::from(foot_m);
    let mut posed: Vec<Posed> = Vec::with_capacity(bones_of_all().len());
    for bone in bones_of_all() {
        let turn = match bone.swing {
            Swing::No => UnitQuaternion::identity(),
            Swing::Leg(side) => swung(side * gait::leg_rad(walker), 0.0),
            Swing::Arm(side) => swung(side * gait::arm_rad(walker), side * ARM_ASIDE_RAD),
        };
        let walked = Pose::from_parts(Translation3::from(bone.offset * height_m), turn);
        let in_parent = custom.map_or(walked, |custom| custom.blended(&bone.name, walked));
        let parent = posed.get(bone.parent).map_or(Pose::identity(), |parent| parent.in_component);
        let in_component = parent * in_parent;
        let in_world = world_from_component * in_component;
        posed.push(Posed { name: &bone.name, in_world, in_component, in_parent });
    }
    posed
}

/// The bone that each limb hangs on, and the one at its other end.
const LIMBS: [(Limb, &str, &str); 10] = [
    (Limb::Trunk, "crl_spine01__C", "crl_hips__C"),
    (Limb::Head, "crl_Head__C", "crl_eye__L"),
    (Limb::LeftArm, "crl_arm__L", "crl_foreArm__L"),
    (Limb::LeftForearm, "crl_foreArm__L", "crl_handMiddle02__L"),
    (Limb::RightArm, "crl_arm__R", "crl_foreArm__R"),
    (Limb::RightForearm, "crl_foreArm__R", "crl_handMiddle02__R"),
    (Limb::LeftThigh, "crl_thigh__L", "crl_leg__L"),
    (Limb::LeftShin, "crl_leg__L", "crl_toe__L"),
    (Limb::RightThigh, "crl_thigh__R", "crl_leg__R"),
    (Limb::RightShin, "crl_leg__R", "crl_toe__R"),
];

/// Limbs of a walker in a pose that shows; none while it walks as it does by itself.
pub(crate) fn limbs(walker: &ActorState, custom: &Custom) -> Vec<PosedLimb> {
    if custom.share <= 0.0 || custom.relative.is_empty() {
        return Vec::new();
    }
    let posed = posed(walker, Some(custom));
    let of = |(limb, bone, _): &(Limb, &str, &str)| {
        let world_from_limb = posed.iter().find(|one| one.name == *bone)?.in_world;
        Some(PosedLimb { walker: walker.id, limb: *limb, world_from_limb })
    };
    LIMBS.iter().filter_map(of).collect()
}

/// How the limbs of a walker moved since an earlier frame.
pub(crate) fn moved([before, now]: [&ActorState; 2], custom: Option<&Custom>) -> Vec<Segment> {
    let [before, now] = [before, now].map(|walker| posed(walker, custom));
    let of = |(_, bone, end): &(Limb, &str, &str)| {
        let at = now.iter().position(|one| one.name == *bone)?;
        let end = now.iter().find(|one| one.name == *end)?;
        let (then, now) = (before.get(at)?, now.get(at)?);
        Some(Segment {
            ends_m: [now.in_world, end.in_world].map(|pose| pose.translation.vector),
            before_from_now: then.in_world * now.in_world.inverse(),
        })
    };
    LIMBS.iter().filter_map(of).collect()
}

/// Ahead about the left axis, then aside about the axis ahead.
fn swung(ahead_rad: f32, aside_rad: f32) -> UnitQuaternion<f32> {
    UnitQuaternion::from_axis_angle(&Vec3::x_axis(), aside_rad)
        * UnitQuaternion::from_axis_angle(&Vec3::y_axis(), -ahead_rad)
}

/// In CARLA's order: programs take bones by their numbers.
fn bones_of_all() -> &'static [Bone] {
    static BONES: LazyLock<Vec<Bone>> = LazyLock::new(|| {
        let mut bones = Bones(Vec::new());
        let root = bones.add("crl_root".to_owned(), 0, Vec3::zeros(), Swing::No);
        let up = |from: f32, to: f32| Vec3::new(0.0, 0.0, to - from);
        let hips = bones.still("crl_hips__C", root, up(0.0, HIPS_Z));
        let spine = bones.still("crl_spine__C", hips, up(HIPS_Z, SPINE_Z));
        let chest = bones.still("crl_spine01__C", spine, up(SPINE_Z, CHEST_Z));
        bones.arm("L", 1.0, chest);
        let neck = bones.still("crl_neck__C", chest, up(CHEST_Z, NECK_Z));
        let head = bones.still("crl_Head__C", neck, up(NECK_Z, HEAD_Z));
        for (letter, side) in [("L", 1.0), ("R", -1.0)] {
            bones.still(&format!("crl_eye__{letter}"), head, Vec3::new(0.05, side * 0.018, 0.035));
        }
        bones.arm("R", -1.0, chest);
        for (letter, side) in [("R", -1.0), ("L", 1.0)] {
            bones.leg(letter, side, hips);
        }
        bones.0
    });
    &BONES
}

struct Bones(Vec<Bone>);

impl Bones {
    fn add(&mut self, name: String, parent: usize, offset: Vec3, swing: Swing) -> usize {
        self.0.push(Bone { name, parent, offset, swing });
        self.0.len() - 1
    }

    fn still(&mut self, name: &str, parent: usize, offset: Vec3) -> usize {
        self.add(name.to_owned(), parent, offset, Swing::No)
    }

    fn arm(&mut self, letter: &str, side: f32, chest: usize) {
        let collar = Vec3::new(0.0, side * COLLAR_Y, SHOULDER_Z - CHEST_Z);
        let shoulder = self.still(&format!("crl_shoulder__{letter}"), chest, collar);
        let joint = Vec3::new(0.0, side * (SHOULDER_Y - COLLAR_Y), 0.0);
        let arm = self.add(format!("crl_arm__{letter}"), shoulder, joint, Swing::Arm(side));
        let fore =
            self.still(&format!("crl_foreArm__{letter}"), arm, Vec3::new(0.0, 0.0, -UPPER_ARM));
        let hand = self.still(&format!("crl_hand__{letter}"), fore, Vec3::new(0.018, 0.0, -0.135));
        let fingers = [
            ("Thumb", 0.018),
            ("Index", 0.010),
            ("Middle", 0.003),
            ("Ring", -0.004),
            ("Pinky", -0.010),
        ];
        for (finger, ahead) in fingers {
            let mut parent = hand;
            let mut offset = Vec3::new(ahead, 0.0, -0.025);
            for part in ["", "01", "02", "End"] {
                parent = self.still(&format!("crl_hand{finger}{part}__{letter}"), parent, offset);
                offset = Vec3::new(0.0, 0.0, -0.015);
            }
        }
    }

    fn leg(&mut self, letter: &str, side: f32, hips: usize) {
        let joint = Vec3::new(0.0, side * HIP_Y, HIP_Z - HIPS_Z);
        let thigh = self.add(format!("crl_thigh__{letter}"), hips, joint, Swing::Leg(side));
        let knee = self.still(&format!("crl_leg__{letter}"), thigh, Vec3::new(0.0, 0.0, -THIGH));
        let foot = self.still(&format!("crl_foot__{letter}"), knee, Vec3::new(0.0, 0.0, -0.21));
        let toe = self.still(&format!("crl_toe__{letter}"), foot, Vec3::new(0.06, 0.0, -0.03));
        self.still(&format!("crl_toeEnd__{letter}"), toe, Vec3::new(0.04, 0.0, 0.0));
    }
}

#[cfg(test)]
mod tests {
    use schemas::{ActorId, ActorKind};

    use super::*;

    fn walker() -> ActorState {
        let at = Pose::translation(10.0, 0.0, 0.9);
        let mut walker = ActorState::at_rest(ActorId::new(1).unwrap(), ActorKind::Walker, 0, at);
        walker.box_half_extent_m = Vec3::new(0.2, 0.2, 0.9);
        walker
    }

    fn bone(posed: &[Posed], name: &str) -> Vec3 {
        let found = posed.iter().find(|bone| bone.name == name);
        found.unwrap_or_else(|| panic!("no {name}")).in_world.translation.vector
    }

    #[test]
    fn a_standing_person_has_its_head_up_and_its_feet_on_the_ground() {
        let posed = posed(&walker(), None);
        assert_eq!(posed.len(), 66);
        assert!((bone(&posed, "crl_root") - Vec3::new(10.0, 0.0, 0.0)).norm() < 1e-5);
        assert!((bone(&posed, "crl_Head__C").z - 0.89 * 1.8).abs() < 1e-4);
        assert!(bone(&posed, "crl_foot__L").z < 0.1 && bone(&posed, "crl_foot__L").y > 0.0);
        assert!(bone(&posed, "crl_hand__R").y < -0.2);
    }

    #[test]
    fn bones_have_the_places_that_programs_know_by_number() {
        let posed = posed(&walker(), None);
        let known = [
            (5, "crl_arm__L"),
            (28, "crl_neck__C"),
            (31, "crl_eye__R"),
            (33, "crl_arm__R"),
            (55, "crl_handPinkyEnd__R"),
            (56, "crl_thigh__R"),
            (61, "crl_thigh__L"),
        ];
        for (place, name) in known {
            assert_eq!(posed[place].name, name);
        }
    }

    #[test]
    fn limbs_of_one_side_swing_against_each_other() {
        let mut walking = walker();
        walking.linear_velocity_mps = Vec3::new(1.4, 0.0, 0.0);
        walking.gait_rad = std::f32::consts::FRAC_PI_2;
        let posed = posed(&walking, None);
        assert!(bone(&posed, "crl_foot__L").x > 10.2 && bone(&posed, "crl_foot__R").x < 9.9);
        assert!(bone(&posed, "crl_hand__L").x < 10.0 && bone(&posed, "crl_hand__R").x > 10.0);
    }

    #[test]
    fn limbs_are_told_only_of_a_pose_that_shows() {
        let mut custom = Custom::default();
        let arm = Pose::from_parts(
            Translation3::new(0.0, 0.17, 0.0),
            UnitQuaternion::from_axis_angle(&Vec3::x_axis(), -1.5),
        );
        custom.set([("crl_arm__R".to_owned(), arm)]);
        assert_eq!(limbs(&walker(), &custom), []);
        custom.blend(1.0);
        let limbs = limbs(&walker(), &custom);
        assert_eq!(limbs.len(), Limb::ALL.len());
        let elbow = limbs.iter().find(|limb| limb.limb == Limb::RightForearm).unwrap();
        let shoulder = limbs.iter().find(|limb| limb.limb == Limb::RightArm).unwrap();
        let along =
            elbow.world_from_limb.translation.vector - shoulder.world_from_limb.translation.vector;
        assert!(along.z.abs() < 0.05 && along.y.abs() > 0.25, "{along:?}");
    }

    #[test]
    fn a_leg_that_swings_moves_more_at_the_foot_than_at_the_hip() {
        let mut walking = walker();
        walking.linear_velocity_mps = Vec3::new(1.4, 0.0, 0.0);
        let later = ActorState { gait_rad: 0.5, ..walking.clone() };
        let segments = moved([&walking, &later], None);
        let shin = &segments[Limb::LeftShin as usize];
        let way = |point_m: &Vec3| {
            let before = shin.before_from_now.transform_point(&(*point_m).into()).coords;
            (point_m - before).norm()
        };
        let [knee, toe] = shin.ends_m;
        assert!(way(&toe) > 1.5 * way(&knee) && way(&knee) > 0.02, "{} {}", way(&toe), way(&knee));
    }

    #[test]
    fn a_custom_pose_shows_as_far_as_it_is_blended() {
        let mut custom = Custom::default();
        let raised = Pose::translation(0.0, 0.0, 0.3);
        custom.set([("crl_neck__C".to_owned(), raised), ("tail".to_owned(), raised)]);
        let neck = |custom: &Custom| bone(&posed(&walker(), Some(custom)), "crl_neck__C").z;
        let own = neck(&custom);
        custom.blend(1.0);
        let shown = neck(&custom);
        custom.blend(0.5);
        assert!((shown - (own - 0.11 * 1.8 + 0.3)).abs() < 1e-4, "{own} {shown}");
        assert!((neck(&custom) - (own + shown) / 2.0).abs() < 1e-4);
    }
}
