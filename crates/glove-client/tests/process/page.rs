//! Runs that browsers and headsets look at: the messages to them, and those that they send.

use std::io::{BufRead, BufReader, ErrorKind};
use std::net::TcpStream;
use std::process::{Child, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::Point3;
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::joints::{JointsRecord, WEBXR_JOINT_COUNT, WRIST, record_of_hand};
use softgrasp_hand::recording::{ReplayHand, read_recording};
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Error, Message, WebSocket, connect};

use crate::start::{Folder, command, fail, succeed};

/// Time after which a run is taken to hang.
const HANG: Duration = Duration::from_secs(240);
/// Options that choose the object of these runs.
const OBJECT: [&str; 4] = ["--object", "strawberry", "--nodes", "300"];

/// Run that serves a page, and one viewer of it.
struct SeenRun {
    run: Child,
    address: String,
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    seen: Seen,
}

/// Counts of what the viewer has received.
#[derive(Default)]
struct Seen {
    objects: u32,
    pictures: u32,
    /// Number of pictures after the first in which vertices came, and in which none did.
    moved: u32,
    still: u32,
    vertices: u32,
    statuses: Vec<String>,
    /// Height of the object in each picture, m.
    heights: Vec<f32>,
    /// Number of the record that the hand followed in each picture.
    records: Vec<u32>,
    error: f32,
    ended: Option<String>,
}

impl SeenRun {
    fn start(more: &[&str]) -> Self {
        let mut run = command()
            .args(["run", "--headless", "--xr", "127.0.0.1:0"])
            .args(OBJECT)
            .args(more)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(run.stderr.take().unwrap()).lines().map_while(Result::ok);
        let told = "glove-client: the page is at http";
        let address = lines.find_map(|line| line.strip_prefix(told).map(str::to_owned)).unwrap();
        // Whoever speaks is heard, so that nobody waits.
        std::thread::spawn(move || lines.for_each(drop));
        let socket = opened(&address);
        Self { run, address, socket, seen: Seen::default() }
    }

    /// Takes what has come, and acknowledges each picture.
    fn look(&mut self) {
        loop {
            match self.socket.read() {
                Ok(Message::Binary(bytes)) => {
                    if let Some(number) = self.seen.take(&bytes) {
                        let mut ack = vec![0x81, 0, 0, 0];
                        ack.extend(number.to_le_bytes());
                        ack.extend(1.0_f64.to_le_bytes());
                        ack.extend(f32::NAN.to_le_bytes());
                        ack.extend([0; 4]);
                        let _ = self.socket.send(Message::binary(ack));
                    }
                }
                Ok(Message::Text(text)) => self.seen.statuses.push(text.to_string()),
                Ok(Message::Close(frame)) => {
                    self.seen.ended = frame.map(|frame| frame.reason.to_string());
                }
                Ok(_) => {}
                Err(Error::Io(e))
                    if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) =>
                {
                    return;
                }
                Err(_) => {
                    self.seen.ended.get_or_insert_default();
                    return;
                }
            }
        }
    }

    fn until(&mut self, what: &str, is_so: impl Fn(&Seen) -> bool) {
        let begun = Instant::now();
        while !is_so(&self.seen) {
            self.look();
            let last = self.seen.statuses.last();
            assert!(begun.elapsed() < HANG && self.seen.ended.is_none(), "never {what}: {last:?}");
        }
    }

    fn ask(&mut self, text: &str) {
        self.socket.send(Message::text(text)).unwrap();
    }

    /// Ends the run by the page's menu; its exit code and what the viewer received.
    fn end(mut self) -> (Option<i32>, Seen) {
        self.ask(r#"{"ask":"exit"}"#);
        let begun = Instant::now();
        while self.seen.ended.is_none() && begun.elapsed() < HANG {
            self.look();
        }
        let code = self.run.wait().unwrap().code();
        (code, std::mem::take(&mut self.seen))
    }
}

/// A connection to the stream of a page.
fn opened(address: &str) -> WebSocket<MaybeTlsStream<TcpStream>> {
    let (mut socket, _) = connect(format!("ws{address}stream")).unwrap();
    let MaybeTlsStream::Plain(stream) = socket.get_mut() else { panic!("not encrypted") };
    stream.set_read_timeout(Some(Duration::from_millis(4))).unwrap();
    socket
}

