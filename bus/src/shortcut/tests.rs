//! Peers that ask too much, read too little or promise what they do not send.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream as StdStream;

use schemas::Reply;

use super::serving::CONNECTIONS_MAX;
use super::*;
use crate::{BusAddress, BusConfig};

#[tokio::test(flavor = "multi_thread")]
async fn who_finds_no_room_is_told_before_asking() {
    let bus = Bus::open(BusConfig::listening(BusAddress::loopback(0))).await.unwrap();
    let (name, _listening) =
        bus.listen_for_shortcuts("key", |asked| asked.reply(&Reply::Done)).unwrap();
    let address = SocketAddr::from_abstract_name(name).unwrap();
    let shortcut = Shortcut { key: String::new(), address, idle: Mutex::default() };
    let mut inside = Vec::new();
    for _ in 0..CONNECTIONS_MAX {
        inside.push(shortcut.connect().await.unwrap());
    }
    assert!(shortcut.connect().await.is_err());
    drop(inside.pop());
    let begun = std::time::Instant::now();
    while shortcut.connect().await.is_err() {
        assert!(begun.elapsed() < Duration::from_secs(10), "the seat stays taken");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn who_promises_too_much_is_cut_off_and_others_are_served() {
    let bus = Bus::open(BusConfig::listening(BusAddress::loopback(0))).await.unwrap();
    let (name, _listening) =
        bus.listen_for_shortcuts("key", |asked| asked.reply(&Reply::Done)).unwrap();
    let address = SocketAddr::from_abstract_name(name).unwrap();
    let hostile = tokio::task::spawn_blocking({
        let address = address.clone();
        move || {
            let mut stream = StdStream::connect_addr(&address).unwrap();
            stream.read_exact(&mut [0]).unwrap();
            stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
            stream.write_all(&[0, 255, 255, 255, 255]).unwrap();
            stream.read(&mut [0; 8]).unwrap()
        }
    });
    assert_eq!(hostile.await.unwrap(), 0, "the connection stays open");
    let shortcut = Shortcut { key: String::new(), address, idle: Mutex::default() };
    let connection = shortcut.connect().await.unwrap();
    let asked = connection.ask(&[1, 2, 3], Duration::from_secs(10)).await;
    assert_eq!(asked.unwrap().unwrap(), schemas::wire::encode_reply(&Reply::Done));
    assert_eq!(shortcut.lock().len(), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn who_does_not_read_keeps_nobody_who_answers() {
    const BYTES: usize = 3_000_000;
    let bus = Bus::open(BusConfig::listening(BusAddress::loopback(0))).await.unwrap();
    let (answered, answers) = std::sync::mpsc::channel();
    let answer = move |asked: crate::Incoming| {
        asked.reply_bytes(vec![7; BYTES]);
        answered.send(()).unwrap();
    };
    let (name, _listening) = bus.listen_for_shortcuts("key", answer).unwrap();
    let address = SocketAddr::from_abstract_name(name).unwrap();
    tokio::task::spawn_blocking(move || {
        let mut stream = StdStream::connect_addr(&address).unwrap();
        stream.read_exact(&mut [0]).unwrap();
        stream.write_all(&[0, 1, 0, 0, 0, 9]).unwrap();
        answers.recv_timeout(Duration::from_secs(10)).expect("whoever answers waits");
        // Nothing is lost of what the asker reads late.
        let mut answer = vec![0; HEAD_BYTES + BYTES];
        stream.read_exact(&mut answer).unwrap();
        assert!(answer[HEAD_BYTES..].iter().all(|byte| *byte == 7));
    })
    .await
    .unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn who_asks_on_without_reading_is_cut_off() {
    let bus = Bus::open(BusConfig::listening(BusAddress::loopback(0))).await.unwrap();
    let answer = |asked: crate::Incoming| asked.reply_bytes(vec![7; 3_000_000]);
    let (name, _listening) = bus.listen_for_shortcuts("key", answer).unwrap();
    let address = SocketAddr::from_abstract_name(name).unwrap();
    tokio::task::spawn_blocking(move || {
        let mut stream = StdStream::connect_addr(&address).unwrap();
        stream.read_exact(&mut [0]).unwrap();
        let begun = std::time::Instant::now();
        while stream.write_all(&[0, 1, 0, 0, 0, 9]).is_ok() {
            assert!(begun.elapsed() < Duration::from_secs(5), "every question is taken");
            std::thread::sleep(Duration::from_millis(50));
        }
    })
    .await
    .unwrap();
}
