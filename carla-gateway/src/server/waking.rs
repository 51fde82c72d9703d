//! Wakes a Traffic Manager that has slept through a frame.

use std::net::IpAddr;
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

/// Deadline of a call to a Traffic Manager.
const CALL_DEADLINE: Duration = Duration::from_secs(2);

/// Signals the newest frame once more to a Traffic Manager.
pub(super) async fn wake(host: IpAddr, port: u16) {
    tracing::warn!(%host, port, "a Traffic Manager has slept through a frame and is woken");
    let waking = async {
        let mut manager = TcpStream::connect((host, port)).await?;
        for mode in [false, true] {
            let call = rmp_serde::to_vec(&(0, u32::from(mode), "set_synchronous_mode", (mode,)));
            manager.write_all(&call.map_err(std::io::Error::other)?).await?;
            // Of no use but for the order: the first call is over before the second.
            let _ = manager.read(&mut [0; 64]).await?;
        }
        Ok::<(), std::io::Error>(())
    };
    match tokio::time::timeout(CALL_DEADLINE, waking).await {
        Ok(Ok(())) => {}
        Ok(Err(error)) => tracing::warn!(%host, port, %error, "a Traffic Manager cannot be woken"),
        Err(_) => tracing::warn!(%host, port, "a Traffic Manager does not answer"),
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use tokio::net::TcpListener;

    use super::*;

    #[tokio::test]
    async fn waking_signals_and_leaves_the_mode_as_it_was() {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
        let port = listener.local_addr().unwrap().port();
        let waking = tokio::spawn(wake(Ipv4Addr::LOCALHOST.into(), port));
        let (mut socket, _) = listener.accept().await.unwrap();
        let mut modes = Vec::new();
        for _ in 0..2 {
            let mut call = [0; 64];
            let count = socket.read(&mut call).await.unwrap();
            let call: (u8, u32, String, (bool,)) = rmp_serde::from_slice(&call[..count]).unwrap();
            assert_eq!(call.2, "set_synchronous_mode");
            modes.push(call.3.0);
            socket.write_all(&[0x94, 1, call.1 as u8, 0xc0, 0xc0]).await.unwrap();
        }
        assert_eq!(modes, [false, true]);
        waking.await.unwrap();
    }
}
