//! The way of pictures past the bus: jobs and large answers arrive whole, refusals as such, and who
//! finds the shortcut closed asks on the bus.

use std::sync::Arc;

use bus::{Bus, Incoming, Renderers, Serving};
use schemas::{Error, ErrorCode, Frame, HiddenScenery, MapRef, RenderJob, ServiceId};
use schemas::{Tick, Weather, WorldId, keys};

use crate::common::{Site, tenant};

const PICTURE_BYTES: usize = 3_000_000;

fn renderer() -> ServiceId {
    "render-0".parse().unwrap()
}

fn job(seed: u64) -> RenderJob {
    let frame = Frame {
        world: WorldId::new(1).unwrap(),
        tick: Tick(7),
        epoch: 1,
        dt_secs: 0.05,
        sim_secs: 0.35,
        state_hash: 0,
        seed,
        map: MapRef { name: "Town".to_owned(), digest: "0".repeat(64) },
        weather: Weather::CLEAR_NOON,
        types: Vec::new(),
        actors: Vec::new(),
        collisions: Vec::new(),
        traffic_lights: Vec::new(),
        agents: Vec::new(),
        hidden: HiddenScenery::default(),
        halted: Vec::new(),
    };
    RenderJob { tenant: tenant(), frame, cameras: Vec::new() }
}

/// Three million bytes that tell the way and the job they are of.
fn picture(way: u8, job: &RenderJob) -> Vec<u8> {
    let mut bytes = vec![job.frame.seed as u8; PICTURE_BYTES];
    bytes[0] = way;
    bytes
}

fn answer(way: u8) -> impl Fn(Incoming) + Send + Sync + 'static {
    move |incoming| {
        assert_eq!(incoming.key(), keys::render_job(&renderer()));
        match incoming.render_job() {
            Ok(job) => incoming.reply_bytes(picture(way, &job)),
            Err(error) => incoming.refuse(error),
        }
    }
}

async fn serve_bus(bus: &Bus) -> Serving {
    bus.serve(&keys::render_job(&renderer()), answer(b'B')).await.unwrap()
}

async fn serve_shortcut(bus: &Bus, handler: impl Fn(Incoming) + Send + Sync + 'static) -> Serving {
    bus.serve_shortcut(&keys::render_job(&renderer()), handler).await.unwrap()
}

async fn known(asker: &Bus) -> Arc<Renderers> {
    let renderers = Arc::new(Renderers::default());
    renderers.note(renderer(), true);
    renderers.find_shortcut(asker, &renderer()).await;
    renderers
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_that_are_asked_at_once_get_their_own_large_answers_past_the_bus() {
    let site = Site::open().await;
    let _on_bus = serve_bus(&site.service).await;
    let _shortcut = serve_shortcut(&site.service, answer(b'S')).await;
    let renderers = known(&site.client).await;
    // More than an asker keeps connections for.
    let asking: Vec<_> = (1..=9)
        .map(|seed| {
            let (renderers, client) = (Arc::clone(&renderers), site.client.clone());
            tokio::spawn(async move {
                let job = job(seed);
                assert!(renderers.draw(&client, &job).await.unwrap() == picture(b'S', &job));
            })
        })
        .collect();
    for asked in asking {
        asked.await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_refusal_comes_by_the_shortcut_as_one() {
    let site = Site::open().await;
    let refuse = |incoming: Incoming| {
        incoming.refuse(Error::new(ErrorCode::InvalidArgument, "no such camera"));
    };
    let _shortcut = serve_shortcut(&site.service, refuse).await;
    let renderers = known(&site.client).await;
    let refusal = renderers.draw(&site.client, &job(1)).await.unwrap_err();
    assert_eq!(refusal.code, ErrorCode::InvalidArgument, "{refusal}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_shortcut_that_closes_in_mid_job_leaves_the_bus() {
    let site = Site::open().await;
    let _on_bus = serve_bus(&site.service).await;
    let (inbox, mut kept) = tokio::sync::mpsc::channel(1);
    let shortcut =
        serve_shortcut(&site.service, move |incoming| inbox.try_send(incoming).unwrap()).await;
    let renderers = known(&site.client).await;
    let drawing = {
        let (renderers, client) = (Arc::clone(&renderers), site.client.clone());
        tokio::spawn(async move { renderers.draw(&client, &job(1)).await })
    };
    let unanswered = kept.recv().await.unwrap();
    drop(shortcut);
    assert!(drawing.await.unwrap().unwrap() == picture(b'B', &job(1)));
    drop(unanswered);
    assert!(renderers.draw(&site.client, &job(2)).await.unwrap() == picture(b'B', &job(2)));
}

#[tokio::test(flavor = "multi_thread")]
async fn who_serves_no_shortcut_is_asked_on_the_bus() {
    let site = Site::open().await;
    let _on_bus = serve_bus(&site.service).await;
    let renderers = known(&site.client).await;
    assert!(renderers.draw(&site.client, &job(3)).await.unwrap() == picture(b'B', &job(3)));
}
