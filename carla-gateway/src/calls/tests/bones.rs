//! Bones of walkers through the calls: what the world is told, and who tells clients.

use schemas::{ActorId, BonePose, BonesChange, Command, Pose, WalkerCommand};

use super::toy::{Toy, runtime};
use super::*;
use crate::dialect::Transform;

/// The toy's only walker.
const WALKER: u32 = 4;

type Told = (Vec<(String, Transform, Transform, Transform)>,);

fn call<T: serde::Serialize>(method: &str, arguments: T) -> Request {
    request(method, &rmp_serde::to_vec(&((false,), WALKER, arguments)).unwrap()).unwrap()
}

fn up(z_m: f32) -> Pose {
    Pose::translation(0.0, 0.0, z_m)
}

/// How high above its parent a client is told that the neck is.
async fn neck_m(endpoint: &mut Endpoint) -> f32 {
    let params = rmp_serde::to_vec(&((false,), WALKER)).unwrap();
    let told = answer(endpoint, &request("get_bones_transform", &params).unwrap()).await;
    let Ok(Payload::Value(bytes)) = told else { panic!("no bones") };
    let (bones,): Told = rmp_serde::from_slice(&bytes).unwrap();
    let (.., relative) = bones.into_iter().find(|bone| bone.0 == "crl_neck__C").unwrap();
    relative.location.z
}

#[test]
fn what_a_client_poses_is_a_command_and_the_world_says_what_came_of_it() {
    runtime().block_on(async {
        let (mut endpoint, _) = Toy::endpoint();
        endpoint.ensure_episode().await.unwrap();
        endpoint.tick().await.unwrap();
        let wanted = [("crl_neck__C", 0.5), ("tail", 1.0)];
        let wanted = wanted.map(|(name, z_m)| (name, Transform::of(&up(z_m))));
        answer(&mut endpoint, &call("set_bones_transform", (wanted,))).await.unwrap();
        assert_eq!(neck_m(&mut endpoint).await, 0.0, "nothing of it shows yet");
        answer(&mut endpoint, &call("blend_pose", 7.0f32)).await.unwrap();
        assert_eq!(neck_m(&mut endpoint).await, 0.5, "clients read what they wrote");
        let bones = vec![BonePose { bone: 28, parent_from_bone: up(0.5) }];
        let changes = [
            BonesChange { bones, ..BonesChange::default() },
            BonesChange { share: Some(1.0), ..BonesChange::default() },
        ];
        let actor = ActorId::new(WALKER).unwrap();
        let told = changes.map(|change| Command::Walker(WalkerCommand::Bones { actor, change }));
        assert_eq!(endpoint.pending, told);
        // The toy's frames tell of no pose.
        endpoint.tick().await.unwrap();
        assert_eq!(neck_m(&mut endpoint).await, 0.0);
    });
}

#[test]
fn the_pose_of_the_walk_is_taken_over_with_all_bones() {
    runtime().block_on(async {
        let (mut endpoint, _) = Toy::endpoint();
        endpoint.ensure_episode().await.unwrap();
        endpoint.tick().await.unwrap();
        let params = rmp_serde::to_vec(&((false,), WALKER)).unwrap();
        let take = request("get_pose_from_animation", &params).unwrap();
        answer(&mut endpoint, &take).await.unwrap();
        let [Command::Walker(WalkerCommand::Bones { change, .. })] = &*endpoint.pending else {
            panic!("{:?}", endpoint.pending)
        };
        assert!(change.afresh && change.share.is_none());
        assert_eq!(change.bones.len(), schemas::skeleton::BONES);
    });
}
