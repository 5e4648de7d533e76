//! List of all parsers of untrusted bytes: those that are fuzzed are also tested.
//!
//! Bytes may be refused, but must not cause a panic, a hang, or memory that is only announced; and what
//! is accepted stays the same when it is written and read again.

use glove_client::object::scene::SceneFile;
use softgrasp_core::mesh_io::{parse, parse_surface, write_msh41};
use softgrasp_core::surface::MendedSurface;
use softgrasp_hand::devices::calibration::read_calibration;
use softgrasp_hand::devices::cyberglove::{GloveEvent, GloveParser, RecordOptions, SensorCount};
use softgrasp_hand::devices::fastrak::{
    Encoding, FastrakEvent, FastrakFormat, FastrakParser, LengthUnit, OutputList,
};
use softgrasp_hand::devices::recordings::{LeapRecording, Trajectory};
use softgrasp_hand::hand_setup::HandConfiguration;
use softgrasp_hand::joints::JointsParser;
use softgrasp_protocol::{EncodeError, Frame, FrameBuffer, Kind, Limits, Reply, Request};

use crate::raw_session::raw_frame;

/// Parser of untrusted bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parser {
    /// Frames in a stream; the first byte decides how the rest is cut into pieces.
    Frames,
    /// A request; the first byte chooses the kind.
    Request,
    /// A reply; the first byte chooses the kind.
    Reply,
    /// Mesh file of any format; behind a line `--companion--` is the other file that it needs.
    Mesh,
    /// A surface file of any format.
    Surface,
    /// Bytes of a glove; the first one chooses sensors and options.
    Glove,
    /// Bytes of a tracker; the first one chooses the format.
    Tracker,
    /// Lines of hand joints.
    Joints,
    /// A calibration of a glove in any of its forms.
    Calibration,
    /// Configuration of a hand.
    HandSetup,
    /// Scene file.
    Scene,
    /// Recordings of other programs.
    Recordings,
}

/// Line between a mesh file and the other file that it needs.
const COMPANION: &[u8] = b"--companion--\n";

impl Parser {
    /// All parsers.
    pub const ALL: [Self; 12] = [
        Self::Frames,
        Self::Request,
        Self::Reply,
        Self::Mesh,
        Self::Surface,
        Self::Glove,
        Self::Tracker,
        Self::Joints,
        Self::Calibration,
        Self::HandSetup,
        Self::Scene,
        Self::Recordings,
    ];

    /// Name of the parser's folder of seeds and of its fuzz target.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Frames => "frames",
            Self::Request => "request",
            Self::Reply => "reply",
            Self::Mesh => "mesh",
            Self::Surface => "surface",
            Self::Glove => "glove",
            Self::Tracker => "tracker",
            Self::Joints => "joints",
            Self::Calibration => "calibration",
            Self::HandSetup => "hand_setup",
            Self::Scene => "scene",
            Self::Recordings => "recordings",
        }
    }

    /// Parses any bytes and checks the result.
    ///
    /// # Panics
    /// If the parser has a fault.
    pub fn take(self, bytes: &[u8]) {
        match self {
            Self::Frames => frames(bytes),
            Self::Request => request(bytes),
            Self::Reply => reply(bytes),
            Self::Mesh => mesh(bytes),
            Self::Surface => surface(bytes),
            Self::Glove => glove(bytes),
            Self::Tracker => tracker(bytes),
            Self::Joints => JointsParser::new().feed_all(bytes, drop),
            Self::Calibration => drop(read_calibration(&String::from_utf8_lossy(bytes))),
            Self::HandSetup => drop(HandConfiguration::read(&String::from_utf8_lossy(bytes))),
            Self::Scene => drop(SceneFile::of_text(&String::from_utf8_lossy(bytes))),
            Self::Recordings => {
                let text = String::from_utf8_lossy(bytes);
                drop(Trajectory::parse(&text));
                drop(LeapRecording::parse(&text));
            }
        }
    }
}

/// Checks that the same frames and the same fault are found, in pieces or not.
fn frames(bytes: &[u8]) {
    let Some((&cut, stream)) = bytes.split_first() else { return };
    let piece = usize::from(cut) + 1;
    let taken = |pieces: &mut dyn Iterator<Item = &[u8]>| {
        let mut buffer = FrameBuffer::new(Limits::default());
        let mut frames = Vec::new();
        let mut fed = 0;
        for piece in pieces {
            buffer.feed(piece);
            fed += piece.len();
            loop {
                match buffer.next_frame() {
                    Ok(Some(frame)) => frames.push(frame),
                    Ok(None) => break,
                    Err(fault) => return (frames, Some(fault)),
                }
            }
            assert!(buffer.capacity() <= 4 * fed + 256 * 1024, "memory is taken on announcement");
        }
        (frames, buffer.finish().err())
    };
    let whole = taken(&mut std::iter::once(stream));
    let cut = taken(&mut stream.chunks(piece));
    assert_eq!(whole.0, cut.0);
    assert_eq!(whole.1.is_some(), cut.1.is_some());
}

