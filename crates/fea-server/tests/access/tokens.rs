//! Tokens: several with names and numbers of sessions, weak ones, and those read again.

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use softgrasp_protocol::RejectCode;

use crate::running::{Running, run};

const ALICE: &str = "alice has a token of her own";
const BOB: &str = "Bob's-token-is-long-enough";

/// File of mode 600 in a folder that is removed with this value.
struct File {
    path: PathBuf,
    _folder: tempfile::TempDir,
}

impl File {
    fn new(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let this = Self { path: folder.path().join("tokens"), _folder: folder };
        this.write(text);
        this.set_mode(0o600);
        this
    }

    fn write(&self, text: &str) {
        std::fs::write(&self.path, text).unwrap();
    }

    fn set_mode(&self, mode: u32) {
        set_mode(&self.path, mode);
    }

    fn argument(&self) -> &str {
        self.path.to_str().unwrap()
    }
}

fn set_mode(path: &Path, mode: u32) {
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
}

#[test]
fn each_name_has_its_token_its_sessions_and_its_numbers() {
    let alice = ALICE.replace(' ', "-");
    let file =
        File::new(&format!("# lab\nname=alice token={alice} sessions=1\nname=bob token={BOB}\n"));
    let server = Running::start(&["--token-file", file.argument()]);
    let mut first = server.client();
    assert_eq!(first.hello("a", Some(&alice)), Ok(()));
    assert!(server.log_line("client introduced itself").contains("alice"));
    assert!(first.is_served());
    assert_eq!(server.client().hello("b", Some(&alice)), Err(RejectCode::Busy));
    let mut bob = [server.client(), server.client()];
    for client in &mut bob {
        assert_eq!(client.hello("c", Some(BOB)), Ok(()));
    }
    let line = format!("name=bob token={BOB}");
    for wrong in ["alice", "bob", &line, "", "lab"] {
        assert_eq!(server.client().hello("d", Some(wrong)), Err(RejectCode::NotAuthorised));
        // The right one after it, so that the address is not barred.
        assert_eq!(server.client().hello("e", Some(BOB)), Ok(()));
    }
    let of = |name: &str, token: &str| {
        server.metric(&format!("softgrasp_token_{name}{{token=\"{token}\"}}"))
    };
    assert_eq!(of("sessions", "alice"), 1.0);
    assert_eq!(of("sessions_total", "alice"), 1.0);
    assert_eq!(of("requests_total", "alice"), 2.0);
    server.await_metric("softgrasp_token_sessions{token=\"bob\"}", 2.0);
    assert_eq!(of("sessions_total", "bob"), 7.0);
    let (_, text) = server.page("/metrics");
    assert!(!text.contains(&alice) && !text.contains(BOB));
    drop(first);
    server.await_metric("softgrasp_token_sessions{token=\"alice\"}", 0.0);
    assert_eq!(server.client().hello("f", Some(&alice)), Ok(()));
}

#[test]
fn tokens_are_read_again_on_hang_up_and_sessions_live_on() {
    let file = File::new(ALICE);
    let server = Running::start(&["--token-file", file.argument()]);
    let mut known = server.client();
    assert_eq!(known.hello("a", Some(ALICE)), Ok(()));
    file.write(BOB);
    server.signal("HUP");
    server.log_line("read again");
    assert!(known.is_served(), "its token is gone, it is not");
    assert_eq!(server.client().hello("b", Some(BOB)), Ok(()));
    assert_eq!(server.client().hello("c", Some(ALICE)), Err(RejectCode::NotAuthorised));
    // What cannot be read leaves the old one in use, and is told.
    file.write("\n");
    server.signal("HUP");
    assert!(server.log_line("stays in use").contains("is empty"));
    assert_eq!(server.client().hello("d", Some(BOB)), Ok(()));
    assert!(known.is_served());
}

#[test]
fn hang_up_ends_a_server_that_has_nothing_to_read_again_as_other_signals_do() {
    let server = Running::start(&["--drain", "20"]);
    let mut known = server.client();
    assert!(known.is_served());
    server.signal("HUP");
    server.log_line("stopping");
    assert!(known.is_served(), "it drains");
    drop(known);
    server.log_line("stopped");
}

#[test]
fn token_that_others_can_read_or_guess_is_warned_of_with_what_to_do() {
    let file = File::new(ALICE);
    let quiet = Running::start(&["--token-file", file.argument()]);
    let lines = quiet.log_until("ready");
    assert!(lines.iter().all(|line| !line.contains("WARN")), "{lines:?}");
    file.set_mode(0o644);
    // The folder lets nobody in, so it is safe still.
    let folder = file.path.parent().unwrap();
    set_mode(folder, 0o700);
    let quiet = Running::start(&["--token-file", file.argument()]);
    let lines = quiet.log_until("ready");
    assert!(lines.iter().all(|line| !line.contains("WARN")), "{lines:?}");
    set_mode(folder, 0o755);
    let loud = Running::start(&["--token-file", file.argument()]);
    assert!(loud.log_line("others on this machine can read").contains("chmod 600"));
    file.write("hush\n");
    let loud = Running::start(&["--token-file", file.argument()]);
    assert!(loud.log_line("fewer than 16 letters").contains("/dev/urandom"));
    file.write("x\n");
    let output = run(&["--listen", "127.0.0.1:0", "--token-file", file.argument()]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("soon guessed") && said.contains("/dev/urandom"), "{said}");
}
