//! The navigation verbs: an agent inside the tick, told where to go.

use schemas::carla::mirror_y;
use schemas::{
    ActorId, AgentBehaviour, AgentCommand, AgentOptions, AgentState, AgentStatus, Command, Vec3,
};

use super::plan::Plan;
use crate::action::{Action, ActionKind};
use crate::limits::TICKS_PER_STEP_MAX;

/// The ego's agent as the last frame shows it, and where the scenario wants it to go.
#[derive(Clone, Copy)]
pub(super) struct Navigation<'a> {
    pub(super) ego: ActorId,
    pub(super) agent: Option<&'a AgentState>,
    pub(super) goal_m: Option<Vec3>,
}

impl Navigation<'_> {
    /// Adds what a navigation verb asks of the world.
    pub(super) fn plan(self, action: &Action, plan: &mut Plan) {
        match action.kind {
            ActionKind::InitNavigationAgent => self.init(behaviour_of(action), plan),
            ActionKind::SetDestination => self.set_destination(action, plan),
            ActionKind::FollowRoute => self.follow(action, plan),
            _ => self.leave(plan),
        }
    }

    /// A new agent, on its way to the scenario's goal if there is one; it does not drive yet.
    fn init(self, behaviour: AgentBehaviour, plan: &mut Plan) {
        let options = AgentOptions { behaviour, ..AgentOptions::default() };
        plan.commands.push(Command::Agent(AgentCommand::Set {
            actor: self.ego,
            options,
            keep_route: false,
        }));
        if let Some(goal_m) = self.goal_m {
            self.go_to(goal_m, plan);
        }
    }

    fn go_to(self, place_m: Vec3, plan: &mut Plan) {
        let places_m = vec![place_m];
        plan.commands.push(Command::Agent(AgentCommand::SetRoute { actor: self.ego, places_m }));
    }

    fn set_destination(self, action: &Action, plan: &mut Plan) {
        self.leave(plan);
        if self.agent.is_none() {
            let options =
                AgentOptions { behaviour: AgentBehaviour::Normal, ..AgentOptions::default() };
            plan.commands.push(Command::Agent(AgentCommand::Set {
                actor: self.ego,
                options,
                keep_route: false,
            }));
        }
        match (action.destination_x, action.destination_y) {
            (Some(x), Some(y)) => {
                let z = action.destination_z.unwrap_or(0.0);
                // What is beyond four bytes is as far away as those reach: no lane leads there.
                let [x, y, z] = [x, y, z].map(|m| (m as f32).clamp(f32::MIN, f32::MAX));
                self.go_to(mirror_y(Vec3::new(x, y, z)), plan);
            }
            _ => plan.events.push(
                "set_destination: destination_x and destination_y are needed; the route stays"
                    .to_owned(),
            ),
        }
    }

    /// Drives for some ticks; an agent that has nowhere to go, or is there, takes no time.
    fn follow(self, action: &Action, plan: &mut Plan) {
        plan.tick_count = 0;
        match (self.agent, self.goal_m) {
            (None, None) => {
                let event = "follow_route: there is no agent; send init_navigation_agent first";
                return plan.events.push(event.to_owned());
            }
            (None, Some(_)) => self.init(AgentBehaviour::Normal, plan),
            (Some(agent), _) if agent.status == AgentStatus::Arrived => {
                return plan.events.push("follow_route: the route is at its end".to_owned());
            }
            (Some(_), _) => {}
        }
        plan.commands.push(Command::Agent(AgentCommand::Drive { actor: self.ego, on: true }));
        let steps = action.route_steps.unwrap_or(1).min(u64::from(TICKS_PER_STEP_MAX));
        plan.tick_count = steps as u32;
    }

    /// Between calls of `follow_route` the vehicle keeps its last control.
    fn leave(self, plan: &mut Plan) {
        if self.agent.is_some_and(|agent| agent.driving) {
            plan.commands
                .insert(0, Command::Agent(AgentCommand::Drive { actor: self.ego, on: false }));
        }
    }
}

