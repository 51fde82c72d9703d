//! The listener.

use std::convert::Infallible;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use bytes::Bytes;
use http_body_util::Full;
use hyper::body::Incoming;
use hyper::header::{ALLOW, CONTENT_TYPE, HeaderValue, ORIGIN};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use monitoring::Monitor;
use seats::{Seat, Seats};
use tokio::net::{TcpListener, TcpStream};

use crate::answer::{Answer, Question, answer};
use crate::process;

/// Connections at once; who is silent gives way to who comes.
const CONNECTIONS_MAX: usize = 32;
/// How long one may say nothing, and last.
const HEAD_WAIT: Duration = Duration::from_secs(5);
const CONNECTION_TIME: Duration = Duration::from_secs(60);
/// Of a request's head.
const HEAD_BYTES_MAX: usize = 16 * 1024;

/// Answers at this address until the process ends, on a thread of its own; gives the address, with
/// its port. The figures of the process itself join the monitor's.
///
/// # Errors
/// The system's, when the address cannot be used.
pub fn serve(address: SocketAddr, monitor: &Monitor) -> io::Result<SocketAddr> {
    let listener = std::net::TcpListener::bind(address)?;
    listener.set_nonblocking(true)?;
    let address = listener.local_addr()?;
    // With threads: what is read for figures may block, as the transport does.
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name("admin")
        .enable_all()
        .build()?;
    process::export(monitor.metrics());
    let monitor = monitor.clone();
    let serving = move || {
        let Err(cause) = runtime.block_on(accept_all(listener, monitor));
        tracing::error!(%cause, "nobody can ask how this process is");
    };
    std::thread::Builder::new().name("admin".to_owned()).spawn(serving)?;
    Ok(address)
}

async fn accept_all(listener: std::net::TcpListener, monitor: Monitor) -> io::Result<Infallible> {
    let listener = TcpListener::from_std(listener)?;
    let seats = Seats::new(CONNECTIONS_MAX);
    loop {
        let (stream, peer) = seats.accept(&listener).await;
        let seat = seats.take(peer.ip()).await;
        let monitor = monitor.clone();
        tokio::spawn(async move { converse(stream, peer, &seat, &monitor).await });
    }
}

async fn converse(stream: TcpStream, peer: SocketAddr, seat: &Seat, monitor: &Monitor) {
    let is_local = peer.ip().to_canonical().is_loopback();
    let service = service_fn(|request: Request<Incoming>| {
        let question = Question {
            method: request.method().as_str(),
            path: request.uri().path(),
            is_local,
            is_of_page: request.headers().contains_key(ORIGIN),
        };
        let response = response(answer(monitor, question));
        async move { Ok::<_, Infallible>(response) }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_WAIT)
        .max_buf_size(HEAD_BYTES_MAX)
        .serve_connection(TokioIo::new(stream), service);
    // Answers are short, so that its connection is as good as silent whatever it does.
    tokio::select! {
        ended = connection => {
            if let Err(cause) = ended {
                tracing::debug!(%peer, %cause, "a connection ended");
            }
        }
        () = tokio::time::sleep(CONNECTION_TIME) => {}
        _ = seat.wanted() => {}
    }
}

fn response(answer: Answer) -> Response<Full<Bytes>> {
    let mut response = Response::new(Full::new(Bytes::from(answer.body)));
    *response.status_mut() =
        StatusCode::from_u16(answer.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
    let headers = response.headers_mut();
    headers.insert(CONTENT_TYPE, HeaderValue::from_static(answer.content_type));
    if let Some(allow) = answer.allow {
        headers.insert(ALLOW, HeaderValue::from_static(allow));
    }
    response
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::{Ipv4Addr, TcpStream as StdStream};

    use super::*;
    use crate::ask;

    const PATIENCE: Duration = Duration::from_secs(30);

    fn served(monitor: &Monitor) -> SocketAddr {
        serve((Ipv4Addr::LOCALHOST, 0).into(), monitor).unwrap()
    }

    /// What comes back of these bytes, to the end of the connection.
    fn raw(address: SocketAddr, bytes: &[u8]) -> String {
        let mut stream = StdStream::connect(address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut answer = Vec::new();
        // A connection that is cut off has said what it had to say.
        let _ = stream.write_all(bytes);
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    #[test]
    fn it_answers_what_is_asked_and_cuts_off_what_is_no_question() {
        let monitor = Monitor::new("world", "0.1", Duration::ZERO);
        let address = served(&monitor);
        let told = ask(address, "GET", "/readyz", PATIENCE).unwrap();
        assert_eq!((told.status, told.is_good()), (503, false));
        monitor.set_started();
        let told = ask(address, "GET", "/readyz", PATIENCE).unwrap();
        assert!(told.is_good() && told.body.contains("ready"), "{told:?}");
        assert_eq!(ask(address, "POST", "/drain", PATIENCE).unwrap().status, 200);
        assert!(monitor.is_draining());
        let metrics = ask(address, "GET", "/metrics", PATIENCE).unwrap().body;
        assert!(metrics.contains("process_resident_memory_bytes "), "{metrics}");
        assert!(raw(address, b"nonsense\r\n\r\n").starts_with("HTTP/1.1 400"));
        let long = format!("GET /{} HTTP/1.1\r\n\r\n", "x".repeat(2 * HEAD_BYTES_MAX));
        let refused = raw(address, long.as_bytes());
        assert!(!refused.starts_with("HTTP/1.1 200"), "{refused}");
        assert!(ask(address, "GET", "/livez", PATIENCE).unwrap().is_good());
    }

    #[test]
    fn who_says_nothing_keeps_nobody_out() {
        let address = served(&Monitor::default());
        let silent: Vec<StdStream> =
            (0..CONNECTIONS_MAX).map(|_| StdStream::connect(address).unwrap()).collect();
        assert!(ask(address, "GET", "/livez", PATIENCE).unwrap().is_good());
        drop(silent);
    }
}
