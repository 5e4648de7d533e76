//! The devices over real sockets and lines: emulated ones feel the forces of a known spring.

mod emulated_haply;
#[cfg(unix)]
mod emulated_lucid;
mod haply;
mod level;
#[cfg(unix)]
mod lucid;
mod record;
mod spring;