/// Kind of one side that the first byte chooses, with the payload, as an undamaged frame.
fn sound_frame(bytes: &[u8], of_server: bool) -> Option<Frame> {
    let (&choice, payload) = bytes.split_first()?;
    let kinds: Vec<Kind> =
        Kind::ALL.into_iter().filter(|kind| (*kind as u16 & 0x8000 != 0) == of_server).collect();
    let kind = kinds[usize::from(choice) % kinds.len()];
    let mut buffer = FrameBuffer::new(Limits::default());
    buffer.feed(&raw_frame(kind as u16, 7, payload));
    buffer.next_frame().ok().flatten()
}

fn request(bytes: &[u8]) {
    let Some(frame) = sound_frame(bytes, false) else { return };
    assert!(Request::trace(&frame).is_none_or(|trace| trace.is_valid()));
    let Ok(request) = Request::decode(&frame, &Limits::default()) else { return };
    let mut written = Vec::new();
    match request.encode_into(7, &Limits::default(), &mut written) {
        // Fields that were not sent take bytes now.
        Err(EncodeError::PartTooLong { .. }) => return,
        written => written.expect("what was read can be written"),
    }
    let mut again = Vec::new();
    let mut buffer = FrameBuffer::new(Limits::default());
    buffer.feed(&written);
    let frame = buffer.next_frame().expect("sound").expect("whole");
    let read = Request::decode(&frame, &Limits::default()).expect("what was written can be read");
    read.encode_into(7, &Limits::default(), &mut again).expect("small enough");
    assert_eq!(written, again);
}

fn reply(bytes: &[u8]) {
    let Some(frame) = sound_frame(bytes, true) else { return };
    let Ok(reply) = Reply::decode(&frame, &Limits::default()) else { return };
    let mut written = Vec::new();
    match reply.encode_into(7, &Limits::default(), &mut written) {
        // As above.
        Err(EncodeError::PartTooLong { .. }) => return,
        written => written.expect("what was read can be written"),
    }
    let mut buffer = FrameBuffer::new(Limits::default());
    buffer.feed(&written);
    let frame = buffer.next_frame().expect("sound").expect("whole");
    let read = Reply::decode(&frame, &Limits::default()).expect("what was written can be read");
    let mut again = Vec::new();
    read.encode_into(7, &Limits::default(), &mut again).expect("small enough");
    assert_eq!(written, again);
}

fn mesh(bytes: &[u8]) {
    let at = bytes.windows(COMPANION.len()).position(|window| window == COMPANION);
    let (file, other) = match at {
        Some(at) => (&bytes[..at], Some(&bytes[at + COMPANION.len()..])),
        None => (bytes, None),
    };
    let Ok(read) = parse("fuzzed", file, &mut |_| other.map(<[u8]>::to_vec)) else { return };
    let count = read.mesh.node_count();
    assert!(read.mesh.tets().iter().flatten().all(|node| (*node as usize) < count));
    let again = parse("written", &write_msh41(&read.mesh), &mut |_| None)
        .expect("what was written can be read");
    assert_eq!(again.mesh.node_count(), count);
}

/// Checks that a surface that can be read can be mended, and then has valid corners.
fn surface(bytes: &[u8]) {
    let Ok(read) = parse_surface("fuzzed", bytes, &mut |_| Some(bytes.to_vec())) else { return };
    let Ok(mended) = MendedSurface::new(&read.surface) else { return };
    let count = mended.surface.points().len();
    assert!(mended.surface.triangles().iter().flatten().all(|n| (*n as usize) < count));
}

fn glove(bytes: &[u8]) {
    let Some((&choice, bytes)) = bytes.split_first() else { return };
    let count = match choice & 1 {
        0 => SensorCount::Eighteen,
        _ => SensorCount::TwentyTwo,
    };
    let options = RecordOptions { timestamp: choice & 2 != 0, status: choice & 4 != 0 };
    let parser = || match choice & 8 {
        0 => GloveParser::new(count, options),
        _ => GloveParser::of_lines(count),
    };
    let records = |pieces: &mut dyn Iterator<Item = &[u8]>| {
        let (mut parser, mut records) = (parser(), Vec::new());
        for piece in pieces {
            parser.feed_all(piece, |event| match event {
                GloveEvent::Record(record) => records.push(format!("{record:?}")),
                GloveEvent::Fault(_) => {}
            });
        }
        records
    };
    assert_eq!(records(&mut std::iter::once(bytes)), records(&mut bytes.chunks(3)));
}

fn tracker(bytes: &[u8]) {
    let Some((&choice, bytes)) = bytes.split_first() else { return };
    let encoding = if choice & 1 == 0 { Encoding::Ascii } else { Encoding::Binary };
    let output =
        if choice & 2 == 0 { OutputList::PositionEuler } else { OutputList::PositionQuaternion };
    let units = if choice & 4 == 0 { LengthUnit::Inches } else { LengthUnit::Centimetres };
    let records = |pieces: &mut dyn Iterator<Item = &[u8]>| {
        let mut parser = FastrakParser::new(FastrakFormat { encoding, output, units });
        let mut records = Vec::new();
        for piece in pieces {
            parser.feed_all(piece, |event| {
                if let FastrakEvent::Record(record) = event {
                    records.push(format!("{record:?}"));
                }
            });
        }
        records
    };
    assert_eq!(records(&mut std::iter::once(bytes)), records(&mut bytes.chunks(3)));
}
