//! Worlds of one tenant: made where there is room, and asked and ticked where they are.

mod ticks;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

use bus::{Bus, Renderers};
use schemas::{
    Camera, Error, ErrorCode, Image, Lease, MapRef, RenderJob, Reply, Request, ServiceId,
    SharedFrame, Staging, Tenant, WorldId, keys,
};
use tokio::sync::watch;

use crate::hosts::{Host, Hosts};
use crate::patience::Patience;
use crate::uploads::Uploads;
use crate::world_of;

/// How long who wants a new world waits for a service that is still starting or restarting.
const START_WAIT: Duration = Duration::from_secs(10);
/// Before a question is put again whose service went, or has only just come up.
const RETRY_PAUSE: Duration = Duration::from_millis(5);
/// How long what one service knows is waited for after another has answered.
const REST_WAIT: Duration = Duration::from_millis(300);

/// Worlds of one tenant, on all world services of a bus. Cheap to clone.
#[derive(Clone)]
pub struct Worlds {
    hosts: Hosts,
    renderers: Arc<Renderers>,
    tenant: Tenant,
    owner: ServiceId,
    patience: Patience,
    /// Of this tenant.
    uploads: Arc<Uploads>,
}

impl Worlds {
    /// Follows the world services and renderers of a bus that may still be connecting. Worlds
    /// belong to a tenant, and live as long as their owner does.
    pub fn follow(
        bus: watch::Receiver<Option<Bus>>,
        tenant: Tenant,
        owner: ServiceId,
        patience: Patience,
    ) -> Self {
        let renderers = Renderers::follow(bus.clone());
        let hosts = Hosts::follow(bus);
        Self { hosts, renderers, tenant, owner, patience, uploads: Arc::default() }
    }

    /// Worlds of another tenant, by the same services.
    pub fn for_tenant(&self, tenant: Tenant) -> Self {
        Self { tenant, uploads: Arc::default(), ..self.clone() }
    }

    /// The world services.
    pub fn hosts(&self) -> &Hosts {
        &self.hosts
    }

    /// Keeps a world while its owner lives, and for so long.
    pub fn lease(&self, millis: u32) -> Lease {
        Lease { owner: self.owner.clone(), millis }
    }

    /// Asks the world that a request is about, or whoever can answer it: new worlds are made where
    /// there is room, maps are put everywhere, and lists are of all services.
    ///
    /// # Errors
    /// [`ErrorCode::Unreachable`] when nobody is up who could answer; refusals; the bus's.
    pub async fn ask(&self, request: Request) -> Result<Reply, Error> {
        if let Request::TickWorlds(items) = request {
            return Ok(Reply::Ticked(self.tick(items).await?));
        }
        if let Some(world) = world_of(&request) {
            let (key, patience) = (keys::world(&self.tenant, world), self.patience.ask);
            if let Some(host) = self.hosts.of_world(world) {
                return host.request(&key, &request, patience).await;
            }
            let bus = self.hosts.bus().ok_or_else(nobody)?;
            return bus.request(&key, &request, patience).await;
        }
        match request {
            Request::ListMaps => Ok(Reply::Maps(self.maps().await?)),
            Request::PutMap { name, text } => self.put_map(name, text).await,
            Request::ListWorlds => self.list_worlds().await,
            request => self.make(&request).await,
        }
    }

    /// One picture for each camera, of what a frame tells.
    ///
    /// # Errors
    /// As for [`Renderers::draw`].
    pub async fn draw(
        &self,
        frame: SharedFrame,
        cameras: Vec<Camera>,
        staging: Staging,
    ) -> Result<Vec<Image>, Error> {
        let job = RenderJob { tenant: self.tenant.clone(), frame, cameras, staging };
        Ok(self.renderers.draw(&job).await?.images)
    }

    /// Whether a renderer is up.
    pub fn can_draw(&self) -> bool {
        self.renderers.is_any_up()
    }

