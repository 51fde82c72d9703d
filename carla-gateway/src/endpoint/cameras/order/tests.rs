use schemas::{Error, ErrorCode, Exposure, Frame, MapRef, Reply, Request, WorldId};

use super::*;
use crate::dialect::{Actor, AttributeValue};
use crate::site::Later;

const SIDE_PX: u32 = 512;
const STREAM: StreamId = StreamId(7);

/// A site that draws white.
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
        Box::pin(std::future::ready(Ok(cameras.into_iter().map(image).collect())))
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

/// One colour picture with much to do to it.
fn order(hub: &Arc<Hub>) -> (Order, Camera) {
    let mut actor = Actor::default();
    let asked = [("exposure_mode", "histogram"), ("bloom_intensity", "5"), ("gamma", "1")];
    actor.description.attributes = asked
        .map(|(id, value)| AttributeValue { id: id.to_owned(), kind: 4, value: value.to_owned() })
        .to_vec();
    let camera = Camera {
        id: 0,
        carrier: None,
        carrier_from_camera: Pose::identity(),
        width_px: SIDE_PX,
        height_px: SIDE_PX,
        horizontal_fov_rad: 1.0,
        kind: ImageKind::Rgb,
        encoding: ImageEncoding::Rgba8,
        jpeg_quality: 90,
        quality: None,
        ignored: Vec::new(),
        exposure: Exposure::PLAIN,
    };
    let ordered = Ordered {
        world_from_camera: Pose::identity(),
        world_from_camera_before: Pose::identity(),
        horizontal_fov_rad: 1.0,
        images: vec![(ImageKind::Rgb, 0)],
        outputs: vec![Output { stream: STREAM, film: Film::Plain(ImageKind::Rgb), reaction: None }],
        optics: Optics::of(&actor).unwrap(),
    };
    let order = Order {
        hub: Arc::clone(hub),
        site: Arc::new(White),
        allowance: Allowance::open("local".parse().unwrap()),
        event_memories: Arc::default(),
        cameras: vec![ordered],
        movement: Movement::default(),
        shapes: Arc::default(),
        frame_number: 1,
        sim_secs: 0.0,
        is_night: false,
        waits: true,
    };
    (order, camera)
}

/// Everything else of this thread goes on, e.g. other clients.
#[tokio::test]
async fn a_picture_that_takes_long_to_finish_holds_nobody_up() {
    let hub = Arc::new(Hub::new());
    hub.open(STREAM, false);
    let mut listener = hub.listen(STREAM).unwrap();
    let (order, camera) = order(&hub);
    let map = MapRef { name: "Town".to_owned(), digest: "0".repeat(64) };
    let frame = schemas::wire::encode_frame(&Frame::empty(WorldId::new(1).unwrap(), map));
    let frame = SharedFrame::decode(frame).unwrap();
    let delivering = tokio::spawn(order.deliver(frame, vec![camera], Staging::default()));
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
