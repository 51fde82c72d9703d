//! Equal pictures in any company, and devices that lose their memory or themselves.

use schemas::{Camera, Frame, ImageEncoding, ImageKind, MapRef, Pose, Vec3, WorldId, level_pose};

use super::*;

fn job() -> RenderJob {
    let map = MapRef { name: String::new(), digest: "d".to_owned() };
    let frame = Frame::empty(WorldId::new(1).unwrap(), map);
    let camera = Camera {
        id: 1,
        carrier: None,
        carrier_from_camera: Pose::identity(),
        width_px: 16,
        height_px: 16,
        horizontal_fov_rad: 1.0,
        kind: ImageKind::Rgb,
        encoding: ImageEncoding::Rgba8,
        jpeg_quality: 75,
        quality: None,
        ignored: Vec::new(),
        exposure: schemas::Exposure::PLAIN,
    };
    RenderJob {
        tenant: "local".parse().unwrap(),
        frame,
        cameras: vec![camera],
        staging: schemas::Staging::default(),
    }
}

/// A street of a town in the rain, in colour and in four kinds of geometry.
fn street(map: &roads::Map, (width_px, height_px): (u32, u32)) -> RenderJob {
    let mut job = job();
    job.frame.map.digest = map.digest().to_owned();
    job.frame.weather.precipitation_percent = 60.0;
    let start: Pose = map.spawn_points().first().unwrap().cast();
    let mut colour = job.cameras.remove(0);
    (colour.width_px, colour.height_px) = (width_px, height_px);
    colour.carrier_from_camera = start * level_pose(Vec3::new(0.0, 0.0, 1.5), 0.0);
    let jpeg = Camera { id: 2, encoding: ImageEncoding::Jpeg, ..colour.clone() };
    let geometry = [ImageKind::Depth, ImageKind::Semantic, ImageKind::Normals].map(|kind| {
        let encoding = kind.encodings()[0];
        Camera { id: 3, kind, encoding, ..colour.clone() }
    });
    job.cameras = [colour, jpeg].into_iter().chain(geometry).collect();
    job
}

/// Slices cost so much that there are at least three of every pass; others of the same size
/// are drawn in between, in the same textures.
#[test]
fn pictures_that_are_drawn_in_slices_have_the_same_bytes() {
    for choice in [AdapterChoice::Software, llvmpipe()] {
        match Renderer::new(choice) {
            Ok(mut renderer) => draw_in_slices(&mut renderer),
            Err(error) => eprintln!("skipped: {error}"),
        }
    }
}

fn draw_in_slices(renderer: &mut Renderer) {
    let (map, town) = a_town();
    for (size_px, slice_px) in [((320, 250), 30_000), ((1_280, 720), 250_000)] {
        let job = street(&map, size_px);
        let mut other = job.clone();
        other.frame.weather.sun_azimuth_rad += 2.0;
        let begun = std::time::Instant::now();
        let whole = renderer.render(&[(Arc::clone(&town), &job)]).remove(0).unwrap();
        let whole_took = begun.elapsed();
        let mut sliced = SlicedJob::new(Arc::clone(&town), &job, &Textures::default()).unwrap();
        let (mut turns, mut took) = (0, std::time::Duration::ZERO);
        while !sliced.is_drawn() {
            let pixels = |work: &crate::sliced::Work| work.colour_px + work.geometry_px;
            let portion = sliced.portion(slice_px, pixels);
            let begun = std::time::Instant::now();
            renderer.draw_portions(vec![(&mut sliced, portion)]).unwrap();
            took += begun.elapsed();
            renderer.render(&[(Arc::clone(&town), &other)]).remove(0).unwrap();
            turns += 1;
        }
        eprintln!("{size_px:?}: whole {whole_took:?}, {turns} slices {took:?}");
        assert!(turns >= 9, "only {turns} slices");
        assert!(sliced.has_rows());
        let sliced = sliced.finish().unwrap();
        assert_eq!(whole.images.len(), sliced.images.len());
        for (whole, sliced) in whole.images.iter().zip(&sliced.images) {
            let differing = whole.data.iter().zip(&sliced.data).filter(|(a, b)| a != b).count();
            assert!(whole == sliced, "{:?} {size_px:?}: {differing} bytes", whole.kind);
        }
    }
}

fn llvmpipe() -> AdapterChoice {
    AdapterChoice::Named("llvmpipe".to_owned())
}

/// Mesa's device, which draws as a GPU does: four samples a pixel, soft edges of shadows.
fn fine_device() -> Option<Renderer> {
    fine_device_within(Room::WHOLE)
}

fn fine_device_within(room: Room) -> Option<Renderer> {
    let mut renderer = Renderer::within(llvmpipe(), room).ok()?;
    let Backend::Device(Some(drawing)) = &mut renderer.backend else { return None };
    drawing.gpu.software = false;
    Some(renderer)
}

fn device(renderer: &Renderer) -> &Drawing {
    let Backend::Device(Some(drawing)) = &renderer.backend else { panic!("no device draws") };
    drawing
}

