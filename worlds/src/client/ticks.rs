//! Ticks of worlds, each where it is.

use std::collections::{BTreeMap, VecDeque};

use futures_util::future::join_all;
use schemas::{Error, Reply, Request, TickItem, TickResult, WorldId, keys};

use super::{Worlds, nobody, unexpected};

impl Worlds {
    /// Advances many worlds; one result per item, in order.
    ///
    /// # Errors
    /// Of the only service that was asked; of several each answers for its own worlds.
    pub async fn tick(&self, items: Vec<TickItem>) -> Result<Vec<TickResult>, Error> {
        let mut hosts = items.iter().map(|item| item.world.host());
        let first = hosts.next();
        if hosts.all(|host| Some(host) == first) {
            return self.tick_there(items).await;
        }
        self.tick_everywhere(items).await
    }

    /// Ticks worlds of one service.
    async fn tick_there(&self, items: Vec<TickItem>) -> Result<Vec<TickResult>, Error> {
        let Some(item) = items.first() else { return Ok(Vec::new()) };
        let host = self.hosts.of_world(item.world).ok_or_else(nobody)?;
        let deadline = self.patience.of(&items);
        let request = Request::TickWorlds(items);
        let reply = match &host.channel {
            Some(channel) => channel.request(&request, deadline).await?,
            None => host.bus.request(&keys::batch_tick(&host.id), &request, deadline).await?,
        };
        match reply {
            Reply::Ticked(results) => Ok(results),
            _ => Err(unexpected("ticked worlds")),
        }
    }

    /// Ticks worlds of several services at once; each answers for its own.
    async fn tick_everywhere(&self, items: Vec<TickItem>) -> Result<Vec<TickResult>, Error> {
        let worlds: Vec<WorldId> = items.iter().map(|item| item.world).collect();
        let mut parts: BTreeMap<u32, Vec<TickItem>> = BTreeMap::new();
        for item in items {
            parts.entry(item.world.host()).or_default().push(item);
        }
        let asked = parts.into_values().map(|part| async {
            let worlds: Vec<WorldId> = part.iter().map(|item| item.world).collect();
            match self.tick_there(part).await {
                Ok(results) => results,
                Err(error) => {
                    let failed = |world| TickResult { world, outcome: Err(error.clone()) };
                    worlds.into_iter().map(failed).collect()
                }
            }
        });
        in_order(worlds, join_all(asked).await.into_iter().flatten())
    }
}

/// A result for each of these worlds; those of one world stay in their order.
fn in_order(
    worlds: Vec<WorldId>,
    results: impl Iterator<Item = TickResult>,
) -> Result<Vec<TickResult>, Error> {
    let mut by_world: BTreeMap<WorldId, VecDeque<TickResult>> = BTreeMap::new();
    for result in results {
        by_world.entry(result.world).or_default().push_back(result);
    }
    let result_of = |world: WorldId| by_world.get_mut(&world)?.pop_front();
    let ordered: Option<Vec<TickResult>> = worlds.into_iter().map(result_of).collect();
    ordered.ok_or_else(|| unexpected("a result for every world"))
}

#[cfg(test)]
mod tests {
    use schemas::{EncodedFrame, ErrorCode, TickOutcome};

    use super::*;

    #[test]
    fn results_of_several_services_come_in_the_order_of_what_was_asked() {
        let [a, b] = [WorldId::of_host(1, 1), WorldId::of_host(2, 1)];
        let result = |world, byte| {
            let frame = EncodedFrame(vec![byte]);
            TickResult { world, outcome: Ok(TickOutcome::new(frame)) }
        };
        let told = vec![result(a, 1), result(a, 2), result(b, 3)];
        let ordered = in_order(vec![a, b, a], told.clone().into_iter()).unwrap();
        assert_eq!(ordered, [result(a, 1), result(b, 3), result(a, 2)]);
        let missing = in_order(vec![a, b, a], told.into_iter().take(2));
        assert_eq!(missing.unwrap_err().code, ErrorCode::InvalidMessage);
    }
}
