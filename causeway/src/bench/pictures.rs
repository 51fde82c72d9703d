//! How many pictures a second does an adapter deliver, and what does each take of processors?
//!
//! Frame in, bytes out: every kind of picture in the sizes and ways in which people ask for them,
//! of a busy street of a built-in town. Prints a row for each.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use render_service::{AdapterChoice, RenderError, Renderer, TownScene};
use schemas::{
    ActorId, ActorKind, ActorState, Camera, Exposure, Frame, ImageEncoding, ImageKind, MapRef,
    PictureQuality, Pose, RenderJob, Staging, Vec3, WorldId, level_pose,
};

#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Args {
    /// What draws: cpu, or part of a Vulkan adapter's name [default: a GPU, else cpu]
    #[arg(long, value_name = "NAME", default_value = "", hide_default_value = true)]
    adapter: String,
    /// How long each row is measured, in seconds.
    #[arg(long, value_name = "N", default_value_t = 2.0, value_parser = crate::numbers::seconds)]
    secs: f64,
    /// Cars and people in the street, as many of each.
    #[arg(long, value_name = "N", default_value_t = 12)]
    actors: u32,
    /// Only rows that begin with this, e.g. `colour, raw | 84 × 84 | low`.
    #[arg(long, value_name = "WORDS", default_value = "", hide_default_value = true)]
    only: String,
    /// Draw the jobs of this folder instead, all together: files `*.job`, each a `RenderJob` of a
    /// built-in town.
    #[arg(long, value_name = "FOLDER")]
    jobs: Option<PathBuf>,
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PicturesError {
    /// No adapter fits.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The built-in town or a picture of it.
    #[error("the town cannot be drawn: {0}")]
    Town(String),
    /// A file of `--jobs`.
    #[error("{0}: {1}")]
    Job(PathBuf, String),
}

/// One row: what is asked for together, each of a world of its own.
struct Case {
    kinds: &'static [ImageKind],
    encoding: ImageEncoding,
    quality: PictureQuality,
    size_px: (u32, u32),
    together: usize,
}

static GEOMETRY: [ImageKind; 4] =
    [ImageKind::Depth, ImageKind::Semantic, ImageKind::Instance, ImageKind::Normals];

pub(crate) fn run(args: &Args) -> Result<(), PicturesError> {
    if let Some(folder) = &args.jobs {
        return draw_jobs(folder, args);
    }
    let name = "Town10HD_Opt";
    let text = roads::town::build(name).ok_or_else(|| unusable(&"it is not built in"))?;
    // What a renderer does when it is started and asked for the first picture of a town.
    let begun = Instant::now();
    let mut renderer = Renderer::new(AdapterChoice::parse(&args.adapter))?;
    let (started, before_mib) = (begun.elapsed(), resident_mib());
    let map = roads::Map::parse(name, &text).map_err(|error| unusable(&error))?;
    let town = Arc::new(TownScene::of_map(&map));
    let first = job(&map, 0, args.actors, &cases(true)[0]);
    let drawn = renderer.render(&[(Arc::clone(&town), &first)]).remove(0);
    drawn.map_err(|error| unusable(&error))?;
    let millis = |duration: Duration| duration.as_secs_f64() * 1e3;
    println!(
        "{name}, {} triangles and its trees, {} cars and as many people, drawn by {}; started \
         after {:.0} ms, map, town and first picture {:.0} ms later; {before_mib:.0} and then \
         {:.0} MiB",
        town.triangle_count(),
        args.actors,
        renderer.adapter_name(),
        millis(started),
        millis(begun.elapsed() - started),
        resident_mib(),
    );
    println!("| pictures | size | quality | together | {HEAD}");
    println!("|---|---|---|---|---|---|---|---|---|");
    let begins = |case: &Case| case.begins().starts_with(&args.only);
    for case in cases(renderer.is_software()).into_iter().filter(begins) {
        let jobs: Vec<RenderJob> =
            (0..case.together).map(|at| job(&map, at, args.actors, &case)).collect();
        let jobs: Vec<_> = jobs.iter().map(|job| (Arc::clone(&town), job)).collect();
        println!("| {} | {}", case.begins(), measured(&mut renderer, &jobs, args.secs));
    }
    Ok(())
}

fn unusable(cause: &dyn std::fmt::Display) -> PicturesError {
    PicturesError::Town(cause.to_string())
}

/// What is measured.
const HEAD: &str = "a second | ms | ms of processors | MiB | µs of kernels |";

