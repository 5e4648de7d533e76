//! A crowd that sends large requests: the server's memory stays within its limit and a constant.

use std::io::Write;
use std::net::TcpStream;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use glove_client::ask::connection::{LinkError, ServerConnection, unexpected};
use softgrasp_core::mesh::BuiltIn;
use softgrasp_protocol::blocking::Connection;
use softgrasp_protocol::{Limits, MeshData, RejectCode, Rejected, Reply, Request};

use super::bars::Bars;
use crate::programs::{Programs, Server};
use crate::report::{ReportError, progress};
use crate::requests::upload;
use crate::scene::Pressed;
use crate::table::{Cell, Table};
use crate::threads::processors;

/// Memory of the server for what it keeps, receives and works on, bytes.
const LIMIT: u64 = 256 << 20;
/// Memory that the process may hold beside the limit, bytes: program, threads, 256 KiB of each session,
/// allocator.
const BESIDE: f64 = (128 << 20) as f64;
/// Number of clients of the crowd.
const CROWD: usize = 8;
/// Length of the request that each of them sends, bytes.
const REQUEST_BYTES: [usize; 2] = [200_000_000, 100_000_000];
/// Largest number of nodes that the server takes, so that the crowd's requests are refused after they
/// were read.
const NODES_MAX: &str = "20000";
/// Time between two looks at the server's memory.
const LOOK: Duration = Duration::from_millis(5);
/// Time after which a client whose bytes are not read gives up.
const SENT_MAX: Duration = Duration::from_secs(60);

/// Measures the section.
///
/// # Errors
/// [`ReportError`].
pub(super) fn measure(programs: &Programs, bars: &mut Bars<'_>) -> Result<(), ReportError> {
    bars.report().text(format!(
        "Memory of a server with `--memory-limit` {} MiB while {CROWD} clients send one large request each \
         at the same time, as fast as it reads. A newcomer's model must be ready meanwhile. Resident \
         memory as the system counts it, every {} ms; the bar is the limit and {} MiB for the program, \
         its threads, the sessions and the allocator.",
        LIMIT >> 20,
        LOOK.as_millis(),
        BESIDE as u64 >> 20,
    ));
    let mut table = Table::new(
        "service-receiving",
        "Resident memory while a crowd sends",
        &["request_mb", "before_mib", "most_mib", "refused", "done", "newcomer_ms"],
    );
    for bytes in REQUEST_BYTES {
        let bytes = if bars.is_quick() { bytes / 20 } else { bytes };
        progress("service", &format!("{CROWD} × {bytes} bytes"));
        let threads = processors().to_string();
        let limit = LIMIT.to_string();
        let arguments = [
            "--listen",
            "127.0.0.1:0",
            "--threads",
            &threads,
            "--memory-limit",
            &limit,
            "--max-nodes",
            NODES_MAX,
        ];
        let server = programs.serve_as(&arguments)?;
        let outcome = crowd(&server, bytes)?;
        let mib = |bytes: f64| Cell::Number(bytes / f64::from(1 << 20));
        table.push([
            Cell::Count(bytes as u64 / 1_000_000),
            mib(outcome.before),
            mib(outcome.most),
            Cell::Count(outcome.refused as u64),
            Cell::Count(outcome.done as u64),
            Cell::Number(outcome.newcomer_ms),
        ]);
        let what = format!("memory while {CROWD} clients send {} MB each", bytes / 1_000_000);
        let most_mib = outcome.most / f64::from(1 << 20);
        bars.row(&what, most_mib, (LIMIT as f64 + BESIDE) / f64::from(1 << 20), "MiB");
    }
    bars.report().table(table);
    Ok(())
}

struct Outcome {
    before: f64,
    most: f64,
    refused: usize,
    done: usize,
    newcomer_ms: f64,
}

fn crowd(server: &Server, bytes: usize) -> Result<Outcome, ReportError> {
    let resident = || server.resident_bytes().unwrap_or(f64::NAN);
    let (before, mut most) = (resident(), 0.0f64);
    let (ended, refused) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let newcomer = Pressed::try_new(BuiltIn::Cube, 1000)?.upload();
    let request = large_request(bytes)?;
    let newcomer_ms = std::thread::scope(|scope| {
        let mut clients = Vec::new();
        for _ in 0..CROWD {
            let (request, ended, refused) = (&request, &ended, &refused);
            let address = server.address.as_str();
            clients.push(scope.spawn(move || {
                let outcome = is_refused(address, request);
                ended.fetch_add(1, Ordering::Relaxed);
                refused.fetch_add(usize::from(outcome?), Ordering::Relaxed);
                Ok::<(), ReportError>(())
            }));
        }
        let come = scope.spawn(|| {
            // When the crowd is in the middle of it.
            std::thread::sleep(Duration::from_millis(200));
            let begun = Instant::now();
            let mut connection = ServerConnection::connect(server.address.as_str())?;
            upload(&mut connection, newcomer)?;
            Ok::<f64, ReportError>(1e3 * begun.elapsed().as_secs_f64())
        });
        while ended.load(Ordering::Relaxed) < CROWD {
            most = most.max(resident());
            std::thread::sleep(LOOK);
        }
        for client in clients {
            client.join().unwrap_or_else(|_| Err(ended_abnormally()))?;
        }
        come.join().unwrap_or_else(|_| Err(ended_abnormally()))
    })?;
    let refused = refused.load(Ordering::Relaxed);
    Ok(Outcome { before, most, refused, done: CROWD - refused, newcomer_ms })
}

fn ended_abnormally() -> ReportError {
    ReportError::Ended { what: "a client of the crowd".to_owned(), said: "it panicked".to_owned() }
}

/// Request with a model of more nodes than the server takes, so that it is only received and read.
fn large_request(bytes: usize) -> Result<Vec<u8>, ReportError> {
    let mut model = Pressed::try_new(BuiltIn::Cube, 64)?.upload();
    model.mesh = MeshData { vertices: vec![[0.0; 3]; bytes / 24], ..MeshData::default() };
    let mut out = Vec::new();
    let encoded = Request::UploadModel(model).encode_into(1, &Limits::default(), &mut out);
    encoded.map_err(LinkError::from)?;
    Ok(out)
}

/// Sends a request; returns whether there was no memory to receive it.
fn is_refused(address: &str, request: &[u8]) -> Result<bool, ReportError> {
    let broken = |error: std::io::Error| LinkError::Connection(error.into());
    let mut stream = TcpStream::connect(address).map_err(broken)?;
    stream.set_write_timeout(Some(SENT_MAX)).map_err(broken)?;
    stream.set_read_timeout(Some(SENT_MAX)).map_err(broken)?;
    stream.write_all(request).map_err(broken)?;
    let mut connection = Connection::new(stream, Limits::default());
    let frame = connection.read_frame().map_err(LinkError::from)?.ok_or(LinkError::Closed)?;
    match Reply::decode(&frame, &Limits::default()).map_err(LinkError::from)? {
        Reply::Rejected(Rejected { code: RejectCode::MemoryLimit, .. }) => Ok(true),
        Reply::Rejected(Rejected { code: RejectCode::TooLarge, .. }) => Ok(false),
        other => Err(unexpected("UploadModel", &other).into()),
    }
}
