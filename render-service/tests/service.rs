//! The render service on a real bus inside this process: jobs in, pictures or reasons out.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use bus::{Bus, BusAddress, BusConfig, Incoming, Presence, Serving};
use common::{camera, frame, job};
use monitoring::Monitor;
use render_service::{AdapterChoice, Config, RenderService, start};
use schemas::{Alive, Camera, ErrorCode, ImageEncoding, Images, Reply, ServiceKind, keys, wire};

const DEADLINE: Duration = Duration::from_secs(60);

/// A bus, a renderer on it, and an owner of this town.
struct Site {
    bus: Bus,
    service: RenderService,
    map: roads::Map,
    alive: Alive,
    monitor: Monitor,
    _asset: Serving,
}

async fn site(adapter: AdapterChoice) -> Site {
    let name = roads::town::names().next().unwrap();
    let map = roads::Map::parse(name, &roads::town::build(name).unwrap()).unwrap();
    let bus = Bus::open(BusConfig::listening(BusAddress::loopback(0))).await.unwrap();
    let text = map.text().as_bytes().to_vec();
    let answer = move |incoming: Incoming| incoming.reply_bytes(text.clone());
    let asset = bus.serve(&keys::asset(map.digest()), answer).await.unwrap();
    let mut watch = bus.watch(Some(ServiceKind::Render)).await.unwrap();
    let connect = bus.listening().to_vec();
    let config = Config {
        connect,
        identity: None,
        id: "render-0".parse().unwrap(),
        adapter,
        quality: schemas::PictureQuality::High,
    };
    let monitor = Monitor::default();
    let service = start(config, &monitor).await.unwrap();
    let Ok(Presence::Up(alive)) = tokio::time::timeout(DEADLINE, watch.next()).await else {
        panic!("the renderer did not announce itself");
    };
    Site { bus, service, map, alive, monitor, _asset: asset }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_over_the_bus_comes_back_as_a_picture_and_the_adapter_is_announced() {
    comes_back_as_a_picture(site(AdapterChoice::Best).await).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_over_the_bus_is_drawn_by_a_device() {
    let site = site(AdapterChoice::Named("llvmpipe".to_owned())).await;
    if site.alive.capacity == 0 {
        eprintln!("skipped: no Vulkan adapter");
        return;
    }
    comes_back_as_a_picture(site).await;
}

async fn comes_back_as_a_picture(site: Site) {
    assert_eq!(site.alive.detail, site.service.adapter());
    let picture = Camera { encoding: ImageEncoding::Jpeg, ..camera() };
    let mut job = job(frame(vec![]), vec![picture]);
    job.frame.map.digest = site.map.digest().to_owned();
    let reply = site.bus.draw(&site.alive.id, &job, DEADLINE).await.unwrap();
    let Ok(Reply::Images(Images { images, .. })) = wire::decode_reply(&reply) else {
        panic!("no pictures")
    };
    assert_eq!(images.len(), 1);
    assert!(images[0].data.starts_with(&[0xff, 0xd8]), "not a JPEG");
    assert!((5_000..200_000).contains(&images[0].data.len()));
    site.service.stop().await.unwrap();
}

/// From the question on, with the town's text still at its owner. The goal is 300 ms on a machine
/// that has nothing else to do; tests run beside others.
#[tokio::test(flavor = "multi_thread")]
async fn the_first_picture_of_a_town_comes_soon_after_it_was_asked_for() {
    let site = site(AdapterChoice::Software).await;
    let mut job = job(frame(vec![]), vec![camera()]);
    job.frame.map.digest = site.map.digest().to_owned();
    let mut took = [Duration::ZERO; 2];
    for took in &mut took {
        let asked = Instant::now();
        site.bus.draw(&site.alive.id, &job, DEADLINE).await.unwrap();
        *took = asked.elapsed();
    }
    eprintln!("{}: first picture after {:.0?}, second {:.0?}", site.map.name(), took[0], took[1]);
    assert!(took[0] < Duration::from_secs(5), "{took:?}");
    site.service.stop().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_sent_at_once_are_all_answered_the_wrong_ones_with_their_reason() {
    let site = site(AdapterChoice::Best).await;
    let small = Camera { width_px: 32, height_px: 32, ..camera() };
    let mut good = job(frame(vec![]), vec![small.clone()]);
    good.frame.map.digest = site.map.digest().to_owned();
    let mut lost = good.clone();
    lost.frame.map.digest = "a".repeat(64);
    let mut flat = good.clone();
    flat.cameras[0].height_px = 0;
    let id = &site.alive.id;
    let draw = |job| site.bus.draw(id, job, DEADLINE);
    let (first, no_map, no_height, last) =
        tokio::join!(draw(&good), draw(&lost), draw(&flat), draw(&good));
    assert_eq!(first.unwrap(), last.unwrap());
    assert_eq!(no_map.unwrap_err().code, ErrorCode::Unreachable);
    assert_eq!(no_height.unwrap_err().code, ErrorCode::InvalidArgument);
    site.service.stop().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn without_an_adapter_every_job_is_answered_with_what_draws_without() {
    let site = site(AdapterChoice::Named("no such adapter".to_owned())).await;
    assert_eq!(site.alive.capacity, 0);
    assert!(site.alive.detail.starts_with("no adapter: "), "{}", site.alive.detail);
    let mut job = job(frame(vec![]), vec![camera()]);
    job.frame.map.digest = site.map.digest().to_owned();
    let error = site.bus.draw(&site.alive.id, &job, DEADLINE).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::RendererUnavailable);
    assert!(error.message.contains("--adapter cpu"), "{error}");
    site.service.stop().await.unwrap();
}

/// A figure of the service.
fn figure(site: &Site, name: &str) -> f64 {
    let text = site.monitor.metrics().text();
    let line = text.lines().find_map(|line| line.strip_prefix(name));
    line.and_then(|value| value.trim().parse().ok()).unwrap_or_else(|| panic!("{name}: {text}"))
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_whose_askers_have_given_up_are_not_drawn() {
    let site = site(AdapterChoice::Best).await;
    let large = Camera { width_px: 4_096, height_px: 4_000, ..camera() };
    let mut large = job(frame(vec![]), vec![large]);
    large.frame.map.digest = site.map.digest().to_owned();
    let mut last = large.clone();
    last.cameras[0].height_px = 8;
    let ask = |job: &schemas::RenderJob, deadline| {
        let (bus, id, job) = (site.bus.clone(), site.alive.id.clone(), job.clone());
        tokio::spawn(async move { bus.draw(&id, &job, deadline).await })
    };
    let first = [ask(&large, DEADLINE), ask(&large, DEADLINE)];
    while figure(&site, "causeway_render_jobs_waiting ") < 2.0 {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    let impatient: Vec<_> = (0..4).map(|_| ask(&large, Duration::from_millis(1))).collect();
    for asked in impatient {
        assert_eq!(asked.await.unwrap().unwrap_err().code, ErrorCode::TimedOut);
    }
    ask(&last, DEADLINE).await.unwrap().unwrap();
    for asked in first {
        asked.await.unwrap().unwrap();
    }
    assert_eq!(figure(&site, "causeway_render_jobs_total{outcome=\"given_up\"}"), 4.0);
    assert_eq!(figure(&site, "causeway_render_jobs_total{outcome=\"drawn\"}"), 3.0);
    site.service.stop().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_town_that_does_not_come_holds_up_no_picture_of_another() {
    let site = site(AdapterChoice::Best).await;
    let small = Camera { width_px: 32, height_px: 32, ..camera() };
    let mut good = job(frame(vec![]), vec![small]);
    good.frame.map.digest = site.map.digest().to_owned();
    let mut slow = good.clone();
    slow.frame.map.digest = "b".repeat(64);
    slow.frame.world = schemas::WorldId::new(2).unwrap();
    // What only the first picture waits for has no part in what the owner of a town may take.
    site.bus.draw(&site.alive.id, &good, DEADLINE).await.unwrap();
    let (asked, mut unanswered) = tokio::sync::mpsc::channel(1);
    let keep = move |incoming: Incoming| asked.try_send(incoming).unwrap();
    let _asset = site.bus.serve(&keys::asset(&slow.frame.map.digest), keep).await.unwrap();
    let waiting = {
        let (bus, id) = (site.bus.clone(), site.alive.id.clone());
        tokio::spawn(async move { bus.draw(&id, &slow, DEADLINE).await })
    };
    let wanted = unanswered.recv().await.unwrap();
    site.bus.draw(&site.alive.id, &good, DEADLINE).await.unwrap();
    assert!(!waiting.is_finished(), "the picture has waited for another town");
    drop(wanted);
    assert_eq!(waiting.await.unwrap().unwrap_err().code, ErrorCode::Internal);
    site.service.stop().await.unwrap();
}

/// Asks for one picture after the other of these sides, for a tenant and as a session of it.
fn ask_on(site: &Site, tenant: &str, session: u64, size_px: (u32, u32)) -> Arc<AtomicUsize> {
    let (width_px, height_px) = size_px;
    let mut job = job(frame(vec![]), vec![Camera { width_px, height_px, ..camera() }]);
    job.tenant = tenant.parse().unwrap();
    job.frame.world = schemas::WorldId::new(session).unwrap();
    job.frame.map.digest = site.map.digest().to_owned();
    let (bus, id, count) = (site.bus.clone(), site.alive.id.clone(), Arc::<AtomicUsize>::default());
    let counted = Arc::clone(&count);
    tokio::spawn(async move {
        while bus.draw(&id, &job, DEADLINE).await.is_ok() {
            counted.fetch_add(1, Ordering::Relaxed);
        }
    });
    count
}

/// Pictures that seven small tenants get each while an eighth asks on, and the eighth's part of the
/// time.
async fn drawn_beside(sizes_px: &[(u32, u32)]) -> (Vec<usize>, f64) {
    const SMALL_PX: (u32, u32) = (320, 180);
    let site = site(AdapterChoice::Best).await;
    for (session, size_px) in (1..).zip(sizes_px) {
        ask_on(&site, "eighth", session, *size_px);
    }
    let small = |at: u64| ask_on(&site, &format!("small-{at}"), 100 + at, SMALL_PX);
    let counts: Vec<_> = (0..7).map(small).collect();
    let now = || counts.iter().map(|count| count.load(Ordering::Relaxed)).collect::<Vec<_>>();
    // The town has come, and costs are known.
    let begun = Instant::now();
    while now().iter().any(|count| *count < 10) {
        assert!(begun.elapsed() < DEADLINE, "not ten pictures for each in time: {:?}", now());
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    let before = now();
    tokio::time::sleep(Duration::from_secs(3)).await;
    let drawn = now().iter().zip(before).map(|(now, before)| now - before).collect();
    // All of the time is somebody's; of the newest pictures it is counted a moment later.
    let used_secs = |tenant: String| {
        figure(&site, &format!("causeway_render_tenant_seconds_total{{tenant=\"{tenant}\"}}"))
    };
    let small_secs: f64 = (0..7).map(|at| used_secs(format!("small-{at}"))).sum();
    let (eighth, all) =
        (used_secs("eighth".to_owned()), figure(&site, "causeway_render_batch_seconds_sum"));
    let share = (small_secs + eighth) / all;
    assert!((0.9..1.02).contains(&share), "{share} of the time is some tenant's");
    site.service.stop().await.unwrap();
    (drawn, eighth / all)
}

/// The goal is 80 % of an eighth each; half of that is asked for here, as the pictures of two times
/// are compared and the machine may have other work in one of them.
///
/// Where it has much of it this passes also if nobody is waited for: a small picture takes so long
/// then that the moment until the next is asked for is little. That waiting gives the shares is
/// told in the time of a model,
/// `seven_tenants_of_pictures_far_below_a_slice_get_their_eighths_too`.
#[tokio::test(flavor = "multi_thread")]
async fn small_tenants_get_their_share_of_the_time_beside_a_wild_one() {
    let (alike, _) = drawn_beside(&[(320, 180)]).await;
    let wild = [(1_920, 1_080), (4_096, 4_000), (1_920, 1_080), (1_280, 720)].repeat(4);
    let (beside, of_wild) = drawn_beside(&wild).await;
    let eighth = alike.iter().sum::<usize>() as f64 / alike.len() as f64;
    let shares: Vec<f64> = beside.iter().map(|count| *count as f64 / eighth).collect();
    eprintln!("of {eighth:.0} pictures each: {shares:.2?}; the wild one has {of_wild:.3}");
    assert!(shares.iter().all(|share| *share >= 0.4), "of an eighth: {shares:.2?}");
    assert!(of_wild >= 0.05, "the wild one has {of_wild:.3} of the time");
}

#[tokio::test(flavor = "multi_thread")]
async fn bytes_that_are_no_job_are_refused_and_the_service_goes_on() {
    let site = site(AdapterChoice::Best).await;
    let key = keys::render_job(&site.alive.id);
    let error = site.bus.request_bytes(&key, vec![0x5a; 300], DEADLINE).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::InvalidMessage);
    site.service.stop().await.unwrap();
}
