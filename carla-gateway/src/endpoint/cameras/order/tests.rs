use schemas::limits::{CAMERAS_PER_JOB_MAX, PIXELS_PER_JOB_MAX};
use schemas::{Error, ErrorCode, Exposure, Frame, MapRef, Reply, Request, WorldId};

use super::*;
use crate::dialect::{Actor, AttributeValue};
use crate::site::Later;

const SIDE_PX: u32 = 512;
const STREAM: StreamId = StreamId(7);

/// A width that is refused.
const NEVER_PX: u32 = 13;

/// A site that draws white, as much at a time as a renderer does, but not all widths.
struct White;

impl Site for White {
    fn ask(&self, _: Request) -> Later<'_, Reply> {
        Box::pin(std::future::ready(Err(Error::new(ErrorCode::Unsupported, "nobody asks"))))
    }

    fn draw(&self, _: SharedFrame, cameras: Vec<Camera>, _: Staging) -> Later<'_, Vec<Image>> {
        let image = |camera: Camera| Image {
            camera: camera.id,
            width_px: camera.width_px,
            height_px: camera.height_px,
            kind: camera.kind,
            encoding: camera.encoding,
            data: vec![255; 4 * (camera.width_px * camera.height_px) as usize],
        };
        let pixels: u32 = cameras.iter().map(|camera| camera.width_px * camera.height_px).sum();
        let refusal = if cameras.len() > CAMERAS_PER_JOB_MAX || pixels as usize > PIXELS_PER_JOB_MAX
        {
            Some(ErrorCode::TooLarge)
        } else if cameras.iter().any(|camera| camera.width_px == NEVER_PX) {
            Some(ErrorCode::InvalidArgument)
        } else {
            None
        };
        let drawn = match refusal {
            Some(code) => Err(Error::new(code, "cannot be drawn")),
            None => Ok(cameras.into_iter().map(image).collect()),
        };
        Box::pin(std::future::ready(drawn))
    }

    fn map_text(&self, _: String) -> Later<'_, Vec<u8>> {
        Box::pin(std::future::ready(Err(Error::new(ErrorCode::Unsupported, "nobody asks"))))
    }

    fn can_draw(&self) -> bool {
        true
    }

    fn should_move(&self, _: WorldId) -> bool {
        false
    }

    fn changes(&self) -> tokio::sync::watch::Receiver<u64> {
        tokio::sync::watch::Sender::new(0).subscribe()
    }
}

/// A colour picture with much to do to it.
fn ordered(stream: StreamId, [width_px, height_px]: [u32; 2]) -> Ordered {
    let mut actor = Actor::default();
    let asked = [("exposure_mode", "histogram"), ("bloom_intensity", "5"), ("gamma", "1")];
    actor.description.attributes = asked
        .map(|(id, value)| AttributeValue { id: id.to_owned(), kind: 4, value: value.to_owned() })
        .to_vec();
    let camera = Camera {
        id: 0,
        carrier: None,
        carrier_from_camera: Pose::identity(),
        width_px,
        height_px,
        horizontal_fov_rad: 1.0,
        kind: ImageKind::Rgb,
        encoding: ImageEncoding::Rgba8,
        jpeg_quality: 90,
        quality: None,
        ignored: Vec::new(),
        exposure: Exposure::PLAIN,
    };
    Ordered {
        world_from_camera: Pose::identity(),
        world_from_camera_before: Pose::identity(),
        horizontal_fov_rad: 1.0,
        wanted: vec![camera],
        outputs: vec![Output { stream, film: Film::Plain(ImageKind::Rgb), reaction: None }],
        optics: Optics::of(&actor).unwrap(),
    }
}

fn order(hub: &Arc<Hub>, cameras: Vec<Ordered>) -> Order {
    Order {
        hub: Arc::clone(hub),
        site: Arc::new(White),
        allowance: Allowance::open("local".parse().unwrap()),
        event_memories: Arc::default(),
        cameras,
        movement: Movement::default(),
        shapes: Arc::default(),
        frame_number: 1,
        sim_secs: 0.0,
        is_night: false,
        waits: true,
    }
}

fn frame() -> SharedFrame {
    let map = MapRef { name: "Town".to_owned(), digest: "0".repeat(64) };
    let frame = schemas::wire::encode_frame(&Frame::empty(WorldId::new(1).unwrap(), map));
    SharedFrame::decode(frame).unwrap()
}

/// Everything else of this thread goes on, e.g. other clients.
#[tokio::test]
async fn a_picture_that_takes_long_to_finish_holds_nobody_up() {
    let hub = Arc::new(Hub::new());
    hub.open(STREAM, false);
    let mut listener = hub.listen(STREAM).unwrap();
    let order = order(&hub, vec![ordered(STREAM, [SIDE_PX; 2])]);
    let delivering = tokio::spawn(order.deliver(frame(), Staging::default()));
    let mut turns = 0;
    while !delivering.is_finished() {
        tokio::task::yield_now().await;
        turns += 1;
    }
    delivering.await.unwrap();
    let sent = listener.letters.recv().await.unwrap().message;
    assert!(sent.len() > 4 * (SIDE_PX * SIDE_PX) as usize);
    assert!(turns > 10, "others had {turns} turns");
}

/// More cameras, and more pixels, than one job may have; some cannot be drawn.
#[tokio::test]
async fn all_pictures_that_can_be_drawn_come_however_many_they_are() {
    let hub = Arc::new(Hub::new());
    let tiny = (0..150).map(|at| if at % 60 == 7 { [NEVER_PX, 4] } else { [4, 4] });
    let sizes: Vec<[u32; 2]> = tiny.chain([[1_920, 1_080]; 9]).chain([[3_840, 2_160]; 3]).collect();
    let streams = (1..).map(StreamId);
    let mut listeners = Vec::new();
    for (stream, _) in streams.clone().zip(&sizes) {
        hub.open(stream, false);
        listeners.push(hub.listen(stream).unwrap());
    }
    let mut cameras: Vec<Ordered> =
        streams.zip(&sizes).map(|(stream, size)| ordered(stream, *size)).collect();
    let plain = Optics::of(&Actor::default()).unwrap();
    cameras.iter_mut().for_each(|camera| camera.optics = plain.clone());
    // One needs more pictures than fit into one job.
    let last = cameras.last_mut().unwrap();
    let depth = Camera { kind: ImageKind::Depth, ..last.wanted[0].clone() };
    last.wanted.extend([depth.clone(), Camera { kind: ImageKind::Semantic, ..depth }]);
    let delivering = tokio::spawn(order(&hub, cameras).deliver(frame(), Staging::default()));
    for (listener, [width_px, height_px]) in listeners.iter_mut().zip(sizes) {
        if width_px != NEVER_PX {
            let sent = listener.letters.recv().await.unwrap().message;
            let bytes = 4 * (width_px * height_px) as usize;
            assert!((bytes..bytes + 200).contains(&sent.len()), "{}", sent.len());
        }
    }
    delivering.await.unwrap();
    assert!(listeners.iter_mut().all(|listener| listener.letters.try_recv().is_err()));
}
