//! Connections of the face: each has a seat, and nothing that a client leaves half done lasts.

use std::convert::Infallible;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::ConnectInfo;
use axum::http::{Request, StatusCode};
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service as _, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use seats::Seats;
use tokio::sync::Semaphore;

use super::access::Peer;
use super::line::{Line, Waits};
use super::{Face, http};
use crate::limits::{
    BODY_WAIT, GUESTS_MAX, HEAD_BYTES_MAX, HEAD_WAIT, LARGE_MAX, LARGE_WAIT, WRITE_WAIT,
};
use crate::listener::FaceListener;

/// How many may be connected, and how long each may take for what.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    /// Connections at once.
    pub(crate) seats: usize,
    /// For the head of a request, or its first byte.
    pub(crate) head: Duration,
    /// For the body of a request.
    pub(crate) body: Duration,
    /// For a large message or body, once it has a place.
    pub(crate) large: Duration,
    /// For taking a byte of an answer.
    pub(crate) write: Duration,
}

impl Bounds {
    /// So many sessions may have a connection, and others ask beside them.
    pub(crate) fn for_sessions(max: u32) -> Self {
        let seats = GUESTS_MAX.saturating_add(max as usize);
        Self { seats, head: HEAD_WAIT, body: BODY_WAIT, large: LARGE_WAIT, write: WRITE_WAIT }
    }
}

/// Serves whoever connects, for ever.
pub(crate) async fn serve(
    mut listener: FaceListener,
    face: Arc<Face>,
    bounds: Bounds,
) -> Infallible {
    let router = http::router(face, bounds.body);
    let (seats, places) = (Seats::new(bounds.seats), Arc::new(Semaphore::new(LARGE_MAX)));
    let waits = Waits { large: bounds.large, write: bounds.write };
    loop {
        let (socket, peer) = listener.accept(&seats).await;
        let seat = seats.take(peer.ip()).await;
        let line = Line::new(socket, seat, Arc::clone(&places), waits);
        tokio::spawn(converse(line, peer, router.clone(), bounds.head));
    }
}

/// Answers the requests of one connection until it ends, is silent for too long, or becomes a
/// WebSocket.
async fn converse(line: Line, peer: SocketAddr, router: Router, head_wait: Duration) {
    let meter = Arc::clone(&line.meter);
    let router = TowerToHyperService::new(router);
    let answer = |mut request: Request<Incoming>| {
        meter.seat.begin();
        request.extensions_mut().insert(ConnectInfo(Peer(peer)));
        request.extensions_mut().insert(Arc::clone(&meter));
        let (meter, answering) = (Arc::clone(&meter), router.call(request));
        async move {
            let answer = answering.await?;
            meter.finish();
            if answer.status() != StatusCode::SWITCHING_PROTOCOLS {
                meter.seat.rest();
            }
            Ok::<_, Infallible>(answer)
        }
    };
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(head_wait)
        .max_buf_size(HEAD_BYTES_MAX)
        .serve_connection(TokioIo::new(line), service_fn(answer))
        .with_upgrades();
    tokio::select! {
        ended = connection => {
            if let Err(cause) = ended {
                tracing::debug!(%peer, %cause, "a connection ended");
            }
        }
        _ = meter.seat.wanted() => tracing::debug!(%peer, "a silent connection gives way"),
    }
}
