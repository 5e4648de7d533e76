//! Certificates: validity, one that has expired, and a new one while the server runs.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned};
use softgrasp_protocol::{Limits, Request};

use crate::running::{LONG, Running, run};

const DAY: Duration = Duration::from_secs(86_400);

struct Pair {
    certificate: PathBuf,
    key: PathBuf,
    _folder: tempfile::TempDir,
}

impl Pair {
    /// Certificate that is valid between two days, counted from now.
    fn valid(from: i32, to: i32) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (certificate, key) = (folder.path().join("certificate"), folder.path().join("key"));
        let this = Self { certificate, key, _folder: folder };
        this.write(from, to);
        this
    }

    fn write(&self, from: i32, to: i32) {
        let day = |days: i32| match days {
            0.. => SystemTime::now() + days as u32 * DAY,
            _ => SystemTime::now() - days.unsigned_abs() * DAY,
        };
        let mut wanted = rcgen::CertificateParams::new(vec!["localhost".to_owned()]).unwrap();
        (wanted.not_before, wanted.not_after) = (day(from).into(), day(to).into());
        let key = rcgen::KeyPair::generate().unwrap();
        std::fs::write(&self.certificate, wanted.self_signed(&key).unwrap().pem()).unwrap();
        std::fs::write(&self.key, key.serialize_pem()).unwrap();
    }

    fn arguments(&self) -> [&str; 4] {
        let [certificate, key] = [&self.certificate, &self.key].map(|path| path.to_str().unwrap());
        ["--tls-cert", certificate, "--tls-key", key]
    }

    /// A client that trusts this certificate as it is now; an error where the server shows another.
    fn connect(
        &self,
        server: &Running,
    ) -> std::io::Result<StreamOwned<ClientConnection, TcpStream>> {
        connect(&self.certificate, server)
    }
}

fn connect(
    trusted: &Path,
    server: &Running,
) -> std::io::Result<StreamOwned<ClientConnection, TcpStream>> {
    let mut roots = RootCertStore::empty();
    roots.add(CertificateDer::from_pem_file(trusted).unwrap()).unwrap();
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let config = ClientConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&rustls::version::TLS13])
        .unwrap()
        .with_root_certificates(roots)
        .with_no_client_auth();
    let name = ServerName::try_from("localhost").unwrap();
    let client = ClientConnection::new(Arc::new(config), name).unwrap();
    let stream = TcpStream::connect(server.address).unwrap();
    stream.set_read_timeout(Some(LONG)).unwrap();
    let mut stream = StreamOwned::new(client, stream);
    ping(&mut stream)?;
    Ok(stream)
}

/// Sends `Ping` and waits for the reply.
fn ping(stream: &mut (impl Read + Write)) -> std::io::Result<()> {
    let mut bytes = Vec::new();
    Request::Ping { nonce: 7 }.encode_into(1, &Limits::default(), &mut bytes).unwrap();
    stream.write_all(&bytes)?;
    stream.read_exact(&mut vec![0; bytes.len()])
}

#[test]
fn certificate_that_is_made_has_the_life_that_was_asked_for() {
    for (asked, days) in [(None, 730), (Some("90"), 90)] {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        let (certificate, key) = (file("certificate"), file("key"));
        let mut arguments = vec!["--make-certificate", "localhost"];
        arguments.extend(["--tls-cert", &certificate, "--tls-key", &key]);
        arguments.extend(asked.iter().flat_map(|days| ["--certificate-days", days]));
        let output = run(&arguments);
        assert!(output.status.success(), "{output:?}");
        let server = Running::start(&["--tls-cert", &certificate, "--tls-key", &key]);
        let expires = server.metric("softgrasp_certificate_expires_seconds");
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap().as_secs_f64();
        let left = (expires - now) / DAY.as_secs_f64();
        assert!((f64::from(days) - 0.1..=f64::from(days)).contains(&left), "{left} of {days}");
    }
}

#[test]
fn certificate_out_of_its_time_is_refused_and_one_near_its_end_is_warned_of() {
    for (from, to, says) in [(-400, -1, "it expired on"), (2, 400, "it is valid from")] {
        let pair = Pair::valid(from, to);
        let output = run(&[&["--listen", "127.0.0.1:0"], &pair.arguments()[..]].concat());
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains(says) && said.lines().count() == 1, "{said}");
    }
    let pair = Pair::valid(-1, 20);
    let server = Running::start(&pair.arguments());
    let line = server.log_line("certificate expires soon");
    // The second in which it was made may have passed.
    assert!(["days_left=19", "days_left=20"].iter().any(|days| line.contains(days)), "{line}");
    assert!(pair.connect(&server).is_ok());
}

#[test]
fn certificate_is_read_again_on_hang_up_and_sessions_live_on() {
    let pair = Pair::valid(-1, 400);
    let server = Running::start(&pair.arguments());
    let mut old = pair.connect(&server).unwrap();
    let trusted_before = pair.certificate.with_extension("before");
    std::fs::copy(&pair.certificate, &trusted_before).unwrap();
    pair.write(-1, 500);
    assert!(pair.connect(&server).is_err(), "it is not read by itself");
    server.signal("HUP");
    server.log_line("read again");
    assert!(pair.connect(&server).is_ok());
    assert!(connect(&trusted_before, &server).is_err());
    ping(&mut old).unwrap();
    // What is of no use leaves the one before in use.
    let expires = server.metric("softgrasp_certificate_expires_seconds");
    std::fs::copy(&pair.certificate, &trusted_before).unwrap();
    pair.write(-400, -1);
    server.signal("HUP");
    assert!(server.log_line("stays in use").contains("it expired on"));
    assert!(connect(&trusted_before, &server).is_ok());
    assert_eq!(server.metric("softgrasp_certificate_expires_seconds"), expires);
    ping(&mut old).unwrap();
}

#[test]
fn end_of_tls_without_a_farewell_between_frames_is_an_ordinary_end() {
    let pair = Pair::valid(-1, 400);
    let server = Running::start(&pair.arguments());
    let stream = pair.connect(&server).unwrap();
    server.await_metric("softgrasp_sessions", 1.0);
    // The socket is closed as by a program that ends: TLS says nothing more.
    stream.sock.shutdown(std::net::Shutdown::Both).unwrap();
    drop(stream);
    server.await_metric("softgrasp_sessions", 0.0);
    assert_eq!(server.metric("softgrasp_given_up_total"), 0.0);
    server.log_line("session ends");
}

#[test]
fn silent_handshakes_keep_no_newcomer_out() {
    let pair = Pair::valid(-1, 400);
    let server = Running::start(&pair.arguments());
    let held: Vec<TcpStream> = (0..300).map(|_| server.silent()).collect();
    assert!(pair.connect(&server).is_ok());
    assert_eq!(server.page("/ready").0, 200);
    drop(held);
}
