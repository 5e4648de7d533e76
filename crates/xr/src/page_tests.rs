//! Tests of the page over real sockets: access, slow pages, damaged bytes.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;

use fea_server::Encryption;
use tungstenite::{Message, WebSocket, connect};

use super::*;
use crate::from_page::{ACK, ACK_BYTES, JOINTS, JOINTS_BYTES};
use crate::picture::{ObjectMesh, Picture};
use crate::quantised::QuantisedBox;
use crate::to_page::{OBJECT, PICTURE};

type Socket = WebSocket<tungstenite::stream::MaybeTlsStream<TcpStream>>;

fn page() -> Page {
    let address = "127.0.0.1:0".parse().unwrap();
    Page::open(PageOptions { address, encryption: None, takes_hands: true }).unwrap()
}

/// Response to an HTTP request for a path.
fn answer(page: &Page, path: &str) -> String {
    let host = page.address().split('/').nth(2).unwrap();
    let mut stream = TcpStream::connect(host).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
    let mut text = Vec::new();
    stream.read_to_end(&mut text).unwrap();
    String::from_utf8_lossy(&text).into_owned()
}

/// The path of the page, with its token.
fn path(page: &Page) -> String {
    format!("/{}/", page.address().split('/').nth(3).unwrap())
}

fn opened(page: &Page) -> Socket {
    let (socket, _) = connect(format!("{}stream", page.address().replace("http", "ws"))).unwrap();
    socket
}

/// Next binary message of a kind.
fn next(socket: &mut Socket, kind: u8) -> Vec<u8> {
    loop {
        if let Message::Binary(bytes) = socket.read().unwrap()
            && bytes[0] == kind
        {
            return bytes.to_vec();
        }
    }
}

fn picture(tick: u64) -> Option<Arc<Picture>> {
    Some(Arc::new(Picture {
        tick,
        object: Arc::new(ObjectMesh { version: 1, message: vec![OBJECT, 0, 0, 0] }),
        hands: [None, None],
        record: None,
        world_from_object: [0.0; 7],
        ground_y: 0.0,
        capsules: Vec::new(),
        space: QuantisedBox { origin: [0.0; 3], step: 1e-5, error: 1e-5 },
        numbers: vec![[tick as u16; 3]; 4],
        normals: vec![[0, 0]; 4],
        shares: Vec::new(),
        status: "{}".into(),
    }))
}

fn ack(number: u32) -> Message {
    let mut bytes = vec![0; ACK_BYTES];
    bytes[0] = ACK;
    bytes[4..8].copy_from_slice(&number.to_le_bytes());
    Message::binary(bytes)
}

fn tick_of(bytes: &[u8]) -> u64 {
    u64::from_le_bytes(bytes[16..24].try_into().unwrap())
}

#[test]
fn page_is_served_with_its_token_and_refused_without() {
    let page = page();
    let path = path(&page);
    let whole = answer(&page, &path);
    assert!(whole.starts_with("HTTP/1.1 200") && whole.contains("<title>Softgrasp"), "{whole}");
    assert!(whole.contains("content-security-policy: default-src 'none'"), "{whole}");
    assert!(answer(&page, &format!("{path}scene.js")).starts_with("HTTP/1.1 200"));
    assert!(answer(&page, &format!("{path}../secret")).starts_with("HTTP/1.1 4"));
    let wrong = path.replace(|c: char| c.is_ascii_digit(), "a");
    for refused in ["/", "/favicon.ico", &wrong, &format!("{wrong}main.js"), &path[..20]] {
        let told = answer(&page, refused);
        assert!(told.starts_with("HTTP/1.1 403"), "{refused}: {told}");
    }
    let address = page.address().replace("http", "ws").replace(&path, &wrong);
    let stream = connect(format!("{address}stream"));
    let Err(tungstenite::Error::Http(told)) = stream else { panic!("let in without the token") };
    assert_eq!(told.status(), 403);
}

#[test]
fn page_of_another_origin_gets_no_stream() {
    use tungstenite::client::IntoClientRequest as _;
    let page = page();
    let address = format!("{}stream", page.address().replace("http", "ws"));
    let host = page.address().split('/').nth(2).unwrap();
    for (origin, is_let_in) in
        [("http://elsewhere.example", false), (&format!("http://{host}"), true)]
    {
        let mut request = address.clone().into_client_request().unwrap();
        request.headers_mut().insert("Origin", origin.parse().unwrap());
        assert_eq!(connect(request).is_ok(), is_let_in, "{origin}");
    }
}