fn a_town() -> (roads::Map, Arc<TownScene>) {
    let name = roads::town::names().next().unwrap();
    let map = roads::Map::parse(name, &roads::town::build(name).unwrap()).unwrap();
    let town = Arc::new(TownScene::of_map(&map));
    (map, town)
}

/// Goal: four samples smooth edges and change nothing else. Method: the same picture with one
/// sample a pixel, and by processors with four times the pixels, of which four make one.
#[test]
fn four_samples_are_what_four_times_the_pixels_are() {
    let Some(mut fine) = fine_device() else {
        eprintln!("skipped: no Vulkan adapter");
        return;
    };
    let (map, town) = a_town();
    let picture = |renderer: &mut Renderer, size_px: (u32, u32)| {
        let mut job = street(&map, size_px);
        job.frame.weather.precipitation_percent = 0.0;
        job.cameras.truncate(1);
        let images = renderer.render(&[(Arc::clone(&town), &job)]).remove(0).unwrap().images;
        images.into_iter().next().unwrap().data
    };
    let smooth = picture(&mut fine, (160, 120));
    let large = picture(&mut Renderer::new(AdapterChoice::Software).unwrap(), (320, 240));
    let linear = |byte: u8| (f32::from(byte) / 255.0).powf(2.2);
    let mut differences = Vec::new();
    for (at, byte) in smooth.iter().enumerate() {
        let (pixel, channel) = (at / 4, at % 4);
        let (x, y) = (pixel % 160 * 2, pixel / 160 * 2);
        let of = |x: usize, y: usize| linear(large[(y * 320 + x) * 4 + channel]);
        let mean = (of(x, y) + of(x + 1, y) + of(x, y + 1) + of(x + 1, y + 1)) / 4.0;
        differences.push((mean.powf(1.0 / 2.2) * 255.0 - f32::from(*byte)).abs());
    }
    let count = differences.len() as f32;
    let mean = differences.iter().sum::<f32>() / count * 4.0 / 3.0;
    let far = differences.iter().filter(|off| **off > 24.0).count() as f32 / count;
    eprintln!("mean difference {mean:.2} of 255, {:.2} % far off", 100.0 * far);
    // Patterns are finer in the larger picture.
    assert!(mean < 3.0 && far < 0.03, "{mean} {far}");
    let off = |other: &[u8]| {
        let off = smooth.iter().zip(other).map(|(a, b)| u64::from(a.abs_diff(*b)));
        off.sum::<u64>() as f32 / count * 4.0 / 3.0
    };
    let single = off(&picture(&mut Renderer::new(llvmpipe()).unwrap(), (160, 120)));
    assert!(single > 1.2 * mean, "one sample is as near: {single}");
    let soft = off(&picture(&mut Renderer::new(AdapterChoice::Software).unwrap(), (160, 120)));
    eprintln!("mean difference of one sample {single:.2}, of soft edges {soft:.2}");
    assert!(soft < 0.8 * single, "soft edges are no nearer than one sample: {soft} and {single}");
}

/// Goal: whatever is drawn in the same submission changes no byte. Method: one picture alone,
/// before and behind 40 others of another town, weather and size.
#[test]
fn a_picture_is_the_same_alone_and_among_many() {
    let Some(mut renderer) = fine_device() else {
        eprintln!("skipped: no Vulkan adapter");
        return;
    };
    let (map, town) = a_town();
    let job = street(&map, (96, 72));
    let plain = Arc::new(TownScene::new("d", &[]));
    let others: Vec<_> = (0..40)
        .map(|at| {
            let mut other = street(&map, (40 + at, 30));
            other.frame.weather.sun_azimuth_rad += at as f32 / 10.0;
            if at % 3 == 0 {
                other.frame.map.digest = "d".to_owned();
            }
            other
        })
        .collect();
    let mut draw = |before: usize| {
        let mut jobs: Vec<TownJob<'_>> = Vec::new();
        for other in &others {
            let town = if other.frame.map.digest == "d" { &plain } else { &town };
            jobs.push((Arc::clone(town), other));
        }
        jobs.truncate(if before == usize::MAX { 0 } else { others.len() });
        let at = before.min(jobs.len());
        jobs.insert(at, (Arc::clone(&town), &job));
        renderer.render(&jobs).remove(at).unwrap()
    };
    let alone = draw(usize::MAX);
    for before in [0, 7, 40] {
        assert!(draw(before) == alone, "behind {before} others");
    }
}

/// 72 views of 24 sizes, in colour and of geometry, under 24 suns.
fn many(map: &roads::Map, town: &Arc<TownScene>) -> Vec<(Arc<TownScene>, RenderJob)> {
    let job = |at: u32| {
        let mut job = street(map, (100 + at, 80));
        job.frame.weather.sun_azimuth_rad += at as f32 / 10.0;
        (Arc::clone(town), job)
    };
    (0..24).map(job).collect()
}

