//! What a collector receives, from a program of its own: this one, started again with the variables that
//! name the collector.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail like tests")]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::{Command, Output};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use serde_json::Value;
use softgrasp_telemetry::{Observed, RequestSpan, observe, start};

/// Variable that makes this program work and end, and says at what.
const WORK: &str = "SOFTGRASP_TEST_WORK";
/// The longest time for what must come.
const SOON: Duration = Duration::from_secs(60);

/// Body of the program that is observed; returns at once if this one was not started for that.
#[test]
fn works_if_asked() {
    let Ok(work) = std::env::var(WORK) else { return };
    tracing_subscriber::fmt().with_ansi(false).with_writer(std::io::stderr).init();
    let export = start("fea-server", "1.2.3").unwrap().expect("a collector is named");
    if work == "again" {
        for _ in 0..3 {
            drop(RequestSpan::client("Ask", 1));
            std::thread::sleep(Duration::from_millis(150));
        }
        return drop(export);
    }
    observe(vec![Observed {
        name: "softgrasp.server.sessions",
        unit: "{session}",
        description: "Sessions that are there.",
        read: Box::new(|| Some(3.0)),
    }]);
    let client = RequestSpan::client("Ask", 7);
    let context = client.context().unwrap();
    // The server's side, as it reads the context from the wire, and its question to the cluster.
    let mut server = RequestSpan::server("Frame", (5, 7), || Some(context));
    server.set("softgrasp.method", "condensed");
    server.set("softgrasp.solve_ms", 0.25);
    let mut further = RequestSpan::client_of(server.context(), "Ask", 2);
    further.fail("ClusterLost", || "the cluster was lost".to_owned());
    drop(further);
    drop(server);
    drop(client);
    drop(export);
}

/// A collector of OTLP over HTTP, with JSON: what was posted, and to which path.
struct Collector {
    address: SocketAddr,
    posted: Receiver<(String, Value)>,
}

impl Collector {
    fn start() -> Self {
        let listener = TcpListener::bind(("127.0.0.1", 0)).unwrap();
        let address = listener.local_addr().unwrap();
        let (to, posted) = channel();
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                let to = to.clone();
                std::thread::spawn(move || serve(&stream.unwrap(), &to));
            }
        });
        Self { address, posted }
    }

    /// Everything that a program has posted until it ended.
    fn all(&self) -> Vec<(String, Value)> {
        let mut posted: Vec<_> = self.posted.recv_timeout(SOON).into_iter().collect();
        posted.extend(self.posted.try_iter());
        posted
    }
}

fn serve(stream: &TcpStream, to: &Sender<(String, Value)>) {
    let mut reader = BufReader::new(stream);
    loop {
        let mut first = String::new();
        if reader.read_line(&mut first).unwrap_or(0) == 0 {
            return;
        }
        let mut len = 0;
        loop {
            let mut line = String::new();
            reader.read_line(&mut line).unwrap();
            if line.trim().is_empty() {
                break;
            }
            if let Some(value) = line.to_lowercase().strip_prefix("content-length:") {
                len = value.trim().parse().unwrap();
            }
        }
        let mut body = vec![0; len];
        reader.read_exact(&mut body).unwrap();
        let path = first.split(' ').nth(1).unwrap().to_owned();
        to.send((path, serde_json::from_slice(&body).unwrap())).unwrap();
        let reply =
            "HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: 2\r\n\r\n{}";
        (&mut &*stream).write_all(reply.as_bytes()).unwrap();
    }
}

/// Runs this program as one that exports everything to an address.
fn work(work: &str, collector: SocketAddr) -> Output {
    let address = format!("http://{collector}");
    work_with(work, &[("OTEL_EXPORTER_OTLP_ENDPOINT", &address)])
}

fn work_with(work: &str, endpoints: &[(&str, &str)]) -> Output {
    Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "works_if_asked", "--nocapture", "--test-threads=1"])
        .env(WORK, work)
        .envs(endpoints.iter().copied())
        .env("OTEL_EXPORTER_OTLP_PROTOCOL", "http/json")
        .env("OTEL_BSP_SCHEDULE_DELAY", "50")
        .env("NO_PROXY", "127.0.0.1")
        .output()
        .unwrap()
}

/// All objects of an array with this name, at any depth.
fn all_named<'a>(value: &'a Value, name: &str) -> Vec<&'a Value> {
    match value {
        Value::Object(fields) => fields
            .iter()
            .flat_map(|(field, inner)| match (field == name, inner.as_array()) {
                (true, Some(entries)) => entries.iter().collect(),
                _ => all_named(inner, name),
            })
            .collect(),
        Value::Array(entries) => entries.iter().flat_map(|entry| all_named(entry, name)).collect(),
        _ => vec![],
    }
}

