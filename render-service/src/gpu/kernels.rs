//! The kernels as pipelines, and how they are run.

use super::adapter::Gpu;
use super::shaders::Kernel;

/// Workgroups along one side of a dispatch.
const GROUPS_MAX: u32 = 65_535;
/// Workgroups that take their work from a list, on a GPU and in software.
const TAKERS: u32 = 4_096;
const TAKERS_SOFTWARE: u32 = 64;

/// What a kernel reads and writes, by the numbers of its texts.
pub(crate) type Bindings<'a> = Vec<(u32, wgpu::BindingResource<'a>)>;

/// All of them.
pub(crate) struct Kernels {
    pipelines: [wgpu::ComputePipeline; Kernel::ALL.len()],
    takers: u32,
}

impl Kernels {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let pipelines = Kernel::ALL.map(|kernel| {
            let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(kernel.name()),
                source: wgpu::ShaderSource::Wgsl(kernel.text().into()),
            });
            gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(kernel.name()),
                layout: None,
                module: &module,
                entry_point: Some(kernel.name()),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            })
        });
        let takers = if gpu.software { TAKERS_SOFTWARE } else { TAKERS };
        Self { pipelines, takers }
    }

    /// Workgroups that take so many pieces of work from a list.
    pub(crate) fn takers(&self, most: u64) -> [u32; 2] {
        [(u64::from(self.takers).min(most).max(1)) as u32, 1]
    }

    /// Records a kernel.
    pub(crate) fn run(
        &self,
        (gpu, encoder): (&Gpu, &mut wgpu::CommandEncoder),
        kernel: Kernel,
        bindings: Bindings<'_>,
        [across, down]: [u32; 2],
        timestamps: Option<wgpu::ComputePassTimestampWrites<'_>>,
    ) {
        let Some(pipeline) = self.pipelines.get(kernel as usize) else { return };
        let entries: Vec<wgpu::BindGroupEntry<'_>> = bindings
            .into_iter()
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(kernel.name()),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(kernel.name()),
            timestamp_writes: timestamps,
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(across, down, 1);
    }
}

/// Workgroups for so many, in two dimensions as one has no room for them.
pub(crate) fn groups_of(count: u32) -> [u32; 2] {
    let across = count.clamp(1, GROUPS_MAX);
    [across, count.div_ceil(across).max(1)]
}
