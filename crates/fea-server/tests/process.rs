//! The `fea-server` program as a process: first line, signals, exit codes, memory.

#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests fail and speak like tests"
)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::{Child, ChildStdout, Command, Output, Stdio};
use std::time::{Duration, Instant};

use softgrasp_core::fem::Material as CoreMaterial;
use softgrasp_core::mesh::{BuiltIn, TetMesh, generate};
use softgrasp_core::model::{Element, Model};
use softgrasp_core::solve::Method;
use softgrasp_core::solve::memory::Need;
use softgrasp_protocol::blocking::Connection;
use softgrasp_protocol::{
    Answer, Ask, Body, DofValue, ElementChoice, Hello, Kind, Limits, Material, MeshData,
    MethodName, Question, RejectCode, Reply, Request, Subject, VERSION,
};

const MIB: u64 = 1 << 20;
/// Time after which a process that has not ended is taken to hang.
const END_MAX: Duration = Duration::from_secs(30);

fn command() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fea-server"));
    command.env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

/// Runs the program to its end.
fn run(arguments: &[&str]) -> Output {
    command().args(arguments).output().unwrap()
}

/// A running server; killed if a test fails.
struct ServerProcess {
    child: Child,
    stdout: BufReader<ChildStdout>,
    address: SocketAddr,
}

impl ServerProcess {
    fn start(arguments: &[&str]) -> Self {
        let mut child = command()
            .args(["--listen", "127.0.0.1:0"])
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let mut first = String::new();
        stdout.read_line(&mut first).unwrap();
        let address = first.strip_prefix("listening on ").expect("the contract's first line");
        let address: SocketAddr = address.trim_end().parse().unwrap();
        assert!(address.ip().is_loopback() && address.port() != 0, "{first}");
        Self { child, stdout, address }
    }

    fn connect(&self) -> Client {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_nodelay(true).unwrap();
        let mut client = Client { connection: Connection::new(stream, Limits::default()), id: 0 };
        let hello = Hello::new("a test", None);
        assert!(matches!(client.ask(&Request::Hello(hello)), Reply::Welcome(_)));
        client
    }

    /// Sends a signal by its name.
    fn signal(&self, name: &str) {
        let kill = format!("kill -{name} {}", self.child.id());
        assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
    }

    /// Exit code and the rest of standard output.
    fn end(&mut self) -> (Option<i32>, String) {
        let start = Instant::now();
        let status = loop {
            match self.child.try_wait().unwrap() {
                Some(status) => break status,
                None => assert!(start.elapsed() < END_MAX, "the server does not end"),
            }
            std::thread::yield_now();
        };
        let mut rest = String::new();
        self.stdout.read_to_string(&mut rest).unwrap();
        (status.code(), rest)
    }

    /// Largest resident memory so far, bytes; `None` where the system does not tell.
    fn peak_bytes(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).ok()?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
        Some(line.split_whitespace().next()?.parse::<u64>().ok()? * 1024)
    }
}

impl Drop for ServerProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

struct Client {
    connection: Connection<TcpStream>,
    id: u64,
}

impl Client {
    fn send(&mut self, request: &Request) {
        self.id += 1;
        let mut bytes = Vec::new();
        request.encode_into(self.id, &Limits::default(), &mut bytes).unwrap();
        self.connection.write_bytes(&bytes).unwrap();
    }

    fn ask(&mut self, request: &Request) -> Reply {
        self.send(request);
        let frame = self.connection.read_frame().unwrap().expect("an answer");
        assert_eq!(frame.request_id(), self.id);
        Reply::decode(&frame, &Limits::default()).unwrap()
    }

    fn solve(&mut self, request: Ask) -> Answer {
        match self.ask(&Request::from(request)) {
            Reply::Answer(answer) => *answer,
            other => panic!("{other:?}"),
        }
    }
}

/// Memory that the server counts for a request before it makes the factor.
fn counted(request: &Ask, method: Method) -> Need {
    let Subject::Mesh(body) = &request.subject else { panic!("a mesh comes along") };
    let vertices = body.mesh.vertices.iter().copied().map(Into::into).collect();
    let mesh = TetMesh::try_new(vertices, body.mesh.tets.clone(), vec![]).unwrap();
    let material = CoreMaterial::try_new(1.0e5, 0.3).unwrap();
    let model = Model::try_new(mesh, Element::Tet4, &[material], vec![], &mut |_| {}).unwrap();
    let mut dofs: Vec<u32> = request.question.known.iter().map(|known| known.dof).collect();
    dofs.sort_unstable();
    let analysed = model.analyse(&dofs, &mut |_| {}).unwrap();
    let blocks = model.stiffness().pattern().block_count();
    Need::counted(Element::Tet4, method, model.bytes() as u64, blocks, analysed.analysis())
}

