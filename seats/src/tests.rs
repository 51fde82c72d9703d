use std::net::Ipv4Addr;

use super::*;

const HERE: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);
/// In tests.
const GRACE: Duration = Duration::from_millis(5);
const ELSEWHERE: IpAddr = IpAddr::V4(Ipv4Addr::new(10, 0, 0, 9));

/// Whether a connection was asked to end.
async fn is_wanted(seat: &Seat) -> bool {
    tokio::time::timeout(Duration::from_millis(50), seat.wanted()).await.is_ok()
}

#[tokio::test]
async fn the_one_that_is_silent_longest_gives_way_and_who_is_served_does_not() {
    let seats = Seats::with_grace(3, 3, GRACE);
    let served = seats.take(HERE).await;
    served.begin();
    let oldest = seats.take(HERE).await;
    tokio::time::sleep(GRACE).await;
    let younger = seats.take(HERE).await;
    let newcomer = tokio::spawn({
        let seats = seats.clone();
        async move { seats.take(HERE).await }
    });
    oldest.wanted().await;
    assert!(!is_wanted(&younger).await && !is_wanted(&served).await);
    assert!(!newcomer.is_finished(), "its seat is not free yet");
    drop(oldest);
    let newcomer = newcomer.await.unwrap();
    assert_eq!(seats.taken(), 3);
    drop((newcomer, younger, served));
    assert_eq!(seats.taken(), 0);
}

#[tokio::test]
async fn of_several_addresses_the_one_with_most_silent_connections_loses_one() {
    let seats = Seats::with_grace(4, 4, GRACE);
    let honest = seats.take(ELSEWHERE).await;
    tokio::time::sleep(GRACE).await;
    let mut crowd = Vec::new();
    for _ in 0..3 {
        crowd.push(seats.take(HERE).await);
    }
    tokio::time::sleep(GRACE).await;
    tokio::spawn(async move { seats.take(ELSEWHERE).await });
    crowd[0].wanted().await;
    assert!(!is_wanted(&honest).await, "it came first, and is alone");
}

#[tokio::test]
async fn who_finds_everybody_served_waits_until_somebody_rests_or_leaves() {
    let seats = Seats::with_grace(1, 1, GRACE);
    let served = seats.take(HERE).await;
    served.begin();
    let newcomer = tokio::spawn({
        let seats = seats.clone();
        async move { seats.take(HERE).await }
    });
    assert!(!is_wanted(&served).await);
    served.rest();
    served.wanted().await;
    drop(served);
    newcomer.await.unwrap();
}

#[tokio::test]
async fn where_more_rest_than_may_the_one_that_has_rested_longest_goes_though_seats_are_free() {
    let seats = Seats::with_grace(8, 2, GRACE);
    // Silent as well, but it has not been served yet.
    let unheard = seats.take(HERE).await;
    let mut resting = Vec::new();
    for _ in 0..2 {
        let seat = seats.take(HERE).await;
        seat.begin();
        seat.rest();
        resting.push(seat);
    }
    assert!(!is_wanted(&resting[0]).await && !is_wanted(&resting[1]).await);
    let third = seats.take(HERE).await;
    third.begin();
    assert!(!is_wanted(&resting[0]).await, "the third is served");
    third.rest();
    assert_eq!(resting[0].wanted().await, Reason::TooManyRest);
    assert!(
        !is_wanted(&resting[1]).await && !is_wanted(&third).await && !is_wanted(&unheard).await
    );
}

#[tokio::test]
async fn who_gives_way_to_a_newcomer_is_told_so() {
    let seats = Seats::with_grace(1, 1, GRACE);
    let silent = seats.take(HERE).await;
    tokio::spawn(async move { seats.take(HERE).await });
    assert_eq!(silent.wanted().await, Reason::Newcomer);
}

#[tokio::test]
async fn who_has_just_come_is_given_time_to_say_something() {
    let seats = Seats::with_grace(1, 1, Duration::from_secs(600));
    let first = seats.take(HERE).await;
    tokio::spawn(async move { seats.take(HERE).await });
    assert!(!is_wanted(&first).await);
}

#[tokio::test]
async fn a_connection_is_asked_now_and_then_whether_its_peer_is_there() {
    let listener = TcpListener::bind((HERE, 0)).await.unwrap();
    let _client = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
    let (stream, _) = Seats::new(1).accept(&listener).await;
    assert!(stream.nodelay().unwrap() && sockopt::socket_keepalive(&stream).unwrap());
    assert_eq!(sockopt::tcp_keepidle(&stream).unwrap(), KEEPALIVE_IDLE);
}

#[tokio::test]
async fn a_system_without_room_is_asked_again_after_a_pause_and_somebody_silent_gives_way() {
    let before = rustix::process::getrlimit(rustix::process::Resource::Nofile);
    let listener = TcpListener::bind((HERE, 0)).await.unwrap();
    let client = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
    let seats = Seats::with_grace(8, 8, GRACE);
    let silent = seats.take(HERE).await;
    tokio::time::sleep(GRACE).await;
    // No more handles than there are.
    let none = rustix::process::Rlimit { current: Some(1), maximum: before.maximum };
    rustix::process::setrlimit(rustix::process::Resource::Nofile, none).unwrap();
    let accepting = tokio::spawn({
        let seats = seats.clone();
        async move { seats.accept(&listener).await }
    });
    silent.wanted().await;
    assert!(!accepting.is_finished());
    rustix::process::setrlimit(rustix::process::Resource::Nofile, before).unwrap();
    accepting.await.unwrap();
    drop(client);
}
