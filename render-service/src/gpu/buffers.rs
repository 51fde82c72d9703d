//! Buffers on the device that grow.

use std::num::NonZeroU64;

use super::adapter::Gpu;

/// The kernels' use of a buffer, and what writes it.
const USAGE: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE
    .union(wgpu::BufferUsages::COPY_DST)
    .union(wgpu::BufferUsages::COPY_SRC);
/// No buffer is smaller.
const BYTES_MIN: u64 = 4_096;

/// A buffer whose content counts for one submission.
pub(crate) struct Scratch {
    label: &'static str,
    buffer: wgpu::Buffer,
}

impl Scratch {
    pub(crate) fn new(gpu: &Gpu, label: &'static str) -> Self {
        Self { label, buffer: new_buffer(gpu, label, BYTES_MIN) }
    }

    /// Makes sure that it has room for so many bytes.
    pub(crate) fn reserve(&mut self, gpu: &Gpu, bytes: u64) {
        if bytes > self.buffer.size() {
            let most = gpu.binding_bytes_max();
            self.buffer = new_buffer(gpu, self.label, bytes.next_power_of_two().min(most));
        }
    }

    /// As [`Self::reserve`], without losing the first so many bytes.
    pub(crate) fn grow(&mut self, gpu: &Gpu, bytes: u64, kept_bytes: u64) {
        let kept_bytes = kept_bytes.min(self.buffer.size());
        let old = self.buffer.clone();
        self.reserve(gpu, bytes);
        if self.buffer != old {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&old, 0, &self.buffer, 0, kept_bytes);
            gpu.queue.submit([encoder.finish()]);
        }
    }

    /// Makes sure that it has these rows and nothing else.
    pub(crate) fn fill<T: bytemuck::Pod>(&mut self, gpu: &Gpu, rows: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(rows);
        self.reserve(gpu, bytes.len() as u64);
        gpu.queue.write_buffer(&self.buffer, 0, bytes);
    }

    pub(crate) fn get(&self) -> &wgpu::Buffer {
        &self.buffer
    }
}

/// How a submission's rows come to the device.
pub(crate) struct Upload<'a> {
    pub(crate) gpu: &'a Gpu,
    pub(crate) encoder: &'a mut wgpu::CommandEncoder,
    pub(crate) belt: &'a mut wgpu::util::StagingBelt,
}

impl Upload<'_> {
    /// Writes rows from the beginning of a buffer on.
    pub(crate) fn write<T: bytemuck::Pod>(&mut self, to: &mut Scratch, rows: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(rows);
        to.reserve(self.gpu, bytes.len() as u64);
        if let Some(mut view) = self.begin(to, 0, bytes.len() as u64) {
            view.copy_from_slice(bytes);
        }
    }

    /// What will be so many bytes of a buffer from an offset on, to be written and dropped before
    /// the submission; `None` for no bytes, and where the device has no memory for them.
    pub(crate) fn begin(
        &mut self,
        to: &Scratch,
        offset_bytes: u64,
        bytes: u64,
    ) -> Option<wgpu::BufferViewMut> {
        let size = NonZeroU64::new(bytes)?;
        let piece = self.belt.allocate(size, NonZeroU64::MIN);
        self.encoder.copy_buffer_to_buffer(
            piece.buffer(),
            piece.offset(),
            &to.buffer,
            offset_bytes,
            bytes,
        );
        // A device without memory gives none; the submission tells it.
        piece.get_mapped_range_mut().ok()
    }
}

/// Rows that are added to and stay.
pub(crate) struct Kept {
    label: &'static str,
    buffer: wgpu::Buffer,
    used_bytes: u64,
}

impl Kept {
    pub(crate) fn new(gpu: &Gpu, label: &'static str) -> Self {
        Self { label, buffer: new_buffer(gpu, label, BYTES_MIN), used_bytes: 0 }
    }

    /// Adds rows behind the others and gives the number of the first one.
    pub(crate) fn push<T: bytemuck::Pod>(&mut self, gpu: &Gpu, rows: &[T]) -> u32 {
        let bytes: &[u8] = bytemuck::cast_slice(rows);
        let end = self.used_bytes + bytes.len() as u64;
        if end > self.buffer.size() {
            let larger = new_buffer(gpu, self.label, end.next_power_of_two());
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&self.buffer, 0, &larger, 0, self.used_bytes);
            gpu.queue.submit([encoder.finish()]);
            self.buffer = larger;
        }
        gpu.queue.write_buffer(&self.buffer, self.used_bytes, bytes);
        let first = self.used_bytes / size_of::<T>() as u64;
        self.used_bytes = end;
        first as u32
    }

    /// Forgets the rows from this byte on.
    pub(crate) fn truncate(&mut self, bytes: u64) {
        self.used_bytes = self.used_bytes.min(bytes);
    }

    pub(crate) fn used_bytes(&self) -> u64 {
        self.used_bytes
    }

    pub(crate) fn get(&self) -> &wgpu::Buffer {
        &self.buffer
    }
}

fn new_buffer(gpu: &Gpu, label: &'static str, bytes: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.max(BYTES_MIN),
        usage: USAGE,
        mapped_at_creation: false,
    })
}
