//! What does a picture cost whoever has the frame, before a renderer hears of it?
//!
//! One job with one camera, by the number of actors in the frame: from the bytes as they came, and
//! from a frame that is copied and encoded again.

#![allow(missing_docs, reason = "the macros of criterion define public items")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use schemas::wire::encode_render_job;
use schemas::{
    ActorId, ActorKind, ActorState, Camera, Frame, FrameBytes, ImageEncoding, ImageKind, MapRef,
    Pose, RenderJob, SharedFrame, WorldId,
};

fn frame(actor_count: u32) -> Frame {
    let map = MapRef { name: "Town10HD_Opt".to_owned(), digest: "0".repeat(64) };
    let actor = |id| {
        let id = ActorId::new(id).expect("ids begin at 1");
        ActorState::at_rest(id, ActorKind::Vehicle, 0, Pose::identity())
    };
    Frame {
        types: vec!["vehicle.lincoln.mkz_2020".to_owned()],
        actors: (1..=actor_count).map(actor).collect(),
        ..Frame::empty(WorldId::new(1).expect("not 0"), map)
    }
}

fn job<F: FrameBytes>(frame: F) -> Vec<u8> {
    let camera = Camera {
        id: 0,
        carrier: ActorId::new(1),
        carrier_from_camera: Pose::identity(),
        width_px: 640,
        height_px: 360,
        horizontal_fov_rad: 1.5,
        kind: ImageKind::Rgb,
        encoding: ImageEncoding::Rgba8,
        jpeg_quality: 90,
        quality: None,
        ignored: Vec::new(),
        exposure: schemas::Exposure::PLAIN,
    };
    let tenant = "bench".parse().expect("a name");
    encode_render_job(&RenderJob {
        tenant,
        frame,
        cameras: vec![camera],
        staging: schemas::Staging::default(),
    })
}

fn asking(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("render job");
    for actor_count in [20, 200] {
        let shared = SharedFrame::from(frame(actor_count));
        group.bench_function(BenchmarkId::new("as it came", actor_count), |bencher| {
            bencher.iter(|| job(black_box(&shared).clone()));
        });
        group.bench_function(BenchmarkId::new("encoded again", actor_count), |bencher| {
            bencher.iter(|| job(Frame::clone(black_box(&shared))));
        });
    }
    group.finish();
}

criterion_group!(benches, asking);
criterion_main!(benches);