#[test]
fn slow_page_gets_the_newest_picture_and_none_of_those_between() {
    let page = page();
    let pictures = &page.site().pictures;
    pictures.send_replace(picture(1));
    let mut socket = opened(&page);
    assert_eq!(tick_of(&next(&mut socket, PICTURE)), 1);
    pictures.send_replace(picture(2));
    assert_eq!(tick_of(&next(&mut socket, PICTURE)), 2, "two may be on their way");
    for tick in 3..=1000 {
        pictures.send_replace(picture(tick));
    }
    // Nothing has been drawn: nothing more comes, and the pictures between are nowhere kept.
    socket.send(ack(1)).unwrap();
    let bytes = next(&mut socket, PICTURE);
    assert_eq!(tick_of(&bytes), 1000);
    assert_eq!(u32::from_le_bytes(bytes[4..8].try_into().unwrap()), 3, "the third that is sent");
    assert_eq!(pictures.receiver_count(), 1);
}

#[test]
fn acknowledgement_of_a_picture_that_was_never_sent_brings_no_more() {
    let page = page();
    page.site().pictures.send_replace(picture(1));
    let mut socket = opened(&page);
    next(&mut socket, PICTURE);
    socket.send(ack(4_000_000)).unwrap();
    page.site().pictures.send_replace(picture(2));
    next(&mut socket, PICTURE);
    page.site().pictures.send_replace(picture(3));
    // The second is drawn: had the wrong number counted, the third would have come before.
    socket.send(ack(2)).unwrap();
    assert_eq!(tick_of(&next(&mut socket, PICTURE)), 3);
}

#[test]
fn malformed_hand_ends_its_page_with_the_reason_and_reaches_no_run() {
    let page = page();
    for (bytes, part) in [
        (vec![JOINTS; 100], "716 bytes, not 100"),
        (vec![JOINTS; JOINTS_BYTES], "a hand is 0 (left) or 1 (right)"),
        (vec![7], "no message begins with 7"),
    ] {
        let mut socket = opened(&page);
        socket.send(Message::binary(bytes)).unwrap();
        let reason = loop {
            if let Message::Close(frame) = socket.read().unwrap() {
                break frame.unwrap().reason;
            }
        };
        assert!(reason.contains(part), "{reason}");
    }
    let mut socket = opened(&page);
    socket.send(Message::text("x".repeat(5000))).unwrap();
    while socket.read().is_ok() {}
    assert!(page.joints().take().is_empty());
}

#[test]
fn wishes_of_a_page_wait_for_the_painter_and_too_many_are_dropped() {
    let mut page = page();
    let asked = page.asked.take().unwrap();
    let mut socket = opened(&page);
    for _ in 0..ASKS_MAX + 20 {
        socket.send(Message::text(r#"{"ask":"keep-shape"}"#)).unwrap();
    }
    // What is answered after them has been read after them.
    page.site().pictures.send_replace(picture(1));
    socket.send(Message::binary(vec![9])).unwrap();
    while socket.read().is_ok() {}
    assert_eq!(asked.try_iter().count(), ASKS_MAX);
}

#[test]
fn page_hears_that_the_run_is_over_and_a_taken_port_is_named() {
    let page = page();
    let address: SocketAddr = page.address().split('/').nth(2).unwrap().parse().unwrap();
    let again = Page::open(PageOptions { address, encryption: None, takes_hands: false });
    let told = again.err().unwrap().to_string();
    assert_eq!(told, format!("cannot serve the page at {address}"));
    let mut socket = opened(&page);
    socket.read().unwrap();
    drop(page);
    let said = std::iter::from_fn(|| socket.read().ok()).find_map(|message| match message {
        Message::Close(frame) => frame.map(|frame| frame.reason.to_string()),
        _ => None,
    });
    assert_eq!(said.as_deref(), Some("the run is over"));
}

#[test]
fn page_with_a_pair_of_its_own_speaks_tls() {
    let address: SocketAddr = "127.0.0.1:0".parse().unwrap();
    let encryption = Some(Encryption::self_made(&[address.ip().to_string()]).unwrap().acceptor());
    let page = Page::open(PageOptions { address, encryption, takes_hands: false }).unwrap();
    assert!(page.address().starts_with("https://127.0.0.1:"), "{}", page.address());
    let host = page.address().split('/').nth(2).unwrap();
    let mut stream = TcpStream::connect(host).unwrap();
    stream.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    // An alert of TLS, and no word of HTTP.
    assert_eq!(answer.first(), Some(&21), "{answer:?}");
}