/// A cube whose lowest layer is held and one of whose upper corners is pulled.
fn pulled_cube(nodes: usize, method: &str) -> Ask {
    pulled(BuiltIn::Cube, nodes, method)
}

/// An object whose lowest tenth is held and whose highest node is pulled.
fn pulled(shape: BuiltIn, nodes: usize, method: &str) -> Ask {
    let mesh: TetMesh = generate(shape, nodes).unwrap();
    let (low, high) = mesh.bounds();
    let mut known = Vec::new();
    let top = mesh.vertices().iter().position(|p| p.y >= high.y);
    for (node, p) in mesh.vertices().iter().enumerate() {
        let value = match p.y {
            y if y <= low.y + 0.1 * (high.y - low.y) => 0.0,
            _ if Some(node) == top => 0.002,
            _ => continue,
        };
        known.extend((0..3).map(|axis| DofValue { dof: 3 * node as u32 + axis, value }));
    }
    let body = Body {
        mesh: MeshData {
            vertices: mesh.vertices().iter().map(|p| [p.x, p.y, p.z]).collect(),
            tets: mesh.tets().to_vec(),
            ..MeshData::default()
        },
        materials: vec![Material { young: 1.0e5, poisson: 0.3 }],
        element: ElementChoice::T4,
    };
    let method = MethodName::try_new(method).unwrap();
    Ask::new(body, Question { known, method, ..Question::default() })
}

#[test]
fn first_line_names_the_address_and_both_signals_end_with_exit_code_0() {
    for signal in ["TERM", "INT"] {
        let mut server = ServerProcess::start(&["--threads", "1"]);
        // A session that is open does not hold the end up.
        let mut client = server.connect();
        assert_eq!(client.ask(&Request::Ping { nonce: 4 }), Reply::Pong { nonce: 4 });
        server.signal(signal);
        assert_eq!(server.end(), (Some(0), String::new()), "SIG{signal}");
        assert!(TcpStream::connect(server.address).is_err());
    }
}

/// Longest time that a stop may take: three seconds, and the rest for a busy machine.
const STOP_MAX: Duration = Duration::from_millis(4500);

#[test]
fn server_at_work_that_takes_minutes_ends_within_three_seconds() {
    for signal in ["TERM", "INT"] {
        let mut server = ServerProcess::start(&["--threads", "2"]);
        let mut clients: Vec<Client> = (0..4).map(|_| server.connect()).collect();
        for client in &mut clients {
            client.send(&Request::from(pulled_cube(2000, "gauss-jordan-plain")));
        }
        // By the time this is answered the others have been read.
        let mut last = server.connect();
        assert_eq!(last.ask(&Request::Ping { nonce: 4 }), Reply::Pong { nonce: 4 });
        let start = Instant::now();
        server.signal(signal);
        assert_eq!(server.end(), (Some(0), String::new()), "SIG{signal}");
        let took = start.elapsed();
        assert!(took < STOP_MAX, "SIG{signal}: the end took {took:?}");
    }
}

/// METIS, once used here, replaced the handler of SIGTERM while it ordered: a server that was stopped
/// then died of SIGSEGV.
#[test]
fn a_stop_while_equations_are_ordered_does_not_crash() {
    // Start-up measures this machine on cubes, which are ordered: the signals fall at other
    // moments of that each time.
    for turn in 0..12 {
        let mut server = ServerProcess::start(&["--threads", "1"]);
        std::thread::sleep(Duration::from_millis(3 * turn));
        server.signal("TERM");
        assert_eq!(server.end(), (Some(0), String::new()), "turn {turn}");
    }
    // One long ordering, with a session that waits for it.
    let mut server = ServerProcess::start(&["--threads", "1"]);
    let mut client = server.connect();
    client.send(&Request::from(pulled_cube(8000, "front")));
    std::thread::sleep(Duration::from_millis(150));
    server.signal("TERM");
    assert_eq!(server.end(), (Some(0), String::new()));
}

#[test]
fn taken_port_ends_with_exit_code_1_and_one_clear_line() {
    let taken = TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let output = run(&["--listen", &address]);
    assert_eq!(output.status.code(), Some(1));
    assert!(output.stdout.is_empty());
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.starts_with("fea-server: cannot listen on"), "{said}");
    assert!(said.contains(&address) && said.contains("--listen HOST:PORT"), "{said}");
}