/// Draws jobs together, again and again: pictures a second, milliseconds of the clock and of
/// processors for each, what memory the process has then, and what the device's kernels took.
fn measured(renderer: &mut Renderer, jobs: &[(Arc<TownScene>, &RenderJob)], secs: f64) -> String {
    black_box(renderer.render(jobs));
    let (begun, processors) = (Instant::now(), processor_time());
    let kernels = renderer.kernel_times();
    let mut pictures = 0;
    while begun.elapsed().as_secs_f64() < secs {
        black_box(renderer.render(black_box(jobs)));
        pictures += jobs.len();
    }
    let took = begun.elapsed().as_secs_f64();
    let used = (processor_time() - processors).as_secs_f64();
    let count = pictures as f64;
    let (millis, used_millis) = (took * 1e3 / count, used * 1e3 / count);
    let kernels: Vec<String> = kernels
        .into_iter()
        .zip(renderer.kernel_times())
        .map(|((name, before), (_, after))| {
            format!("{name} {:.2}", (after - before).as_secs_f64() * 1e6 / count)
        })
        .collect();
    let (per_second, mib) = (count / took, resident_mib());
    format!(
        "{per_second:.0} | {millis:.3} | {used_millis:.3} | {mib:.0} | {} |",
        kernels.join(", ")
    )
}

/// Measures the jobs of a folder.
fn draw_jobs(folder: &Path, args: &Args) -> Result<(), PicturesError> {
    let failed = |path: &Path, cause: &dyn std::fmt::Display| {
        PicturesError::Job(path.to_owned(), cause.to_string())
    };
    let entries = std::fs::read_dir(folder).map_err(|error| failed(folder, &error))?;
    let is_job = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "job");
    let mut paths: Vec<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_job).collect();
    paths.sort();
    let mut renderer = Renderer::new(AdapterChoice::parse(&args.adapter))?;
    let (mut towns, mut jobs) = (BTreeMap::new(), Vec::with_capacity(paths.len()));
    for path in &paths {
        let bytes = std::fs::read(path).map_err(|error| failed(path, &error))?;
        let job = schemas::wire::decode_render_job(&bytes).map_err(|error| failed(path, &error))?;
        let name = job.frame.map.name.clone();
        if !towns.contains_key(&name) {
            let text = roads::town::build(&name)
                .ok_or_else(|| failed(path, &format!("{name} is not built in")))?;
            let map = roads::Map::parse(&name, &text).map_err(|error| failed(path, &error))?;
            towns.insert(name.clone(), Arc::new(TownScene::of_map(&map)));
        }
        jobs.push((name, job));
    }
    if jobs.is_empty() {
        return Err(failed(folder, &"wanted files *.job, found none"));
    }
    let jobs: Vec<_> = jobs.iter().map(|(name, job)| (Arc::clone(&towns[name]), job)).collect();
    for (drawn, path) in renderer.render(&jobs).into_iter().zip(&paths) {
        drawn.map_err(|error| failed(path, &error))?;
    }
    println!("drawn by {}", renderer.adapter_name());
    println!("| jobs together | {HEAD}");
    println!("|---|---|---|---|---|---|");
    println!("| {} | {}", jobs.len(), measured(&mut renderer, &jobs, args.secs));
    Ok(())
}

fn cases(is_software: bool) -> Vec<Case> {
    let mut cases = Vec::new();
    let (small, large): (&[usize], &[usize]) =
        if is_software { (&[1, 16, 256], &[1, 8]) } else { (&[1, 16, 256, 4_096], &[1, 8, 64]) };
    for (size_px, many) in [((84, 84), small), ((640, 360), large)] {
        for quality in [PictureQuality::High, PictureQuality::Low] {
            for encoding in [ImageEncoding::Jpeg, ImageEncoding::Rgba8] {
                let case = |together| Case {
                    kinds: &[ImageKind::Rgb],
                    encoding,
                    quality,
                    size_px,
                    together,
                };
                cases.extend(many.iter().copied().map(case));
            }
        }
        let of = |kinds| Case {
            kinds,
            encoding: ImageEncoding::Rgba8,
            quality: PictureQuality::High,
            size_px,
            together: many.last().copied().unwrap_or(1),
        };
        for at in 0..GEOMETRY.len() {
            let kinds = GEOMETRY.get(at..=at).unwrap_or_default();
            cases.push(of(kinds));
            cases.push(Case { together: 1, ..of(kinds) });
        }
        cases.push(Case { together: 1, ..of(&GEOMETRY) });
    }
    cases
}

