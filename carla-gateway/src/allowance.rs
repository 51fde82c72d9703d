//! How much of a site the tenant of an endpoint may use.

mod recordings;

use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use schemas::limits::CAMERAS_PER_WORLD_MAX;
use schemas::{ActorKind, Camera, Frame, Tenant};
use tenancy::{Door, PixelBudget, Quotas, Seldom};

use crate::figures::QuotaFigures;
use crate::rpc::Refusal;
pub(crate) use recordings::Growing;
use recordings::Recordings;

/// What all endpoints of a tenant may use. Cheap to clone.
#[derive(Clone)]
pub(crate) struct Allowance(Arc<Shared>);

struct Shared {
    door: Arc<Door>,
    tenant: Tenant,
    /// What may still be drawn.
    pixels: PixelBudget,
    recordings: Arc<Recordings>,
    figures: QuotaFigures,
    /// By quota, as they are written down: clients ask again and again.
    refusals: Seldom<&'static str>,
}

/// What may still be spawned into a world.
pub(crate) struct Room {
    allowance: Allowance,
    quotas: Quotas,
    /// Those that are there or were asked for.
    actors: u32,
    cameras: u32,
}

impl fmt::Debug for Allowance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Allowance").field(&self.0.tenant).finish()
    }
}

impl Allowance {
    /// What a door allows a tenant.
    pub(crate) fn new(door: Arc<Door>, tenant: Tenant, figures: QuotaFigures) -> Self {
        Self(Arc::new(Shared {
            door,
            tenant,
            pixels: PixelBudget::default(),
            recordings: Arc::default(),
            figures,
            refusals: Seldom::default(),
        }))
    }

    /// Everything.
    pub(crate) fn open(tenant: Tenant) -> Self {
        Self::new(Arc::new(Door::open(tenant.clone())), tenant, QuotaFigures::default())
    }

    /// What may still be spawned into a world as it is in a frame.
    pub(crate) fn room(&self, frame: &Frame) -> Room {
        let is_spawned = |kind| !matches!(kind, ActorKind::TrafficLight | ActorKind::TrafficSign);
        let spawned = frame.actors.iter().filter(|actor| is_spawned(actor.kind));
        let types = spawned.map(|actor| frame.type_of(actor)).filter(|of| *of != "spectator");
        let (mut actors, mut cameras) = (0, 0);
        for blueprint in types {
            actors += 1;
            cameras += u32::from(is_camera(blueprint));
        }
        Room { allowance: self.clone(), quotas: self.quotas(), actors, cameras }
    }

    /// Counts pictures against what may be drawn. Who waits for pictures gets them later; without,
    /// `false`: they are left out.
    pub(crate) async fn may_draw(
        &self,
        cameras: impl Iterator<Item = &Camera>,
        waits: bool,
    ) -> bool {
        let Some(rate) = self.quotas().pixels_per_second else { return true };
        let pixels_of = |camera: &Camera| u64::from(camera.width_px) * u64::from(camera.height_px);
        let pixels = cameras.map(pixels_of).sum();
        let now = Instant::now();
        let late = match waits {
            true => Some(self.0.pixels.book(pixels, rate, now)).filter(|pause| !pause.is_zero()),
            false => self.0.pixels.take(pixels, rate, now).err(),
        };
        let Some(pause) = late else { return true };
        self.0.figures.pixels.inc();
        self.tell("pixels_per_second");
        if waits {
            tokio::time::sleep(pause).await;
        }
        waits
    }

    /// Room for a recording in a folder of the tenant's recordings, beside those that are there and
    /// those that grow at the same time.
    ///
    /// # Errors
    /// The quota is used up.
    pub(crate) async fn recording(&self, folder: &Path, path: &Path) -> Result<Growing, Refusal> {
        let quota = self.quotas().recordings_mib;
        let bytes_max = quota.map(|mib| u64::from(mib) << 20);
        let (recordings, tenant) = (Arc::clone(&self.0.recordings), self.clone());
        let (folder, path) = (folder.to_owned(), path.to_owned());
        // It may take a while to look at all files.
        let beginning = tokio::task::spawn_blocking(move || {
            recordings::begin(&recordings, tenant, bytes_max, &folder, &path)
        });
        let begun = beginning.await.map_err(|error| Refusal(format!("cannot record: {error}")))?;
        begun.map_err(|there| {
            self.refuse_recording();
            Refusal(format!(
                "wanted a new recording, found {there} bytes of recordings, and the quota \
                 recordings_mib = {} of tenant {} allows no more: remove some",
                quota.unwrap_or_default(),
                self.0.tenant
            ))
        })
    }

    /// Counts and says that recordings may have no more bytes.
    fn refuse_recording(&self) {
        self.0.figures.recordings.inc();
        self.tell("recordings_mib");
    }

    /// Whose it is.
    pub(crate) fn tenant(&self) -> &Tenant {
        &self.0.tenant
    }

    fn quotas(&self) -> Quotas {
        self.0.door.quotas_of(&self.0.tenant)
    }

    fn tell(&self, quota: &'static str) {
        if self.0.refusals.may_tell(quota, Instant::now()) {
            tracing::warn!(target: "audit", tenant = %self.0.tenant, quota, "quota refused");
        }
    }
}

impl Room {
    /// Takes the place of an actor to be spawned.
    ///
    /// # Errors
    /// There is none; which quota says so.
    pub(crate) fn take(&mut self, blueprint: &str) -> Result<(), Refusal> {
        let Quotas { actors_per_world, cameras_per_world, .. } = self.quotas;
        if let Some(max) = actors_per_world.filter(|max| self.actors >= *max) {
            self.allowance.0.figures.actors.inc();
            return Err(self.refusal("actors_per_world", "actors", self.actors, max));
        }
        let is_camera = is_camera(blueprint);
        if let Some(max) = cameras_per_world.filter(|max| is_camera && self.cameras >= *max) {
            self.allowance.0.figures.cameras.inc();
            return Err(self.refusal("cameras_per_world", "cameras", self.cameras, max));
        }
        if is_camera && self.cameras >= CAMERAS_PER_WORLD_MAX {
            return Err(Refusal(format!(
                "wanted one more, found {} cameras in this world, and a server draws at most \
                 {CAMERAS_PER_WORLD_MAX}: destroy some",
                self.cameras
            )));
        }
        self.actors += 1;
        self.cameras += u32::from(is_camera);
        Ok(())
    }

    fn refusal(&self, quota: &'static str, what: &str, found: u32, max: u32) -> Refusal {
        self.allowance.tell(quota);
        let tenant = &self.allowance.0.tenant;
        Refusal(format!(
            "wanted one more, found {found} {what} in this world, and the quota {quota} = {max} \
             of tenant {tenant} allows no more: destroy some"
        ))
    }
}

fn is_camera(blueprint: &str) -> bool {
    blueprint.starts_with("sensor.camera.")
}

#[cfg(test)]
mod tests;
