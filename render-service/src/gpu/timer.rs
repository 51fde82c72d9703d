//! How long each kernel runs on the device.

use std::time::Duration;

use super::adapter::Gpu;
use super::shaders::Kernel;

/// Beginning and end of each kernel.
const STAMPS: u32 = 2 * Kernel::ALL.len() as u32;
/// Bytes that a submission's times take.
pub(crate) const TIMES_BYTES: u64 = STAMPS as u64 * 8;

/// Notes when kernels begin and end, if the device can.
pub(crate) struct Timer {
    device: Option<Stamps>,
    sums: [Duration; Kernel::ALL.len()],
}

struct Stamps {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    nanos: f64,
}

impl Timer {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let has = gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        let device = has.then(|| Stamps {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("times"),
                ty: wgpu::QueryType::Timestamp,
                count: STAMPS,
            }),
            resolved: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("times"),
                size: TIMES_BYTES,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            nanos: f64::from(gpu.queue.get_timestamp_period()),
        });
        Self { device, sums: Default::default() }
    }

    /// What a kernel's pass notes.
    pub(crate) fn of(&self, kernel: Kernel) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let first = 2 * kernel as u32;
        self.device.as_ref().map(|stamps| wgpu::ComputePassTimestampWrites {
            query_set: &stamps.queries,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    /// Records the copy of a submission's times to where they are read back.
    pub(crate) fn copy(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        to: &wgpu::Buffer,
        offset_bytes: u64,
    ) {
        if let Some(stamps) = &self.device {
            encoder.resolve_query_set(&stamps.queries, 0..STAMPS, &stamps.resolved, 0);
            encoder.copy_buffer_to_buffer(&stamps.resolved, 0, to, offset_bytes, TIMES_BYTES);
        }
    }

    /// Adds the times of a submission that is done.
    pub(crate) fn add(&mut self, bytes: &[u8]) {
        let Some(stamps) = &self.device else { return };
        let ticks = bytes.as_chunks::<8>().0.iter().map(|bytes| u64::from_le_bytes(*bytes));
        let ticks: Vec<u64> = ticks.collect();
        for (sum, ends) in self.sums.iter_mut().zip(ticks.as_chunks::<2>().0) {
            let nanos = ends[1].saturating_sub(ends[0]) as f64 * stamps.nanos;
            *sum += Duration::from_nanos(nanos as u64);
        }
    }

    /// What all kernels took since the device was opened; `None` if it does not tell.
    pub(crate) fn sums(&self) -> Option<[(&'static str, Duration); Kernel::ALL.len()]> {
        self.device.as_ref()?;
        Some(Kernel::ALL.map(|kernel| {
            let sum = self.sums.get(kernel as usize).copied().unwrap_or_default();
            (kernel.name(), sum)
        }))
    }
}