impl Case {
    /// What a row says before its figures.
    fn begins(&self) -> String {
        let (width_px, height_px) = self.size_px;
        let quality = if self.quality == PictureQuality::Low { "low" } else { "high" };
        format!("{} | {width_px} × {height_px} | {quality} | {}", self.name(), self.together)
    }

    fn name(&self) -> String {
        match (self.kinds, self.encoding) {
            ([ImageKind::Rgb], ImageEncoding::Jpeg) => "colour, JPEG".to_owned(),
            ([ImageKind::Rgb], _) => "colour, raw".to_owned(),
            ([kind], _) => format!("{kind:?}").to_lowercase(),
            _ => "these four at one pose".to_owned(),
        }
    }

    /// One camera of each kind in this place.
    fn cameras(&self, world_from_camera: Pose) -> Vec<Camera> {
        let camera = |kind: &ImageKind| Camera {
            id: 1,
            carrier: None,
            carrier_from_camera: world_from_camera,
            width_px: self.size_px.0,
            height_px: self.size_px.1,
            horizontal_fov_rad: std::f32::consts::FRAC_PI_2,
            kind: *kind,
            encoding: match kind {
                ImageKind::Rgb => self.encoding,
                other => other.encodings().first().copied().unwrap_or(self.encoding),
            },
            jpeg_quality: 75,
            ignored: Vec::new(),
            exposure: Exposure::PLAIN,
            quality: Some(self.quality),
        };
        self.kinds.iter().map(camera).collect()
    }
}

/// How far a spawn point is above its road, in metres.
const DROP_M: f32 = 0.5;

/// A street of the town with cars ahead and people aside, seen by a car on the road below one of
/// its spawn points.
fn job(map: &roads::Map, spawn: usize, count: u32, case: &Case) -> RenderJob {
    let points = map.spawn_points();
    let above =
        points.get(spawn * 7 % points.len().max(1)).map_or_else(Pose::identity, |pose| pose.cast());
    let start = above * level_pose(Vec3::new(0.0, 0.0, -DROP_M), 0.0);
    let mut actors = Vec::new();
    for at in 0..count {
        let row = at as f32;
        let ahead =
            start * level_pose(Vec3::new(12.0 + 9.0 * row, 3.5 * (at % 3) as f32, 0.0), 0.0);
        actors.push(actor(1 + at, ActorKind::Vehicle, ahead, Vec3::new(2.4, 1.0, 0.74)));
        let aside = start * level_pose(Vec3::new(7.0 + 3.0 * row, -3.0, 0.95), row);
        actors.push(actor(1_000 + at, ActorKind::Walker, aside, Vec3::new(0.19, 0.19, 0.93)));
    }
    actors.sort_by_key(|actor| actor.id);
    let cameras = case.cameras(start * level_pose(Vec3::new(2.5, 0.0, 1.0), 0.0));
    let map = MapRef { name: map.name().to_owned(), digest: map.digest().to_owned() };
    let frame = Frame {
        sim_secs: 1.0,
        types: vec!["vehicle.tesla.model3".to_owned()],
        actors,
        ..Frame::empty(WorldId::new(1).expect("not zero"), map)
    };
    let tenant = "bench".parse().expect("a name");
    RenderJob { tenant, frame, cameras, staging: Staging::default() }
}

fn actor(id: u32, kind: ActorKind, world_from_actor: Pose, box_half_extent_m: Vec3) -> ActorState {
    let lift_m = if kind == ActorKind::Vehicle { box_half_extent_m.z } else { 0.0 };
    ActorState {
        gear: 1,
        box_centre_m: Vec3::new(0.0, 0.0, lift_m),
        box_half_extent_m,
        colour_rgb: 0xa0_2020,
        ..ActorState::at_rest(ActorId::new(id).expect("not zero"), kind, 0, world_from_actor)
    }
}

/// What all threads of this process have used of processors so far; zero where the system does not
/// tell. **Source:** `proc_pid_stat(5)`, fields 14 and 15, in hundredths of a second.
fn processor_time() -> Duration {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name of the program, in brackets, may have spaces.
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    let ticks: u64 = fields.skip(11).take(2).filter_map(|field| field.parse::<u64>().ok()).sum();
    Duration::from_millis(ticks * 10)
}

/// Memory of this process that is in use, in MiB; zero where the system does not tell.
/// **Source:** `proc_pid_statm(5)`, the second number, in pages of 4 KiB.
fn resident_mib() -> f64 {
    let statm = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages = statm.split_whitespace().nth(1).and_then(|pages| pages.parse::<f64>().ok());
    pages.unwrap_or_default() / 256.0
}