    /// The OpenDRIVE text with this digest, from whoever has it.
    ///
    /// # Errors
    /// As for [`Bus::asset`].
    pub async fn map_text(&self, digest: &str) -> Result<Vec<u8>, Error> {
        let until = Instant::now() + START_WAIT;
        let mut changes = self.hosts.changes();
        loop {
            match self.hosts.bus() {
                Some(bus) if self.hosts.is_any_up() => {
                    match bus.asset(digest, self.patience.ask).await {
                        Err(error) if is_passing(&error) && Instant::now() < until => {}
                        answer => return answer,
                    }
                }
                _ => wait_for_change(&mut changes, until).await?,
            }
            tokio::time::sleep(RETRY_PAUSE).await;
        }
    }

    /// Worlds whose owner this is, of the services that answer.
    ///
    /// # Errors
    /// When none does.
    pub async fn owned(&self) -> Result<Vec<WorldId>, Error> {
        let Reply::Worlds(worlds) = self.list_worlds().await? else {
            return Err(unexpected("worlds"));
        };
        let own = worlds.into_iter().filter(|info| info.owner.as_ref() == Some(&self.owner));
        Ok(own.map(|info| info.world).collect())
    }

    /// Makes a world on whichever service takes it: who has no room, or not the map or journal,
    /// leaves it to another. Waits while none is up.
    async fn make(&self, request: &Request) -> Result<Reply, Error> {
        let until = Instant::now() + START_WAIT;
        let mut changes = self.hosts.changes();
        let mut refused = BTreeSet::new();
        let mut unreached = BTreeSet::new();
        let mut refusal = None;
        loop {
            let Some(host) = self.hosts.place(&(&refused | &unreached)) else {
                if !std::mem::take(&mut unreached).is_empty() {
                    tokio::time::sleep(RETRY_PAUSE).await;
                    continue;
                }
                if let Some(refusal) = refusal {
                    return Err(refusal);
                }
                wait_for_change(&mut changes, until).await?;
                continue;
            };
            match self.ask_host(&host, request).await {
                // Others first; then those that were not reached once more.
                Err(error) if is_passing(&error) && Instant::now() < until => {
                    unreached.insert(host.id);
                }
                Err(error) if is_elsewhere(error.code) => {
                    if error.code == ErrorCode::Capacity {
                        self.hosts.note_full(&host.id);
                    }
                    refused.insert(host.id);
                    refusal.get_or_insert(error);
                }
                answer => return answer,
            }
        }
    }

    /// Asks one service; if it lacks a map that was put by this client, after putting it there.
    async fn ask_host(&self, host: &Host, request: &Request) -> Result<Reply, Error> {
        let mut answer = self.ask_once(host, request).await;
        if let Err(error) = &answer
            && error.code == ErrorCode::UnknownMap
        {
            let mut was_put = false;
            for (name, text) in self.uploads.all() {
                let put = Request::PutMap { name, text: text.to_string() };
                was_put |= self.ask_once(host, &put).await.is_ok();
            }
            if was_put {
                answer = self.ask_once(host, request).await;
            }
        }
        if let Ok(Reply::WorldCreated { world, .. }) = &answer {
            self.hosts.note_world(&host.id, *world);
        }
        answer
    }

    async fn ask_once(&self, host: &Host, request: &Request) -> Result<Reply, Error> {
        let key = keys::worlds_of(&self.tenant, &host.id);
        host.request(&key, request, self.patience.ask).await
    }

    /// What all that are heard answer, by name: those who do so soon after the first has. Waits
    /// while none is up.
    async fn ask_all(&self, request: &Request) -> Result<BTreeMap<ServiceId, Reply>, Error> {
        let until = Instant::now() + START_WAIT;
        let mut changes = self.hosts.changes();
        loop {
            if !self.hosts.is_any_up() {
                wait_for_change(&mut changes, until).await?;
                continue;
            }
            match self.ask_heard(request).await {
                Err(error) if is_passing(&error) && Instant::now() < until => {
                    tokio::time::sleep(RETRY_PAUSE).await;
                }
                answers => return answers,
            }
        }
    }