/// Any word but the three of the behaviour agents means the basic agent.
fn behaviour_of(action: &Action) -> AgentBehaviour {
    match action.navigation_behavior.as_deref() {
        Some("cautious") => AgentBehaviour::Cautious,
        None | Some("normal") => AgentBehaviour::Normal,
        Some("aggressive") => AgentBehaviour::Aggressive,
        Some(_) => AgentBehaviour::Basic,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ego() -> ActorId {
        ActorId::new(3).unwrap()
    }

    fn agent(status: AgentStatus, driving: bool) -> AgentState {
        let target_m = Vec3::zeros();
        AgentState { actor: ego(), status, driving, distance_left_m: 10.0, target_m }
    }

    fn planned(agent: Option<&AgentState>, goal_m: Option<Vec3>, action: &Action) -> Plan {
        let mut plan = Plan { tick_count: 1, ..Plan::default() };
        Navigation { ego: ego(), agent, goal_m }.plan(action, &mut plan);
        plan
    }

    fn follow(route_steps: u64) -> Action {
        Action { route_steps: Some(route_steps), ..Action::of(ActionKind::FollowRoute) }
    }

    #[test]
    fn a_new_agent_knows_the_way_to_the_scenarios_goal_and_waits() {
        let goal_m = Vec3::new(1.0, 2.0, 0.0);
        for (word, behaviour) in [
            (Some("cautious"), AgentBehaviour::Cautious),
            (Some("aggressive"), AgentBehaviour::Aggressive),
            (Some("normal"), AgentBehaviour::Normal),
            (None, AgentBehaviour::Normal),
            (Some("other"), AgentBehaviour::Basic),
        ] {
            let mut action = Action::of(ActionKind::InitNavigationAgent);
            action.navigation_behavior = word.map(str::to_owned);
            let plan = planned(None, Some(goal_m), &action);
            let options = AgentOptions { behaviour, ..AgentOptions::default() };
            let set =
                Command::Agent(AgentCommand::Set { actor: ego(), options, keep_route: false });
            let route =
                Command::Agent(AgentCommand::SetRoute { actor: ego(), places_m: vec![goal_m] });
            assert_eq!((plan.commands, plan.tick_count), (vec![set, route], 1));
        }
    }

    #[test]
    fn following_drives_for_as_many_ticks_as_asked_within_the_limit() {
        let on_route = agent(AgentStatus::OnRoute, false);
        let drive = Command::Agent(AgentCommand::Drive { actor: ego(), on: true });
        for (asked, ticks) in [(1, 1), (5, 5), (1_000_000, TICKS_PER_STEP_MAX)] {
            let plan = planned(Some(&on_route), None, &follow(asked));
            assert_eq!((plan.commands, plan.tick_count), (vec![drive.clone()], ticks));
        }
        let at_first = planned(None, Some(Vec3::zeros()), &follow(2));
        assert_eq!((at_first.commands.len(), at_first.tick_count), (3, 2));
    }

    #[test]
    fn at_the_end_or_without_an_agent_no_time_passes() {
        let arrived = agent(AgentStatus::Arrived, false);
        for agent in [Some(&arrived), None] {
            let plan = planned(agent, None, &follow(5));
            assert_eq!((plan.commands.len(), plan.tick_count, plan.events.len()), (0, 0, 1));
        }
    }

    #[test]
    fn any_other_action_takes_the_wheel_from_a_driving_agent() {
        let driving = agent(AgentStatus::OnRoute, true);
        let leave = Command::Agent(AgentCommand::Drive { actor: ego(), on: false });
        let observe = Action::of(ActionKind::Observe);
        assert_eq!(planned(Some(&driving), None, &observe).commands, [leave]);
        let waiting = agent(AgentStatus::OnRoute, false);
        assert_eq!(planned(Some(&waiting), None, &observe).commands, []);
    }

    #[test]
    fn a_destination_is_given_in_carlas_frame_and_needs_both_coordinates() {
        let mut action = Action::of(ActionKind::SetDestination);
        let waiting = agent(AgentStatus::Wandering, false);
        let plan = planned(Some(&waiting), None, &action);
        assert_eq!((plan.commands.len(), plan.events.len(), plan.tick_count), (0, 1, 1));
        (action.destination_x, action.destination_y) = (Some(10.0), Some(20.0));
        let places_m = vec![Vec3::new(10.0, -20.0, 0.0)];
        let route = Command::Agent(AgentCommand::SetRoute { actor: ego(), places_m });
        assert_eq!(planned(Some(&waiting), None, &action).commands, std::slice::from_ref(&route));
        let first = planned(None, None, &action).commands;
        assert!(matches!(first[..], [Command::Agent(AgentCommand::Set { .. }), _]), "{first:?}");
        assert_eq!(first[1], route);
    }
}
