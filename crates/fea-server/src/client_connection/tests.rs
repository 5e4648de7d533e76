//! Tests of a client's connection, on a paused clock.

use std::sync::Arc;

use super::*;
use crate::resources::Resources;
use crate::workers::Workers;
use softgrasp_protocol::{Masks, ModelHash, Prefetch, Request};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};

const PATIENCE: Patience = Patience {
    stall: Duration::from_secs(30),
    greeting: Duration::from_secs(10),
    idle: None,
    reply: Duration::from_secs(60),
};
const MOMENT: Duration = Duration::from_millis(2);

fn room() -> Room {
    room_within(1 << 30)
}

fn room_within(memory_limit: u64) -> Room {
    let config = ServerConfig { memory_limit, ..ServerConfig::default() };
    Room::new(Arc::new(Resources::new(config, Workers::new(1, 1).unwrap())))
}

fn request_id(incoming: Result<Incoming, SessionError>) -> u64 {
    match incoming {
        Ok(Incoming::Request { frame, .. }) => frame.request_id(),
        other => panic!("{other:?}"),
    }
}

/// A connection, the client's end of it, and the bytes of a request. The clock of these tests is paused:
/// it jumps to the next timer when all tasks are idle.
fn connected() -> (ClientConnection<DuplexStream>, DuplexStream, Vec<u8>) {
    let (client, server) = duplex(1 << 10);
    let mut bytes = Vec::new();
    Request::Ping { nonce: 7 }.encode_into(1, &Limits::default(), &mut bytes).unwrap();
    let mut connection = ClientConnection::new(server, Limits::default(), PATIENCE, true, room());
    connection.make_known(Limits::default());
    (connection, client, bytes)
}

#[tokio::test(start_paused = true)]
async fn client_that_stops_inside_a_frame_is_not_waited_for_twice_as_long_as_said() {
    for idle in [0, 1, 29, 31, 3600].map(Duration::from_secs) {
        let (mut connection, mut client, bytes) = connected();
        let sender = async {
            sleep(idle).await;
            client.write_all(&bytes[..bytes.len() - 1]).await.unwrap();
            Instant::now()
        };
        let (ended, last_byte) = tokio::join!(connection.next_frame(), sender);
        assert!(matches!(ended, Err(SessionError::Stalled(_))), "{ended:?}");
        // The runtime's timer counts milliseconds.
        let over = last_byte.elapsed().checked_sub(PATIENCE.stall).expect("not too soon");
        assert!(over <= MOMENT, "{over:?} late after {idle:?} between frames");
    }
}

#[tokio::test(start_paused = true)]
async fn client_whose_bytes_come_slowly_is_waited_for() {
    let (mut connection, mut client, bytes) = connected();
    let sender = async {
        let (header, payload) = bytes.split_at(HEADER_LEN);
        client.write_all(header).await.unwrap();
        for byte in payload {
            sleep(PATIENCE.stall - Duration::from_millis(10)).await;
            client.write_all(&[*byte]).await.unwrap();
        }
    };
    let (frame, ()) = tokio::join!(connection.next_frame(), sender);
    assert_eq!(request_id(frame), 1);
}

#[tokio::test(start_paused = true)]
async fn header_that_comes_byte_by_byte_is_there_in_time_or_given_up() {
    for (pause_ms, is_in_time) in [(300, true), (350, false)] {
        for idle in [0, 7, 3600].map(Duration::from_secs) {
            let (mut connection, mut client, bytes) = connected();
            let sender = async {
                sleep(idle).await;
                let start = Instant::now();
                for byte in &bytes {
                    if client.write_all(&[*byte]).await.is_err() {
                        break;
                    }
                    sleep(Duration::from_millis(pause_ms)).await;
                }
                start
            };
            let ended = async {
                let ended = connection.next_frame().await;
                (ended, Instant::now())
            };
            let ((ended, at), start) = tokio::join!(ended, sender);
            match is_in_time {
                true => assert!(matches!(ended.unwrap(), Incoming::Request { .. })),
                false => {
                    assert!(matches!(ended, Err(SessionError::NoHeader(_))), "{ended:?}");
                    let took = at.duration_since(start);
                    assert!(took >= PATIENCE.greeting && took <= PATIENCE.greeting + MOMENT);
                }
            }
        }
    }
}

