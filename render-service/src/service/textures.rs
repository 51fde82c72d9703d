//! Textures of things of towns by digest: fetched once, and kept while there is room.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use bus::Bus;
use lru::LruCache;
use schemas::{Error, ErrorCode, Paint, Texture};
use tokio::runtime::Handle;

use crate::Textures;
use crate::scene::coat::ready;

use super::job_queue::JobQueue;

/// Bytes of all that are kept; the one longest unused goes first.
const BYTES_MAX: usize = 512 * 1024 * 1024;
/// How long the owner of a texture may take to send it.
const ASSET_DEADLINE: Duration = Duration::from_secs(2);
/// Textures that are fetched at once.
const UNDER_WAY_MAX: usize = 16;

/// Textures by digest.
pub(crate) struct TextureShelf {
    bus: Bus,
    runtime: Handle,
    queue: Arc<JobQueue>,
    known: LruCache<String, Arc<raster::Texture>>,
    bytes: usize,
    under_way: BTreeSet<String>,
}

/// What came of a texture that was asked for.
pub(crate) struct FetchedTexture {
    pub(crate) digest: String,
    /// Why there is none: [`ErrorCode::InvalidMessage`] when the bytes are not it, and what the bus
    /// says when they cannot be had.
    pub(crate) texture: Result<Arc<raster::Texture>, Error>,
}

impl TextureShelf {
    pub(crate) fn new(bus: Bus, runtime: Handle, queue: Arc<JobQueue>) -> Self {
        let (known, under_way) = (LruCache::unbounded(), BTreeSet::new());
        Self { bus, runtime, queue, known, bytes: 0, under_way }
    }

    /// Whether all textures of some paint are there.
    pub(crate) fn has(&self, paint: &Paint) -> bool {
        paint.textures.iter().all(|digest| self.known.contains(digest))
    }

    /// Those of some paint that are there.
    pub(crate) fn get(&mut self, paint: &Paint) -> Textures {
        let mut textures = Textures::default();
        for digest in &paint.textures {
            if let Some(texture) = self.known.get(digest) {
                textures.share(digest, Arc::clone(texture));
            }
        }
        textures
    }

    /// Has those fetched that are not there, as far as there is room.
    pub(crate) fn want(&mut self, paint: &Paint) {
        for digest in &paint.textures {
            let is_enough = self.under_way.len() >= UNDER_WAY_MAX;
            if is_enough || self.known.contains(digest) || self.under_way.contains(digest) {
                continue;
            }
            self.under_way.insert(digest.clone());
            let (bus, queue, digest) = (self.bus.clone(), Arc::clone(&self.queue), digest.clone());
            drop(self.runtime.spawn(async move {
                let fetched = bus.asset(&digest, ASSET_DEADLINE).await;
                let texture = fetched.and_then(|bytes| checked(&digest, bytes));
                queue.put_texture(FetchedTexture { digest, texture });
            }));
        }
    }

    /// Takes in what came of one.
    pub(crate) fn note_end(&mut self, digest: &str, texture: Option<Arc<raster::Texture>>) {
        self.under_way.remove(digest);
        let Some(texture) = texture else { return };
        self.bytes += texture.bytes();
        if let Some((_, before)) = self.known.push(digest.to_owned(), texture) {
            self.bytes -= before.bytes();
        }
        while self.bytes > BYTES_MAX
            && let Some((_, oldest)) = self.known.pop_lru()
        {
            self.bytes -= oldest.bytes();
        }
    }
}

/// # Errors
/// `InvalidMessage` for bytes that are not the texture with this digest.
fn checked(digest: &str, bytes: Vec<u8>) -> Result<Arc<raster::Texture>, Error> {
    let texture = Texture::from_bytes(bytes)?;
    if texture.digest() != digest {
        let error = Error::new(ErrorCode::InvalidMessage, "the bus has other bytes under this key");
        return Err(error.wanted(digest).found(texture.digest()));
    }
    ready(&texture).map(Arc::new)
}
