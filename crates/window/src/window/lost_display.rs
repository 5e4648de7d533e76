//! What is done when the window ends although nobody closed it: the X server goes away, or drawing
//! fails.
//!
//! Xlib, which the window stands on, calls a handler when the server goes and ends the process when
//! it returns. So the handler never returns: what is left to do is done beside it, and ends the
//! process.

use std::sync::Mutex;

/// Why the window has ended although nobody closed it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// The display is lost.
    DisplayLost,
    /// The window could not be drawn any more although its display is there; why, in a sentence.
    Failed(String),
}

/// Work that is left when the window has ended; it does not return.
pub type Rest = Box<dyn FnOnce(End) + Send>;

/// Work that is left when the window has ended without being closed.
static REST: Mutex<Option<Rest>> = Mutex::new(None);

/// Sets the work that is left when the window ends without being closed; it ends the process.
pub fn set_rest(rest: Rest) {
    *lock() = Some(rest);
}

/// Clears that work: nothing is left to do.
pub fn clear_rest() {
    *lock() = None;
}

fn lock() -> std::sync::MutexGuard<'static, Option<Rest>> {
    REST.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Whether a display answers. Where there is no Xlib to ask, one is taken to be there.
#[cfg(all(unix, not(target_os = "macos")))]
pub fn is_there() -> bool {
    if std::env::var_os("DISPLAY").is_none_or(|name| name.is_empty()) {
        return true;
    }
    let Ok(xlib) = x11_dl::xlib::Xlib::open() else { return true };
    // SAFETY: a null name stands for the display that DISPLAY names; what is opened is closed at
    // once, on the same thread, and nothing else holds it.
    unsafe {
        let display = (xlib.XOpenDisplay)(std::ptr::null());
        !display.is_null() && (xlib.XCloseDisplay)(display) == 0
    }
}

/// Always `true`: other systems have no Xlib.
#[cfg(not(all(unix, not(target_os = "macos"))))]
pub fn is_there() -> bool {
    true
}

/// Asks Xlib to call [`REST`] when the display is lost. Does nothing where there is no Xlib.
#[cfg(all(unix, not(target_os = "macos")))]
pub fn hear() {
    let Ok(xlib) = x11_dl::xlib::Xlib::open() else { return };
    // SAFETY: the function stores a pointer to a function of the signature it asks for, which
    // lives as long as the process, and so does the library, which is never unloaded; Xlib allows the call at any time, before others too.
    unsafe { (xlib.XSetIOErrorHandler)(Some(display_is_lost)) };
}

/// Does nothing: other systems have no Xlib.
#[cfg(not(all(unix, not(target_os = "macos"))))]
pub fn hear() {}

/// Called by Xlib on the thread that uses the display; nothing may unwind through its frames.
#[cfg(all(unix, not(target_os = "macos")))]
extern "C" fn display_is_lost(_display: *mut x11_dl::xlib::Display) -> std::ffi::c_int {
    do_rest("the display was lost", End::DisplayLost)
}

/// Does what is left to do where the window cannot be drawn any more, for this reason; the process
/// ends with it.
pub fn go_on_without(why: &str) -> ! {
    let end = if is_there() { End::Failed(why.to_owned()) } else { End::DisplayLost };
    do_rest(why, end)
}

/// What is left is done on another thread, which ends the process: on this one the libraries of the
/// window would tidy up then, and fail at it as drawing did.
fn do_rest(why: &str, end: End) -> ! {
    let rest = lock().take();
    let why = why.to_owned();
    let work = move || {
        let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| match rest {
            Some(rest) => {
                eprintln!("glove-client: {why}; the run goes on without it");
                rest(end);
            }
            None => eprintln!("glove-client: {why}"),
        }));
        std::process::exit(if done.is_ok() { 1 } else { 101 })
    };
    if std::thread::Builder::new().name("without window".to_owned()).spawn(work).is_err() {
        std::process::abort();
    }
    loop {
        std::thread::park();
    }
}
