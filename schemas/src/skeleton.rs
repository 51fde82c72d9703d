//! The skeleton of walkers: where their bones and limbs are, for pictures, for rays and for whoever
//! asks for bones. Bones have CARLA's names and order, as programs take them by their numbers.
//!
//! **Frame:** a bone's own pose is relative to its parent; the component stands on the ground under
//! the walker, x ahead, y left, z up. Limbs hang down along -z.
//!
//! **Determinism:** sines are those of `libm`: rays meet limbs, and measure the same everywhere.

use std::sync::LazyLock;

use crate::gait::{
    self, ARM_ASIDE_RAD, CHEST_Z, HEAD_Z, HIP_Y, HIP_Z, SHOULDER_Y, SHOULDER_Z, THIGH, UPPER_ARM,
};
use crate::{ActorState, Pose, Translation3, UnitQuaternion, Vec3, WalkerPose};

/// Bones of a walker.
pub const BONES: usize = 66;

/// Heights of the joints of the trunk, in heights of the person.
const HIPS_Z: f32 = 0.53;
const SPINE_Z: f32 = 0.61;
const NECK_Z: f32 = 0.84;
/// Sideways from the spine to the collar bone.
const COLLAR_Y: f32 = 0.03;

/// The limbs that pictures move, each from its joint to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Limb {
    /// From the hips up, with what is on the back.
    Trunk,
    /// From the neck up.
    Head,
    /// Left, from the shoulder.
    LeftArm,
    /// Left, from the elbow.
    LeftForearm,
    /// Right, from the shoulder.
    RightArm,
    /// Right, from the elbow.
    RightForearm,
    /// Left, from the hip.
    LeftThigh,
    /// Left, from the knee.
    LeftShin,
    /// Right, from the hip.
    RightThigh,
    /// Right, from the knee.
    RightShin,
}

impl Limb {
    /// Every limb, at the place of its number.
    pub const ALL: [Self; 10] = [
        Self::Trunk,
        Self::Head,
        Self::LeftArm,
        Self::LeftForearm,
        Self::RightArm,
        Self::RightForearm,
        Self::LeftThigh,
        Self::LeftShin,
        Self::RightThigh,
        Self::RightShin,
    ];

    /// The bone that it hangs on, and the one at its other end.
    fn bones(self) -> [&'static str; 2] {
        match self {
            Self::Trunk => ["crl_spine01__C", "crl_hips__C"],
            Self::Head => ["crl_Head__C", "crl_eye__L"],
            Self::LeftArm => ["crl_arm__L", "crl_foreArm__L"],
            Self::LeftForearm => ["crl_foreArm__L", "crl_handMiddle02__L"],
            Self::RightArm => ["crl_arm__R", "crl_foreArm__R"],
            Self::RightForearm => ["crl_foreArm__R", "crl_handMiddle02__R"],
            Self::LeftThigh => ["crl_thigh__L", "crl_leg__L"],
            Self::LeftShin => ["crl_leg__L", "crl_toe__L"],
            Self::RightThigh => ["crl_thigh__R", "crl_leg__R"],
            Self::RightShin => ["crl_leg__R", "crl_toe__R"],
        }
    }
}

/// One limb of a walker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosedLimb {
    /// Which.
    pub limb: Limb,
    /// Its joint in the world: x ahead, y left, z up for a person who stands with arms down.
    pub world_from_limb: Pose,
}

/// Where a bone is.
#[derive(Clone, Copy, Debug)]
pub struct PosedBone {
    /// CARLA's.
    pub name: &'static str,
    /// In the world.
    pub in_world: Pose,
    /// In the component.
    pub in_component: Pose,
    /// In its parent.
    pub in_parent: Pose,
}

/// The number of a bone that CARLA's pedestrians have.
pub fn number_of(name: &str) -> Option<u8> {
    let place = skeleton().bones.iter().position(|bone| bone.name == name)?;
    u8::try_from(place).ok()
}

