//! What one submission draws: the rows of some plans, each where it is in the buffers.

use std::ops::Range;

use bodies::Instance;
use schemas::{Camera, HiddenScenery, ImageKind};

use super::adapter::Gpu;
use super::models::{Models, TownPlace};
use super::plan::Plan;
use super::room::Room;
use super::rows::{LampRow, ModelPlace, OccluderRow, PlacedRow, TargetRow, ViewRow};
use super::shadow_maps::{MapKey, TownMaps};

/// Bytes of a sample, and of a pixel of a map of shadows.
pub(crate) const SAMPLE_BYTES: u64 = 8;
pub(crate) const SHADOW_PX_BYTES: u64 = 4;
/// Clusters of a chunk.
pub(crate) const CHUNK: u32 = 64;
/// Chunks that the numbers of triangles have room for.
const CHUNKS_MAX: u32 = (1 << 20) - 1;
/// Bytes that the visible clusters of a chunk take, at most.
pub(crate) const VISIBLE_BYTES: u64 = CHUNK as u64 * 4;
/// Side of a tile of pixels that are shaded together.
const TILE_PX: u32 = 8;

/// Rows of one picture of a view.
#[derive(Clone, Copy)]
pub(crate) struct PlannedPicture<'a> {
    pub(crate) camera: &'a Camera,
    /// Whether it has all rows.
    pub(crate) is_whole: bool,
    /// Its bytes among those that are read back.
    pub(crate) offset_bytes: usize,
    pub(crate) bytes: usize,
}

/// What one submission uploads; kept from one to the next, it saves memory being fetched anew.
#[derive(Default)]
pub(crate) struct Rows {
    pub(crate) targets: Vec<TargetRow>,
    pub(crate) views: Vec<ViewRow>,
    pub(crate) lamps: Vec<LampRow>,
    pub(crate) occluders: Vec<OccluderRow>,
    /// Bits of hidden things, one set after the other.
    pub(crate) hidden: Vec<u32>,
}

impl Rows {
    /// Without any.
    fn cleared(mut self) -> Self {
        self.targets.clear();
        self.views.clear();
        self.lamps.clear();
        self.occluders.clear();
        self.hidden.clear();
        self
    }
}

/// One submission.
#[derive(Default)]
pub(crate) struct Batch<'a> {
    pub(crate) rows: Rows,
    pub(crate) samples: u64,
    /// Pixels of bodies' maps of shadows.
    pub(crate) shadow_px: u64,
    /// Pixels of towns' maps of shadows that are drawn anew.
    pub(crate) new_maps: Vec<Range<u32>>,
    /// Four bytes each.
    pub(crate) pixels: u64,
    pub(crate) tiles_max: u32,
    pub(crate) pictures: Vec<PlannedPicture<'a>>,
    /// At the places of the plans that it draws.
    pub(crate) spots: Vec<Spot>,
    /// Placed models of all plans, and chunks.
    pub(crate) placed: u32,
    pub(crate) chunks: u32,
    last_hidden: Option<(&'a HiddenScenery, [u32; 2])>,
}

/// Where the models of a plan are among all, and what looks at them.
#[derive(Clone, Copy)]
pub(crate) struct Spot {
    town: TownPlace,
    /// Number of the picture's target.
    picture: u32,
    /// Of the bodies' shadows, if it has any.
    bodies: Option<u32>,
    /// Of the town's shadows, if they are drawn anew.
    standing: Option<u32>,
    first_placed: u32,
    pub(crate) placed: u32,
    pub(crate) chunks: u32,
}

impl Spot {
    /// The models of its plan, in order.
    pub(crate) fn placed<'p>(&self, plan: &'p Plan<'_>) -> impl Iterator<Item = PlacedRow> + 'p {
        let Self { town, picture, bodies, standing, .. } = *self;
        let whole =
            |model: ModelPlace, target: u32| PlacedRow::new(&Instance::IN_PLACE, model, target);
        let shading = plan.shadows.as_ref().map_or(&[][..], |shadows| &shadows.shading);
        let of_bodies = shading.iter().map(move |row| row.seen_by(bodies.unwrap_or_default()));
        standing
            .map(|target| whole(town.models[1], target))
            .into_iter()
            .chain(of_bodies)
            .chain(town.models.map(|model| whole(model, picture)))
            .chain(plan.seen.iter().map(move |row| row.seen_by(picture)))
    }

    /// The chunks of its plan, in order: places among all models, and first clusters.
    pub(crate) fn chunks<'p>(&self, plan: &'p Plan<'_>) -> impl Iterator<Item = [u32; 2]> + 'p {
        let numbers = self.first_placed..;
        self.placed(plan).zip(numbers).flat_map(|(row, number)| {
            (0..row.clusters()).step_by(CHUNK as usize).map(move |first| [number, first])
        })
    }
}

