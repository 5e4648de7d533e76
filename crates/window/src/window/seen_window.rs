//! Whether the window is to be seen: one that is minimised is not drawn.
//!
//! The library of the window tells nobody. Under X11 the server is asked; elsewhere the window is
//! taken to be seen, and its system keeps pictures back that nobody sees.

use std::time::{Duration, Instant};

/// Looks whether the window is to be seen, now and then.
pub struct SeenWindow {
    looked: Option<Instant>,
    is_seen: bool,
    #[cfg(all(unix, not(target_os = "macos")))]
    server: Option<x11::Server>,
}

/// Time between two questions to the X server.
const LOOK_EVERY: Duration = Duration::from_millis(300);

impl SeenWindow {
    /// The window of this process that has a title.
    pub fn titled(title: &str) -> Self {
        // Nobody is asked about it elsewhere.
        #[cfg(not(all(unix, not(target_os = "macos"))))]
        let _ = title;
        Self {
            looked: None,
            is_seen: true,
            #[cfg(all(unix, not(target_os = "macos")))]
            server: x11::Server::connect(title),
        }
    }

    /// Whether the window is to be seen.
    pub fn is_seen(&mut self) -> bool {
        if self.looked.is_none_or(|then| then.elapsed() >= LOOK_EVERY) {
            self.looked = Some(Instant::now());
            #[cfg(all(unix, not(target_os = "macos")))]
            if let Some(server) = &mut self.server {
                self.is_seen = server.window_is_seen();
            }
        }
        self.is_seen
    }
}

#[cfg(all(unix, not(target_os = "macos")))]
mod x11 {
    //! A connection of its own to the X server.

    use std::ffi::{CStr, c_uchar};
    use std::mem::MaybeUninit;

    use x11_dl::xlib::{Display, IsViewable, Window, XWindowAttributes, Xlib};

    /// The connection, and the window once it was found.
    pub struct Server {
        xlib: Xlib,
        display: *mut Display,
        title: String,
        window: Option<Window>,
    }

    /// Windows that are looked at for the one with the title; a window manager puts it into frames.
    const WINDOWS_MAX: usize = 2000;

    impl Server {
        /// `None` where there is no X server, or the window is Wayland's.
        pub fn connect(title: &str) -> Option<Self> {
            let named = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
            if !named("DISPLAY") || named("WAYLAND_DISPLAY") {
                return None;
            }
            let xlib = Xlib::open().ok()?;
            // SAFETY: a null name stands for the display that DISPLAY names.
            let display = unsafe { (xlib.XOpenDisplay)(std::ptr::null()) };
            let server = Self { xlib, display, title: title.to_owned(), window: None };
            (!display.is_null()).then_some(server)
        }

        /// Whether the window is mapped; one that is not found is taken to be seen.
        pub fn window_is_seen(&mut self) -> bool {
            if self.window.is_none() {
                self.window = self.find();
            }
            let Some(window) = self.window else { return true };
            let mut attributes = MaybeUninit::<XWindowAttributes>::zeroed();
            // SAFETY: the display is open as long as this lives, the window as long as the process,
            // and the structure is plain numbers, all of which zero is a value of.
            unsafe {
                let told =
                    (self.xlib.XGetWindowAttributes)(self.display, window, attributes.as_mut_ptr());
                told == 0 || attributes.assume_init().map_state == IsViewable
            }
        }

        /// The window of this process with the title.
        fn find(&self) -> Option<Window> {
            // SAFETY: the display is open.
            let mut open = vec![unsafe { (self.xlib.XDefaultRootWindow)(self.display) }];
            let mut looked_at = 0;
            while let Some(window) = open.pop() {
                if self.title_of(window).as_deref() == Some(&self.title) && self.is_ours(window) {
                    return Some(window);
                }
                looked_at += 1;
                if looked_at > WINDOWS_MAX {
                    return None;
                }
                open.extend(self.children_of(window));
            }
            None
        }

        fn children_of(&self, window: Window) -> Vec<Window> {
            let (mut root, mut parent, mut count) = (0, 0, 0);
            let mut children = std::ptr::null_mut();
            // SAFETY: all places are ours; what the server allots is copied and freed.
            unsafe {
                let told = (self.xlib.XQueryTree)(
                    self.display,
                    window,
                    &mut root,
                    &mut parent,
                    &mut children,
                    &mut count,
                );
                if told == 0 || children.is_null() {
                    return Vec::new();
                }
                let all = std::slice::from_raw_parts(children, count as usize).to_vec();
                (self.xlib.XFree)(children.cast());
                all
            }
        }

        fn title_of(&self, window: Window) -> Option<String> {
            let mut name = std::ptr::null_mut();
            // SAFETY: the name ends with a zero, is copied and freed.
            unsafe {
                let told = (self.xlib.XFetchName)(self.display, window, &mut name);
                if told == 0 || name.is_null() {
                    return None;
                }
                let title = CStr::from_ptr(name).to_string_lossy().into_owned();
                (self.xlib.XFree)(name.cast());
                Some(title)
            }
        }

        /// Whether the window says that it is of this process.
        fn is_ours(&self, window: Window) -> bool {
            let (mut kind, mut format, mut count, mut left) = (0, 0, 0, 0);
            let mut value: *mut c_uchar = std::ptr::null_mut();
            // SAFETY: all places are ours; a property of format 32 is an array of C longs, of which
            // one was asked for, and it is freed.
            unsafe {
                let name = c"_NET_WM_PID".as_ptr();
                let atom = (self.xlib.XInternAtom)(self.display, name, 1);
                let told = (self.xlib.XGetWindowProperty)(
                    self.display,
                    window,
                    atom,
                    0,
                    1,
                    0,
                    0,
                    &mut kind,
                    &mut format,
                    &mut count,
                    &mut left,
                    &mut value,
                );
                if told != 0 || value.is_null() {
                    return false;
                }
                let is_ours = format == 32
                    && count == 1
                    && *value.cast::<std::ffi::c_ulong>()
                        == std::ffi::c_ulong::from(std::process::id());
                (self.xlib.XFree)(value.cast());
                is_ours
            }
        }
    }
}