    async fn ask_heard(&self, request: &Request) -> Result<BTreeMap<ServiceId, Reply>, Error> {
        let mut asked = tokio::task::JoinSet::new();
        for host in self.hosts.heard() {
            let (client, request) = (self.clone(), request.clone());
            asked.spawn(async move {
                let answer = client.ask_once(&host, &request).await;
                (host.id, answer)
            });
        }
        let mut answers = BTreeMap::new();
        let mut refusal = nobody();
        let mut deadline = tokio::time::Instant::now() + self.patience.ask;
        while let Ok(Some(joined)) = tokio::time::timeout_at(deadline, asked.join_next()).await {
            match joined {
                Ok((id, Ok(answer))) => {
                    answers.insert(id, answer);
                    deadline = deadline.min(tokio::time::Instant::now() + REST_WAIT);
                }
                Ok((_, Err(error))) => refusal = error,
                Err(_) => {}
            }
        }
        if answers.is_empty() { Err(refusal) } else { Ok(answers) }
    }

    /// All maps, ordered by name; of several versions that of the first service by name. An upload
    /// that no service takes back is missing.
    ///
    /// # Errors
    /// When no service answers.
    pub async fn maps(&self) -> Result<Vec<MapRef>, Error> {
        let maps = self.list_maps().await?;
        let uploads = self.uploads.all();
        let is_missing =
            |(name, _): &&(String, Arc<str>)| !maps.iter().any(|map| map.name == *name);
        let missing: Vec<_> = uploads.iter().filter(is_missing).collect();
        if missing.is_empty() {
            return Ok(maps);
        }
        // The services that had them are gone.
        for (name, text) in missing {
            let put = Request::PutMap { name: name.clone(), text: text.to_string() };
            if let Err(error) = self.ask_all(&put).await {
                tracing::warn!(map = %name, %error, "an uploaded map could not be put again");
            }
        }
        self.list_maps().await
    }

    async fn list_maps(&self) -> Result<Vec<MapRef>, Error> {
        let mut maps = BTreeMap::new();
        for answer in self.ask_all(&Request::ListMaps).await?.into_values() {
            let Reply::Maps(told) = answer else { return Err(unexpected("maps")) };
            for map in told {
                maps.entry(map.name.clone()).or_insert(map);
            }
        }
        Ok(maps.into_values().collect())
    }

    async fn list_worlds(&self) -> Result<Reply, Error> {
        let mut worlds = Vec::new();
        for answer in self.ask_all(&Request::ListWorlds).await?.into_values() {
            let Reply::Worlds(told) = answer else { return Err(unexpected("worlds")) };
            worlds.extend(told);
        }
        worlds.sort_by_key(|info| info.world);
        Ok(Reply::Worlds(worlds))
    }

    /// Puts a map on all services that are heard; those that come later get it when they need it.
    async fn put_map(&self, name: String, text: String) -> Result<Reply, Error> {
        let request = Request::PutMap { name: name.clone(), text: text.clone() };
        self.ask_all(&request).await?;
        self.uploads.keep(name, text.into());
        Ok(Reply::Done)
    }
}

/// Whether another service may do what this one refuses.
fn is_elsewhere(code: ErrorCode) -> bool {
    use ErrorCode::{Capacity, UnknownAsset, UnknownMap, Unsupported};
    // Those that keep no journals do not support a request about one.
    matches!(code, Capacity | UnknownMap | UnknownAsset | Unsupported)
}

/// A service's liveliness may be known a moment before its keys are, and after they are gone.
fn is_passing(error: &Error) -> bool {
    error.code == ErrorCode::Unreachable
}

async fn wait_for_change(changes: &mut watch::Receiver<u64>, until: Instant) -> Result<(), Error> {
    let left = until.saturating_duration_since(Instant::now());
    match tokio::time::timeout(left, changes.changed()).await {
        Ok(Ok(())) => Ok(()),
        _ => Err(nobody()),
    }
}

fn nobody() -> Error {
    Error::new(ErrorCode::Unreachable, "no world service is up")
}

fn unexpected(wanted: &str) -> Error {
    Error::new(ErrorCode::InvalidMessage, "the world service answered something else")
        .wanted(wanted)
}