#[tokio::test(start_paused = true)]
async fn stranger_that_does_not_speak_is_given_up_and_a_known_client_is_not() {
    for wants_token in [false, true] {
        let (client, server) = duplex(1 << 10);
        let mut connection =
            ClientConnection::new(server, Limits::default(), PATIENCE, wants_token, room());
        let start = Instant::now();
        let ended = connection.next_frame().await;
        assert!(matches!(ended, Err(SessionError::Stranger(_))), "{ended:?}");
        let over = start.elapsed().checked_sub(PATIENCE.greeting).expect("not too soon");
        assert!(over <= MOMENT);
        drop(client);
    }
    let (mut connection, mut client, bytes) = connected();
    let sender = async {
        sleep(Duration::from_secs(24 * 3600)).await;
        client.write_all(&bytes).await.unwrap();
    };
    let (frame, ()) = tokio::join!(connection.next_frame(), sender);
    assert!(matches!(frame.unwrap(), Incoming::Request { .. }));
}

#[tokio::test(start_paused = true)]
async fn first_request_may_be_long_only_where_no_token_is_wanted() {
    for wants_token in [false, true] {
        let (mut client, server) = duplex(1 << 10);
        let (_, _, bytes) = connected();
        let mut connection =
            ClientConnection::new(server, Limits::default(), PATIENCE, wants_token, room());
        let sender = async {
            let (first, last) = bytes.split_at(HEADER_LEN);
            client.write_all(first).await.unwrap();
            sleep(2 * PATIENCE.greeting).await;
            let _ = client.write_all(last).await;
        };
        let (frame, ()) = tokio::join!(connection.next_frame(), sender);
        assert_eq!(frame.is_ok(), !wants_token, "{frame:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn time_in_which_the_server_does_not_read_is_not_held_against_the_client() {
    for left in [1, HEADER_LEN] {
        let (mut connection, mut client, bytes) = connected();
        let (first, last) = bytes.split_at(bytes.len() - left);
        client.write_all(&[&bytes, first].concat()).await.unwrap();
        assert!(matches!(connection.next_frame().await.unwrap(), Incoming::Request { .. }));
        sleep(10 * PATIENCE.stall).await;
        let sender = async {
            sleep(PATIENCE.greeting / 2).await;
            client.write_all(last).await.unwrap();
        };
        let (frame, ()) = tokio::join!(connection.next_frame(), sender);
        assert!(matches!(frame.unwrap(), Incoming::Request { .. }));
    }
}

#[tokio::test(start_paused = true)]
async fn client_that_rests_is_given_up_when_its_time_is_over_and_not_before() {
    let limit = Duration::from_secs(50);
    for (rests, is_in_time) in [(49, true), (51, false)] {
        let (mut connection, mut client, bytes) = connected();
        connection.patience.idle = Some(limit);
        let start = Instant::now();
        let sender = async {
            sleep(Duration::from_secs(rests)).await;
            let _ = client.write_all(&bytes).await;
        };
        let ended = async { (connection.next_frame().await, start.elapsed()) };
        let ((ended, took), ()) = tokio::join!(ended, sender);
        match is_in_time {
            true => assert!(matches!(ended.unwrap(), Incoming::Request { .. })),
            false => {
                assert!(matches!(ended, Err(SessionError::Idle(_))), "{ended:?}");
                assert!((limit..limit + MOMENT).contains(&took), "{took:?}");
            }
        }
    }
}

#[tokio::test(start_paused = true)]
async fn reply_that_is_not_taken_is_given_up_after_the_time_for_its_size() {
    // 3 s for its size; the pipe holds the first KiB.
    let reply = vec![0; 3 * REPLY_BYTES_PER_S as usize];
    let limit = PATIENCE.reply + Duration::from_secs(3);
    for (pause, is_taken) in [(limit - MOMENT, true), (limit + MOMENT, false)] {
        let (mut connection, mut client, _) = connected();
        let start = Instant::now();
        let writer = async { (connection.write_bytes(&reply).await, start.elapsed()) };
        let reader = async {
            sleep(pause).await;
            let mut taken = vec![0; reply.len()];
            client.read_exact(&mut taken).await
        };
        let (written, took) = match is_taken {
            true => tokio::join!(writer, reader).0,
            false => writer.await,
        };
        assert_eq!(written.is_ok(), is_taken, "{written:?} after {took:?}");
        assert!(is_taken || (limit..limit + MOMENT).contains(&took), "{took:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn client_that_goes_during_its_request_is_noticed_and_one_that_waits_is_not() {
    // It is gone without a word.
    let (mut connection, client, _) = connected();
    let start = Instant::now();
    let goes = async {
        sleep(Duration::from_secs(3)).await;
        drop(client);
    };
    let (gone, ()) = tokio::join!(connection.watch(1), goes);
    assert!(matches!(gone, Watched::Gone(SessionError::Gone)), "{gone:?}");
    assert!(start.elapsed() >= Duration::from_secs(3) + HALF_CLOSED_MAX);
    // It waits, and has sent its next request meanwhile.
    let (mut connection, mut client, bytes) = connected();
    client.write_all(&bytes).await.unwrap();
    let waits = timeout(Duration::from_secs(3600), connection.watch(7)).await;
    assert!(waits.is_err(), "{:?}", waits);
    assert!(
        matches!(connection.next_frame().await.unwrap(), Incoming::Request { .. }),
        "nothing is lost"
    );
    // It sends without end: only a little is taken.
    let (mut connection, mut client, _) = connected();
    let sends = async {
        let mut sent = 0;
        while let Ok(Ok(())) = timeout(Duration::from_secs(1), client.write_all(&[0; 256])).await {
            sent += 256;
        }
        sent
    };
    let gone = timeout(Duration::from_secs(60), connection.watch(7));
    let (gone, sent) = tokio::join!(gone, sends);
    assert!(gone.is_err() && sent <= 4 * READ_AHEAD_MAX, "{sent}");
}

#[tokio::test(start_paused = true)]
async fn request_without_room_is_passed_over_and_the_session_lives() {
    let (mut client, server) = duplex(1 << 10);
    let room = room_within(1 << 20);
    let mut connection = ClientConnection::new(server, Limits::default(), PATIENCE, false, room);
    let mut bytes = Vec::new();
    let nodes = vec![7; 200_000];
    let hint = Prefetch { model: ModelHash([0; 32]), nodes, masks: Masks::default() };
    Request::Prefetch(hint).encode_into(5, &Limits::default(), &mut bytes).unwrap();
    let (_, _, next) = connected();
    let sender = async {
        client.write_all(&bytes).await.unwrap();
        client.write_all(&next).await.unwrap();
    };
    let receiver = async {
        match connection.next_frame().await {
            Ok(Incoming::NoRoom { header, why: NoRoom::Never { .. } }) => {
                assert_eq!(header.request_id, 5);
            }
            other => panic!("{other:?}"),
        }
        assert_eq!(request_id(connection.next_frame().await), 1);
    };
    tokio::join!(sender, receiver);
}

/// Bytes of a request.
fn bytes_of(request: &Request, request_id: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    request.encode_into(request_id, &Limits::default(), &mut bytes).unwrap();
    bytes
}

#[tokio::test(start_paused = true)]
async fn request_that_is_worked_on_or_waits_is_cancelled_by_its_number() {
    let (mut connection, mut client, _) = connected();
    let ping = Request::Ping { nonce: 1 };
    let sent = [
        bytes_of(&ping, 5),
        bytes_of(&ping, 6),
        bytes_of(&Request::Cancel { request_id: 6 }, 7),
        bytes_of(&Request::Cancel { request_id: 99 }, 8),
        bytes_of(&Request::Cancel { request_id: 4 }, 9),
    ];
    client.write_all(&sent.concat()).await.unwrap();
    assert!(matches!(connection.watch(4).await, Watched::Cancelled));
    assert_eq!(request_id(connection.next_frame().await), 5);
    match connection.next_frame().await {
        Ok(Incoming::Cancelled { header }) => assert_eq!(header.request_id, 6),
        other => panic!("{other:?}"),
    }
}

#[tokio::test(start_paused = true)]
async fn newer_request_for_the_same_model_is_seen_before_it_is_waited_for() {
    let (mut connection, mut client, _) = connected();
    let ask = |model, newest_wins| {
        let question = softgrasp_protocol::Question::default();
        Request::Ask(Box::new(Ask { newest_wins, ..Ask::new(ModelHash(model), question) }))
    };
    client.write_all(&bytes_of(&ask([1; 32], true), 2)).await.unwrap();
    client.write_all(&bytes_of(&ask([2; 32], false), 3)).await.unwrap();
    assert!(connection.has_newer(ModelHash([1; 32])).await);
    assert!(!connection.has_newer(ModelHash([2; 32])).await, "it lets others be");
    assert_eq!(request_id(connection.next_frame().await), 2);
    assert_eq!(request_id(connection.next_frame().await), 3);
}

#[tokio::test(start_paused = true)]
async fn client_that_wants_to_hear_of_the_server_is_told_and_its_idle_time_goes_on() {
    let (mut connection, _client, _) = connected();
    connection.patience.idle = Some(Duration::from_secs(50));
    connection.set_alive(Some(Duration::from_secs(20)));
    let start = Instant::now();
    let mut told = 0;
    let ended = loop {
        match connection.next_frame().await {
            Ok(Incoming::Silent) => told += 1,
            ended => break ended,
        }
        connection.write_bytes(&[0; 8]).await.unwrap();
    };
    assert!(matches!(ended, Err(SessionError::Idle(_))), "{ended:?}");
    assert_eq!((told, start.elapsed().as_secs()), (2, 50));
    assert!(matches!(connection.watch(1).await, Watched::Silent));
}
