//! Bones of pedestrians: what clients say of them by CARLA's names, and how limbs moved.

use std::collections::BTreeMap;

use schemas::skeleton::{self, ends_of_limbs};
use schemas::{ActorState, BonePose, Pose, WalkerPose};

use crate::pictures::Segment;

/// Poses of bones that our walkers have, each once; others are left out.
pub(crate) fn named(bones: impl IntoIterator<Item = (String, Pose)>) -> Vec<BonePose> {
    let known = bones.into_iter().filter_map(|(name, pose)| {
        let bone = skeleton::number_of(&name)?;
        Some((bone, BonePose { bone, parent_from_bone: pose }))
    });
    known.collect::<BTreeMap<_, _>>().into_values().collect()
}

/// All bones as the walk alone has them.
pub(crate) fn walked(walker: &ActorState) -> Vec<BonePose> {
    let walked = skeleton::posed(walker, None);
    let bones = walked.iter().zip(0..);
    bones
        .map(|(bone, number)| BonePose { bone: number, parent_from_bone: bone.in_parent })
        .collect()
}

/// A walker in a frame, and how it is posed there.
pub(crate) type Moment<'a> = (&'a ActorState, Option<&'a WalkerPose>);

/// How the limbs of a walker moved since an earlier frame.
pub(crate) fn moved(moments: [Moment<'_>; 2]) -> Vec<Segment> {
    let [before, now] = moments.map(|(walker, pose)| skeleton::posed(walker, pose));
    let of = |[bone, end]: [usize; 2]| {
        let (then, now, end) = (before.get(bone)?, now.get(bone)?, now.get(end)?);
        Some(Segment {
            ends_m: [now.in_world, end.in_world].map(|pose| pose.translation.vector),
            before_from_now: then.in_world * now.in_world.inverse(),
        })
    };
    ends_of_limbs().into_iter().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use schemas::{ActorId, ActorKind, BonesChange, Limb, Vec3};

    use super::*;

    fn walker() -> ActorState {
        let at = Pose::translation(10.0, 0.0, 0.9);
        let mut walker = ActorState::at_rest(ActorId::FIRST, ActorKind::Walker, 0, at);
        walker.box_half_extent_m = Vec3::new(0.2, 0.2, 0.9);
        walker
    }

    /// How far a place of a limb has moved.
    fn way_m(limb: &Segment, point_m: &Vec3) -> f32 {
        let before = limb.before_from_now.transform_point(&(*point_m).into()).coords;
        (point_m - before).norm()
    }

    #[test]
    fn a_leg_that_swings_moves_more_at_the_foot_than_at_the_hip() {
        let mut walking = walker();
        walking.linear_velocity_mps = Vec3::new(1.4, 0.0, 0.0);
        let later = ActorState { gait_rad: 0.5, ..walking.clone() };
        let segments = moved([(&walking, None), (&later, None)]);
        let shin = &segments[Limb::LeftShin as usize];
        let [knee, toe] = shin.ends_m.map(|end_m| way_m(shin, &end_m));
        assert!(toe > 1.5 * knee && knee > 0.02, "{toe} {knee}");
    }

    #[test]
    fn an_arm_that_is_posed_anew_has_moved() {
        let walker = walker();
        let mut pose = WalkerPose::none(walker.id);
        let raised = Pose::rotation(Vec3::x() * -1.5);
        let bones = named([("crl_arm__R".to_owned(), raised)]);
        pose.change(&BonesChange { afresh: false, bones, share: Some(1.0) });
        let segments = moved([(&walker, None), (&walker, Some(&pose))]);
        let ways = [Limb::RightForearm, Limb::LeftForearm].map(|limb| {
            let limb = &segments[limb as usize];
            way_m(limb, &limb.ends_m[1])
        });
        assert!(ways[0] > 0.5 && ways[1] < 1e-4, "{ways:?}");
    }

    #[test]
    fn of_what_clients_name_only_our_bones_are_taken_and_each_once() {
        let up = |z_m| Pose::translation(0.0, 0.0, z_m);
        let wanted = [("crl_eye__R", 1.0), ("tail", 2.0), ("crl_root", 3.0), ("crl_eye__R", 4.0)];
        let bones = named(wanted.map(|(name, z_m)| (name.to_owned(), up(z_m))));
        let posed = |bone, z_m| BonePose { bone, parent_from_bone: up(z_m) };
        assert_eq!(bones, [posed(0, 3.0), posed(31, 4.0)]);
        assert_eq!(walked(&walker()).len(), skeleton::BONES);
    }
}
