//! What a plain graphics pipeline takes for the street that we measure with: every triangle of the
//! town and of twelve cars and people in vertex buffers, one flat colour for each material, a depth
//! test, no light, no shadows; drawn by a Vulkan adapter and read back.
//! `cargo run --release -p render-service --example bare_vulkan -- ADAPTER SECONDS FOLDER`, e.g.
//! `llvmpipe 2 /tmp`; into the folder, if there is one, go pictures to look at.

#[path = "../../benches/busy_street/mod.rs"]
mod busy_street;
mod pass;
mod street;

use std::error::Error;
use std::time::{Duration, Instant};

use pass::{Pass, mesh_of, pipeline};
use street::{bodies_of, town};

const TOWN: &str = "Town10HD_Opt";
/// Pixels of a picture, and how many are drawn in one submission, each of a world of its own.
const CASES: [((u32, u32), u32); 3] = [((84, 84), 16), ((84, 84), 1), ((640, 360), 1)];

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let adapter = args.next().unwrap_or_else(|| "llvmpipe".to_owned());
    let secs: f64 = args.next().map_or(Ok(2.0), |text| text.parse())?;
    let folder = args.next();
    let (device, queue, name) = open(&adapter)?;
    let map = roads::Map::parse(TOWN, &roads::town::build(TOWN).ok_or("no such town")?)?;
    let town = mesh_of(&device, &town(&map));
    let pipeline = pipeline(&device);
    println!("{} triangles of {TOWN}, drawn by {name}", town.count / 3);
    println!("| pictures | size | together | a second | ms of processors |\n|---|---|---|---|---|");
    for (size_px, together) in CASES {
        let jobs: Vec<_> =
            (0..together).map(|at| busy_street::job(&map, at as usize, size_px)).collect();
        let worlds: Vec<_> =
            jobs.iter().map(|job| mesh_of(&device, &bodies_of(&job.frame))).collect();
        let cameras: Vec<_> = jobs.iter().map(|job| &job.cameras[0]).collect();
        let pass = Pass::new(&device, &pipeline, (&cameras, size_px));
        let draw = || pass.draw(&device, &queue, &pipeline, (&town, &worlds));
        let pixels = draw()?;
        if let Some(folder) = &folder {
            save(folder, &pixels, &pass)?;
        }
        let (width, height) = size_px;
        let figures = measured(secs, together, draw)?;
        println!("| bare | {width} × {height} | {together} | {figures} |");
    }
    Ok(())
}

fn open(adapter: &str) -> Result<(wgpu::Device, wgpu::Queue, String), Box<dyn Error>> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
    let is_wanted = |found: &wgpu::Adapter| found.get_info().name.contains(adapter);
    let found = all.into_iter().find(is_wanted).ok_or("no such Vulkan adapter")?;
    let (device, queue) =
        pollster::block_on(found.request_device(&wgpu::DeviceDescriptor::default()))?;
    Ok((device, queue, found.get_info().name))
}

/// The first of some pictures.
fn save(folder: &str, pixels: &[u8], pass: &Pass) -> Result<(), Box<dyn Error>> {
    let (width, height) = (pass.size_px.0 as usize, pass.size_px.1 as usize);
    let (pitch, format) = (pass.row_bytes as usize, turbojpeg::PixelFormat::RGBA);
    let image = turbojpeg::Image { pixels, width, pitch, height, format };
    let image = image.as_deref();
    let bytes = turbojpeg::compress(image, 95, turbojpeg::Subsamp::None)?;
    std::fs::write(format!("{folder}/bare-{width}x{height}.jpg"), &bytes)?;
    Ok(())
}

/// Pictures a second, and milliseconds of processors for each.
fn measured(
    secs: f64,
    together: u32,
    draw: impl Fn() -> Result<Vec<u8>, Box<dyn Error>>,
) -> Result<String, Box<dyn Error>> {
    let (begun, processors) = (Instant::now(), processor_time());
    let mut count = 0.0;
    while begun.elapsed().as_secs_f64() < secs {
        std::hint::black_box(draw()?);
        count += f64::from(together);
    }
    let used_ms = (processor_time() - processors).as_secs_f64() * 1e3;
    Ok(format!("{:.0} | {:.2}", count / begun.elapsed().as_secs_f64(), used_ms / count))
}

/// What all threads of this process have used of processors so far; zero where the system does not
/// tell. **Source:** `proc_pid_stat(5)`, fields 14 and 15, in hundredths of a second.
fn processor_time() -> Duration {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    let ticks: u64 = fields.skip(11).take(2).filter_map(|field| field.parse::<u64>().ok()).sum();
    Duration::from_millis(ticks * 10)
}
