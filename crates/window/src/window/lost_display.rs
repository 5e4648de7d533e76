//! What is done when the X server goes away while a window is open.
//!
//! Xlib, which the window stands on, calls a handler then and ends the process when it returns. So
//! the handler never returns: what is left to do is done beside it, and ends the process.

use std::sync::Mutex;

/// What is left to do; it does not return.
pub type Rest = Box<dyn FnOnce() + Send>;

/// What is left to do when the display is lost now.
static REST: Mutex<Option<Rest>> = Mutex::new(None);

/// From now on this is done when the display is lost; it ends the process.
pub fn set_rest(rest: Rest) {
    *lock() = Some(rest);
}

/// Nothing is left to do any more.
pub fn clear_rest() {
    *lock() = None;
}

fn lock() -> std::sync::MutexGuard<'static, Option<Rest>> {
    REST.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Asks Xlib to call [`REST`] when the display is lost. Does nothing where there is no Xlib.
#[cfg(all(unix, not(target_os = "macos")))]
pub fn hear() {
    let Ok(xlib) = x11_dl::xlib::Xlib::open() else { return };
    // SAFETY: the function stores a pointer to a function of the signature it asks for, which
    // lives as long as the process, and so does the library, which is never unloaded; Xlib allows the call at any time, before others too.
    unsafe { (xlib.XSetIOErrorHandler)(Some(display_is_lost)) };
}

/// Other systems have no Xlib.
#[cfg(not(all(unix, not(target_os = "macos"))))]
pub fn hear() {}

/// Called by Xlib on the thread that uses the display; nothing may unwind through its frames.
///
/// What is left is done on another thread, which ends the process: on this one the libraries of the
/// window would tidy up then, and fail at it without a display.
#[cfg(all(unix, not(target_os = "macos")))]
extern "C" fn display_is_lost(_display: *mut x11_dl::xlib::Display) -> std::ffi::c_int {
    let rest = lock().take();
    let work = move || {
        let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| match rest {
            Some(rest) => {
                eprintln!("glove-client: the display was lost; the run goes on without it");
                rest();
            }
            None => eprintln!("glove-client: the display was lost"),
        }));
        std::process::exit(if done.is_ok() { 1 } else { 101 })
    };
    if std::thread::Builder::new().name("without display".to_owned()).spawn(work).is_err() {
        std::process::abort();
    }
    loop {
        std::thread::park();
    }
}
