//! A graphics pipeline, and what it draws on.

use std::error::Error;

use nalgebra::Matrix4;
use schemas::Camera;
use wgpu::util::{BufferInitDescriptor, DeviceExt as _};

use crate::street::{Corner, Triangles};

/// Nearest thing that is drawn, as in our pictures.
const NEAR_M: f32 = 0.08;
const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Bytes of a row that is read back are a multiple of this, and so are places of matrices.
const ALIGNED_BYTES: u32 = 256;

const SHADER: &str = "
@group(0) @binding(0) var<uniform> clip_from_world: mat4x4<f32>;

struct Shown {
    @builtin(position) place: vec4<f32>,
    @location(0) @interpolate(flat) colour: vec4<f32>,
}

@vertex
fn placed(@location(0) place_m: vec3<f32>, @location(1) colour: vec4<f32>) -> Shown {
    return Shown(clip_from_world * vec4<f32>(place_m, 1.0), colour);
}

@fragment
fn coloured(shown: Shown) -> @location(0) vec4<f32> {
    return shown.colour;
}
";

/// Triangles on the device.
pub(crate) struct Mesh {
    corners: wgpu::Buffer,
    indices: wgpu::Buffer,
    pub(crate) count: u32,
}

pub(crate) fn mesh_of(device: &wgpu::Device, (corners, indices): &Triangles) -> Mesh {
    let buffer = |contents: &[u8], usage: wgpu::BufferUsages| {
        device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
    };
    Mesh {
        corners: buffer(bytemuck::cast_slice(corners), wgpu::BufferUsages::VERTEX),
        indices: buffer(bytemuck::cast_slice(indices), wgpu::BufferUsages::INDEX),
        count: indices.len() as u32,
    }
}

pub(crate) fn pipeline(device: &wgpu::Device) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(SHADER.into()),
    });
    let entry = wgpu::BindGroupLayoutEntry {
        binding: 0,
        visibility: wgpu::ShaderStages::VERTEX,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: true,
            min_binding_size: None,
        },
        count: None,
    };
    let group = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[entry],
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&group)],
        immediate_size: 0,
    });
    let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Unorm8x4];
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Corner>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &attributes,
            })],
        },
        primitive: wgpu::PrimitiveState {
            cull_mode: Some(wgpu::Face::Back),
            ..wgpu::PrimitiveState::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(COLOUR.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// From the world to a cube, -1 to 1 to the right and up; depth falls from 1 at the nearest.
fn clip_from_world(camera: &Camera) -> Matrix4<f32> {
    let half_width = (camera.horizontal_fov_rad / 2.0).tan();
    let half_height = half_width * camera.height_px as f32 / camera.width_px as f32;
    #[rustfmt::skip]
    let clip_from_camera = Matrix4::new(
        0.0, -1.0 / half_width, 0.0, 0.0,
        0.0, 0.0, 1.0 / half_height, 0.0,
        0.0, 0.0, 0.0, NEAR_M,
        1.0, 0.0, 0.0, 0.0,
    );
    clip_from_camera * camera.carrier_from_camera.inverse().to_homogeneous()
}

/// What some pictures of one size are drawn on.
pub(crate) struct Pass {
    pub(crate) size_px: (u32, u32),
    pub(crate) row_bytes: u32,
    colours: wgpu::Texture,
    layers: Vec<wgpu::TextureView>,
    depth: wgpu::TextureView,
    group: wgpu::BindGroup,
    read: wgpu::Buffer,
}

impl Pass {
    pub(crate) fn new(
        device: &wgpu::Device,
        pipeline: &wgpu::RenderPipeline,
        (cameras, size_px): (&[&Camera], (u32, u32)),
    ) -> Self {
        let count = cameras.len() as u32;
        let texture = |format, depth_or_array_layers, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: size_px.0, height: size_px.1, depth_or_array_layers },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let colours = texture(COLOUR, count, wgpu::TextureUsages::COPY_SRC);
        let depth = texture(DEPTH, 1, wgpu::TextureUsages::empty());
        let layer = |at| {
            colours.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: at,
                array_layer_count: Some(1),
                ..wgpu::TextureViewDescriptor::default()
            })
        };
        let mut matrices = Vec::new();
        for camera in cameras {
            matrices.extend_from_slice(bytemuck::cast_slice(clip_from_world(camera).as_slice()));
            matrices.resize(matrices.len().next_multiple_of(ALIGNED_BYTES as usize), 0);
        }
        let matrices = device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents: &matrices,
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                    buffer: &matrices,
                    offset: 0,
                    size: std::num::NonZeroU64::new(size_of::<Matrix4<f32>>() as u64),
                }),
            }],
        });
        let row_bytes = (size_px.0 * 4).next_multiple_of(ALIGNED_BYTES);
        let read = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row_bytes * size_px.1 * count),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let layers = (0..count).map(layer).collect();
        let depth = depth.create_view(&wgpu::TextureViewDescriptor::default());
        Self { size_px, row_bytes, layers, colours, depth, group, read }
    }

    /// Draws all and gives their rows, one picture below the other.
    pub(crate) fn draw(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        pipeline: &wgpu::RenderPipeline,
        (town, worlds): (&Mesh, &[Mesh]),
    ) -> Result<Vec<u8>, Box<dyn Error>> {
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for (at, (layer, bodies)) in self.layers.iter().zip(worlds).enumerate() {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: None,
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: layer,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::WHITE),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &self.depth,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0.0),
                        store: wgpu::StoreOp::Discard,
                    }),
                    stencil_ops: None,
                }),
                timestamp_writes: None,
                occlusion_query_set: None,
                multiview_mask: None,
            });
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &self.group, &[at as u32 * ALIGNED_BYTES]);
            for mesh in [bodies, town] {
                pass.set_vertex_buffer(0, mesh.corners.slice(..));
                pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..mesh.count, 0, 0..1);
            }
        }
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(self.row_bytes),
            rows_per_image: Some(self.size_px.1),
        };
        let to = wgpu::TexelCopyBufferInfo { buffer: &self.read, layout };
        encoder.copy_texture_to_buffer(self.colours.as_image_copy(), to, self.colours.size());
        queue.submit([encoder.finish()]);
        self.read.slice(..).map_async(wgpu::MapMode::Read, |_| ());
        device.poll(wgpu::PollType::wait_indefinitely())?;
        let pixels = self.read.slice(..).get_mapped_range()?.to_vec();
        self.read.unmap();
        Ok(pixels)
    }
}
