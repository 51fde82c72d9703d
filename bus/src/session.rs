//! One process's place on the bus.

use std::sync::Arc;
use std::time::{Duration, Instant};

use schemas::wire;
use schemas::{Error, ErrorCode, RenderJob, Reply, Request, ServiceId, keys, limits};
use tokio::sync::oneshot;
use zenoh::Wait;

use crate::config::RETRY_MILLIS;
use crate::publishing::Publishing;
use crate::query::{ask, ask_all, ask_every};
use crate::{BusAddress, BusConfig, BusError};

/// Who has tried to connect for so long says so.
const TELLS_AFTER: Duration = Duration::from_secs(3);

/// One process's place on the bus. Cheap to clone; the place is given up with the last clone.
#[derive(Clone)]
pub struct Bus {
    pub(crate) session: zenoh::Session,
    listening: Vec<BusAddress>,
    pub(crate) publishing: Arc<Publishing>,
}

impl Bus {
    /// Listens and connects.
    ///
    /// # Errors
    /// [`BusError::Listen`] names the address that cannot be taken; [`BusError::Connect`] after
    /// [`BusConfig::connect_deadline`].
    pub async fn open(mut config: BusConfig) -> Result<Self, BusError> {
        for address in &mut config.listen {
            *address = address
                .with_port()
                .map_err(|cause| BusError::Listen { address: address.clone(), cause })?;
        }
        match open_in_time(&config).await? {
            Ok(session) => {
                let publishing = Arc::new(Publishing::of(session.clone()));
                Ok(Self { session, listening: config.listen, publishing })
            }
            Err(cause) => Err(why_not_opened(config, cause)),
        }
    }

    /// Where others may connect; never with port 0.
    pub fn listening(&self) -> &[BusAddress] {
        &self.listening
    }

    /// Gives up the place for all clones: what they serve ends, what they asked is unreachable.
    pub async fn close(&self) {
        if let Err(cause) = self.session.close().await {
            tracing::debug!(%cause, "the bus was closed before");
        }
    }

    /// Asks whoever serves `key`.
    ///
    /// # Errors
    /// The service's own [`Reply::Error`], or [`ErrorCode::Unreachable`] when nobody serves the key
    /// or the service dies before it answers, [`ErrorCode::TimedOut`] at the deadline,
    /// [`ErrorCode::TooLarge`] and [`ErrorCode::InvalidMessage`] when a message breaks a limit.
    pub async fn request(
        &self,
        key: &str,
        request: &Request,
        deadline: Duration,
    ) -> Result<Reply, Error> {
        self.request_bytes(key, wire::encode_request(request), deadline).await
    }

    /// [`request`](Self::request) with a request that is already encoded.
    ///
    /// # Errors
    /// As for [`request`](Self::request).
    pub async fn request_bytes(
        &self,
        key: &str,
        request: Vec<u8>,
        deadline: Duration,
    ) -> Result<Reply, Error> {
        let reply = ask(&self.session, key, request, limits::REQUEST_BYTES_MAX, deadline).await?;
        reply_of(&reply)
    }

    /// Asks all who serve `key`; one reply each.
    ///
    /// # Errors
    /// As for [`request`](Self::request), when nobody answers or one refuses.
    pub async fn request_every(
        &self,
        key: &str,
        request: &Request,
        deadline: Duration,
    ) -> Result<Vec<Reply>, Error> {
        let payload = wire::encode_request(request);
        let replies = ask_every(&self.session, key, payload, deadline).await?;
        replies.iter().map(|reply| reply_of(reply)).collect()
    }

    /// Has one renderer draw all cameras of a job. Gives its reply as it came, for whoever asked
    /// for the pictures to [decode](wire::decode_reply).
    ///
    /// # Errors
    /// As for [`request`](Self::request).
    pub async fn draw(
        &self,
        worker: &ServiceId,
        job: &RenderJob,
        deadline: Duration,
    ) -> Result<Vec<u8>, Error> {
        let (key, job) = (keys::render_job(worker), wire::encode_render_job(job));
        ask(&self.session, &key, job, limits::REPLY_BYTES_MAX, deadline).await
    }

