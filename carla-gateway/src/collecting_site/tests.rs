use std::future::ready;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use schemas::{EncodedFrame, ErrorCode, Tick, WorldInfo};

use super::*;

/// A world service whose answers may be lost, and questions too.
#[derive(Default)]
struct Lossy {
    worlds: Mutex<Vec<(WorldId, ServiceId)>>,
    loses_answers: AtomicBool,
    loses_questions: AtomicBool,
    /// Services come and go.
    changes: watch::Sender<u64>,
}

fn id(name: &str) -> ServiceId {
    name.parse().unwrap()
}

fn create() -> Request {
    Request::CreateWorld {
        map: "Town".to_owned(),
        seed: 1,
        dt_secs: 0.05,
        commands: Vec::new(),
        lease: None,
        traffic: true,
        first_actor: schemas::ActorId::FIRST,
    }
}

impl Lossy {
    fn add(&self, owner: &str) -> WorldId {
        let mut worlds = self.worlds.lock().unwrap();
        let newest = worlds.iter().map(|(world, _)| world.get()).max().unwrap_or(0);
        let world = WorldId::new(newest + 1).unwrap();
        worlds.push((world, id(owner)));
        world
    }

    fn there(&self) -> Vec<WorldId> {
        self.worlds.lock().unwrap().iter().map(|(world, _)| *world).collect()
    }

    fn answer(&self, request: &Request) -> Reply {
        match request {
            Request::CreateWorld { .. } => {
                let (frame, replies) = (EncodedFrame::default(), Vec::new());
                Reply::WorldCreated { world: self.add("gateway"), frame, replies }
            }
            Request::DestroyWorld { world } => {
                self.worlds.lock().unwrap().retain(|(there, _)| there != world);
                Reply::Done
            }
            Request::ListWorlds => {
                let info = |(world, owner): &(WorldId, ServiceId)| WorldInfo {
                    world: *world,
                    map: "Town".to_owned(),
                    tick: Tick(0),
                    actor_count: 0,
                    owner: Some(owner.clone()),
                    quarantined: None,
                    stands_for: None,
                };
                Reply::Worlds(self.worlds.lock().unwrap().iter().map(info).collect())
            }
            _ => Reply::Done,
        }
    }
}

impl Site for Lossy {
    fn ask(&self, request: Request) -> Later<'_, Reply> {
        let lost = Error::new(ErrorCode::TimedOut, "no answer in time");
        if self.loses_questions.load(Ordering::Relaxed) {
            return Box::pin(ready(Err(lost)));
        }
        let answer = self.answer(&request);
        let is_lost = self.loses_answers.load(Ordering::Relaxed);
        Box::pin(ready(if is_lost { Err(lost) } else { Ok(answer) }))
    }

    fn draw(&self, _: SharedFrame, _: Vec<Camera>, _: schemas::Staging) -> Later<'_, Vec<Image>> {
        unreachable!("nobody draws")
    }

    fn map_text(&self, _: String) -> Later<'_, Vec<u8>> {
        unreachable!("nobody reads maps")
    }

    fn can_draw(&self) -> bool {
        false
    }

    fn should_move(&self, _: WorldId) -> bool {
        false
    }

    fn changes(&self) -> watch::Receiver<u64> {
        self.changes.subscribe()
    }
}

async fn made(site: &dyn Site) -> WorldId {
    let Reply::WorldCreated { world, .. } = site.ask(create()).await.unwrap() else {
        panic!("a world")
    };
    world
}

#[tokio::test]
async fn a_world_of_which_no_answer_told_is_freed_when_none_can_come_any_more() {
    let service = Arc::new(Lossy::default());
    let site = CollectingSite::new(Arc::clone(&service) as Arc<dyn Site>, id("gateway"));
    let used = made(&site).await;
    let foreign = service.add("scenario");
    service.loses_answers.store(true, Ordering::Relaxed);
    assert!(site.ask(create()).await.is_err());
    service.loses_answers.store(false, Ordering::Relaxed);
    assert_eq!(service.there().len(), 3);

    let start = Instant::now();
    site.sweep(start).await;
    assert_eq!(service.there().len(), 3, "its answer may be on its way");
    site.sweep(start + PATIENCE.ask + Duration::from_secs(1)).await;
    assert_eq!(service.there(), [used, foreign]);
    site.sweep(start + 10 * PATIENCE.ask).await;
    assert_eq!(service.there(), [used, foreign]);
}

#[tokio::test]
async fn a_world_that_could_not_be_destroyed_is_freed_as_soon_as_its_service_is_back() {
    let service = Arc::new(Lossy::default());
    let site = CollectingSite::new(Arc::clone(&service) as Arc<dyn Site>, id("gateway"));
    let (left, used) = (made(&site).await, made(&site).await);
    service.loses_questions.store(true, Ordering::Relaxed);
    assert!(site.ask(Request::DestroyWorld { world: left }).await.is_err());
    site.sweep(Instant::now()).await;
    service.loses_questions.store(false, Ordering::Relaxed);
    assert_eq!(service.there(), [left, used]);
    site.sweep(Instant::now()).await;
    assert_eq!(service.there(), [used]);
}

#[tokio::test]
async fn a_site_that_endpoints_share_frees_what_they_left_behind_when_services_come() {
    let service = Arc::new(Lossy::default());
    let site: Arc<dyn Site> =
        CollectingSite::start(Arc::clone(&service) as Arc<dyn Site>, id("gateway"));
    let (left, used) = (made(&*site).await, made(&*site).await);
    service.loses_questions.store(true, Ordering::Relaxed);
    assert!(site.ask(Request::DestroyWorld { world: left }).await.is_err());
    service.loses_questions.store(false, Ordering::Relaxed);
    let begun = Instant::now();
    while service.there() != [used] {
        // Long before worlds are looked for without any reason.
        assert!(begun.elapsed() < Duration::from_secs(5), "nobody frees {left}");
        service.changes.send_modify(|version| *version += 1);
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}
