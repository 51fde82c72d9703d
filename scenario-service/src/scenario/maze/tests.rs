use serde_json::json;

use super::*;
use crate::scenario::DoneReason;
use crate::testing;

fn begun(seed: u64) -> (Maze, WorldSpec) {
    let mut maze = Maze::new("maze_navigation", Profile::Documented);
    let spec = maze.reset(seed, &testing::map()).unwrap();
    (maze, spec)
}

fn facts(step_count: u64, things_hit: u32, goal_distance_m: f32) -> Facts {
    let goal_distance_m = Some(goal_distance_m);
    Facts { step_count, things_hit, goal_distance_m, ..Facts::default() }
}

#[test]
fn the_goal_is_as_far_as_asked_behind_at_least_two_corners() {
    for seed in 0..5 {
        let (maze, spec) = begun(seed);
        let to_goal_m = maze.goal_m().unwrap() - spec.ego.world_from_actor.translation.vector;
        assert!((to_goal_m.xy().norm() - 150.0).abs() <= 5.5, "{}", to_goal_m.xy().norm());
        assert!(maze.info()["route_length"].as_f64().unwrap() > 150.0);
        assert!(spec.others.is_empty());
        assert_eq!(begun(seed).0.goal_m(), maze.goal_m());
    }
}

#[test]
fn it_ends_at_the_goal_at_a_collision_or_after_all_steps() {
    let end = |facts| begun(1).0.on_frame(&facts);
    let running = end(facts(199, 0, 5.1));
    assert_eq!((running.reward, running.done), (0.0, None));
    let reached = end(facts(9, 0, 4.9));
    assert_eq!((reached.reward, reached.done), (1.0, Some(DoneReason::GoalReached)));
    let collided = end(facts(9, 1, 4.9));
    assert_eq!((collided.reward, collided.done), (-1.0, Some(DoneReason::Collision)));
    let late = end(facts(200, 0, 50.0));
    assert_eq!((late.done, late.truncated), (Some(DoneReason::MaxSteps), true));
}

#[test]
fn a_goal_that_no_lane_leads_to_is_an_error() {
    let mut maze = Maze::new("maze_navigation", Profile::Documented);
    let config = json!({ "goal_distance": 4_900 });
    let mut overrides = Overrides::new(config.as_object().unwrap());
    maze.configure(&mut overrides).unwrap();
    let error = maze.reset(1, &testing::map()).unwrap_err().to_string();
    assert_eq!(error, "no place of this map has a goal 4900 m away that its lanes lead to");
}

#[test]
fn the_prompt_prints_the_radius_as_a_decimal_number() {
    let text = begun(1).0.prompt();
    assert!(text.starts_with(
        "You control a vehicle in a maze.\n\nGoal: reach within 5.0m of the destination.\n"
    ));
}
