//! Textures that clients put on things of the map. They change pictures alone, but belong to the
//! state: whoever restores or forks a world sees it as it was.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use schemas::{Coat, Error, ErrorCode, MaterialParameter, Paint, Texture, limits};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Textures of all worlds of the process: equal ones are kept once, and whoever draws a world finds
/// what its frames name.
static KEPT: Mutex<Kept> = Mutex::new(Kept { all: BTreeMap::new(), latest: VecDeque::new() });

/// The latest ones are kept for so long: a frame may be drawn after its world got others.
const LATEST_MAX: usize = 32;

struct Kept {
    /// By digest.
    all: BTreeMap<String, Weak<Texture>>,
    latest: VecDeque<Arc<Texture>>,
}

/// The texture with a digest, if a world of this process has it or had it a moment ago.
pub fn texture(digest: &str) -> Option<Arc<Texture>> {
    kept().all.get(digest)?.upgrade()
}

/// A texture as all worlds share it.
fn shared(texture: Arc<Texture>) -> Arc<Texture> {
    let mut kept = kept();
    if let Some(known) = kept.all.get(texture.digest()).and_then(Weak::upgrade) {
        return known;
    }
    kept.all.retain(|_, texture| texture.strong_count() > 0);
    kept.all.insert(texture.digest().to_owned(), Arc::downgrade(&texture));
    if kept.latest.len() >= LATEST_MAX {
        kept.latest.pop_front();
    }
    kept.latest.push_back(Arc::clone(&texture));
    texture
}

fn kept() -> MutexGuard<'static, Kept> {
    // A panic while it was held left every entry whole.
    KEPT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The textures of a world and what has them.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(crate) struct Painted {
    /// Each in use.
    textures: Vec<Shared>,
    /// Ordered by place; each with a texture.
    coats: Vec<Coat>,
}

#[derive(Clone)]
struct Shared(Arc<Texture>);

impl Painted {
    /// Puts a texture on the things at some places.
    ///
    /// # Errors
    /// `Capacity` for too many things and for textures of too many bytes; nothing is changed then.
    pub(crate) fn paint(
        &mut self,
        places: &[u32],
        parameter: MaterialParameter,
        texture: &Arc<Texture>,
    ) -> Result<(), Error> {
        let mut coats: BTreeMap<u32, Coat> =
            self.coats.iter().map(|coat| (coat.place, *coat)).collect();
        let mut textures = self.textures.clone();
        let known = textures.iter().position(|known| known.0.digest() == texture.digest());
        let position = known.unwrap_or_else(|| {
            textures.push(Shared(Arc::clone(texture)));
            textures.len() - 1
        });
        // No more than the limit, which is less.
        let position = Some(position as u16);
        for place in places {
            let bare = Coat { place: *place, diffuse: None, emissive: None };
            let coat = coats.entry(*place).or_insert(bare);
            match parameter {
                MaterialParameter::Diffuse => coat.diffuse = position,
                MaterialParameter::Emissive => coat.emissive = position,
            }
        }
        let mut next = Self { textures, coats: coats.into_values().collect() };
        next.leave_unused();
        next.check_size()?;
        for texture in &mut next.textures {
            texture.0 = shared(Arc::clone(&texture.0));
        }
        *self = next;
        Ok(())
    }

    /// Leaves the things at some places as they were.
    pub(crate) fn strip(&mut self, is_stripped: impl Fn(u32) -> bool) {
        if !self.coats.is_empty() {
            self.coats.retain(|coat| !is_stripped(coat.place));
            self.leave_unused();
        }
    }

    /// As frames tell it.
    pub(crate) fn told(&self) -> Paint {
        let textures = self.textures.iter().map(|texture| texture.0.digest().to_owned());
        Paint { textures: textures.collect(), coats: self.coats.clone() }
    }

    /// Whether nothing is painted.
    pub(crate) fn is_none(&self) -> bool {
        self.coats.is_empty()
    }

    /// Whether it can be that of a map with so many places.
    pub(crate) fn is_consistent(&self, places: usize) -> bool {
        let count = self.textures.len();
        let is_known = |position: u16| usize::from(position) < count;
        self.coats.windows(2).all(|pair| pair[0].place < pair[1].place)
            && self.coats.last().is_none_or(|coat| (coat.place as usize) < places)
            && self.coats.iter().flat_map(used).all(is_known)
            && self.coats.iter().all(|coat| used(coat).next().is_some())
            && self.coats.iter().flat_map(used).collect::<BTreeSet<u16>>().len() == count
            && self.check_size().is_ok()
    }

    /// Forgets textures that nothing has any more.
    fn leave_unused(&mut self) {
        let used: BTreeSet<u16> = self.coats.iter().flat_map(used).collect();
        if used.len() == self.textures.len() {
            return;
        }
        let next: BTreeMap<u16, u16> = used.iter().copied().zip(0..).collect();
        for coat in &mut self.coats {
            for slot in [&mut coat.diffuse, &mut coat.emissive] {
                *slot = slot.and_then(|position| next.get(&position).copied());
            }
        }
        let kept = used.iter().filter_map(|at| self.textures.get(usize::from(*at)).cloned());
        self.textures = kept.collect();
    }