/// All bones of a walker, parents before children, as far in a pose as it shows.
pub fn posed(walker: &ActorState, pose: Option<&WalkerPose>) -> Vec<PosedBone> {
    let height_m = 2.0 * walker.box_half_extent_m.z;
    let foot_m = walker.box_centre_m - Vec3::z() * walker.box_half_extent_m.z;
    let world_from_component = walker.world_from_actor * Translation3::from(foot_m);
    let pose = pose.filter(|pose| pose.shows());
    let mut posed: Vec<PosedBone> = Vec::with_capacity(BONES);
    for (bone, number) in skeleton().bones.iter().zip(0..) {
        let turn = match bone.swing {
            Swing::No => UnitQuaternion::identity(),
            Swing::Leg(side) => swung(side * gait::leg_rad(walker), 0.0),
            Swing::Arm(side) => swung(side * gait::arm_rad(walker), side * ARM_ASIDE_RAD),
        };
        let walked = Pose::from_parts(Translation3::from(bone.offset * height_m), turn);
        let wanted = pose.and_then(|pose| Some((pose.of_bone(number)?, pose.share)));
        let in_parent = wanted.map_or(walked, |(wanted, share)| between(&walked, wanted, share));
        let parent = posed.get(bone.parent).map_or(Pose::identity(), |parent| parent.in_component);
        let in_component = parent * in_parent;
        let in_world = world_from_component * in_component;
        posed.push(PosedBone { name: &bone.name, in_world, in_component, in_parent });
    }
    posed
}

/// Limbs of a walker whose pose shows; none while it walks as it does by itself.
///
/// - **Cost:** two microseconds for a pose that shows.
pub fn limbs(walker: &ActorState, pose: Option<&WalkerPose>) -> Vec<PosedLimb> {
    if !pose.is_some_and(WalkerPose::shows) {
        return Vec::new();
    }
    let posed = posed(walker, pose);
    let of = |(limb, [bone, _]): (Limb, [usize; 2])| PosedLimb {
        limb,
        world_from_limb: posed[bone].in_world,
    };
    Limb::ALL.into_iter().zip(ends_of_limbs()).map(of).collect()
}

/// Of each limb, in the order of [`Limb::ALL`], the numbers of the bone that it hangs on and of the
/// one at its other end.
pub fn ends_of_limbs() -> [[usize; 2]; Limb::ALL.len()] {
    skeleton().limbs
}

/// On the way from one pose to another.
fn between(from: &Pose, to: &Pose, share: f32) -> Pose {
    let at_m = from.translation.vector.lerp(&to.translation.vector, share);
    // A rotation is two quaternions: between those that are far from each other there may be none.
    let (a, b) = (from.rotation.coords, to.rotation.coords);
    let b = if a.dot(&b) < 0.0 { -b } else { b };
    Pose::from_parts(at_m.into(), UnitQuaternion::new_normalize(a.lerp(&b, share).into()))
}

/// Ahead about the left axis, then aside about the axis ahead.
fn swung(ahead_rad: f32, aside_rad: f32) -> UnitQuaternion<f32> {
    UnitQuaternion::from_axis_angle(&Vec3::x_axis(), aside_rad)
        * UnitQuaternion::from_axis_angle(&Vec3::y_axis(), -ahead_rad)
}

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

struct Skeleton {
    bones: Vec<Bone>,
    limbs: [[usize; 2]; Limb::ALL.len()],
}

fn skeleton() -> &'static Skeleton {
    static SKELETON: LazyLock<Skeleton> = LazyLock::new(|| {
        let bones = Bones::of_a_person();
        let place = |name| bones.iter().position(|bone| bone.name == name).unwrap_or(0);
        let limbs = Limb::ALL.map(|limb| limb.bones().map(place));
        Skeleton { bones, limbs }
    });
    &SKELETON
}

struct Bones(Vec<Bone>);

impl Bones {
    fn of_a_person() -> Vec<Bone> {
        let mut bones = Self(Vec::with_capacity(BONES));
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
    }

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
    use std::f32::consts::FRAC_PI_2;

    use super::*;
    use crate::{ActorId, ActorKind, BonePose, BonesChange};

    fn walker() -> ActorState {
        let at = Pose::translation(10.0, 0.0, 0.9);
        let mut walker = ActorState::at_rest(ActorId::FIRST, ActorKind::Walker, 0, at);
        walker.box_half_extent_m = Vec3::new(0.2, 0.2, 0.9);
        walker
    }

    fn bone(posed: &[PosedBone], name: &str) -> Vec3 {
        let found = posed.iter().find(|bone| bone.name == name);
        found.unwrap_or_else(|| panic!("no {name}")).in_world.translation.vector
    }