#[test]
fn files_and_addresses_that_are_not_there_end_with_exit_code_1() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("no-token").display().to_string();
    let empty = folder.path().join("empty").display().to_string();
    std::fs::write(&empty, "\n").unwrap();
    for (arguments, says) in [
        (["--token-file", &missing], "cannot read the token file"),
        (["--token-file", &empty], "is empty"),
        (["--listen", "7878"], "write HOST:PORT"),
    ] {
        let output = run(&arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.starts_with("fea-server: ") && said.contains(says), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }
}

#[test]
fn wrong_usage_ends_with_exit_code_2() {
    for arguments in [
        &["--nonsense"][..],
        &["--threads", "many"],
        &["--threads", "0"],
        &["--threads", "99999"],
        &["--max-nodes", "0"],
        &["--max-nodes", "-5"],
        &["--max-sessions", "0"],
        &["--memory-limit", "0"],
        &["--memory-limit", "lots"],
        &["--memory-limit", "0GiB"],
        &["--log", "xml"],
        &["stray"],
    ] {
        let arguments = [&["--listen", "127.0.0.1:0"], arguments].concat();
        let output = run(&arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(!said.is_empty() && output.stdout.is_empty(), "{arguments:?}");
    }
}

#[test]
fn token_of_the_file_is_wanted() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("token");
    std::fs::write(&file, "hush\nnot this line\n").unwrap();
    let server = ServerProcess::start(&["--token-file", file.to_str().unwrap()]);
    let stream = TcpStream::connect(server.address).unwrap();
    let mut client = Client { connection: Connection::new(stream, Limits::default()), id: 0 };
    let hello = |token: &str| Request::Hello(Hello::new("a test", Some(token.to_owned())));
    match client.ask(&hello("not this line")) {
        Reply::Rejected(rejected) => assert_eq!(rejected.code, RejectCode::NotAuthorised),
        other => panic!("{other:?}"),
    }
    assert!(matches!(client.ask(&hello("hush")), Reply::Welcome(_)));
}

#[test]
fn announced_sizes_take_no_memory() {
    let server = ServerProcess::start(&["--threads", "1"]);
    let mut client = server.connect();
    let sound = || Request::from(pulled_cube(64, "auto"));
    assert!(matches!(client.ask(&sound()), Reply::Answer(_)));
    let Some(before) = server.peak_bytes() else {
        println!("skipped: this system does not tell a process's memory");
        return;
    };
    // Headers that announce the largest payload, each followed by a little of it.
    let header = |len: u32| {
        let mut raw = b"SGRP".to_vec();
        raw.extend(VERSION.to_le_bytes());
        raw.extend(Kind::UploadModel.number().to_le_bytes());
        raw.extend(0_u32.to_le_bytes());
        raw.extend(len.to_le_bytes());
        raw.extend(1_u64.to_le_bytes());
        raw.extend(crc32c::crc32c(&raw).to_le_bytes());
        raw.extend(crc32c::crc32c(&raw).to_le_bytes());
        raw
    };
    let mut half_open = Vec::new();
    for _ in 0..20 {
        let mut stream = TcpStream::connect(server.address).unwrap();
        stream.write_all(&header(Limits::default().payload_len_max)).unwrap();
        stream.write_all(&[0; 10_000]).unwrap();
        half_open.push(stream);
    }
    // A part that announces all the nodes and elements there may be, and brings none.
    let mut mesh = 400_000_u32.to_le_bytes().to_vec();
    mesh.extend(2_400_000_u32.to_le_bytes());
    mesh.extend([1, 0, 0, 1, 0]);
    // The number of an Ask's subject stands before its mesh.
    for (kind, before) in [(Kind::UploadModel, &[][..]), (Kind::Ask, &[0; 4])] {
        let fields = [before, &mesh].concat();
        let mut payload = (fields.len() as u64).to_le_bytes().to_vec();
        payload.extend(fields);
        payload.resize(payload.len().next_multiple_of(8), 0);
        let mut frame = header(0);
        frame.truncate(6);
        frame.extend(kind.number().to_le_bytes());
        frame.extend(0_u32.to_le_bytes());
        frame.extend((payload.len() as u32).to_le_bytes());
        frame.extend(1_u64.to_le_bytes());
        frame.extend(crc32c::crc32c(&frame).to_le_bytes());
        frame.extend(crc32c::crc32c_append(crc32c::crc32c(&frame), &payload).to_le_bytes());
        frame.extend(&payload);
        let mut stream = TcpStream::connect(server.address).unwrap();
        stream.write_all(&frame).unwrap();
        let refused = Connection::new(stream, Limits::default()).read_frame().unwrap().unwrap();
        let reply = Reply::decode(&refused, &Limits::default()).unwrap();
        let Reply::Rejected(rejected) = reply else { panic!("{reply:?}") };
        assert!(rejected.text.contains("vertices need"), "{}", rejected.text);
    }
    assert!(matches!(client.ask(&sound()), Reply::Answer(_)));
    let grown = server.peak_bytes().unwrap() - before;
    assert!(grown < 16 * MIB, "grown by {} MiB", grown / MIB);
}

