//! Ends the program on Ctrl-C, SIGTERM and a closed terminal: `run` writes its report first, other
//! commands end at once, and so does any command at the second signal.

use std::process::exit;
use std::sync::atomic::{AtomicU8, Ordering};

use softgrasp_os::{EndSignal, on_end_signal};

/// The command does not check for signals: a signal ends the program.
const UNHEARD: u8 = 0;
/// The command checks [`asked`].
const HEARD: u8 = 1;
/// A signal has asked the command to end.
const ASKED: u8 = 2;

static STATE: AtomicU8 = AtomicU8::new(UNHEARD);

/// Installs the handlers; to be called before any other thread is started.
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

/// Declares that from now on the command checks [`asked`] and ends by itself.
pub fn hear() {
    // Where it has heard already, it may have been asked already.
    let _ = STATE.compare_exchange(UNHEARD, HEARD, Ordering::Relaxed, Ordering::Relaxed);
}

/// Whether a signal has asked the program to end since [`hear`].
pub fn asked() -> bool {
    STATE.load(Ordering::Relaxed) == ASKED
}
