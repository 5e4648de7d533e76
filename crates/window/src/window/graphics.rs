//! Whether this machine can draw, and with which graphics.

use std::cell::Cell;
use std::sync::Once;

use kiss3d::prelude::Context;

use crate::view::display::Level;

/// The graphics card or program that draws.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Graphics {
    /// Name of the graphics card or of the program that stands in for it.
    pub name: String,
    /// Whether the processor draws, because there is no graphics card.
    pub is_software: bool,
}

/// Why nothing can be drawn.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoGraphics {
    /// There is no display.
    #[error("there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set)")]
    NoDisplay,
    /// No driver was found.
    #[error(
        "no graphics driver was found; on Debian, `apt install mesa-vulkan-drivers libvulkan1` \
         draws with the processor"
    )]
    NoDriver,
    /// The window could not be opened.
    #[error("the window cannot be shown: {reason}")]
    Window {
        /// Reason that the system gave.
        reason: String,
    },
}

impl Graphics {
    /// The graphics with which this machine would draw.
    ///
    /// # Errors
    /// [`NoGraphics::NoDriver`].
    pub fn find() -> Result<Self, NoGraphics> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::all(),
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let adapter = instance.request_adapter(&wgpu::RequestAdapterOptions::default());
        let adapter = pollster::block_on(adapter).map_err(|_| NoGraphics::NoDriver)?;
        Self::usable(&adapter.get_info())
    }

    /// Mesa's OpenGL on the processor takes every order and leaves the picture black: several samples a
    /// pixel are not what it can draw into. Its Vulkan can.
    fn usable(info: &wgpu::AdapterInfo) -> Result<Self, NoGraphics> {
        let found = Self::of(info);
        match info.backend == wgpu::Backend::Gl && found.is_software {
            true => Err(NoGraphics::NoDriver),
            false => Ok(found),
        }
    }

    /// The graphics of the window or picture that is open.
    pub fn in_use() -> Self {
        Self::of(&Context::get().adapter.get_info())
    }

    fn of(info: &wgpu::AdapterInfo) -> Self {
        let is_software = info.device_type == wgpu::DeviceType::Cpu;
        Self { name: format!("{} ({})", info.name, info.backend), is_software }
    }

    /// What a person who chooses this level of light should know of its cost here; `None` where it costs
    /// nothing.
    pub fn price_of(&self, light: Level) -> Option<&'static str> {
        (self.is_software && light != Level::Plain).then_some(
            "The processor draws here: this light is slow, and takes memory with every picture. \
             View, Plain light goes back.",
        )
    }
}

/// Whether a display is named; it may still not answer.
///
/// # Errors
/// [`NoGraphics::NoDisplay`].
pub fn check_display() -> Result<(), NoGraphics> {
    if !cfg!(all(unix, not(target_os = "macos"))) {
        return Ok(());
    }
    let names = ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"];
    let is_set = |name: &&str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    if names.iter().any(is_set) { Ok(()) } else { Err(NoGraphics::NoDisplay) }
}

/// Sets the panic hook once: panics that become a sentence are not printed besides.
static HOOK: Once = Once::new();

thread_local! {
    /// Whether this thread runs work of [`without_panic`].
    static CAUGHT_HERE: Cell<bool> = const { Cell::new(false) };
}

/// Does something that ends in a panic where the system's part of it fails, and says why in a
/// sentence: the libraries that open windows know no other way.
///
/// # Errors
/// [`NoGraphics::Window`].
pub fn without_panic<T>(work: impl FnOnce() -> T) -> Result<T, NoGraphics> {
    HOOK.call_once(|| {
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !CAUGHT_HERE.get() {
                hook(panic);
            }
        }));
    });
    CAUGHT_HERE.set(true);
    let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work));
    CAUGHT_HERE.set(false);
    done.map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
        NoGraphics::Window { reason: reason(text.unwrap_or("the system gave no reason")) }
    })
}

/// What a panic says, as far as a person can use it.
fn reason(panic: &str) -> String {
    let first = panic.lines().next().unwrap_or("");
    if first.contains("event loop") {
        return "the display does not answer; look at DISPLAY or WAYLAND_DISPLAY".to_owned();
    }
    if first.contains("adapter") || first.contains("device") {
        return NoGraphics::NoDriver.to_string();
    }
    // Behind a colon follow the names of types and source files.
    first.split(':').next().unwrap_or(first).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::action::Action;

    #[test]
    fn panic_of_a_library_becomes_a_sentence() {
        let failed = without_panic(|| panic!("Failed to create window: Os({})", 7)).unwrap_err();
        let NoGraphics::Window { reason } = &failed else { panic!("{failed}") };
        assert_eq!(reason, "Failed to create window");
        assert_eq!(without_panic(|| 3), Ok(3));
    }

    #[test]
    fn opengl_on_the_processor_is_no_driver_instead_of_a_black_picture() {
        use wgpu::{AdapterInfo, Backend, DeviceType};
        let usable = |kind, backend| Graphics::usable(&AdapterInfo::new(kind, backend));
        assert_eq!(usable(DeviceType::Cpu, Backend::Gl), Err(NoGraphics::NoDriver));
        assert!(usable(DeviceType::Cpu, Backend::Vulkan).is_ok_and(|found| found.is_software));
        assert!(usable(DeviceType::DiscreteGpu, Backend::Gl).is_ok());
    }

    #[test]
    fn light_that_takes_memory_where_the_processor_draws_is_not_chosen_without_a_word() {
        let graphics = |is_software| Graphics { name: "one that draws".to_owned(), is_software };
        for light in Level::ALL {
            let told = graphics(true).price_of(light);
            assert_eq!(told.is_some(), light != Level::Plain, "{light}: {told:?}");
            let way_back = Action::Light(Level::Plain).label();
            for words in ["The processor draws", "memory", way_back.as_str()] {
                assert!(told.is_none_or(|told| told.contains(words)), "{light}: '{words}'");
            }
            assert_eq!(graphics(false).price_of(light), None, "{light} on a graphics card");
        }
    }
}
