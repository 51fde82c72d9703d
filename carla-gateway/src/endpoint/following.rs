//! The world of a session that clients are in, when another one takes its place: its service has
//! gone, or gives it away. The session makes it; clients go on there, and what they did last is
//! done again.

use std::time::Duration;

use schemas::{ActorId, Error, ErrorCode, Reply, Request, SharedFrame, TickItem, WorldId};
use tokio::time::Instant;

use super::Endpoint;
use super::deeds::{Deeds, brought};
use super::visit::Order;
use super::worlds::{first_result, refused};
use crate::rpc::Refusal;

/// How long a world that is gone with its service may take to be made again.
const SERVICE_WAIT: Duration = Duration::from_secs(20);
/// How long one may take to be found whose service is still there: it was made before the old one
/// went, unless its session has ended.
const MOVE_WAIT: Duration = Duration::from_secs(2);
/// Before worlds are listed again.
const PAUSE: Duration = Duration::from_millis(100);

impl Endpoint {
    /// The world that goes on from one that a client has named, and the first of them.
    pub(super) async fn present_world_of(&self, named: WorldId) -> (WorldId, WorldId) {
        let worlds = match self.site.ask(Request::ListWorlds).await {
            Ok(Reply::Worlds(worlds)) => worlds,
            _ => return (named, named),
        };
        if let Some(info) = worlds.iter().find(|info| info.world == named) {
            return (named, info.stands_for.unwrap_or(named));
        }
        let later = worlds.iter().find(|info| info.stands_for == Some(named));
        (later.map_or(named, |info| info.world), named)
    }

    /// Goes on in the world that has taken the place of the visited one; whether there is one.
    pub(super) async fn follow_session(&mut self, why: &Error) -> bool {
        let begun = Instant::now();
        let Some(world) = self.next_world(why).await else { return false };
        match self.go_on_in(world).await {
            Ok(()) => {
                self.figures.recovered.inc();
                let (tenant, port) = (self.config.allowance.tenant(), self.port);
                let millis = begun.elapsed().as_millis() as u64;
                tracing::info!(target: "audit", %tenant, port, millis, "follow session");
                true
            }
            Err(refusal) => {
                self.note_loss(format_args!(
                    "its session goes on in another one, without what was done last ({refusal}); \
                     load_world() of its metadata.carla_world comes there"
                ));
                false
            }
        }
    }

    /// The world that takes the place of the visited one, when it is there.
    async fn next_world(&self, why: &Error) -> Option<WorldId> {
        let visit = self.visit.as_ref()?;
        let (old, root) = (visit.clock.world, visit.root);
        let begun = Instant::now();
        loop {
            let is_lost = why.code == ErrorCode::Unreachable || self.site.is_gone(old);
            if let Ok(Reply::Worlds(worlds)) = self.site.ask(Request::ListWorlds).await {
                let is_next = |world| world != old && !self.site.is_gone(world);
                let mut of_session = worlds.iter().filter(|info| info.stands_for == Some(root));
                if let Some(info) = of_session.find(|info| is_next(info.world)) {
                    return Some(info.world);
                }
            }
            if begun.elapsed() > if is_lost { SERVICE_WAIT } else { MOVE_WAIT } {
                return None;
            }
            tokio::time::sleep(PAUSE).await;
        }
    }

    /// Does in a world what clients have done since the state from which it goes on, and shows it
    /// to them as the one that they know.
    ///
    /// # Errors
    /// It cannot be as they know it.
    async fn go_on_in(&mut self, world: WorldId) -> Result<(), Refusal> {
        let Some(visit) = &self.visit else { return Ok(()) };
        let clock = visit.clock.of(world).await.map_err(|error| refused(&error))?;
        let (mut frame, _) = self.have_done(TickItem::new(world, 0)).await?;
        let mut deeds = Deeds::default();
        deeds.note_tick(&frame);
        for again in visit.deeds.again(&frame)? {
            let item = TickItem { commands: again.commands.clone(), ..TickItem::new(world, 0) };
            let (told, replies) = self.have_done(item).await?;
            if brought(&replies) != again.spawned {
                return Err(Refusal("others have got the ids of actors".to_owned()));
            }
            deeds.note(&told, again.commands, &replies);
            frame = told;
        }
        let told = self.visited.0.clone();
        let Some(visit) = &mut self.visit else { return Ok(()) };
        visit.go_on(clock, deeds, told);
        let owes_tick = visit.owes_tick;
        let episode = self.episode()?;
        episode.world = world;
        let is_gone = |id: &ActorId| frame.actor(*id).is_none();
        let gone: Vec<ActorId> = episode.states().map(|state| state.id).filter(is_gone).collect();
        self.take_frame(frame, &[])?;
        gone.into_iter().for_each(|actor| self.forget(actor));
        match &self.visit {
            Some(visit) if owes_tick => visit.order(Order::Tick),
            _ => self.follow_on(),
        }
        Ok(())
    }

    async fn have_done(
        &self,
        item: TickItem,
    ) -> Result<(SharedFrame, Vec<schemas::CommandReply>), Refusal> {
        let ticked = self.site.ask(Request::TickWorlds(vec![item])).await;
        let outcome = ticked.and_then(first_result).map_err(|error| refused(&error))?;
        let frame = SharedFrame::decode(outcome.frame).map_err(|error| refused(&error))?;
        Ok((frame, outcome.replies))
    }
}
