//! How much of a site the tenant of an endpoint may use.

use std::fmt;
use std::sync::Arc;
use std::time::Instant;

use schemas::{ActorKind, Camera, Frame, Tenant};
use tenancy::{Door, PixelBudget, Quotas, Seldom};

use crate::figures::QuotaFigures;
use crate::rpc::Refusal;

/// What all endpoints of a tenant may use. Cheap to clone.
#[derive(Clone)]
pub(crate) struct Allowance(Arc<Shared>);

struct Shared {
    door: Arc<Door>,
    tenant: Tenant,
    /// What may still be drawn.
    pixels: PixelBudget,
    figures: QuotaFigures,
    /// As they are written down: clients ask again and again.
    refusals: Seldom,
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
        let (pixels, refusals) = (PixelBudget::default(), Seldom::default());
        Self(Arc::new(Shared { door, tenant, pixels, figures, refusals }))
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
    pub(crate) async fn may_draw(&self, cameras: &[Camera], waits: bool) -> bool {
        let Some(rate) = self.quotas().pixels_per_second else { return true };
        let pixels_of = |camera: &Camera| u64::from(camera.width_px) * u64::from(camera.height_px);
        let pixels = cameras.iter().map(pixels_of).sum();
        let mut is_counted = false;
        loop {
            let Err(pause) = self.0.pixels.take(pixels, rate, Instant::now()) else { return true };
            if !std::mem::replace(&mut is_counted, true) {
                self.0.figures.pixels.inc();
                self.tell("pixels_per_second");
            }
            if !waits {
                return false;
            }
            tokio::time::sleep(pause).await;
        }
    }

    /// How long a new recording may be, beside so many bytes that are there.
    ///
    /// # Errors
    /// The quota is used up.
    pub(crate) fn recording_bytes(&self, there: u64) -> Result<u64, Refusal> {
        let Some(mib) = self.quotas().recordings_mib else { return Ok(u64::MAX) };
        let left = (u64::from(mib) << 20).saturating_sub(there);
        if left > 0 {
            return Ok(left);
        }
        self.0.figures.recordings.inc();
        self.tell("recordings_mib");
        Err(Refusal(format!(
            "wanted a new recording, found {there} bytes of recordings, and the quota \
             recordings_mib = {mib} of tenant {} allows no more: remove some",
            self.0.tenant
        )))
    }

    /// Whose it is.
    pub(crate) fn tenant(&self) -> &Tenant {
        &self.0.tenant
    }

    fn quotas(&self) -> Quotas {
        self.0.door.quotas_of(&self.0.tenant)
    }

    fn tell(&self, quota: &'static str) {
        if self.0.refusals.may_tell(Instant::now()) {
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