impl Drop for SeenRun {
    fn drop(&mut self) {
        let _ = self.run.kill();
        let _ = self.run.wait();
    }
}

impl Seen {
    /// Takes a binary message; returns the number of a picture.
    fn take(&mut self, bytes: &[u8]) -> Option<u32> {
        let whole = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        match bytes[0] {
            1 => {
                self.objects += 1;
                self.vertices = whole(8);
                None
            }
            3 => {
                let changed = whole(92);
                if bytes[1] & 4 != 0 {
                    assert_eq!(changed, self.vertices, "a whole picture has every vertex");
                } else if changed == 0 {
                    self.still += 1;
                } else {
                    self.moved += 1;
                }
                self.pictures += 1;
                self.heights.push(float(44));
                self.records.extend(Some(whole(32)).filter(|record| *record != u32::MAX));
                self.error = float(84);
                Some(whole(4))
            }
            _ => None,
        }
    }

    fn told(&self, words: &str) -> bool {
        self.statuses.iter().any(|status| status.contains(words))
    }

    /// Height of the object above its first position, m.
    fn lifted(&self) -> f32 {
        let lay = self.heights.first().copied().unwrap_or_default();
        self.heights.iter().map(|height| height - lay).fold(0.0, f32::max)
    }
}

/// Hand of a scripted lift, tick by tick, as a perfect tracker would measure it.
fn lifting_hand(folder: &Folder) -> Vec<JointsRecord> {
    let path = folder.path("lift.mcap");
    let lift = ["run", "--headless", "--hand", "scripted:lift", "--record", &path];
    succeed(&[&lift, &OBJECT[..]].concat());
    let recording = Arc::new(read_recording(path.as_ref()).unwrap());
    let mut hand = ReplayHand::new(recording, path);
    let mut reader = HandReader::new(HandSetup::default());
    let mut records = Vec::new();
    while let Some(tick) = hand.next_tick() {
        reader.feed(&tick.sent.arrivals, tick.now_s);
        if let Some((angles, palm)) = reader.measured(tick.now_s) {
            records.push(record_of_hand(&reader.setup().dimensions, &angles, &palm));
        }
    }
    records
}

/// Message of a hand as a page sends it.
fn message(record: &JointsRecord, number: u32) -> Message {
    let mut bytes = vec![0x82, 1, WEBXR_JOINT_COUNT as u8, 0];
    bytes.extend(number.to_le_bytes());
    bytes.extend((16.0 * f64::from(number)).to_le_bytes());
    for joint in 0..WEBXR_JOINT_COUNT {
        let Point3 { coords, .. } = record.position(WRIST + joint).unwrap();
        for number in [coords.x, coords.y, coords.z, 0.0, 0.0, 0.0, 1.0] {
            bytes.extend((number as f32).to_le_bytes());
        }
    }
    Message::binary(bytes)
}

