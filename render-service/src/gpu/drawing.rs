//! One open device and everything on it; gone with the device.

use std::collections::VecDeque;
use std::time::Duration;

use schemas::PictureQuality;

use crate::RenderError;
use crate::encode::{Encoder, Pixels};
use crate::parallel::{in_parallel, threads};
use crate::strip::{Drawn, Strip, row_pitch_bytes};

use super::adapter::{AdapterChoice, Gpu, one_at_a_time};
use super::batch::{Batch, PlannedPicture, Rows, SAMPLE_BYTES, SHADOW_PX_BYTES, VISIBLE_BYTES};
use super::buffers::{Scratch, Upload};
use super::kernels::{Kernels, groups_of};
use super::models::Models;
use super::plan::{Fineness, Plan};
use super::readback::{InFlight, RING, Ring};
use super::room::Room;
use super::rows::{PlacedRow, material_rows};
use super::shaders::Kernel;
use super::shadow_maps::TownMaps;
use super::timer::{TIMES_BYTES, Timer};

/// Strips that are planned at once.
const PLANS_MAX: usize = 1_024;
/// Bytes of rows.
const PLACED_BYTES: u64 = size_of::<PlacedRow>() as u64;
const CHUNK_BYTES: u64 = 8;
/// Plans whose rows one thread writes, at least.
const PLANS_WRITTEN_MIN: usize = 8;
/// Bytes that are uploaded in one piece.
const BELT_BYTES: u64 = 4 * 1024 * 1024;
/// Bytes of a block's row.
const LARGE_BYTES: u64 = 8;
/// What is told of a submission behind its pictures: visible clusters, blocks of large triangles.
const FOUND_BYTES: u64 = 8;
/// All that is told, with the kernels' times.
const TAIL_BYTES: u64 = TIMES_BYTES + FOUND_BYTES;

/// One open device and everything on it.
pub(crate) struct Drawing {
    pub(crate) gpu: Gpu,
    room: Room,
    kernels: Kernels,
    models: Models,
    maps: TownMaps,
    buffers: Buffers,
    ring: Ring,
    belt: wgpu::util::StagingBelt,
    /// Of an older submission.
    rows: Rows,
    timer: Timer,
    /// One for each thread.
    encoders: Vec<Encoder>,
}

/// What is written anew for every submission, but for shadows of towns.
struct Buffers {
    targets: Scratch,
    placed: Scratch,
    chunks: Scratch,
    views: Scratch,
    lamps: Scratch,
    occluders: Scratch,
    hidden: Scratch,
    materials: Scratch,
    visible: Scratch,
    found: Scratch,
    large: Scratch,
    visibility: Scratch,
    shadows: Scratch,
    pixels: Scratch,
}

impl Buffers {
    fn new(gpu: &Gpu, room: &Room) -> Self {
        let new = |label: &'static str| Scratch::new(gpu, label);
        let mut buffers = Self {
            targets: new("targets"),
            placed: new("placed"),
            chunks: new("chunks"),
            views: new("views"),
            lamps: new("lamps"),
            occluders: new("occluders"),
            hidden: new("hidden"),
            materials: new("materials"),
            visible: new("visible"),
            found: new("found"),
            large: new("large"),
            visibility: new("visibility"),
            shadows: new("shadows"),
            pixels: new("pixels"),
        };
        buffers.materials.fill(gpu, &material_rows());
        buffers.large.reserve(gpu, room.large_blocks * LARGE_BYTES);
        buffers
    }
}

impl Drawing {
    /// # Errors
    /// [`RenderError::NoAdapter`], [`RenderError::NoDevice`].
    pub(crate) fn open(choice: &AdapterChoice, room: Room) -> Result<Self, RenderError> {
        let _one = one_at_a_time();
        let gpu = Gpu::open(choice)?;
        let room = room.on(&gpu);
        let drawing = Self {
            room,
            kernels: Kernels::new(&gpu),
            models: Models::new(&gpu, room.models_bytes),
            maps: TownMaps::new((room.town_maps_bytes / SHADOW_PX_BYTES) as u32),
            buffers: Buffers::new(&gpu, &room),
            ring: Ring::default(),
            belt: wgpu::util::StagingBelt::new(gpu.device.clone(), BELT_BYTES),
            rows: Rows::default(),
            timer: Timer::new(&gpu),
            encoders: std::iter::repeat_with(Encoder::default).take(threads()).collect(),
            gpu,
        };
        match drawing.gpu.fault() {
            None => Ok(drawing),
            Some(cause) => {
                Err(RenderError::NoDevice { adapter: drawing.gpu.adapter_name.clone(), cause })
            }
        }
    }

