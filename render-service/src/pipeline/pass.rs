//! The passes of one view: shadow map and colour, or geometry; then the copy of its pictures to
//! where they are read back.

use schemas::{DEPTH_MAX_M, SemanticTag};

use crate::scene::material::Family;

use super::batch::{Draw, PlannedPicture, PlannedView, Shadows};
use super::buffers::{FrameBuffers, GpuMesh, ShapeLibrary};
use super::pipelines::Pipelines;
use super::targets::{GeometryTarget, ShadowMap, Target};

/// What all pictures of a submission share.
pub(crate) struct Shared<'a> {
    pub(crate) pipelines: &'a Pipelines,
    pub(crate) shapes: &'a ShapeLibrary,
    pub(crate) frame: &'a FrameBuffers,
}

impl Shared<'_> {
    /// Records the shadows of the view with this number of the submission.
    pub(crate) fn shadow_pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        number: usize,
        shadows: &Shadows,
        town: &GpuMesh,
        map: &ShadowMap,
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow"),
            color_attachments: &[],
            depth_stencil_attachment: Some(depth(&map.depth, 1.0, wgpu::StoreOp::Store)),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(&self.pipelines.shadow);
        pass.set_bind_group(0, &self.frame.view_group, &[FrameBuffers::view_offset(number)]);
        pass.set_vertex_buffer(1, self.frame.instances.slice(..));
        bind(&mut pass, town);
        for range in &shadows.town {
            pass.draw_indexed(range.clone(), 0, 0..1);
        }
        self.draw_bodies(&mut pass, &shadows.bodies);
    }

    /// Records the colours of the view with this number of the submission.
    pub(crate) fn colour_pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        number: usize,
        view: &PlannedView<'_>,
        town: &GpuMesh,
        (map, target): (&ShadowMap, &Target),
    ) {
        let store =
            if target.resolved.is_some() { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("colour"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target.colour,
                depth_slice: None,
                resolve_target: target.resolved.as_ref(),
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store },
            })],
            depth_stencil_attachment: Some(depth(&target.depth, 0.0, wgpu::StoreOp::Discard)),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        let offset = [FrameBuffers::view_offset(number)];
        show_rows(&mut pass, view);
        pass.set_bind_group(0, &self.frame.view_group, &offset);
        pass.set_bind_group(1, &map.group, &[]);
        pass.set_vertex_buffer(1, self.frame.instances.slice(..));
        for (family, pipeline) in self.pipelines.surfaces() {
            pass.set_pipeline(pipeline);
            if family == Family::Body {
                self.draw_bodies(&mut pass, &view.bodies);
            }
            bind(&mut pass, town);
            for (_, range) in view.town.iter().filter(|(of, _)| *of == family) {
                pass.draw_indexed(range.clone(), 0, 0..1);
            }
        }
        // Last: only where nothing else is.
        pass.set_pipeline(&self.pipelines.sky);
        pass.draw(0..3, 0..1);
        if view.strip.light.rain > 0.0 {
            pass.set_pipeline(&self.pipelines.rain);
            pass.draw(0..3, 0..1);
        }
    }

    /// Records depth, labels and normals of the view with this number of the submission.
    pub(crate) fn geometry_pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        number: usize,
        view: &PlannedView<'_>,
        town: &GpuMesh,
        target: &GeometryTarget,
    ) {
        // The sky is what nothing is drawn over.
        let sky = [f64::from(DEPTH_MAX_M), f64::from(SemanticTag::Sky.number()), 0.0];
        let [depth_m, labels, normals] = &target.views;
        let attachments = [(depth_m, sky[0]), (labels, sky[1]), (normals, sky[2])];
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("geometry"),
            color_attachments: &attachments.map(|(view, cleared)| {
                let colour = wgpu::Color { r: cleared, ..wgpu::Color::TRANSPARENT };
                Some(wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(colour),
                        store: wgpu::StoreOp::Store,
                    },
                })
            }),
            depth_stencil_attachment: Some(depth(&target.depth, 0.0, wgpu::StoreOp::Discard)),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        show_rows(&mut pass, view);
        pass.set_pipeline(&self.pipelines.geometry);
        pass.set_bind_group(0, &self.frame.view_group, &[FrameBuffers::view_offset(number)]);
        pass.set_vertex_buffer(1, self.frame.instances.slice(..));
        self.draw_bodies(&mut pass, &view.bodies);
        bind(&mut pass, town);
        for (_, range) in &view.town {
            pass.draw_indexed(range.clone(), 0, 0..1);
        }
    }

    fn draw_bodies(&self, pass: &mut wgpu::RenderPass<'_>, draws: &[Draw]) {
        bind(pass, &self.shapes.mesh);
        for ((shape, detail), instances) in draws {
            pass.draw_indexed(self.shapes.indices_of(*shape, *detail), 0, instances.clone());
        }
    }
}

/// Leaves all rows but those of the strip as they are: a pixel that is drawn is the same whichever
/// rows are drawn with it, as nothing else of the pass depends on them.
fn show_rows(pass: &mut wgpu::RenderPass<'_>, view: &PlannedView<'_>) {
    let rows = &view.strip.rows;
    pass.set_scissor_rect(0, rows.start, view.strip.camera().width_px, rows.len() as u32);
}

/// Records the copy of the drawn rows of a picture, the first of which is this one, to their place
/// in the read-back buffer.
pub(crate) fn copy_out(
    encoder: &mut wgpu::CommandEncoder,
    (result, first_row): (&wgpu::Texture, u32),
    buffer: &wgpu::Buffer,
    picture: &PlannedPicture<'_>,
) {
    let layout = wgpu::TexelCopyBufferLayout {
        offset: picture.offset_bytes,
        bytes_per_row: Some(picture.row_pitch_bytes),
        rows_per_image: None,
    };
    encoder.copy_texture_to_buffer(
        wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x: 0, y: first_row, z: 0 },
            ..result.as_image_copy()
        },
        wgpu::TexelCopyBufferInfo { buffer, layout },
        wgpu::Extent3d { height: picture.row_count, ..result.size() },
    );
}

fn bind(pass: &mut wgpu::RenderPass<'_>, mesh: &GpuMesh) {
    pass.set_vertex_buffer(0, mesh.vertices.slice(..));
    pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
}

fn depth(
    view: &wgpu::TextureView,
    cleared: f32,
    store: wgpu::StoreOp,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(cleared), store }),
        stencil_ops: None,
    }
}