#[test]
fn viewer_sees_a_scripted_hand_squeeze_and_lift_and_ends_the_run_by_the_menu() {
    let mut run = SeenRun::start(&["--hand", "scripted:lift"]);
    run.until("squeezed", |seen| seen.told("\"state\":\"squeezed\""));
    run.until("lifted", |seen| seen.lifted() > 0.02);
    run.until("moved", |seen| seen.moved > 20);
    run.ask(r#"{"ask":"shade","what":"displacement"}"#);
    run.until("coloured", |seen| seen.told("\"shading\":\"displacement\""));
    run.ask(r#"{"ask":"save","name":"../shape.msh"}"#);
    run.until("refused", |seen| seen.told("is no name of a file"));
    // Before the hand comes, or when it has put the object down: what nobody touches costs nothing.
    run.until("still", |seen| seen.still > 0);
    let (code, seen) = run.end();
    assert_eq!(code, Some(0));
    assert_eq!((seen.objects, seen.ended.as_deref()), (1, Some("the run is over")));
    assert!(seen.told("\"key_direction\"") && seen.told("\"marks\""));
    assert!((1e-6..1e-5).contains(&seen.error), "{}", seen.error);
}

#[test]
fn objects_of_a_table_come_as_one_mesh_in_the_world_and_colours_are_of_the_touched_one() {
    let mut alone = SeenRun::start(&["--hand", "scripted:lift"]);
    alone.until("an object", |seen| seen.pictures > 2);
    let one = alone.end().1.vertices;
    // The second object is lifted, so that it comes first from its touch on.
    let mut run = SeenRun::start(&["--object", "cube", "--lifts", "2"]);
    run.until("the touched one first", |seen| seen.objects > 1);
    run.until("moved", |seen| seen.moved > 10);
    let (code, seen) = run.end();
    assert_eq!(code, Some(0));
    assert!(seen.vertices > one + 100, "{} vertices beside {one} of the first", seen.vertices);
    assert!((1e-6..1e-5).contains(&seen.error), "{}", seen.error);
    // Vertices are given in the world, whatever is lifted.
    assert!(seen.heights.iter().all(|height| *height == 0.0));
}

#[test]
fn hand_of_a_headset_lifts_the_object_and_pictures_name_the_hand_they_show() {
    let folder = Folder::new();
    let hand = lifting_hand(&folder);
    if let Some(path) = std::env::var_os("LIFTING_HAND") {
        // What the fake headset of tests/xr plays: every fourth tick, whole tenths of a millimetre.
        let places = |record: &JointsRecord| -> Vec<[i32; 3]> {
            let joints = (0..WEBXR_JOINT_COUNT).filter_map(|joint| record.position(WRIST + joint));
            joints.map(|p| [p.x, p.y, p.z].map(|x| (1e4 * x).round() as i32)).collect()
        };
        let frames: Vec<_> = hand.iter().step_by(4).map(places).collect();
        std::fs::write(path, serde_json::to_string(&frames).unwrap()).unwrap();
    }
    let mut run = SeenRun::start(&["--hand", "xr"]);
    run.until("shown", |seen| seen.pictures > 0);
    run.until("connected", |seen| seen.told("\"server\":\"connected\",\"preparing\":false"));
    let begun = Instant::now();
    for (number, record) in hand.iter().enumerate() {
        let number = u32::try_from(number).unwrap();
        run.socket.send(message(record, number)).unwrap();
        let due = begun + Duration::from_micros(16_667) * (number + 1);
        while Instant::now() < due {
            run.look();
        }
        assert!(run.seen.ended.is_none(), "{:?}", run.seen.statuses.last());
    }
    assert!(run.seen.told("\"state\":\"squeezed\""), "{:?}", run.seen.statuses.last());
    assert!(run.seen.lifted() > 0.02, "lifted by {} m", run.seen.lifted());
    let records = &run.seen.records;
    assert!(records.windows(2).all(|pair| pair[0] <= pair[1]), "{records:?}");
    assert!(records.len() > 50 && records.last().unwrap() + 20 > hand.len() as u32);
    let (code, _) = run.end();
    assert_eq!(code, Some(0));
}

#[test]
fn run_without_a_viewer_goes_on_and_one_that_comes_back_sees_the_whole_object() {
    let mut run = SeenRun::start(&["--hand", "xr"]);
    run.until("shown", |seen| seen.pictures > 2);
    let MaybeTlsStream::Plain(stream) = run.socket.get_mut() else { panic!("not encrypted") };
    // A lid is closed.
    stream.shutdown(std::net::Shutdown::Both).unwrap();
    run.socket = opened(&run.address);
    run.seen = Seen::default();
    run.until("shown again", |seen| seen.pictures > 2);
    assert_eq!(run.seen.objects, 1, "the object comes whole");
    assert!(run.run.try_wait().unwrap().is_none(), "the run ended with its viewer");
}

#[test]
fn page_that_cannot_be_served_is_one_sentence() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    fn run<'a>(more: &[&'a str]) -> Vec<&'a str> {
        [&["run", "--headless"], &OBJECT[..], more].concat()
    }
    let said = fail(1, &run(&["--xr", &address]));
    assert!(said.contains(&format!("cannot serve the page at {address}")), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    let said = fail(2, &run(&["--xr", "somewhere"]));
    assert!(said.contains("IP:PORT or localhost:PORT"), "{said}");
    let said = fail(1, &run(&["--hand", "xr"]));
    assert!(said.contains("give it an address by --xr"), "{said}");
    let files = ["--xr", "127.0.0.1:0", "--xr-cert", "none.pem", "--xr-key", "none.pem"];
    let said = fail(1, &run(&files));
    assert!(
        said.contains("the page cannot be encrypted: certificate none.pem cannot be used"),
        "{said}"
    );
}