    /// The OpenDRIVE text of a map, by its digest, from any service that has it.
    ///
    /// # Errors
    /// As for [`request`](Self::request).
    pub async fn asset(&self, digest: &str, deadline: Duration) -> Result<Vec<u8>, Error> {
        let key = keys::asset(digest);
        if keys::parse_asset(&key).is_none() {
            return Err(Error::new(ErrorCode::InvalidArgument, "not a digest")
                .wanted("64 hexadecimal characters, lower case")
                .found(digest));
        }
        ask_all(&self.session, &key, Vec::new(), limits::REQUEST_BYTES_MAX, deadline).await
    }
}

/// A verified reply; [`Reply::Error`] is the `Err` of the result.
pub(crate) fn reply_of(bytes: &[u8]) -> Result<Reply, Error> {
    match wire::decode_reply(bytes)? {
        Reply::Error(error) => Err(error),
        reply => Ok(reply),
    }
}

/// Opens the transport; who only connects tries until somebody answers, or the deadline.
async fn open_in_time(config: &BusConfig) -> Result<Result<zenoh::Session, String>, BusError> {
    let begun = Instant::now();
    let (first, pause_max) = RETRY_MILLIS;
    let (mut pause, pause_max) = (Duration::from_millis(first), Duration::from_millis(pause_max));
    let mut is_told = false;
    loop {
        let opened = open_apart(config.to_zenoh()?).await;
        let is_over = config.connect_deadline.is_some_and(|time| begun.elapsed() + pause > time);
        if opened.is_ok() || is_over || !config.only_connects() {
            return Ok(opened);
        }
        if let Err(cause) = &opened
            && !is_told
            && begun.elapsed() > TELLS_AFTER
        {
            let addresses = config.connect.clone();
            let nobody = BusError::Connect { addresses, cause: cause.clone() };
            tracing::warn!("{nobody}; waiting for one");
            is_told = true;
        }
        tokio::time::sleep(pause).await;
        pause = (pause * 3 / 2).min(pause_max);
    }
}

/// Opens the transport on a thread of its own.
///
/// Opening blocks until it is connected. On a thread of the caller's runtime it would also swallow
/// the wake-ups of whatever else that thread awaits: a server beside it then accepts nobody.
async fn open_apart(config: zenoh::Config) -> Result<zenoh::Session, String> {
    let (sender, receiver) = oneshot::channel();
    let open = move || {
        // Nobody receives when the caller has given up; then the session is closed again.
        let _ = sender.send(zenoh::open(config).wait().map_err(|cause| said(&cause.to_string())));
    };
    std::thread::Builder::new()
        .name("bus-open".to_owned())
        .spawn(open)
        .map_err(|cause| cause.to_string())?;
    receiver.await.unwrap_or_else(|_| Err("opening it panicked".to_owned()))
}

/// What the transport says, without the place in its source that it ends with.
fn said(cause: &str) -> String {
    let is_place = |rest: &str| {
        let (file, line) = rest.trim_end_matches('.').rsplit_once(':').unwrap_or_default();
        file.ends_with(".rs") && line.bytes().all(|byte| byte.is_ascii_digit())
    };
    let text = cause.rsplit_once(" at ").filter(|(_, rest)| is_place(rest));
    text.map_or(cause, |(text, _)| text).trim_end_matches(['!', '.', ' ']).to_owned()
}

/// Finds the address that cannot be taken, which the transport's text does not name reliably.
fn why_not_opened(config: BusConfig, cause: String) -> BusError {
    for address in &config.listen {
        if let Err(cause) = address.bind() {
            return BusError::Listen { address: address.clone(), cause };
        }
    }
    BusError::Connect { addresses: config.connect, cause }
}

#[cfg(test)]
mod tests {
    use super::said;

    #[test]
    fn what_the_transport_says_names_no_place_in_its_source() {
        let cause = "Unable to connect to any of [Single(tcp/router:7460)]!  at \
                     /home/of/somebody/zenoh-1.10.2/src/net/runtime/orchestrator.rs:447.";
        assert_eq!(said(cause), "Unable to connect to any of [Single(tcp/router:7460)]");
        assert_eq!(said("nobody is at home"), "nobody is at home");
    }
}
