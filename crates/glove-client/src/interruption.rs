//! Ctrl-C, SIGTERM and a closed terminal: a command that ends with a summary is told, any other
//! program ends at once. So does one that is asked a second time.

use std::process::exit;
use std::sync::atomic::{AtomicU8, Ordering};

use softgrasp_os::{EndSignal, on_end_signal};

/// Nobody waits to be told.
const UNHEARD: u8 = 0;
/// A command looks whether it was asked to end.
const HEARD: u8 = 1;
/// It was asked.
const ASKED: u8 = 2;

static STATE: AtomicU8 = AtomicU8::new(UNHEARD);

/// Takes the signals over; before any other thread is started.
pub fn watch() {
    let react = |signal: EndSignal| {
        let told = STATE.compare_exchange(HEARD, ASKED, Ordering::Relaxed, Ordering::Relaxed);
        if told.is_err() {
            exit(i32::from(signal.exit_code));
        }
    };
    // Without, the signals still end the program, only without a summary.
    if let Err(error) = on_end_signal(true, react) {
        tracing::debug!(%error, "signals cannot be waited for");
    }
}

/// From now on the command looks at [`asked`] and ends by itself.
pub fn hear() {
    STATE.store(HEARD, Ordering::Relaxed);
}

/// Whether the program was asked to end since [`hear`].
pub fn asked() -> bool {
    STATE.load(Ordering::Relaxed) == ASKED
}