/// The value of an attribute as text.
fn attribute(of: &Value, name: &str) -> Option<String> {
    let entries = of["attributes"].as_array()?;
    let value = &entries.iter().find(|entry| entry["key"] == name)?["value"];
    let (_, value) = value.as_object()?.iter().next()?;
    Some(value.as_str().map_or_else(|| value.to_string(), str::to_owned))
}

#[test]
fn spans_of_one_request_are_one_trace_and_their_durations_are_metrics() {
    let collector = Collector::start();
    let ran = work("once", collector.address);
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let posted = collector.all();
    let of = |path: &str| -> Vec<&Value> {
        posted.iter().filter(|(to, _)| to == path).map(|(_, value)| value).collect()
    };
    let traces = of("/v1/traces");
    let spans: Vec<&Value> = traces.iter().flat_map(|value| all_named(value, "spans")).collect();
    assert_eq!(spans.len(), 3, "{posted:?}");
    let named = |name: &str, request: &str| {
        let is_it = |span: &&&Value| {
            span["name"] == name && attribute(span, "softgrasp.request").as_deref() == Some(request)
        };
        *spans.iter().find(is_it).unwrap()
    };
    let (client, server, further) = (named("Ask", "7"), named("Frame", "7"), named("Ask", "2"));
    for span in [server, further] {
        assert_eq!(span["traceId"], client["traceId"]);
    }
    assert_eq!(server["parentSpanId"], client["spanId"]);
    assert_eq!(further["parentSpanId"], server["spanId"]);
    assert_eq!([client["kind"].as_i64(), server["kind"].as_i64()], [Some(3), Some(2)]);
    assert_eq!(attribute(server, "softgrasp.session").unwrap(), "5");
    assert_eq!(attribute(server, "softgrasp.method").unwrap(), "condensed");
    assert_eq!(attribute(server, "softgrasp.solve_ms").unwrap(), "0.25");
    assert_eq!(attribute(further, "error.type").unwrap(), "ClusterLost");
    assert_eq!(further["status"]["message"], "the cluster was lost");
    let resource = &traces[0]["resourceSpans"][0]["resource"];
    assert_eq!(attribute(resource, "service.name").unwrap(), "fea-server");
    assert_eq!(attribute(resource, "service.version").unwrap(), "1.2.3");

    let exported = of("/v1/metrics");
    let metrics: Vec<&Value> =
        exported.iter().flat_map(|value| all_named(value, "metrics")).collect();
    let metric = |name: &str| *metrics.iter().find(|metric| metric["name"] == name).unwrap();
    let asked = &metric("softgrasp.client.request.duration")["histogram"]["dataPoints"];
    let errors: Vec<_> =
        asked.as_array().unwrap().iter().map(|point| attribute(point, "error.type")).collect();
    assert_eq!(errors.iter().flatten().collect::<Vec<_>>(), ["ClusterLost"]);
    assert_eq!(errors.len(), 2);
    let answered = &metric("softgrasp.server.request.duration")["histogram"]["dataPoints"][0];
    assert_eq!(attribute(answered, "rpc.method").unwrap(), "Frame");
    let sessions = &metric("softgrasp.server.sessions")["gauge"]["dataPoints"][0];
    assert_eq!(sessions["asDouble"], 3.0);
}

#[test]
fn signal_without_an_address_is_not_sent_to_one_that_nobody_named() {
    let collector = Collector::start();
    let address = format!("http://{}/v1/traces", collector.address);
    let ran = work_with("once", &[("OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", &address)]);
    let log = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success() && !log.contains("collector"), "{log}");
    let posted = collector.all();
    assert!(!posted.is_empty() && posted.iter().all(|(path, _)| path == "/v1/traces"));
}

#[test]
fn program_ends_in_time_where_no_collector_listens() {
    let listener = TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let nobody = listener.local_addr().unwrap();
    drop(listener);
    let began = Instant::now();
    let ran = work("again", nobody);
    let log = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success(), "{log}");
    assert!(began.elapsed() < SOON);
    assert_eq!(log.matches("the collector cannot be reached").count(), 1, "{log}");
}

#[test]
fn program_ends_in_time_where_the_collector_never_replies() {
    // It accepts into its queue, and nobody reads.
    let listener = TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let began = Instant::now();
    let ran = work("again", listener.local_addr().unwrap());
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    assert!(began.elapsed() < SOON);
}

#[test]
fn without_a_collector_nothing_is_recorded() {
    assert!(start("fea-server", "1").unwrap().is_none());
    let read = || panic!("the parent is not needed");
    let span = RequestSpan::server("Ask", (1, 1), read);
    assert!(span.context().is_none() && !span.is_recorded());
}
