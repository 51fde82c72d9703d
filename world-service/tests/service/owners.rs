//! Leases and pictures: what depends on who else is up.

use std::time::{Duration, Instant};

use crate::common::{Site, camera, config, connect, deadline, until};
use bus::{Announcement, Bus, Presence};
use schemas::{
    Alive, Error, ErrorCode, Image, Images, Lease, Reply, Request, ServiceKind, WorldId, keys,
};

async fn announce(bus: &Bus, kind: ServiceKind, id: &str) -> Announcement {
    let alive = Alive {
        kind,
        id: id.parse().unwrap(),
        version: String::new(),
        pid: 1,
        capacity: 1,
        detail: String::new(),
    };
    bus.announce(alive).await.unwrap()
}

fn lease(owner: &str, millis: u32) -> Option<Lease> {
    Some(Lease { owner: owner.parse().unwrap(), millis })
}

#[tokio::test(flavor = "multi_thread")]
async fn a_world_service_says_what_it_is() {
    let site = Site::open(config()).await;
    let mut watch = site.client.watch(Some(ServiceKind::World)).await.unwrap();
    let Presence::Up(alive) = watch.next().await else { panic!("down") };
    assert_eq!((alive.id, alive.capacity), (config().id, 64));
    assert_eq!(alive.pid, std::process::id());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_world_ends_with_its_lease_after_its_owner_died() {
    let site = Site::open(config()).await;
    let owner = connect(&site.service).await;
    let _announcement = announce(&owner, ServiceKind::Scenario, "s").await;
    let (kept, leased) =
        (site.create(1, None).await.unwrap(), site.create(2, lease("s", 200)).await.unwrap());
    tokio::time::sleep(Duration::from_millis(400)).await;
    assert_eq!(site.list().await.len(), 2, "the owner lives");
    let died = Instant::now();
    owner.close().await;
    until("the leased world has ended", || async { site.list().await.len() == 1 }).await;
    assert!(died.elapsed() >= Duration::from_millis(200), "{:?}", died.elapsed());
    assert_eq!(site.list().await[0].world, kept, "{leased} was to end");
}

#[tokio::test(flavor = "multi_thread")]
async fn an_owner_that_comes_back_in_time_keeps_its_world() {
    let site = Site::open(config()).await;
    let owner = connect(&site.service).await;
    let announcement = announce(&owner, ServiceKind::Scenario, "s").await;
    site.create(1, lease("s", 1_000)).await.unwrap();
    drop(announcement);
    tokio::time::sleep(Duration::from_millis(200)).await;
    let _again = announce(&owner, ServiceKind::Scenario, "s").await;
    tokio::time::sleep(Duration::from_millis(1_200)).await;
    assert_eq!(site.list().await.len(), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_world_whose_owner_was_never_there_ends_too() {
    let site = Site::open(config()).await;
    site.create(1, lease("nobody", 100)).await.unwrap();
    until("it has ended", || async { site.list().await.is_empty() }).await;
}

async fn capture(site: &Site, world: WorldId) -> Result<Reply, Error> {
    let request = Request::Capture { world, cameras: vec![camera(None)] };
    site.client.request(&keys::world(&crate::common::tenant(), world), &request, deadline()).await
}

/// Answers jobs like a renderer, with the job's frame.
async fn draw(bus: &Bus, id: &str) -> (bus::Serving, Announcement) {
    let key = keys::render_job(&id.parse().unwrap());
    let serving = bus.serve(&key, |incoming| {
        let job = incoming.render_job().unwrap();
        let images = job.cameras.iter().map(|camera| Image {
            camera: camera.id,
            width_px: camera.width_px,
            height_px: camera.height_px,
            kind: camera.kind,
            encoding: camera.encoding,
            data: vec![7; 8],
        });
        let images = images.collect();
        incoming.reply(&Reply::Images(Images {
            tick: job.frame.tick,
            state_hash: job.frame.state_hash,
            images,
        }));
    });
    (serving.await.unwrap(), announce(bus, ServiceKind::Render, id).await)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_picture_is_drawn_by_a_renderer_and_ticks_nothing() {
    let site = Site::open(config()).await;
    let renderer = connect(&site.service).await;
    let _drawing = draw(&renderer, "r").await;
    let world = site.create(1, None).await.unwrap();
    let reply = capture(&site, world).await;
    let Ok(Reply::Images(images)) = reply else { panic!("{reply:?}") };
    assert_eq!((images.tick.0, images.images[0].camera), (0, 3));
    assert_eq!(site.list().await[0].tick.0, 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_picture_waits_for_a_renderer_that_comes_back_while_worlds_go_on() {
    let site = Site::open(config()).await;
    let world = site.create(1, None).await.unwrap();
    let lost = connect(&site.service).await;
    let (unanswered, mut jobs) = tokio::sync::mpsc::channel(1);
    let key = keys::render_job(&"r".parse().unwrap());
    let _serving =
        lost.serve(&key, move |incoming| unanswered.try_send(incoming).unwrap()).await.unwrap();
    let _announcement = announce(&lost, ServiceKind::Render, "r").await;

    let picture = async { capture(&site, world).await };
    let events = async {
        let job = jobs.recv().await.unwrap();
        lost.close().await;
        drop(job);
        site.tick(crate::common::ticks(world, 1)).await.unwrap();
        let restarted = connect(&site.service).await;
        let drawing = draw(&restarted, "r").await;
        (restarted, drawing)
    };
    let (reply, _restarted) = tokio::join!(picture, events);
    let Ok(Reply::Images(images)) = reply else { panic!("{reply:?}") };
    assert_eq!(images.tick.0, 0, "the picture is of the moment it was asked for");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_picture_that_nobody_can_draw_says_so_in_time() {
    let site = Site::open(config()).await;
    let world = site.create(1, None).await.unwrap();
    let asked = Instant::now();
    let error = capture(&site, world).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::RendererUnavailable, "{error}");
    assert!(asked.elapsed() < deadline() / 2, "{:?}", asked.elapsed());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_renderer_that_cannot_draw_is_final() {
    let site = Site::open(config()).await;
    let world = site.create(1, None).await.unwrap();
    let renderer = connect(&site.service).await;
    let refusal = Error::new(ErrorCode::RendererUnavailable, "no adapter");
    let (answer, key) = (refusal.clone(), keys::render_job(&"r".parse().unwrap()));
    let _serving =
        renderer.serve(&key, move |incoming| incoming.refuse(answer.clone())).await.unwrap();
    let _announcement = announce(&renderer, ServiceKind::Render, "r").await;
    let asked = Instant::now();
    assert_eq!(capture(&site, world).await, Err(refusal));
    assert!(asked.elapsed() < Duration::from_secs(4), "{:?}", asked.elapsed());
}
