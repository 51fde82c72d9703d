//! How long do questions about an hour of 100 cars and 50 lights at 20 Hz take, and how fast is it
//! replayed?
//!
//! The log is made here and read from a file. Its size is printed, and the most memory of all.

use std::fs::File;
use std::hint::black_box;
use std::io::{BufReader, BufWriter, Write};
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use recording::query::{Letter, actors_blocked, collisions, file_info};
use recording::{
    Add, Class, FrameContent, Header, Index, LightState, Long, Player, Position, Reader, Rotation,
    Vector, VehicleControl, VehicleLights, WheelPose, Wheels, Writer,
};

const CARS: u32 = 100;
const LIGHTS: u32 = 50;
const FRAMES: u32 = 72_000;

fn frame(number: u32) -> FrameContent {
    let cars = || (100..100 + CARS).map(|id| (id, (id + number) as f32));
    let place = |along| Vector { x: 25.0 * along, y: 300.0, z: 2.0 };
    let wheel = |wheel| WheelPose { wheel, steer_deg: 3.0, rotation_deg: 170.0 };
    let add = |id| Add {
        id,
        class: Class::VEHICLE,
        blueprint: "vehicle.lincoln.mkz_2017".to_owned(),
        ..Add::default()
    };
    FrameContent {
        elapsed_secs: f64::from(number) * 0.05,
        adds: if number == 0 { (100..100 + CARS).map(add).collect() } else { Vec::new() },
        positions: cars()
            .map(|(id, along)| Position {
                id,
                location: place(along),
                rotation: Rotation::default(),
            })
            .collect(),
        light_states: (1..=LIGHTS).map(|id| LightState { id, ..LightState::default() }).collect(),
        vehicle_controls: cars()
            .map(|(id, _)| VehicleControl { id, throttle: 0.7, ..VehicleControl::default() })
            .collect(),
        vehicle_lights: cars().map(|(id, _)| VehicleLights { id, flags: 0 }).collect(),
        wheels: cars()
            .map(|(id, _)| Wheels { id, wheels: Long((0..4).map(wheel).collect()) })
            .collect(),
        ..FrameContent::default()
    }
}

/// Writes the log and says how large it is.
fn written(path: &Path) {
    let header = Header { version: Header::VERSION, date: 0, map: "Town01".to_owned() };
    let sink = BufWriter::new(File::create(path).expect("a file"));
    let mut writer = Writer::begin(sink, &header).expect("room on the disk");
    for number in 0..FRAMES {
        writer.frame(frame(number)).expect("room on the disk");
    }
    writer.finish().expect("room on the disk");
    let bytes = path.metadata().expect("a file").len();
    println!("an hour: {} MB", bytes / 1_000_000);
}

/// The most memory that the process has had, in MB.
fn peak_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    peak.and_then(|peak| peak.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0) / 1_000
}

fn hour(criterion: &mut Criterion) {
    let path = std::env::temp_dir().join(format!("causeway-hour-{}.log", std::process::id()));
    written(&path);
    let source = || BufReader::with_capacity(256 * 1024, File::open(&path).expect("a file"));
    let open = || Reader::open(source()).expect("a log");
    let date = |secs: i64| secs.to_string();
    let mut group = criterion.benchmark_group("hour");
    group.sample_size(10);
    group.bench_function("file_info", |bencher| {
        bencher.iter(|| file_info(&mut open(), false, &date, &mut black_box(Sink)));
    });
    group.bench_function("collisions", |bencher| {
        let any = [Letter('a'), Letter('a')];
        bencher.iter(|| collisions(&mut open(), any, &date, &mut black_box(Sink)));
    });
    group.bench_function("actors_blocked", |bencher| {
        bencher.iter(|| actors_blocked(&mut open(), 30.0, 10.0, &date, &mut black_box(Sink)));
    });
    let mut index = Index::default();
    group.bench_function("index", |bencher| {
        bencher.iter(|| index = Index::build(&mut open()).expect("a log"));
    });
    group.bench_function("begin at 59:58", |bencher| {
        bencher.iter(|| Player::begin(open(), &index, index.span(-2.0, 0.0)).expect("a log"));
    });
    group.bench_function("replay of a minute", |bencher| {
        bencher.iter(|| {
            let begun = Player::begin(open(), &index, index.span(1_800.0, 0.0));
            let (mut player, _) = begun.expect("a log").expect("frames");
            (0..1_200).for_each(|_| drop(black_box(player.advance(0.05, 1.0))));
        });
    });
    group.finish();
    println!("most memory: {} MB", peak_mb());
    std::fs::remove_file(path).expect("the file");
}

/// Takes texts and forgets them.
struct Sink;

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

criterion_group!(benches, hour);
criterion_main!(benches);