impl<'a> Batch<'a> {
    /// As many of the plans as fit into one submission, at least one; `rows` are those of an older
    /// one.
    ///
    /// # Errors
    /// What the device has no room for.
    pub(crate) fn of(
        plans: &[Plan<'a>],
        (gpu, room, models, maps): (&Gpu, &Room, &mut Models, &mut TownMaps),
        rows: Rows,
    ) -> Result<Self, String> {
        models.make_room();
        maps.begin();
        let mut batch = Self { rows: rows.cleared(), ..Self::default() };
        for plan in plans.iter().take(room.views) {
            if !batch.spots.is_empty() && !batch.fits(plan, room, gpu) {
                break;
            }
            let town = match models.get(plan.strip.town) {
                Some(town) => town,
                None if !batch.spots.is_empty() && models.is_full() => break,
                None => models.put(gpu, plan.strip.town)?,
            };
            if !batch.add(plan, town, maps) {
                break;
            }
        }
        if batch.spots.is_empty() { Err("a picture has no room".to_owned()) } else { Ok(batch) }
    }

    fn fits(&self, plan: &Plan<'_>, room: &Room, gpu: &Gpu) -> bool {
        let most = gpu.binding_bytes_max();
        let samples = (self.samples + plan.sample_count()) * SAMPLE_BYTES;
        let shadows = (self.shadow_px + u64::from(plan.shadow_px())) * SHADOW_PX_BYTES;
        let pixels = (self.pixels + pixels_of(plan)) * 4;
        samples <= room.samples_bytes
            && shadows <= room.body_maps_bytes
            && pixels <= room.pictures_bytes
            // A town alone may have many.
            && u64::from(self.chunks) <= u64::from(CHUNKS_MAX).min(most / VISIBLE_BYTES) / 2
    }

    /// Whether it had room.
    fn add(&mut self, plan: &Plan<'a>, town: TownPlace, maps: &mut TownMaps) -> bool {
        let hidden = self.hide(plan.strip.hidden);
        let mut view = plan.view;
        let (mut bodies, mut standing) = (None, None);
        if let Some(shadows) = &plan.shadows {
            let key = MapKey::new(town.number, plan.strip.hidden, &shadows.sun);
            let Some((first_px, is_new)) = maps.get(&key, plan.shadow_px()) else { return false };
            if is_new {
                standing = Some(self.target(shadows.target, first_px, hidden));
                self.new_maps.push(first_px..first_px + plan.shadow_px());
            }
            let own_px = maps.room_px() + self.shadow_px as u32;
            bodies = Some(self.target(shadows.target, own_px, [0; 2]));
            self.shadow_px += u64::from(plan.shadow_px());
            view.shadow[0] = first_px;
            view.shadow[1] = own_px;
        }
        let first_sample = self.samples as u32;
        let picture = self.target(plan.target, first_sample, hidden);
        view.samples[0] = first_sample;
        self.samples += plan.sample_count();
        let (lamps, occluders) = (plan.lamps.len() as u32, plan.occluders.len() as u32);
        view.lists =
            [self.rows.lamps.len() as u32, lamps, self.rows.occluders.len() as u32, occluders];
        self.rows.lamps.extend(&plan.lamps);
        self.rows.occluders.extend(&plan.occluders);
        self.read_back(plan, &mut view);
        self.rows.views.push(view);
        self.put(
            plan,
            Spot {
                town,
                picture,
                bodies,
                standing,
                first_placed: self.placed,
                placed: 0,
                chunks: 0,
            },
        );
        true
    }

    /// Makes room for the models of a plan.
    fn put(&mut self, plan: &Plan<'_>, spot: Spot) {
        let chunks = |model: &ModelPlace| model.clusters.div_ceil(CHUNK);
        let [ground, standing] = spot.town.models.each_ref().map(chunks);
        let is_new = u32::from(spot.standing.is_some());
        let placed = plan.placed + 2 + is_new;
        let chunks = plan.chunks + ground + standing * (1 + is_new);
        self.placed += placed;
        self.chunks += chunks;
        self.spots.push(Spot { placed, chunks, ..spot });
    }

    /// Adds a target whose first sample or pixel is this one and gives its number.
    fn target(&mut self, mut target: TargetRow, first: u32, hidden: [u32; 2]) -> u32 {
        target.place[0] = first;
        target.kind[1..3].copy_from_slice(&hidden);
        self.rows.targets.push(target);
        self.rows.targets.len() as u32 - 1
    }

    /// Where the bits of hidden things begin, and how many words they are.
    fn hide(&mut self, hidden: &'a HiddenScenery) -> [u32; 2] {
        if hidden.is_none() {
            return [0; 2];
        }
        if let Some((last, words)) = self.last_hidden
            && last == hidden
        {
            return words;
        }
        let first = self.rows.hidden.len();
        self.rows.hidden.extend(hidden.bits().chunks(4).map(|bytes| {
            let mut word = [0; 4];
            word.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
            u32::from_le_bytes(word)
        }));
        let words = [first as u32, (self.rows.hidden.len() - first) as u32];
        self.last_hidden = Some((hidden, words));
        words
    }

    /// Makes room for the pictures of a plan. Cameras that want the same share it.
    fn read_back(&mut self, plan: &Plan<'a>, view: &mut ViewRow) {
        let strip = plan.strip;
        let px = u64::from(strip.camera().width_px) * strip.rows.len() as u64;
        for camera in &strip.cameras {
            let Some(out) = view.outs.get_mut(out_of(camera.kind)) else { continue };
            if *out == super::rows::NOWHERE {
                *out = self.pixels as u32;
                self.pixels += px;
            }
            self.pictures.push(PlannedPicture {
                camera,
                is_whole: strip.is_whole(),
                offset_bytes: *out as usize * 4,
                bytes: px as usize * 4,
            });
        }
        let tiles = strip.camera().width_px.div_ceil(TILE_PX)
            * (strip.rows.end - strip.rows.start).div_ceil(TILE_PX);
        self.tiles_max = self.tiles_max.max(tiles);
    }
}

/// Which of a view's pixels a kind of picture is.
fn out_of(kind: ImageKind) -> usize {
    match kind {
        ImageKind::Rgb | ImageKind::Depth => 0,
        ImageKind::Semantic | ImageKind::Instance => 1,
        ImageKind::Normals => 2,
    }
}

fn pixels_of(plan: &Plan<'_>) -> u64 {
    let strip = plan.strip;
    u64::from(strip.camera().width_px) * (strip.rows.len() * strip.cameras.len()) as u64
}
