//! Ticks of worlds, where they are.

use schemas::{Error, ErrorCode, Reply, Request, TickItem, TickResult, keys};

use super::{Worlds, nobody, unexpected};

impl Worlds {
    /// Advances worlds of one service; one result per item, in order. Who has worlds of several
    /// asks for each, as the answer of one that stands still is not worth waiting for.
    ///
    /// # Errors
    /// Of the service; [`ErrorCode::InvalidMessage`] for worlds of several.
    pub async fn tick(&self, items: Vec<TickItem>) -> Result<Vec<TickResult>, Error> {
        let Some(world) = items.first().map(|item| item.world) else { return Ok(Vec::new()) };
        if items.iter().any(|item| item.world.host() != world.host()) {
            let several = "ticks of worlds of several services in one request";
            return Err(Error::new(ErrorCode::InvalidMessage, several));
        }
        let host = self.hosts.of_world(world).ok_or_else(nobody)?;
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
}
