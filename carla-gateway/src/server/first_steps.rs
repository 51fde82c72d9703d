//! How far clients have come on the way to their world, which is the same for all: `get_world()`
//! asks for the episode, reads the first frame, and asks for the street lights. One of another
//! version than the endpoint is for reads that frame as something else and ends there; nothing that
//! it says before tells it from others.

use std::collections::BTreeMap;

use crate::rpc::ConnectionId;

/// How far each client has come.
#[derive(Debug, Default)]
pub(super) struct FirstSteps {
    /// Whether they have their world.
    have_world: BTreeMap<ConnectionId, bool>,
}

impl FirstSteps {
    /// A client calls.
    pub(super) fn note_call(&mut self, client: ConnectionId, method: &str) {
        match method {
            "get_episode_info" => {
                self.have_world.entry(client).or_insert(false);
            }
            "query_lights_state" => {
                self.have_world.insert(client, true);
            }
            _ => {}
        }
    }

    /// A call of a client is refused, which ends many; whether it was on the way to its world.
    pub(super) fn note_refusal(&mut self, client: ConnectionId) -> bool {
        self.note_end(client)
    }

    /// A client is gone; whether it was on the way to its world.
    pub(super) fn note_end(&mut self, client: ConnectionId) -> bool {
        self.have_world.remove(&client) == Some(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_ends_between_the_episode_and_the_lights_was_on_the_way() {
        let mut steps = FirstSteps::default();
        let [first, second, third] = [1, 2, 3].map(ConnectionId);
        for method in ["version", "get_episode_info", "get_sensor_token", "get_episode_settings"] {
            steps.note_call(first, method);
            steps.note_call(second, method);
        }
        steps.note_call(second, "query_lights_state");
        // As after a load.
        steps.note_call(second, "get_episode_info");
        steps.note_call(third, "version");
        assert!(steps.note_end(first));
        assert!(!steps.note_end(second) && !steps.note_end(third));
        assert!(steps.have_world.is_empty());
    }

    #[test]
    fn who_is_refused_on_the_way_ends_for_that_reason() {
        let (mut steps, client) = (FirstSteps::default(), ConnectionId(1));
        assert!(!steps.note_refusal(client));
        steps.note_call(client, "get_episode_info");
        assert!(steps.note_refusal(client));
        assert!(!steps.note_end(client));
    }
}
