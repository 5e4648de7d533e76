//! An Inverse3 with its service: a real WebSocket that tells a place and hears forces.

use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

/// The service, on a port of its own.
pub struct EmulatedHaply {
    /// Address of the service.
    pub url: String,
    state: Arc<Mutex<State>>,
    thread: Option<JoinHandle<()>>,
}

/// What the device is like.
#[derive(Clone, Copy, Debug, Default)]
pub struct State {
    /// Place of the cursor, in the axes of the service, m.
    pub place: [f64; 3],
    /// Newest force on the cursor, in the axes of the service, N.
    pub force: [f64; 3],
    /// Number of forces that have come.
    pub forces: u64,
    /// Whether the device is silent.
    pub is_silent: bool,
    ends: bool,
}

impl EmulatedHaply {
    /// Starts the service.
    pub fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a loopback port is free");
        let url = format!("ws://{}", listener.local_addr().expect("it is bound"));
        let state = Arc::new(Mutex::new(State::default()));
        let of_thread = Arc::clone(&state);
        let thread = std::thread::spawn(move || serve(&listener, &of_thread));
        Self { url, state, thread: Some(thread) }
    }

    /// What the device is like now.
    pub fn state(&self) -> State {
        *self.state.lock().expect("the service goes on")
    }

    /// Changes the device.
    pub fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.state.lock().expect("the service goes on"));
    }
}

impl Drop for EmulatedHaply {
    fn drop(&mut self) {
        self.change(|state| state.ends = true);
        // The service may wait for a connection.
        let _ = TcpStream::connect(self.url.trim_start_matches("ws://"));
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn serve(listener: &TcpListener, state: &Mutex<State>) {
    while let Ok((stream, _)) = listener.accept() {
        if state.lock().expect("the test goes on").ends {
            return;
        }
        if let Ok(socket) = tungstenite::accept(stream) {
            speak(socket, state);
        }
    }
}

/// As the service does it: a state, then a command, in turn.
fn speak(mut socket: WebSocket<TcpStream>, state: &Mutex<State>) {
    let wait = Some(Duration::from_millis(20));
    if socket.get_ref().set_read_timeout(wait).is_err() {
        return;
    }
    loop {
        let now = *state.lock().expect("the test goes on");
        if now.ends {
            return;
        }
        if !now.is_silent && socket.send(Message::text(told(&now))).is_err() {
            return;
        }
        match socket.read() {
            Ok(Message::Text(text)) => {
                if let Some(force) = commanded(text.as_str()) {
                    let mut state = state.lock().expect("the test goes on");
                    (state.force, state.forces) = (force, state.forces + 1);
                }
            }
            Ok(Message::Close(_)) => return,
            Ok(_) => {}
            Err(tungstenite::Error::Io(_)) => {}
            Err(_) => return,
        }
    }
}

fn told(state: &State) -> String {
    let [x, y, z] = state.place;
    let cursor = json!({"x": x, "y": y, "z": z});
    let state = json!({"cursor_position": cursor, "mode": "force"});
    json!({"inverse3": [{"device_id": "1234", "state": state, "status": {"ready": true}}]})
        .to_string()
}

fn commanded(text: &str) -> Option<[f64; 3]> {
    let message: Value = serde_json::from_str(text).ok()?;
    let device = message.get("inverse3")?.get(0)?;
    assert_eq!(device.get("device_id")?.as_str()?, "1234");
    let vector = device.get("commands")?.get("set_cursor_force")?.get("vector")?;
    let axis = |axis| vector.get(axis)?.as_f64();
    Some([axis("x")?, axis("y")?, axis("z")?])
}
