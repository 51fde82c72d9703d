//! Textures that are drawn into: per picture size, and shadow maps per side.

use std::num::NonZeroUsize;

use lru::LruCache;

use super::device::Gpu;
use super::pipelines::{COLOUR, DEPTH, GEOMETRY, Pipelines};

/// Picture sizes kept; a picture of another size takes the place of the one longest unused.
const SIZES_MAX: NonZeroUsize = NonZeroUsize::new(8).unwrap();
/// Shadow map sides kept: see [`shadow_side_px`](crate::scene::shadow::shadow_side_px).
const SHADOW_MAPS_MAX: NonZeroUsize = NonZeroUsize::new(4).unwrap();

/// Where one picture is drawn. Pictures of one size follow each other in it.
pub(crate) struct Target {
    /// What the passes write.
    pub(crate) colour: wgpu::TextureView,
    /// What is read back, if it is not the colour itself.
    pub(crate) resolved: Option<wgpu::TextureView>,
    pub(crate) result: wgpu::Texture,
    pub(crate) depth: wgpu::TextureView,
}

/// Where the geometry of one picture size is drawn.
pub(crate) struct GeometryTarget {
    /// What the pass writes and what is read back, at the places of [`GEOMETRY`].
    pub(crate) results: [wgpu::Texture; 3],
    pub(crate) views: [wgpu::TextureView; 3],
    pub(crate) depth: wgpu::TextureView,
}

/// Depth as the sun sees it.
#[derive(Clone)]
pub(crate) struct ShadowMap {
    /// What was drawn there last, once the commands that are recorded have been carried out.
    shows: Option<u64>,
    pub(crate) depth: wgpu::TextureView,
    pub(crate) group: wgpu::BindGroup,
}

/// Targets in use, by size or side.
pub(crate) struct Targets {
    sample_count: u32,
    pictures: LruCache<(u32, u32), Target>,
    geometry: LruCache<(u32, u32), GeometryTarget>,
    shadows: LruCache<u32, ShadowMap>,
}

impl Targets {
    pub(crate) fn new(sample_count: u32) -> Self {
        Self {
            sample_count,
            pictures: LruCache::new(SIZES_MAX),
            geometry: LruCache::new(SIZES_MAX),
            shadows: LruCache::new(SHADOW_MAPS_MAX),
        }
    }

    /// Makes sure that there is a target of this size.
    pub(crate) fn picture(&mut self, gpu: &Gpu, size_px: (u32, u32)) -> &Target {
        self.pictures.get_or_insert(size_px, || Target::new(gpu, size_px, self.sample_count))
    }

    /// Makes sure that there is a target for geometry of this size.
    pub(crate) fn geometry(&mut self, gpu: &Gpu, size_px: (u32, u32)) -> &GeometryTarget {
        self.geometry.get_or_insert(size_px, || GeometryTarget::new(gpu, size_px))
    }

    /// Makes sure that there is a shadow map of this side, for shadows of this number; and whether
    /// it shows them already.
    pub(crate) fn shadow(
        &mut self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        (side_px, shadows_of): (u32, u64),
    ) -> (ShadowMap, bool) {
        let new = || ShadowMap::new(gpu, pipelines, side_px);
        let map = self.shadows.get_or_insert_mut(side_px, new);
        let is_drawn = map.shows.replace(shadows_of) == Some(shadows_of);
        (map.clone(), is_drawn)
    }
}

impl Target {
    fn new(gpu: &Gpu, size_px: (u32, u32), sample_count: u32) -> Self {
        let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let result = texture(gpu, size_px, COLOUR, 1, attachment | wgpu::TextureUsages::COPY_SRC);
        let result_view = view(&result);
        let (colour, resolved) = if sample_count > 1 {
            (view(&texture(gpu, size_px, COLOUR, sample_count, attachment)), Some(result_view))
        } else {
            (result_view, None)
        };
        let depth = view(&texture(gpu, size_px, DEPTH, sample_count, attachment));
        Self { colour, resolved, result, depth }
    }
}

impl GeometryTarget {
    fn new(gpu: &Gpu, size_px: (u32, u32)) -> Self {
        let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let usage = attachment | wgpu::TextureUsages::COPY_SRC;
        let results = GEOMETRY.map(|format| texture(gpu, size_px, format, 1, usage));
        let views = results.each_ref().map(view);
        let depth = view(&texture(gpu, size_px, DEPTH, 1, attachment));
        Self { results, views, depth }
    }
}

impl ShadowMap {
    fn new(gpu: &Gpu, pipelines: &Pipelines, side_px: u32) -> Self {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
        let depth = view(&texture(gpu, (side_px, side_px), DEPTH, 1, usage));
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shadow"),
            layout: &pipelines.shadow_layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&depth),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::Sampler(&pipelines.shadow_sampler),
                },
            ],
        });
        Self { shows: None, depth, group }
    }
}

fn texture(
    gpu: &Gpu,
    (width, height): (u32, u32),
    format: wgpu::TextureFormat,
    sample_count: u32,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
