//! Poses that somebody gives to bones of walkers.

use serde::{Deserialize, Serialize};

use crate::{ActorId, Pose};

/// How a bone of a walker is posed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BonePose {
    /// Its place among the [`BONES`](crate::skeleton::BONES) of a walker.
    pub bone: u8,
    /// How it is in its parent.
    pub parent_from_bone: Pose,
}

/// Bones of a walker that somebody posed: what is shown and met is between its walk and this.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WalkerPose {
    /// Whose.
    pub walker: ActorId,
    /// 0: its walk alone; 1: the pose alone.
    pub share: f32,
    /// Ordered by bone, each once; all others walk.
    pub bones: Vec<BonePose>,
}

/// A change of the pose of a walker.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BonesChange {
    /// Bones that were posed before walk again.
    pub afresh: bool,
    /// Those that are not named stay as they are; of a bone named twice the last one counts.
    pub bones: Vec<BonePose>,
    /// As [`WalkerPose::share`]; `None`: it stays.
    pub share: Option<f32>,
}

impl BonesChange {
    /// The walker walks with all its bones again.
    pub fn none() -> Self {
        Self { afresh: true, bones: Vec::new(), share: Some(0.0) }
    }
}

impl WalkerPose {
    /// That of a walker whose bones nobody posed.
    pub fn none(walker: ActorId) -> Self {
        Self { walker, share: 0.0, bones: Vec::new() }
    }

    /// Whether it is that of a walker whose bones nobody posed.
    pub fn is_none(&self) -> bool {
        self.share == 0.0 && self.bones.is_empty()
    }

    /// Whether anything of it is to be seen.
    pub fn shows(&self) -> bool {
        self.share > 0.0 && !self.bones.is_empty()
    }

    /// How a bone is posed; `None` for one that walks.
    pub fn of_bone(&self, bone: u8) -> Option<&Pose> {
        let at = self.bones.binary_search_by_key(&bone, |posed| posed.bone).ok()?;
        self.bones.get(at).map(|posed| &posed.parent_from_bone)
    }

    /// Carries out a change.
    pub fn change(&mut self, change: &BonesChange) {
        if change.afresh {
            self.bones.clear();
        }
        for new in &change.bones {
            match self.bones.binary_search_by_key(&new.bone, |posed| posed.bone) {
                Ok(at) => self.bones[at] = *new,
                Err(at) => self.bones.insert(at, *new),
            }
        }
        self.share = change.share.unwrap_or(self.share);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn posed(bone: u8, z_m: f32) -> BonePose {
        BonePose { bone, parent_from_bone: Pose::translation(0.0, 0.0, z_m) }
    }

    #[test]
    fn a_change_leaves_alone_what_it_does_not_name() {
        let mut pose = WalkerPose::none(ActorId::FIRST);
        assert!(pose.is_none() && !pose.shows());
        let bones = vec![posed(7, 0.1), posed(3, 0.2), posed(7, 0.3)];
        pose.change(&BonesChange { bones, ..BonesChange::default() });
        assert_eq!(pose.bones, [posed(3, 0.2), posed(7, 0.3)]);
        assert!(!pose.is_none() && !pose.shows());
        pose.change(&BonesChange { share: Some(0.5), ..BonesChange::default() });
        assert!(pose.shows() && pose.of_bone(7).is_some() && pose.of_bone(4).is_none());
        let bones = vec![posed(4, 0.4)];
        pose.change(&BonesChange { afresh: true, bones, share: None });
        assert_eq!((pose.share, &*pose.bones), (0.5, &[posed(4, 0.4)][..]));
        pose.change(&BonesChange::none());
        assert!(pose.is_none());
    }
}