fn draw_all(
    renderer: &mut Renderer,
    jobs: &[(Arc<TownScene>, RenderJob)],
) -> Vec<Result<Images, Error>> {
    let jobs: Vec<_> = jobs.iter().map(|(town, job)| (Arc::clone(town), job)).collect();
    renderer.render(&jobs)
}

/// Goal: how much of a device's memory is used changes no byte, only how many submissions there
/// are. Method: the same jobs within the whole room, the least, and one for a view at a time.
#[test]
fn pictures_are_the_same_however_little_room_there_is() {
    let Some(mut whole) = fine_device() else {
        eprintln!("skipped: no Vulkan adapter");
        return;
    };
    let (map, town) = a_town();
    let jobs = many(&map, &town);
    let wanted = draw_all(&mut whole, &jobs);
    let one = Room { views: 1, samples_bytes: 0, large_blocks: 0, ..Room::LEAST };
    for (room, submissions) in [(Room::LEAST, 1), (one, 71)] {
        let mut small = fine_device_within(room).unwrap();
        assert!(draw_all(&mut small, &jobs) == wanted, "another picture within {room:?}");
        let more = device(&small).submissions() - device(&whole).submissions();
        assert!(more >= submissions, "{more} submissions more within {room:?}");
    }
}

/// Goal: large triangles for which there was no room are not missing. Method: room for 512
/// blocks, which is the least that a buffer has, and for a quarter of a million.
#[test]
fn all_is_drawn_again_when_large_triangles_had_no_room() {
    let Some(mut renderer) = fine_device() else {
        eprintln!("skipped: no Vulkan adapter");
        return;
    };
    let (map, town) = a_town();
    let jobs = [(Arc::clone(&town), street(&map, (1_280, 720)))];
    let wanted = draw_all(&mut renderer, &jobs);
    let mut small = fine_device_within(Room { large_blocks: 1, ..Room::WHOLE }).unwrap();
    let before = device(&small).large_blocks();
    assert!(draw_all(&mut small, &jobs) == wanted, "large triangles are missing");
    let after = device(&small).large_blocks();
    eprintln!("room for {before} blocks, then for {after}");
    assert!(after > before, "there were no more than {before}");
}

/// Goal: a device that has too little memory draws with less of it, however often. Method: it
/// is told to have said so.
#[test]
fn a_device_without_memory_is_asked_for_less_of_it() {
    let Ok(mut renderer) = Renderer::new(llvmpipe()) else {
        eprintln!("skipped: no Vulkan adapter");
        return;
    };
    let (town, job) = (Arc::new(TownScene::new("d", &[])), job());
    let before = renderer.render(&[(Arc::clone(&town), &job)]).remove(0).unwrap();
    let mut room = Some(Room::WHOLE);
    for _ in 0..LOSSES_MAX + 1 {
        device(&renderer).gpu.pretend_to_lack_memory();
        let after = renderer.render(&[(Arc::clone(&town), &job)]).remove(0).unwrap();
        assert!(before == after, "the picture with less memory differs");
        room = room.and_then(Room::halved);
        assert_eq!(Some(renderer.room), room);
    }
}

#[test]
fn devices_are_opened_and_closed_one_after_the_other() {
    let moment = Duration::from_secs(1);
    let held = one_at_a_time();
    let opening = std::thread::spawn(|| Renderer::new(llvmpipe()));
    std::thread::sleep(moment);
    assert!(!opening.is_finished(), "it was opened beside another one");
    drop(held);
    let Ok(renderer) = opening.join().unwrap() else {
        eprintln!("skipped: no Vulkan adapter");
        return;
    };
    let held = one_at_a_time();
    let closing = std::thread::spawn(|| drop(renderer));
    std::thread::sleep(moment);
    assert!(!closing.is_finished(), "it was closed beside another one");
    drop(held);
    closing.join().unwrap();
}

/// Reliability F23: the device goes before a job, and twice in a row.
#[test]
fn a_lost_device_is_opened_anew_and_the_job_drawn() {
    let Ok(mut renderer) = Renderer::new(llvmpipe()) else {
        eprintln!("skipped: no Vulkan adapter");
        return;
    };
    let (town, job) = (Arc::new(TownScene::new("d", &[])), job());
    let before = renderer.render(&[(Arc::clone(&town), &job)]).remove(0).unwrap();
    for _ in 0..2 {
        device(&renderer).gpu.device.destroy();
        let after = renderer.render(&[(Arc::clone(&town), &job)]).remove(0).unwrap();
        assert!(before == after, "the picture from the new device differs");
    }
}

#[test]
fn processors_draw_when_a_device_is_lost_and_does_not_come_back() {
    let mut renderer = Renderer::new(AdapterChoice::Software).unwrap();
    let (town, job) = (Arc::new(TownScene::new("d", &[])), job());
    let whole = renderer.render(&[(Arc::clone(&town), &job)]).remove(0).unwrap();
    renderer.backend = Backend::Device(None);
    let after = renderer.render(&[(town, &job)]).remove(0).unwrap();
    assert!(whole == after, "the picture after the loss differs");
    assert!(matches!(renderer.backend, Backend::Cpu(_)), "{}", renderer.adapter_name());
}