    /// # Errors
    /// `Capacity`.
    fn check_size(&self) -> Result<(), Error> {
        let over = |what: &'static str, most: usize, found: usize| {
            Err(Error::new(ErrorCode::Capacity, "the world has no room for more paint")
                .wanted(format_args!("at most {most} {what}"))
                .found(found))
        };
        let bytes: usize = self.textures.iter().map(|texture| texture.0.bytes().len()).sum();
        if self.coats.len() > limits::PAINTED_OBJECTS_MAX {
            over("painted objects", limits::PAINTED_OBJECTS_MAX, self.coats.len())
        } else if self.textures.len() > limits::TEXTURES_PER_WORLD_MAX {
            over("textures", limits::TEXTURES_PER_WORLD_MAX, self.textures.len())
        } else if bytes > limits::TEXTURE_BYTES_PER_WORLD_MAX {
            let most = limits::TEXTURE_BYTES_PER_WORLD_MAX;
            over("bytes of textures; smaller ones, or one for several objects", most, bytes)
        } else {
            Ok(())
        }
    }
}

/// Positions of the textures of a coat.
fn used(coat: &Coat) -> impl Iterator<Item = u16> + use<> {
    [coat.diffuse, coat.emissive].into_iter().flatten()
}

impl Serialize for Shared {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.bytes().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Shared {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let texture = Texture::from_bytes(Vec::deserialize(deserializer)?);
        texture.map(|texture| Self(shared(Arc::new(texture)))).map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One of a colour, of this many bytes of pixels in rows of 512.
    fn texture(colour: u8, rows: u32) -> Arc<Texture> {
        let rgb = vec![colour; 512 * 3 * rows as usize];
        Arc::new(Texture::new([512, rows], 1.0, &rgb).unwrap())
    }

    fn digests(painted: &Painted) -> Vec<String> {
        painted.told().textures
    }

    #[test]
    fn a_texture_that_nothing_has_any_more_is_forgotten() {
        let mut painted = Painted::default();
        let [one, two] = [texture(1, 1), texture(2, 1)];
        painted.paint(&[5, 3], MaterialParameter::Diffuse, &one).unwrap();
        painted.paint(&[3], MaterialParameter::Emissive, &two).unwrap();
        assert_eq!(digests(&painted), [one.digest(), two.digest()]);
        painted.paint(&[3, 5], MaterialParameter::Diffuse, &two).unwrap();
        assert_eq!(digests(&painted), [two.digest()]);
        let both = Coat { place: 3, diffuse: Some(0), emissive: Some(0) };
        assert_eq!(painted.coats, [both, Coat { place: 5, emissive: None, ..both }]);
        assert!(painted.is_consistent(6) && !painted.is_consistent(5));
        painted.strip(|place| place == 3);
        assert_eq!(painted.coats.len(), 1);
        painted.strip(|_| true);
        assert!(painted.is_none() && painted.textures.is_empty());
    }

    #[test]
    fn equal_textures_count_once_and_others_until_there_is_no_room() {
        let mut painted = Painted::default();
        for place in 0..100 {
            painted.paint(&[place], MaterialParameter::Diffuse, &texture(9, 512)).unwrap();
        }
        assert_eq!(painted.textures.len(), 1);
        for place in 0..9 {
            let other = texture(10 + place as u8, 512);
            painted.paint(&[place], MaterialParameter::Diffuse, &other).unwrap();
        }
        let before = painted.told();
        let refused = painted.paint(&[9], MaterialParameter::Diffuse, &texture(90, 512));
        assert_eq!(refused.unwrap_err().code, ErrorCode::Capacity);
        assert_eq!(painted.told(), before);
        let many: Vec<u32> = (0..=limits::PAINTED_OBJECTS_MAX as u32).collect();
        let refused = painted.paint(&many, MaterialParameter::Diffuse, &texture(9, 512));
        assert_eq!(refused.unwrap_err().code, ErrorCode::Capacity);
    }

    #[test]
    fn a_texture_is_found_while_a_world_has_it() {
        let mut painted = Painted::default();
        let mine = texture(77, 2);
        let digest = mine.digest().to_owned();
        assert!(super::texture(&digest).is_none());
        painted.paint(&[1], MaterialParameter::Diffuse, &mine).unwrap();
        drop(mine);
        let bytes = postcard::to_allocvec(&painted).unwrap();
        let copy: Painted = postcard::from_bytes(&bytes).unwrap();
        assert!(Arc::ptr_eq(&copy.textures[0].0, &painted.textures[0].0));
        for other in 0..=LATEST_MAX as u8 {
            painted.paint(&[1], MaterialParameter::Diffuse, &texture(other, 3)).unwrap();
        }
        assert!(super::texture(&digest).is_some());
        drop(copy);
        assert!(super::texture(&digest).is_none());
    }
}
