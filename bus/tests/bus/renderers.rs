//! Jobs wait for a renderer that comes back, and no longer than they have to.

use std::time::{Duration, Instant};

use bus::{Bus, BusConfig, Incoming, Serving};
use schemas::{Error, ErrorCode, Frame, Images, Reply, keys};

use crate::common::{Site, announce_renderer, deadline, job, renderer, renderers};

/// Answers jobs with no pictures.
async fn draw(bus: &Bus) -> Serving {
    let key = keys::render_job(&renderer());
    let answer = |incoming: Incoming| {
        let Frame { tick, state_hash, .. } = incoming.render_job().unwrap().frame;
        incoming.reply(&Reply::Images(Images { tick, state_hash, images: Vec::new() }));
    };
    bus.serve(&key, answer).await.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_waits_for_a_renderer_that_comes_back() {
    let site = Site::open().await;
    let connect = || Bus::open(BusConfig::connecting(site.service.listening()[0].clone()));
    let lost = connect().await.unwrap();
    let (unanswered, mut jobs) = tokio::sync::mpsc::channel(1);
    let key = keys::render_job(&renderer());
    let _serving =
        lost.serve(&key, move |incoming| unanswered.try_send(incoming).unwrap()).await.unwrap();
    let _up = announce_renderer(&lost).await;

    let renderers = renderers(&site.client);
    let job = job(1);
    let events = async {
        let asked = jobs.recv().await.unwrap();
        lost.close().await;
        drop(asked);
        let restarted = connect().await.unwrap();
        let drawing = draw(&restarted).await;
        let up = announce_renderer(&restarted).await;
        (restarted, drawing, up)
    };
    let (images, _restarted) = tokio::join!(renderers.draw(&job), events);
    assert_eq!(images.unwrap().tick, job.frame.tick);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_whose_renderer_is_gone_and_has_not_said_no_is_drawn_by_the_next() {
    let site = Site::open().await;
    let (unanswered, mut jobs) = tokio::sync::mpsc::channel(1);
    let key = keys::render_job(&renderer());
    let lost = site.service.serve(&key, move |incoming| unanswered.try_send(incoming).unwrap());
    let lost = lost.await.unwrap();
    let up = announce_renderer(&site.service).await;

    let renderers = renderers(&site.client);
    let job = job(1);
    let asked_at = Instant::now();
    let events = async {
        // Kept until the end: the question stays open.
        let asked = jobs.recv().await.unwrap();
        drop((lost, up));
        let drawing = draw(&site.service).await;
        (asked, drawing, announce_renderer(&site.service).await)
    };
    let (images, _restarted) = tokio::join!(renderers.draw(&job), events);
    assert_eq!(images.unwrap().tick, job.frame.tick);
    assert!(asked_at.elapsed() < Duration::from_secs(20), "{:?}", asked_at.elapsed());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_that_nobody_can_draw_says_so_in_time() {
    let site = Site::open().await;
    let asked = Instant::now();
    let error = renderers(&site.client).draw(&job(1)).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::RendererUnavailable, "{error}");
    assert!(asked.elapsed() < deadline(), "{:?}", asked.elapsed());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_renderer_that_cannot_draw_is_final() {
    let site = Site::open().await;
    let refusal = Error::new(ErrorCode::RendererUnavailable, "no adapter");
    let (answer, key) = (refusal.clone(), keys::render_job(&renderer()));
    let _serving =
        site.service.serve(&key, move |incoming| incoming.refuse(answer.clone())).await.unwrap();
    let _up = announce_renderer(&site.service).await;
    let asked = Instant::now();
    assert_eq!(renderers(&site.client).draw(&job(1)).await, Err(refusal));
    assert!(asked.elapsed() < Duration::from_secs(4), "{:?}", asked.elapsed());
}
