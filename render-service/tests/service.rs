//! The render service on a real bus inside this process: jobs in, pictures or reasons out.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::time::Duration;

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
    let config = Config { connect, id: "render-0".parse().unwrap(), adapter };
    let service = start(config, &Monitor::default()).await.unwrap();
    let Ok(Presence::Up(alive)) = tokio::time::timeout(DEADLINE, watch.next()).await else {
        panic!("the renderer did not announce itself");
    };
    Site { bus, service, map, alive, _asset: asset }
}

fn no_adapter(site: &Site) -> bool {
    let skipped = site.alive.capacity == 0;
    if skipped {
        eprintln!("skipped: {}", site.alive.detail);
    }
    skipped
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_over_the_bus_comes_back_as_a_picture_and_the_adapter_is_announced() {
    let site = site(AdapterChoice::Best).await;
    if no_adapter(&site) {
        return;
    }
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

#[tokio::test(flavor = "multi_thread")]
async fn jobs_sent_at_once_are_all_answered_the_wrong_ones_with_their_reason() {
    let site = site(AdapterChoice::Best).await;
    if no_adapter(&site) {
        return;
    }
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
async fn without_an_adapter_every_job_is_answered_with_what_to_install() {
    let site = site(AdapterChoice::Named("no such adapter".to_owned())).await;
    assert_eq!(site.alive.capacity, 0);
    assert!(site.alive.detail.starts_with("no adapter: "), "{}", site.alive.detail);
    let mut job = job(frame(vec![]), vec![camera()]);
    job.frame.map.digest = site.map.digest().to_owned();
    let error = site.bus.draw(&site.alive.id, &job, DEADLINE).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::RendererUnavailable);
    assert!(error.message.contains("mesa-vulkan-drivers"), "{error}");
    site.service.stop().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn bytes_that_are_no_job_are_refused_and_the_service_goes_on() {
    let site = site(AdapterChoice::Best).await;
    let key = keys::render_job(&site.alive.id);
    let error = site.bus.request_bytes(&key, vec![0x5a; 300], DEADLINE).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::InvalidMessage);
    site.service.stop().await.unwrap();
}
