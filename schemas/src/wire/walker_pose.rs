//! Poses of walkers.

use flatbuffers::{FlatBufferBuilder, ForwardsUOffset, Vector, WIPOffset};

use super::check_count;
use super::parts::{actor_in, pose_in, pose_out};
use crate::generated as fb;
use crate::limits::POSED_WALKERS_MAX;
use crate::skeleton::BONES;
use crate::{BonePose, Error, ErrorCode, WalkerPose};

type Poses<'a> = Vector<'a, ForwardsUOffset<fb::WalkerPose<'a>>>;

pub(super) fn bones_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    bones: &[BonePose],
) -> WIPOffset<Vector<'a, fb::BonePose>> {
    let bone_out = |it: &BonePose| fb::BonePose::new(it.bone, &pose_out(&it.parent_from_bone));
    let raw: Vec<fb::BonePose> = bones.iter().map(bone_out).collect();
    b.create_vector(&raw)
}

/// # Errors
/// For too many, for a bone that no walker has, and for numbers that are none.
pub(super) fn bones_in(raw: Vector<'_, fb::BonePose>) -> Result<Vec<BonePose>, Error> {
    check_count("bones", raw.len(), BONES)?;
    let bone_in = |raw: &fb::BonePose| {
        if usize::from(raw.bone()) >= BONES {
            return Err(Error::new(ErrorCode::InvalidMessage, "a walker has no such bone")
                .wanted(format_args!("0 to {}", BONES - 1))
                .found(raw.bone()));
        }
        let parent_from_bone = pose_in(raw.parent_from_bone(), "parent_from_bone")?;
        Ok(BonePose { bone: raw.bone(), parent_from_bone })
    };
    raw.iter().map(bone_in).collect()
}

/// Nothing where nobody is posed.
pub(super) fn poses_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    poses: &[WalkerPose],
) -> Option<WIPOffset<Poses<'a>>> {
    let mut raw = Vec::with_capacity(poses.len());
    for pose in poses {
        let bones = Some(bones_out(b, &pose.bones));
        let args = fb::WalkerPoseArgs { walker: pose.walker.get(), share: pose.share, bones };
        raw.push(fb::WalkerPose::create(b, &args));
    }
    (!raw.is_empty()).then(|| b.create_vector(&raw))
}

/// # Errors
/// For too many, and for what no walker can have.
pub(super) fn poses_in(raw: Option<Poses<'_>>) -> Result<Vec<WalkerPose>, Error> {
    let Some(raw) = raw else { return Ok(Vec::new()) };
    check_count("poses of walkers", raw.len(), POSED_WALKERS_MAX)?;
    let pose_in = |raw: fb::WalkerPose<'_>| {
        Ok(WalkerPose {
            walker: actor_in(raw.walker())?,
            share: share_in(raw.share())?,
            bones: bones_in(raw.bones())?,
        })
    };
    raw.iter().map(pose_in).collect()
}

fn share_in(share: f32) -> Result<f32, Error> {
    // NaN is no share either.
    if (0.0..=1.0).contains(&share) {
        return Ok(share);
    }
    Err(Error::new(ErrorCode::InvalidMessage, "a pose shows by no such share")
        .wanted("0 to 1")
        .found(share))
}
