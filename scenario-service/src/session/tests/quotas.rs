//! What a tenant may have of a world.

use super::*;

#[tokio::test]
async fn a_world_with_more_actors_than_the_tenant_may_have_is_not_made() {
    let (_, context) = testing::context();
    let quotas = Quotas { actors_per_world: Some(3), ..Quotas::default() };
    let mut session = Session::new(context, quotas).unwrap();
    let others = |count: u32| json!({"num_npc_vehicles": count, "num_pedestrians": 0});
    session.reset(reset_to("free_roam", 7, others(2))).await.unwrap();
    let before = state(&session);
    let refused = session.reset(reset_to("free_roam", 7, others(3))).await.unwrap_err();
    assert!(refused.is_callers_fault(), "{refused}");
    for word in ["actors_per_world = 3", "ask for fewer", "wanted 3", "found 4"] {
        assert!(refused.to_string().contains(word), "{refused}");
    }
    assert_eq!(state(&session), before);
}
