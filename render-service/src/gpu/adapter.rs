//! Opening an adapter, and noticing when it is lost.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::RenderError;

/// Which adapter draws.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// A GPU if there is one, else processors.
    #[default]
    Best,
    /// Processors, without Vulkan.
    Software,
    /// The first Vulkan adapter whose name contains this text, without regard to case; also
    /// software, such as Mesa's `llvmpipe`.
    Named(String),
}

impl AdapterChoice {
    /// `cpu` for processors, other text for a part of the name.
    pub fn parse(text: &str) -> Self {
        match text {
            "" => Self::Best,
            "cpu" => Self::Software,
            name => Self::Named(name.to_owned()),
        }
    }

    /// Whether what it names is there.
    ///
    /// # Errors
    /// [`RenderError::NoAdapter`].
    pub fn check(&self) -> Result<(), RenderError> {
        match self {
            Self::Named(_) => {
                let _opening = one_at_a_time();
                find(self).map(drop)
            }
            Self::Best | Self::Software => Ok(()),
        }
    }

    fn accepts(&self, info: &wgpu::AdapterInfo) -> bool {
        match self {
            Self::Best => !is_software(info),
            Self::Software => false,
            Self::Named(part) => info.name.to_lowercase().contains(&part.to_lowercase()),
        }
    }

    fn wanted(&self) -> String {
        match self {
            Self::Best => "a GPU".to_owned(),
            Self::Software => "no Vulkan adapter".to_owned(),
            Self::Named(part) => format!("a Vulkan adapter named {part:?}"),
        }
    }
}

/// What the kernels need.
const FEATURES: wgpu::Features =
    wgpu::Features::SHADER_INT64.union(wgpu::Features::SHADER_INT64_ATOMIC_MIN_MAX);
/// Buffers of one kernel.
const BINDINGS_MAX: u32 = 13;
/// No buffer of ours is larger, whatever the device binds.
const BINDING_BYTES_MAX: u64 = 2 << 30;

/// An open device.
pub(crate) struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    /// The adapter's own name.
    pub(crate) adapter_name: String,
    /// Drawn by the processor: cheap filters are chosen.
    pub(crate) software: bool,
    pub(crate) has_own_memory: bool,
    fault: Fault,
}

/// The first thing that went wrong with a device; everything after it is a consequence.
#[derive(Clone, Default)]
struct Fault(Arc<Mutex<Option<First>>>);

#[derive(Clone)]
struct First {
    what: String,
    is_lack_of_memory: bool,
}

impl Fault {
    fn note(&self, what: String, is_lack_of_memory: bool) {
        // Nothing panics while it holds the lock.
        let mut first = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        first.get_or_insert(First { what, is_lack_of_memory });
    }

    fn get(&self) -> Option<First> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// What wgpu says of a device that it gives up as there is no memory.
const OUT_OF_MEMORY: &str = "Out of memory";

static OPENING: Mutex<()> = Mutex::new(());

/// Whoever opens or closes a device holds this meanwhile: NVIDIA's driver for Linux is not safe
/// where threads make and drop instances at once (<https://github.com/gfx-rs/wgpu/issues/5930>).
pub(crate) fn one_at_a_time() -> MutexGuard<'static, ()> {
    OPENING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Environment of a renderer's process: Mesa's layer that orders devices looks for a display and
/// prints an error where there is none.
pub const NO_DISPLAY: (&str, &str) = ("NODEVICE_SELECT", "1");

fn find(choice: &AdapterChoice) -> Result<wgpu::Adapter, RenderError> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
    // A stable order by preference: the driver's own order decides among equals.
    adapters.sort_by_key(|adapter| preference(&adapter.get_info()));
    let found: Vec<String> = adapters.iter().map(|adapter| adapter.get_info().name).collect();
    adapters.into_iter().find(|adapter| choice.accepts(&adapter.get_info())).ok_or_else(|| {
        RenderError::NoAdapter {
            wanted: choice.wanted(),
            found: if found.is_empty() { "none".to_owned() } else { found.join(", ") },
        }
    })
}

impl Gpu {
    /// **Cost:** 65 to 300 ms.
    ///
    /// # Errors
    /// [`RenderError::NoAdapter`], [`RenderError::NoDevice`].
    pub(crate) fn open(choice: &AdapterChoice) -> Result<Self, RenderError> {
        Self::open_device(&find(choice)?)
    }

    fn open_device(adapter: &wgpu::Adapter) -> Result<Self, RenderError> {
        let info = adapter.get_info();
        if !adapter.features().contains(FEATURES) {
            return Err(RenderError::NoDevice {
                adapter: info.name,
                cause:
                    "it cannot compare whole numbers of 64 bits in shared memory, which drawing \
                        needs (VK_KHR_shader_atomic_int64)"
                        .to_owned(),
            });
        }
        let limits = adapter.limits();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("causeway"),
            required_features: FEATURES | (adapter.features() & wgpu::Features::TIMESTAMP_QUERY),
            required_limits: wgpu::Limits {
                max_buffer_size: limits.max_buffer_size,
                max_storage_buffer_binding_size: limits.max_storage_buffer_binding_size,
                max_storage_buffers_per_shader_stage: BINDINGS_MAX,
                ..wgpu::Limits::default()
            },
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|cause| {
                RenderError::NoDevice { adapter: info.name.clone(), cause: cause.to_string() }
            })?;
        // Both are needed: a loss comes through the one, each later use through the other, whose
        // default is a panic.
        let fault = Fault::default();
        device.set_device_lost_callback({
            let fault = fault.clone();
            move |reason, text| {
                let is_lack_of_memory = text.contains(OUT_OF_MEMORY);
                fault.note(format!("device lost ({reason:?}): {text}"), is_lack_of_memory);
            }
        });
        device.on_uncaptured_error(Arc::new({
            let fault = fault.clone();
            move |error: wgpu::Error| {
                let is_lack_of_memory = matches!(error, wgpu::Error::OutOfMemory { .. });
                fault.note(error.to_string(), is_lack_of_memory);
            }
        }));
        let software = is_software(&info);
        let has_own_memory = info.device_type == wgpu::DeviceType::DiscreteGpu;
        Ok(Self { device, queue, adapter_name: info.name, software, has_own_memory, fault })
    }

    /// Bytes that a kernel can be given of one buffer.
    pub(crate) fn binding_bytes_max(&self) -> u64 {
        let limits = self.device.limits();
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size).min(BINDING_BYTES_MAX)
    }

    /// What went wrong first; the device is of no use afterwards.
    pub(crate) fn fault(&self) -> Option<String> {
        self.fault.get().map(|first| first.what)
    }

    /// Whether that was that it has no memory left.
    pub(crate) fn lacks_memory(&self) -> bool {
        self.fault.get().is_some_and(|first| first.is_lack_of_memory)
    }

    /// As if an allocation had failed.
    #[cfg(test)]
    pub(crate) fn pretend_to_lack_memory(&self) {
        self.fault.note("nothing but a test".to_owned(), true);
    }

    /// The adapter's name and, if so, that it is software.
    pub(crate) fn description(&self) -> String {
        if self.software {
            format!("{}, software", self.adapter_name)
        } else {
            self.adapter_name.clone()
        }
    }
}

fn is_software(info: &wgpu::AdapterInfo) -> bool {
    info.device_type == wgpu::DeviceType::Cpu
}

fn preference(info: &wgpu::AdapterInfo) -> u8 {
    match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}