    /// Draws strips in as few submissions as fit, one drawn while the one before is encoded. Gives
    /// what came of each strip's cameras, in order. Those that do not say their quality have this
    /// one.
    ///
    /// # Errors
    /// What happened to the device; it is of no use afterwards.
    pub(crate) fn draw(
        &mut self,
        strips: &[Strip<'_>],
        quality: PictureQuality,
    ) -> Result<Vec<Drawn>, String> {
        loop {
            if let Some(drawn) = self.try_to_draw(strips, quality)? {
                return Ok(drawn);
            }
        }
    }

    /// `None` if there was no room for all blocks of large triangles; there is more next time.
    fn try_to_draw(
        &mut self,
        strips: &[Strip<'_>],
        quality: PictureQuality,
    ) -> Result<Option<Vec<Drawn>>, String> {
        let fineness = Fineness { quality, is_software: self.gpu.software };
        let mut drawn = Vec::with_capacity(strips.len());
        let mut under_way = VecDeque::new();
        let mut large = 0;
        for strips in strips.chunks(PLANS_MAX) {
            let models = &self.models;
            let plans = in_parallel(&mut self.encoders, strips.iter().collect(), |_, strip| {
                Plan::new(strip, fineness, models)
            });
            let mut rest = plans.as_slice();
            while !rest.is_empty() {
                let room = (&self.gpu, &self.room, &mut self.models, &mut self.maps);
                let batch = Batch::of(rest, room, std::mem::take(&mut self.rows))?;
                let flight = self.submit(&batch, rest);
                self.rows = batch.rows;
                rest = rest.get(batch.spots.len()..).unwrap_or_default();
                under_way.push_back((flight, batch.pictures));
                if under_way.len() >= RING
                    && let Some((flight, pictures)) = under_way.pop_front()
                {
                    large = large.max(self.collect(flight, &pictures, &mut drawn)?);
                }
            }
        }
        for (flight, pictures) in under_way {
            large = large.max(self.collect(flight, &pictures, &mut drawn)?);
        }
        let room = self.buffers.large.get().size() / LARGE_BYTES;
        if large <= room {
            return Ok(Some(drawn));
        }
        let most = self.gpu.binding_bytes_max() / LARGE_BYTES;
        if large > most {
            return Err(format!("{large} blocks of large triangles, room for {most}"));
        }
        self.buffers.large.reserve(&self.gpu, large * LARGE_BYTES);
        // Maps of towns may lack triangles.
        self.maps = TownMaps::new(self.maps.room_px());
        Ok(None)
    }

    /// What all kernels took since the device was opened; `None` if it does not tell.
    pub(crate) fn kernel_times(&self) -> Option<[(&'static str, Duration); Kernel::ALL.len()]> {
        self.timer.sums()
    }

    /// Submissions since the device was opened, and blocks of large triangles that it has room for.
    #[cfg(test)]
    pub(crate) fn submissions(&self) -> u64 {
        self.maps.submission()
    }

    #[cfg(test)]
    pub(crate) fn large_blocks(&self) -> u64 {
        self.buffers.large.get().size() / LARGE_BYTES
    }

    fn submit(&mut self, batch: &Batch<'_>, plans: &[Plan<'_>]) -> InFlight {
        let mut encoder =
            self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.upload(&mut encoder, batch, plans);
        let bytes = batch.pixels * 4;
        let readback = self.ring.take(&self.gpu, bytes + TAIL_BYTES);
        let Self { gpu, buffers, .. } = &*self;
        encoder.clear_buffer(buffers.visibility.get(), 0, Some(batch.samples * SAMPLE_BYTES));
        let shadows = buffers.shadows.get();
        let px = |px: u32| u64::from(px) * SHADOW_PX_BYTES;
        if batch.shadow_px > 0 {
            let bytes = batch.shadow_px * SHADOW_PX_BYTES;
            encoder.clear_buffer(shadows, px(self.maps.room_px()), Some(bytes));
        }
        for map in &batch.new_maps {
            encoder.clear_buffer(shadows, px(map.start), Some(px(map.end - map.start)));
        }
        for kernel in Kernel::ALL {
            self.run(&mut encoder, kernel, batch);
        }
        self.timer.copy(&mut encoder, &readback, readback.size() - TAIL_BYTES);
        let offset = readback.size() - FOUND_BYTES;
        encoder.copy_buffer_to_buffer(buffers.pixels.get(), 0, &readback, 0, bytes);
        encoder.copy_buffer_to_buffer(buffers.found.get(), 0, &readback, offset, FOUND_BYTES);
        let flight = InFlight::submit(gpu, encoder, readback);
        self.belt.recall();
        flight
    }

    fn upload(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        batch: &Batch<'_>,
        plans: &[Plan<'_>],
    ) {
        let Self { gpu, buffers, maps, belt, encoders, .. } = self;
        let mut way = Upload { gpu, encoder, belt };
        way.write(&mut buffers.targets, &batch.rows.targets);
        write_models(
            &mut way,
            (&mut buffers.placed, &mut buffers.chunks),
            (batch, plans),
            encoders,
        );
        way.write(&mut buffers.views, &batch.rows.views);
        way.write(&mut buffers.lamps, &batch.rows.lamps);
        way.write(&mut buffers.occluders, &batch.rows.occluders);
        way.write(&mut buffers.hidden, &batch.rows.hidden);
        way.write(&mut buffers.found, &[0, 0, batch.chunks, 0]);
        belt.finish();
        buffers.visible.reserve(gpu, u64::from(batch.chunks) * VISIBLE_BYTES);
        buffers.visibility.reserve(gpu, batch.samples * SAMPLE_BYTES);
        buffers.pixels.reserve(gpu, batch.pixels * 4);
        let of_towns = u64::from(maps.room_px()) * SHADOW_PX_BYTES;
        let of_bodies = batch.shadow_px * SHADOW_PX_BYTES;
        buffers.shadows.grow(gpu, of_towns + of_bodies, of_towns);
    }

    fn run(&self, encoder: &mut wgpu::CommandEncoder, kernel: Kernel, batch: &Batch<'_>) {
        let Self { buffers, models, kernels, .. } = self;
        let chunks = u64::from(batch.chunks);
        let mut bindings = vec![
            (1, buffers.placed.get().as_entire_binding()),
            (2, buffers.chunks.get().as_entire_binding()),
            (3, models.clusters.get().as_entire_binding()),
        ];
        if kernel != Kernel::Shade {
            bindings.push((0, buffers.targets.get().as_entire_binding()));
            bindings.push((5, buffers.found.get().as_entire_binding()));
        }
        if kernel != Kernel::Cull {
            bindings.push((6, models.triangles.get().as_entire_binding()));
            bindings.push((7, models.corners.get().as_entire_binding()));
            bindings.push((9, buffers.visibility.get().as_entire_binding()));
            bindings.push((10, buffers.shadows.get().as_entire_binding()));
        }
        let groups = match kernel {
            Kernel::Cull => {
                bindings.push((4, buffers.visible.get().as_entire_binding()));
                groups_of(chunks as u32)
            }
            Kernel::Small => {
                bindings.push((4, buffers.visible.get().as_entire_binding()));
                bindings.push((8, buffers.hidden.get().as_entire_binding()));
                bindings.push((11, buffers.large.get().as_entire_binding()));
                kernels.takers(chunks * 64)
            }
            Kernel::Large => {
                bindings.push((8, buffers.hidden.get().as_entire_binding()));
                bindings.push((11, buffers.large.get().as_entire_binding()));
                kernels.takers(u64::MAX)
            }
            Kernel::Shade => {
                bindings.push((4, buffers.views.get().as_entire_binding()));
                bindings.push((5, buffers.lamps.get().as_entire_binding()));
                bindings.push((8, buffers.occluders.get().as_entire_binding()));
                bindings.push((11, buffers.materials.get().as_entire_binding()));
                bindings.push((12, buffers.pixels.get().as_entire_binding()));
                [groups_of(batch.tiles_max)[0], batch.rows.views.len() as u32]
            }
        };
        kernels.run((&self.gpu, encoder), kernel, bindings, groups, self.timer.of(kernel));
    }

    /// Takes the pictures of a submission; how many blocks of large triangles it had.
    fn collect(
        &mut self,
        flight: InFlight,
        pictures: &[PlannedPicture<'_>],
        drawn: &mut Vec<Drawn>,
    ) -> Result<u64, String> {
        let Self { encoders, timer, .. } = self;
        self.ring.finish(&self.gpu, flight, |bytes| {
            let times = bytes.len() - TAIL_BYTES as usize..bytes.len() - FOUND_BYTES as usize;
            timer.add(bytes.get(times).unwrap_or_default());
            let found = bytes.last_chunk::<4>().copied().map_or(0, u32::from_le_bytes);
            let pictures = pictures.iter().collect();
            drawn.extend(in_parallel(encoders, pictures, |encoder, picture| {
                finished(picture, bytes, encoder)
            }));
            u64::from(found)
        })
    }
}

/// Writes the models of all plans and their chunks straight to where the device takes them from,
/// some plans each thread.
fn write_models<K: Send>(
    way: &mut Upload<'_>,
    (to_placed, to_chunks): (&mut Scratch, &mut Scratch),
    (batch, plans): (&Batch<'_>, &[Plan<'_>]),
    threads: &mut [K],
) {
    to_placed.reserve(way.gpu, u64::from(batch.placed) * PLACED_BYTES);
    to_chunks.reserve(way.gpu, u64::from(batch.chunks) * CHUNK_BYTES);
    let together = batch.spots.len().div_ceil(2 * threads.len()).max(PLANS_WRITTEN_MIN);
    let (mut first_placed, mut first_chunk) = (0, 0);
    let mut parts = Vec::new();
    for (spots, plans) in batch.spots.chunks(together).zip(plans.chunks(together)) {
        let placed: u64 = spots.iter().map(|spot| u64::from(spot.placed)).sum();
        let chunks: u64 = spots.iter().map(|spot| u64::from(spot.chunks)).sum();
        let own_placed = way.begin(to_placed, first_placed * PLACED_BYTES, placed * PLACED_BYTES);
        let own_chunks = way.begin(to_chunks, first_chunk * CHUNK_BYTES, chunks * CHUNK_BYTES);
        (first_placed, first_chunk) = (first_placed + placed, first_chunk + chunks);
        parts.push((spots, plans, own_placed, own_chunks));
    }
    in_parallel(threads, parts, |_, (spots, plans, placed, chunks)| {
        let all = || spots.iter().zip(plans);
        if let Some(mut view) = placed {
            let (rows, _) = view.slice(..).into_chunks::<{ PLACED_BYTES as usize }>();
            rows.write_iter(all().flat_map(|(spot, plan)| spot.placed(plan)).map(bytemuck::cast));
        }
        if let Some(mut view) = chunks {
            let (rows, _) = view.slice(..).into_chunks::<{ CHUNK_BYTES as usize }>();
            rows.write_iter(all().flat_map(|(spot, plan)| spot.chunks(plan)).map(bytemuck::cast));
        }
    });
}

fn finished(picture: &PlannedPicture<'_>, bytes: &[u8], encoder: &mut Encoder) -> Drawn {
    let range = picture.offset_bytes..picture.offset_bytes + picture.bytes;
    let bytes = bytes.get(range).unwrap_or_default();
    if picture.is_whole {
        let row_pitch_bytes = row_pitch_bytes(picture.camera.width_px) as usize;
        Drawn::Picture(encoder.encode(picture.camera, &Pixels { bytes, row_pitch_bytes }))
    } else {
        Drawn::Rows(bytes.to_vec())
    }
}
