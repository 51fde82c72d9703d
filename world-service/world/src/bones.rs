//! How clients posed the bones of walkers. The world only keeps it: pictures and rays go by it.

use schemas::skeleton::BONES;
use schemas::{ActorId, BonePose, Error, ErrorCode, WalkerPose, limits};

use crate::check;
use crate::world::State;

impl State {
    /// How somebody posed a walker; `None` for one that walks with all its bones.
    pub(crate) fn walker_pose(&self, walker: ActorId) -> Option<&WalkerPose> {
        let at = self.walker_poses.binary_search_by_key(&walker, |pose| pose.walker).ok()?;
        self.walker_poses.get(at)
    }

    /// Takes the place of how a walker was posed before.
    ///
    /// # Errors
    /// `Capacity` where too many walkers are posed.
    pub(crate) fn keep_pose(&mut self, pose: WalkerPose) -> Result<(), Error> {
        let poses = &mut self.walker_poses;
        let place = poses.binary_search_by_key(&pose.walker, |kept| kept.walker);
        match (place, pose.is_none()) {
            (Ok(at), true) => drop(poses.remove(at)),
            (Ok(at), false) => poses[at] = pose,
            (Err(_), true) => {}
            (Err(_), false) if poses.len() >= limits::POSED_WALKERS_MAX => {
                return Err(Error::new(ErrorCode::Capacity, "too many walkers are posed")
                    .wanted(format!("at most {}", limits::POSED_WALKERS_MAX))
                    .found(poses.len()));
            }
            (Err(at), false) => poses.insert(at, pose),
        }
        Ok(())
    }

    /// A walker is gone.
    pub(crate) fn forget_pose(&mut self, walker: ActorId) {
        self.walker_poses.retain(|pose| pose.walker != walker);
    }

    /// Whether only walkers of this world are posed, each once and as commands can do it.
    pub(crate) fn poses_fit(&self) -> bool {
        let poses = &self.walker_poses;
        let fits = |pose: &WalkerPose| {
            let ordered = pose.bones.windows(2).all(|pair| pair[0].bone < pair[1].bone);
            let walks = self.actor(pose.walker).is_some_and(|actor| actor.walker.is_some());
            let is_one = check_share(pose.share).is_ok() && check_bones(&pose.bones).is_ok();
            ordered && walks && is_one && !pose.is_none()
        };
        poses.len() <= limits::POSED_WALKERS_MAX
            && poses.windows(2).all(|pair| pair[0].walker < pair[1].walker)
            && poses.iter().all(fits)
    }
}

/// # Errors
/// `InvalidArgument` for bones that no walker has, and for poses that nothing can have.
pub(crate) fn check_bones(bones: &[BonePose]) -> Result<(), Error> {
    if bones.len() > BONES {
        return Err(Error::new(ErrorCode::InvalidArgument, "a walker has not so many bones")
            .wanted(format!("at most {BONES}"))
            .found(bones.len()));
    }
    for posed in bones {
        if usize::from(posed.bone) >= BONES {
            return Err(Error::new(ErrorCode::InvalidArgument, "a walker has no such bone")
                .wanted(format!("0 to {}", BONES - 1))
                .found(posed.bone));
        }
        check::pose(&posed.parent_from_bone)?;
    }
    Ok(())
}

/// # Errors
/// `InvalidArgument` for a share outside of 0 to 1.
pub(crate) fn check_share(share: f32) -> Result<(), Error> {
    check::range("share of the pose", share, 0.0, 1.0, "")
}
