//! The ring of buffers through which pictures come back.

use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use super::adapter::Gpu;

/// Submissions under way at once: one is drawn while the one before is encoded.
pub(crate) const RING: usize = 2;
/// A submission that takes longer means that the device hangs. The largest legal one takes seconds
/// on a software adapter that shares its processor.
const DRAW_DEADLINE: Duration = Duration::from_secs(60);

/// Buffers of the ring, kept for the next submission.
#[derive(Default)]
pub(crate) struct Ring {
    free: Vec<wgpu::Buffer>,
}

/// A submission whose pictures are on their way.
pub(crate) struct InFlight {
    buffer: wgpu::Buffer,
    submission: wgpu::SubmissionIndex,
    mapped: Receiver<Result<(), wgpu::BufferAsyncError>>,
}

impl Ring {
    /// A buffer of at least this size.
    pub(crate) fn take(&mut self, gpu: &Gpu, bytes: u64) -> wgpu::Buffer {
        match self.free.iter().position(|buffer| buffer.size() >= bytes) {
            Some(at) => self.free.swap_remove(at),
            None => gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("readback"),
                size: bytes.next_power_of_two(),
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            }),
        }
    }

    fn give_back(&mut self, buffer: wgpu::Buffer) {
        if self.free.len() >= RING {
            self.free.remove(0);
        }
        self.free.push(buffer);
    }

    /// Waits for a submission and shows its bytes to `read`.
    ///
    /// # Errors
    /// What went wrong with the device; it is of no use afterwards.
    pub(crate) fn finish<R>(
        &mut self,
        gpu: &Gpu,
        flight: InFlight,
        read: impl FnOnce(&[u8]) -> R,
    ) -> Result<R, String> {
        let InFlight { buffer, submission, mapped } = flight;
        let wait = wgpu::PollType::Wait {
            submission_index: Some(submission),
            timeout: Some(DRAW_DEADLINE),
        };
        gpu.device.poll(wait).map_err(|cause| gpu.fault().unwrap_or_else(|| cause.to_string()))?;
        if let Some(fault) = gpu.fault() {
            return Err(fault);
        }
        match mapped.try_recv() {
            Ok(Ok(())) => {}
            Ok(Err(cause)) => return Err(cause.to_string()),
            Err(_) => return Err("the pictures were drawn but not handed over".to_owned()),
        }
        let result = {
            let view = buffer.slice(..).get_mapped_range().map_err(|cause| cause.to_string())?;
            read(&view)
        };
        buffer.unmap();
        self.give_back(buffer);
        Ok(result)
    }
}

impl InFlight {
    /// Submits, and asks for the buffer's content.
    pub(crate) fn submit(gpu: &Gpu, encoder: wgpu::CommandEncoder, buffer: wgpu::Buffer) -> Self {
        let submission = gpu.queue.submit([encoder.finish()]);
        let (sender, mapped) = channel();
        buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
            // Nobody listens any more when the device was given up meanwhile.
            let _ = sender.send(result);
        });
        Self { buffer, submission, mapped }
    }
}
