//! Shaders, layouts and fixed-function state.

use bodies::{Instance, Vertex};

use crate::scene::material::Family;
use crate::shaders::{Pass, text_of};

use super::device::Gpu;

/// Colour targets: the GPU encodes sRGB on writing.
pub(crate) const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
/// Depth of pictures and shadow maps.
pub(crate) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Targets of the geometry pass: metres along the view, packed labels, packed normals.
pub(crate) const GEOMETRY: [wgpu::TextureFormat; 3] =
    [wgpu::TextureFormat::R32Float, wgpu::TextureFormat::R32Uint, wgpu::TextureFormat::R32Uint];

const VERTEX_ATTRIBUTES: [wgpu::VertexAttribute; 4] =
    wgpu::vertex_attr_array![0 => Float32x3, 1 => Sint16x4, 2 => Float32x2, 10 => Uint32];
const INSTANCE_ATTRIBUTES: [wgpu::VertexAttribute; 8] = wgpu::vertex_attr_array![
    3 => Float32x4, 4 => Float32x4, 5 => Float32x4,
    6 => Unorm8x4, 7 => Unorm8x4, 8 => Unorm8x4, 9 => Unorm8x4, 11 => Uint32
];

/// Everything that is compiled once per device.
pub(crate) struct Pipelines {
    pub(crate) shadow: wgpu::RenderPipeline,
    pub(crate) sky: wgpu::RenderPipeline,
    pub(crate) rain: wgpu::RenderPipeline,
    pub(crate) geometry: wgpu::RenderPipeline,
    surfaces: [(Family, wgpu::RenderPipeline); 3],
    /// Group 0: the view, at an offset, and the materials.
    pub(crate) view_layout: wgpu::BindGroupLayout,
    /// Group 1: the shadow map.
    pub(crate) shadow_layout: wgpu::BindGroupLayout,
    pub(crate) shadow_sampler: wgpu::Sampler,
}

impl Pipelines {
    /// **Cost:** 15 to 150 ms.
    pub(crate) fn new(gpu: &Gpu, sample_count: u32) -> Self {
        let view_layout = view_layout(&gpu.device);
        let shadow_layout = shadow_layout(&gpu.device);
        let layout_of = |groups: &[Option<&wgpu::BindGroupLayout>]| {
            gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: None,
                bind_group_layouts: groups,
                immediate_size: 0,
            })
        };
        let view_only = layout_of(&[Some(&view_layout)]);
        let with_shadow = layout_of(&[Some(&view_layout), Some(&shadow_layout)]);
        let surface = |family: Family| {
            (family, colour_pipeline(gpu, &with_shadow, Pass::Surface(family), sample_count))
        };
        Self {
            shadow: shadow_pipeline(&gpu.device, &view_only),
            sky: colour_pipeline(gpu, &view_only, Pass::Sky, sample_count),
            rain: colour_pipeline(gpu, &view_only, Pass::Rain, sample_count),
            geometry: geometry_pipeline(&gpu.device, &view_only),
            surfaces: Family::ALL.map(surface),
            shadow_sampler: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("shadow"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                compare: Some(wgpu::CompareFunction::LessEqual),
                ..wgpu::SamplerDescriptor::default()
            }),
            view_layout,
            shadow_layout,
        }
    }

    pub(crate) fn surfaces(&self) -> impl Iterator<Item = (Family, &wgpu::RenderPipeline)> {
        self.surfaces.iter().map(|(family, pipeline)| (*family, pipeline))
    }
}

fn view_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let uniform = |binding: u32, has_dynamic_offset: bool, visibility: wgpu::ShaderStages| {
        wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset,
                min_binding_size: None,
            },
            count: None,
        }
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("view"),
        entries: &[
            uniform(0, true, wgpu::ShaderStages::VERTEX_FRAGMENT),
            uniform(1, false, wgpu::ShaderStages::VERTEX),
        ],
    })
}

fn shadow_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding: u32, ty: wgpu::BindingType| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("shadow"),
        entries: &[
            entry(
                0,
                wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Depth,
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
            ),
            entry(1, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison)),
        ],
    })
}

fn vertex_buffers() -> [Option<wgpu::VertexBufferLayout<'static>>; 2] {
    [
        Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &VERTEX_ATTRIBUTES,
        }),
        Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<Instance>() as u64,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &INSTANCE_ATTRIBUTES,
        }),
    ]
}

fn module(device: &wgpu::Device, pass: Pass) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(text_of(pass).into()),
    })
}

fn colour_pipeline(
    gpu: &Gpu,
    layout: &wgpu::PipelineLayout,
    pass: Pass,
    sample_count: u32,
) -> wgpu::RenderPipeline {
    let module = module(&gpu.device, pass);
    let is_surface = matches!(pass, Pass::Surface(_));
    let cheap_shadow = [("CHEAP_SHADOW", if gpu.software { 1.0 } else { 0.0 })];
    let constants: &[(&str, f64)] = if is_surface { &cheap_shadow } else { &[] };
    let buffers = vertex_buffers();
    let in_front = pass == Pass::Rain;
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: if is_surface { &buffers } else { &[] },
        },
        primitive: wgpu::PrimitiveState {
            cull_mode: is_surface.then_some(wgpu::Face::Back),
            ..wgpu::PrimitiveState::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(is_surface),
            depth_compare: Some(if in_front {
                wgpu::CompareFunction::Always
            } else {
                wgpu::CompareFunction::GreaterEqual
            }),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState {
            count: sample_count,
            ..wgpu::MultisampleState::default()
        },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants,
                ..wgpu::PipelineCompilationOptions::default()
            },
            targets: &[Some(wgpu::ColorTargetState {
                blend: in_front.then_some(wgpu::BlendState::ALPHA_BLENDING),
                ..COLOUR.into()
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// One sample a pixel: labels cannot be mixed.
fn geometry_pipeline(device: &wgpu::Device, layout: &wgpu::PipelineLayout) -> wgpu::RenderPipeline {
    let module = module(device, Pass::Geometry);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("geometry"),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &vertex_buffers(),
        },
        primitive: wgpu::PrimitiveState {
            cull_mode: Some(wgpu::Face::Back),
            ..wgpu::PrimitiveState::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &GEOMETRY.map(|format| Some(format.into())),
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn shadow_pipeline(device: &wgpu::Device, layout: &wgpu::PipelineLayout) -> wgpu::RenderPipeline {
    let module = module(device, Pass::Shadow);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("shadow"),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &vertex_buffers(),
        },
        // Both sides throw shadows: houses are open below and above for the sun.
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::LessEqual),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState { constant: 2, slope_scale: 1.5, clamp: 0.0 },
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: None,
        multiview_mask: None,
        cache: None,
    })
}