/// Growth of a fresh process over one solve, against what was counted before the factor was made.
fn check_counted_memory(method: Method, shape: BuiltIn, nodes: usize) {
    let server = ServerProcess::start(&["--threads", "2", "--memory-limit", "1GiB"]);
    let mut client = server.connect();
    client.solve(pulled_cube(64, method.name()));
    let Some(before) = server.peak_bytes() else {
        println!("skipped: this system does not tell a process's memory");
        return;
    };
    let request = pulled(shape, nodes, method.name());
    let need = counted(&request, method).bytes();
    let grown = {
        assert_eq!(client.solve(request).report.method, method.name());
        server.peak_bytes().unwrap().saturating_sub(before)
    };
    println!("{method}, {nodes} nodes: grown by {} of {} MiB", grown / MIB, need / MIB);
    // The count is an upper bound for any number of threads and knows whole squares of which a
    // triangle is touched; the process has a few MiB of its own beside it.
    assert!(grown <= need + need / 4 + 24 * MIB, "{grown} of {need}");
    assert!(grown >= need / 4, "{grown} of {need}: the count is far too large");
}

#[test]
fn counted_memory_is_that_which_is_taken() {
    check_counted_memory(Method::Front, BuiltIn::Sphere, 6000);
    check_counted_memory(Method::FrontMixed, BuiltIn::Cube, 8000);
    check_counted_memory(Method::Front, BuiltIn::Toothpaste, 8000);
}

/// Peak of one dense solve in a fresh process: 2.2 n² × 8 bytes and 64 MiB.
fn check_dense_memory(method: &str, nodes: usize, unknowns: std::ops::Range<u64>) {
    let server = ServerProcess::start(&["--threads", "2"]);
    let mut client = server.connect();
    let Some(idle) = server.peak_bytes() else {
        println!("skipped: this system does not tell a process's memory");
        return;
    };
    assert!(idle < 64 * MIB, "{} MiB before anything was asked", idle / MIB);
    let report = client.solve(pulled_cube(nodes, method)).report;
    assert_eq!(report.method, method);
    let n = report.unknown_dofs;
    assert!(unknowns.contains(&n), "{n} unknowns");
    assert!(report.residual_rel < 1e-10, "residual {:e}", report.residual_rel);
    let peak = server.peak_bytes().unwrap();
    // The same figure from inside; the system counts pages in batches per thread.
    assert!(report.peak_rss_bytes.abs_diff(peak) < 2 * MIB && report.peak_rss_bytes > idle);
    let bound = 22 * n * n * 8 / 10 + 64 * MIB;
    println!("{method}, {n} unknowns: {} of {} MiB", peak / MIB, bound / MIB);
    assert!(peak <= bound, "{method}: {} MiB, allowed {}", peak / MIB, bound / MIB);
    // And it is all there: a matrix that is not in memory was not inverted.
    let matrix = n * n * 8;
    let least = if method.starts_with("dense-") { matrix / 2 } else { matrix };
    assert!(peak > least, "{method}: {} MiB", peak / MIB);
}

#[test]
fn dense_inverse_stays_within_its_memory() {
    check_dense_memory("dense-inverse", 1000, 2500..3000);
}

#[test]
fn dense_cholesky_stays_within_its_memory() {
    check_dense_memory("dense-cholesky", 1000, 2500..3000);
}

#[test]
fn gauss_jordan_stays_within_its_memory() {
    check_dense_memory("gauss-jordan", 590, 1400..1700);
}

#[test]
fn server_ends_with_the_program_that_holds_its_input_and_not_before() {
    let mut child = command()
        .args(["--listen", "127.0.0.1:0", "--threads", "1", "--end-with-input"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut first = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut first).unwrap();
    assert!(first.starts_with("listening on "), "{first}");
    let mut input = child.stdin.take().unwrap();
    input.write_all(b"whatever is written\n").unwrap();
    std::thread::sleep(Duration::from_millis(300));
    assert!(child.try_wait().unwrap().is_none(), "it ended though its input is open");
    drop(input);
    let asked = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        assert!(asked.elapsed() < END_MAX, "it goes on without its input");
        std::thread::sleep(Duration::from_millis(20));
    };
    assert!(status.success(), "{status}");
}
