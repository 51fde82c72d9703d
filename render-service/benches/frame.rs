//! How long does one picture of a town take, by size, alone and when many are asked for together,
//! each of a world of its own? And by kind, each alone and the four of geometry at one pose? By
//! processors and, in the same run, by every Vulkan adapter that is there.
//!
//! The scene is a street of the built-in town with twelve cars and twelve people. Times are per
//! request; for several together the throughput line gives pictures per second. Pictures are
//! delivered, frame in and bytes out; they are JPEG unless `raw` is said.

mod busy_street;

use std::error::Error;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use busy_street::job;
use criterion::{BenchmarkId, Criterion, Throughput};
use render_service::{AdapterChoice, Renderer, TownScene};
use schemas::{Camera, ImageEncoding, ImageKind, PictureQuality, RenderJob};

const SIZES_PX: [(u32, u32); 2] = [(640, 360), (84, 84)];
/// Pixels of all pictures that are asked for together.
const PIXELS_TOGETHER_MAX: u32 = 4_000_000;

fn main() -> Result<(), Box<dyn Error>> {
    let name = roads::town::names().next().ok_or("no built-in town")?;
    let map = roads::Map::parse(name, &roads::town::build(name).ok_or("no such town")?)?;
    let mut criterion = Criterion::default().configure_from_args();
    for (adapter, choice) in [
        ("cpu", AdapterChoice::Software),
        ("llvmpipe", AdapterChoice::Named("llvmpipe".to_owned())),
        ("gpu", AdapterChoice::Best),
    ] {
        match Renderer::new(choice) {
            Ok(renderer) if adapter == "gpu" && renderer.adapter_name().ends_with("software") => {}
            Ok(renderer) => measure(&mut criterion, &map, adapter, renderer)?,
            Err(error) => println!("{adapter}: {error}"),
        }
    }
    criterion.final_summary();
    Ok(())
}

fn measure(
    criterion: &mut Criterion,
    map: &roads::Map,
    adapter: &str,
    mut renderer: Renderer,
) -> Result<(), Box<dyn Error>> {
    let town = Arc::new(TownScene::of_map(map));
    println!("{} triangles, drawn by {}", town.triangle_count(), renderer.adapter_name());
    let begun = Instant::now();
    let first = job(map, 0, (640, 360));
    renderer.render(&[(Arc::clone(&town), &first)]).remove(0)?;
    println!("{adapter}: first picture of the town after {:?}", begun.elapsed());
    for (width_px, height_px, quality) in SIZES_PX.into_iter().flat_map(|(width_px, height_px)| {
        [PictureQuality::High, PictureQuality::Low].map(|quality| (width_px, height_px, quality))
    }) {
        let name = format!("{adapter}/picture/{width_px}x{height_px}/{quality:?}");
        let mut group = criterion.benchmark_group(name);
        for (together, is_raw) in [(1u32, false), (8, false), (1, true), (256, true)] {
            let mut jobs: Vec<RenderJob> =
                (0..together).map(|at| job(map, at as usize, (width_px, height_px))).collect();
            for camera in jobs.iter_mut().flat_map(|job| &mut job.cameras) {
                camera.quality = Some(quality);
                if is_raw {
                    camera.encoding = ImageEncoding::Rgba8;
                }
            }
            if jobs.len() as u32 * width_px * height_px > PIXELS_TOGETHER_MAX {
                continue;
            }
            let jobs: Vec<_> = jobs.iter().map(|job| (Arc::clone(&town), job)).collect();
            let name = if is_raw { "raw/together" } else { "together" };
            group.throughput(Throughput::Elements(u64::from(together)));
            group.bench_function(BenchmarkId::new(name, together), |bencher| {
                bencher.iter(|| black_box(renderer.render(black_box(&jobs))));
            });
        }
        group.finish();
    }
    let all = [ImageKind::Depth, ImageKind::Semantic, ImageKind::Instance, ImageKind::Normals];
    let [depth, semantic, instance, normals] = all;
    let cases: [(&str, &[ImageKind]); 6] = [
        ("rgb", &[ImageKind::Rgb]),
        ("depth", &[depth]),
        ("semantic", &[semantic]),
        ("instance", &[instance]),
        ("normals", &[normals]),
        ("all four of geometry", &all),
    ];
    for (width_px, height_px) in SIZES_PX {
        let mut group = criterion.benchmark_group(format!("{adapter}/kind/{width_px}x{height_px}"));
        for (name, kinds) in cases {
            let job = of_kinds(job(map, 0, (width_px, height_px)), kinds);
            group.bench_function(name, |bencher| {
                let town = &town;
                bencher.iter(|| black_box(renderer.render(&[(Arc::clone(town), black_box(&job))])));
            });
        }
        group.finish();
    }
    Ok(())
}

/// The job with one camera of each kind in the place of its own; colour raw.
fn of_kinds(mut job: RenderJob, kinds: &[ImageKind]) -> RenderJob {
    let of_kind = |kind: ImageKind, camera: &Camera| Camera {
        kind,
        encoding: kind.encodings().last().copied().unwrap_or(camera.encoding),
        ..camera.clone()
    };
    let cameras = std::mem::take(&mut job.cameras);
    let pairs = cameras.iter().flat_map(|camera| kinds.iter().map(move |kind| (kind, camera)));
    job.cameras = pairs.map(|(kind, camera)| of_kind(*kind, camera)).collect();
    job
}
