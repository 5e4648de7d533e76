//! Log lines about clients: they name the client, and are short, few and harmless.

use softgrasp_protocol::{Ask, Body, ElementChoice, MeshData, MethodName, Question, Request};

use crate::running::Running;

/// Client's name of 16 KiB that would turn, colour and break the lines of a terminal.
fn nasty_name() -> String {
    let nasty = "\u{202e}\u{9b}31m\u{1b}[2J\n\u{2066}\u{feff}\"}";
    nasty.repeat(16_000 / nasty.len())
}

/// Whether a terminal shows a line without harm.
fn is_harmless(line: &str) -> bool {
    line.chars().all(|c| c == '"' || c == '\'' || c == '\\' || c.escape_debug().len() == 1)
}

#[test]
fn names_of_clients_are_short_and_harmless_in_both_forms_of_the_log() {
    for form in ["text", "json"] {
        let server = Running::start(&["--log", form]);
        assert_eq!(server.client().hello(&nasty_name(), None), Ok(()));
        let line = server.log_line("client introduced itself");
        assert!(line.contains("<U+202E><U+009B>31m<U+001B>[2J<U+000A>"), "{form}: {line}");
        assert!(line.len() < 1500 && is_harmless(&line), "{form}: {} bytes", line.len());
    }
}

#[test]
fn every_line_of_a_session_bears_its_number_and_its_peer() {
    for form in ["text", "json"] {
        let server = Running::start(&["--log", form]);
        let mut client = server.client();
        assert_eq!(client.hello("a test", None), Ok(()));
        let method = MethodName::try_new("nosuch").unwrap();
        let body =
            Body { mesh: MeshData::default(), materials: Vec::new(), element: ElementChoice::T4 };
        let once = Ask::new(body, Question { method, ..Question::default() });
        assert!(client.ask(&Request::from(once)).is_some());
        client.send(b"this is no frame");
        assert!(client.reply().is_some());
        let peer = client.peer().to_string();
        let lines = server.log_until("session is given up");
        for message in
            ["session begins", "client introduced itself", "request refused", "session is given up"]
        {
            let line = lines.iter().find(|line| line.contains(message)).expect(message);
            let number = if form == "text" { "id=1" } else { "\"id\":1" };
            assert!(line.contains(&peer) && line.contains(number), "{form}: {line}");
            assert!(is_harmless(line), "{form}: {line}");
        }
    }
}

#[test]
fn client_that_says_hello_or_connects_without_end_does_not_fill_the_log() {
    let server = Running::start(&[]);
    let mut greets = server.client();
    for _ in 0..2000 {
        assert_eq!(greets.hello(&nasty_name(), None), Ok(()));
    }
    for _ in 0..500 {
        assert!(server.client().is_served());
    }
    server.await_metric("softgrasp_sessions", 1.0);
    server.signal("TERM");
    let lines = server.log_until("stopped");
    // 200 at once and 10 a second: a minute for a very busy machine.
    assert!(lines.len() < 200 + 600 + 20, "{} lines", lines.len());
    let bytes: usize = lines.iter().map(String::len).sum();
    assert!(bytes < 300 * lines.len(), "{bytes} bytes in {} lines", lines.len());
    let greetings = lines.iter().filter(|line| line.contains("client introduced itself"));
    assert_eq!(greetings.count(), 1);
}