    fn pose_of(share: f32, bones: &[(&str, Pose)]) -> WalkerPose {
        let mut pose = WalkerPose::none(ActorId::FIRST);
        let bones = bones.iter().map(|(name, parent_from_bone)| BonePose {
            bone: number_of(name).unwrap(),
            parent_from_bone: *parent_from_bone,
        });
        pose.change(&BonesChange { bones: bones.collect(), share: Some(share), afresh: false });
        pose
    }

    #[test]
    fn a_standing_person_has_its_head_up_and_its_feet_on_the_ground() {
        let posed = posed(&walker(), None);
        assert_eq!(posed.len(), BONES);
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
            assert_eq!(posed[usize::from(place)].name, name);
            assert_eq!(number_of(name), Some(place));
        }
        assert_eq!(number_of("tail"), None);
    }

    #[test]
    fn every_limb_hangs_on_a_bone_and_has_another_at_its_end() {
        for (limb, ends) in Limb::ALL.into_iter().zip(ends_of_limbs()) {
            let posed = posed(&walker(), None);
            assert_eq!(ends.map(|bone| posed[bone].name), limb.bones(), "{limb:?}");
        }
    }

    #[test]
    fn limbs_of_one_side_swing_against_each_other() {
        let mut walking = walker();
        walking.linear_velocity_mps = Vec3::new(1.4, 0.0, 0.0);
        walking.gait_rad = FRAC_PI_2;
        let posed = posed(&walking, None);
        assert!(bone(&posed, "crl_foot__L").x > 10.2 && bone(&posed, "crl_foot__R").x < 9.9);
        assert!(bone(&posed, "crl_hand__L").x < 10.0 && bone(&posed, "crl_hand__R").x > 10.0);
    }

    #[test]
    fn limbs_are_told_only_of_a_pose_that_shows() {
        let arm = Pose::from_parts(
            Translation3::new(0.0, 0.17, 0.0),
            UnitQuaternion::from_axis_angle(&Vec3::x_axis(), -1.5),
        );
        let raised = |share| pose_of(share, &[("crl_arm__R", arm)]);
        assert_eq!(limbs(&walker(), None), []);
        assert_eq!(limbs(&walker(), Some(&raised(0.0))), []);
        assert_eq!(limbs(&walker(), Some(&pose_of(1.0, &[]))), []);
        let limbs = limbs(&walker(), Some(&raised(1.0)));
        let joint = |limb: Limb| limbs[limb as usize].world_from_limb.translation.vector;
        assert!(limbs.iter().map(|limb| limb.limb).eq(Limb::ALL));
        let along = joint(Limb::RightForearm) - joint(Limb::RightArm);
        assert!(along.z.abs() < 0.05 && along.y.abs() > 0.25, "{along:?}");
    }

    #[test]
    fn a_pose_shows_as_far_as_it_is_blended() {
        let raised = Pose::translation(0.0, 0.0, 0.3);
        let neck = |share| {
            let pose = pose_of(share, &[("crl_neck__C", raised)]);
            bone(&posed(&walker(), Some(&pose)), "crl_neck__C").z
        };
        let (own, shown) = (neck(0.0), neck(1.0));
        assert!((shown - (own - 0.11 * 1.8 + 0.3)).abs() < 1e-4, "{own} {shown}");
        assert!((neck(0.5) - (own + shown) / 2.0).abs() < 1e-4);
    }

    #[test]
    fn a_pose_is_blended_the_short_way_whichever_quaternion_tells_it() {
        let turn = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), 0.4);
        for turn in [turn, UnitQuaternion::new_unchecked(-turn.into_inner())] {
            let pose =
                pose_of(0.5, &[("crl_neck__C", Pose::from_parts(Vec3::zeros().into(), turn))]);
            let neck = posed(&walker(), Some(&pose))[28].in_parent.rotation;
            assert!((neck.angle() - 0.2).abs() < 1e-4, "{neck:?}");
        }
        let none = UnitQuaternion::new_unchecked(-UnitQuaternion::identity().into_inner());
        let pose = pose_of(0.5, &[("crl_neck__C", Pose::from_parts(Vec3::zeros().into(), none))]);
        let neck = posed(&walker(), Some(&pose))[28].in_parent.rotation;
        assert!(neck.angle() < 1e-4, "{neck:?}");
    }
}
