//! Tests of the listener: datagrams and connections side by side, bad bytes, the end.

use std::io::Write;

use nalgebra::Isometry3;
use softgrasp_grasp::hand::{HandDimensions, JointAngles};

use super::*;
use crate::joints::{JointsEvent, JointsParser, record_of_hand};

/// Long enough for a machine that has other things to do.
const PATIENCE: Duration = Duration::from_secs(60);

fn listener() -> JointsListener {
    JointsListener::bind(SocketAddr::from(([127, 0, 0, 1], 0))).unwrap()
}

/// A line of joints of a fist with this record number.
fn line(frame: u64) -> String {
    let hand = HandDimensions::default();
    let mut record = record_of_hand(&hand, &JointAngles::fist(), &Isometry3::identity());
    record.frame = Some(frame);
    record.to_line()
}

/// What has arrived, parsed, until there are `count` records.
struct Reader {
    parser: JointsParser,
    frames: Vec<(bool, u64)>,
    faults: usize,
}

impl Reader {
    fn new() -> Self {
        Self { parser: JointsParser::new(), frames: Vec::new(), faults: 0 }
    }

    fn take(&mut self, listener: &mut JointsListener) {
        for piece in listener.take() {
            assert!(piece.bytes.ends_with(b"\n") && piece.arrived <= Instant::now());
            let (frames, faults) = (&mut self.frames, &mut self.faults);
            self.parser.feed_all(&piece.bytes, |event| match event {
                JointsEvent::Record(record) => {
                    frames.push((piece.datagram, record.frame.unwrap()));
                }
                JointsEvent::Fault(_) => *faults += 1,
            });
        }
    }

    fn until(&mut self, listener: &mut JointsListener, is_done: impl Fn(&Self) -> bool) {
        let started = Instant::now();
        while !is_done(self) {
            assert!(started.elapsed() < PATIENCE, "{:?}, {} faults", self.frames, self.faults);
            self.take(listener);
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

fn wait_until(mut is_so: impl FnMut() -> bool) {
    let started = Instant::now();
    while !is_so() {
        assert!(started.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn datagrams_and_connections_are_heard_on_one_port() {
    let mut listener = listener();
    let addr = listener.local_addr();
    let udp = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut tcp = TcpStream::connect(addr).unwrap();
    let mut reader = Reader::new();
    for frame in 0..5 {
        // Without its LF, as many senders would have it.
        udp.send_to(line(frame).trim_end().as_bytes(), addr).unwrap();
        tcp.write_all(line(100 + frame).as_bytes()).unwrap();
        reader.until(&mut listener, |r| r.frames.len() == 2 * (frame as usize + 1));
    }
    assert_eq!(reader.faults, 0);
    for (datagram, first) in [(true, 0), (false, 100)] {
        let heard: Vec<u64> =
            reader.frames.iter().filter(|(d, _)| *d == datagram).map(|(_, f)| *f).collect();
        assert_eq!(heard, (first..first + 5).collect::<Vec<_>>());
    }
    assert!(listener.senders() >= 1);
    drop(tcp);
    wait_until(|| listener.senders() == 0);
    assert_eq!(listener.dropped(), 0);
}

#[test]
fn a_second_connection_neither_starves_nor_ends_the_first() {
    let mut listener = listener();
    let addr = listener.local_addr();
    let mut first = TcpStream::connect(addr).unwrap();
    let mut second = TcpStream::connect(addr).unwrap();
    let mut reader = Reader::new();
    // Halves of lines, so that a mixture of bytes would spoil both.
    for frame in 0..4 {
        let (a, b) = (line(frame), line(1000 + frame));
        first.write_all(&a.as_bytes()[..200]).unwrap();
        second.write_all(&b.as_bytes()[..333]).unwrap();
        std::thread::sleep(Duration::from_millis(3));
        first.write_all(&a.as_bytes()[200..]).unwrap();
        second.write_all(&b.as_bytes()[333..]).unwrap();
    }
    reader.until(&mut listener, |r| r.frames.len() == 8);
    assert_eq!((reader.faults, listener.senders()), (0, 2));
    // One floods, the other is still heard.
    let flood = std::thread::spawn(move || {
        let garbage = vec![b'x'; 1 << 20];
        let _ = second.write_all(&garbage);
        let _ = second.write_all(b"\n");
        second
    });
    first.write_all(line(7).as_bytes()).unwrap();
    reader.until(&mut listener, |r| r.frames.last() == Some(&(false, 7)));
    drop(flood.join().unwrap());
    reader.until(&mut listener, |r| r.faults > 0);
    first.write_all(line(8).as_bytes()).unwrap();
    reader.until(&mut listener, |r| r.frames.last() == Some(&(false, 8)));
}

#[test]
fn too_many_connections_are_closed_and_the_others_live() {
    let mut listener = listener();
    let addr = listener.local_addr();
    let mut held: Vec<TcpStream> =
        (0..CONNECTIONS_MAX).map(|_| TcpStream::connect(addr).unwrap()).collect();
    wait_until(|| listener.senders() == CONNECTIONS_MAX);
    let mut refused = TcpStream::connect(addr).unwrap();
    refused.set_read_timeout(Some(PATIENCE)).unwrap();
    assert!(matches!(refused.read(&mut [0; 1]), Ok(0) | Err(_)));
    let mut reader = Reader::new();
    for (frame, stream) in held.iter_mut().enumerate() {
        stream.write_all(line(frame as u64).as_bytes()).unwrap();
        reader.until(&mut listener, |r| r.frames.len() > frame);
    }
    assert_eq!(listener.senders(), CONNECTIONS_MAX);
}

#[test]
fn bad_bytes_end_nothing() {
    let mut listener = listener();
    let addr = listener.local_addr();
    let udp = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut reader = Reader::new();
    for bytes in [&b""[..], b"\n", b"\0\xff\xfe", b"{", &[b'['; 9000], b"{\"joints\":[]}"] {
        udp.send_to(bytes, addr).unwrap();
        let mut tcp = TcpStream::connect(addr).unwrap();
        tcp.write_all(bytes).unwrap();
    }
    reader.until(&mut listener, |r| r.faults >= 8);
    udp.send_to(line(1).as_bytes(), addr).unwrap();
    TcpStream::connect(addr).unwrap().write_all(line(2).trim_end().as_bytes()).unwrap();
    reader.until(&mut listener, |r| r.frames.len() == 2);
}

#[test]
fn dropping_it_frees_the_port_at_once() {
    let first = listener();
    let addr = first.local_addr();
    let mut sender = TcpStream::connect(addr).unwrap();
    sender.write_all(b"{\"joints\":").unwrap();
    assert!(matches!(JointsListener::bind(addr), Err(JointsError::Tcp { .. })));
    let started = Instant::now();
    drop(first);
    assert!(started.elapsed() < PATIENCE);
    // The datagram port is free; the connection's end may hold the other for a while.
    UdpSocket::bind(addr).unwrap();
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let addr = taken.local_addr().unwrap();
    match JointsListener::bind(addr) {
        Err(JointsError::Udp { .. } | JointsError::Tcp { .. }) => {}
        other => panic!("{other:?}"),
    }
}
