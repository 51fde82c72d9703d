//! Buffers on the device: the library of shapes, and what is written anew for every submission.

use bodies::{Detail, Instance, Shape};

use crate::scene::material;

use super::device::Gpu;
use super::uniform::ViewUniform;

/// Views of one submission.
pub(crate) const VIEWS_PER_BATCH_MAX: usize = 64;
/// Distance of two views in the view buffer, in bytes: the device's alignment of offsets.
const VIEW_STRIDE_BYTES: u64 = 6_656;
const _: () = assert!(size_of::<ViewUniform>() <= VIEW_STRIDE_BYTES as usize);

/// Indexed triangles on the device.
pub(crate) struct GpuMesh {
    pub(crate) vertices: wgpu::Buffer,
    pub(crate) indices: wgpu::Buffer,
}

impl GpuMesh {
    pub(crate) fn new(gpu: &Gpu, vertices: &[u8], indices: &[u32]) -> Self {
        Self {
            vertices: filled(gpu, vertices, wgpu::BufferUsages::VERTEX),
            indices: filled(gpu, bytemuck::cast_slice(indices), wgpu::BufferUsages::INDEX),
        }
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.vertices.size() + self.indices.size()
    }
}

/// A buffer with this content; never empty, as an empty one cannot be bound.
fn filled(gpu: &Gpu, content: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: (content.len() as u64).max(4).next_multiple_of(4),
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, content);
    buffer
}

/// All shapes in one mesh.
pub(crate) struct ShapeLibrary {
    pub(crate) mesh: GpuMesh,
    /// Indices of every shape, at the place of its number: fine, then coarse.
    ranges: Vec<[std::ops::Range<u32>; 2]>,
}

impl ShapeLibrary {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let (mut vertices, mut indices, mut ranges) = (Vec::new(), Vec::<u32>::new(), Vec::new());
        for shape in Shape::ALL {
            ranges.push([Detail::Fine, Detail::Coarse].map(|detail| {
                let mesh = shape.mesh_at(detail);
                let (first_vertex, start) = (vertices.len() as u32, indices.len() as u32);
                vertices.extend(mesh.vertices);
                indices.extend(mesh.indices.iter().map(|index| first_vertex + index));
                start..indices.len() as u32
            }));
        }
        Self { mesh: GpuMesh::new(gpu, bytemuck::cast_slice(&vertices), &indices), ranges }
    }

    pub(crate) fn indices_of(&self, shape: Shape, detail: Detail) -> std::ops::Range<u32> {
        let details =
            self.ranges.get(shape as usize).and_then(|details| details.get(detail as usize));
        details.cloned().unwrap_or_default()
    }
}

/// Views and instances of one submission.
pub(crate) struct FrameBuffers {
    views: wgpu::Buffer,
    pub(crate) view_group: wgpu::BindGroup,
    pub(crate) instances: wgpu::Buffer,
}

impl FrameBuffers {
    pub(crate) fn new(gpu: &Gpu, view_layout: &wgpu::BindGroupLayout) -> Self {
        let views = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("views"),
            size: VIEW_STRIDE_BYTES * VIEWS_PER_BATCH_MAX as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let table = material::table();
        let materials = filled(gpu, bytemuck::cast_slice(&table), wgpu::BufferUsages::UNIFORM);
        let view_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("view"),
            layout: view_layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                        buffer: &views,
                        offset: 0,
                        size: std::num::NonZeroU64::new(size_of::<ViewUniform>() as u64),
                    }),
                },
                wgpu::BindGroupEntry { binding: 1, resource: materials.as_entire_binding() },
            ],
        });
        let instances = filled(gpu, &[0; 64 * 256], wgpu::BufferUsages::VERTEX);
        Self { views, view_group, instances }
    }

    /// Offset of a view, for binding.
    pub(crate) fn view_offset(number: usize) -> u32 {
        (number as u64 * VIEW_STRIDE_BYTES) as u32
    }

    pub(crate) fn write(&mut self, gpu: &Gpu, views: &[ViewUniform], instances: &[Instance]) {
        let mut bytes = vec![0; views.len() * VIEW_STRIDE_BYTES as usize];
        for (slot, view) in bytes.chunks_mut(VIEW_STRIDE_BYTES as usize).zip(views) {
            let view = bytemuck::bytes_of(view);
            if let Some(slot) = slot.get_mut(..view.len()) {
                slot.copy_from_slice(view);
            }
        }
        gpu.queue.write_buffer(&self.views, 0, &bytes);
        let content: &[u8] = bytemuck::cast_slice(instances);
        if content.len() as u64 > self.instances.size() {
            let room = vec![0; content.len().next_power_of_two()];
            self.instances = filled(gpu, &room, wgpu::BufferUsages::VERTEX);
        }
        gpu.queue.write_buffer(&self.instances, 0, content);
    }
}
