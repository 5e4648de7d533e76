//! What is seen of a run, and what a person asks of it.
//!
//! [`view`] is plain data: a copy of one tick, colours, camera, the skins of object and hand, and the
//! wishes of the person. It knows no graphics card and is there without the feature `window`. `window`
//! draws it with kiss3d and egui, on a screen or into pictures. How a run is played is the business of
//! its owner: the window takes views of ticks from an outlet and sends wishes into a channel.
//!
//! ```
//! use nalgebra::{Point2, Point3};
//! use softgrasp_window::view::camera::ViewCamera;
//!
//! let mut camera = ViewCamera::default();
//! camera.frame(Point3::new(0.0, 0.1, 0.0), 0.05);
//! // The middle of the picture looks at the middle of what is framed.
//! let (eye, direction) = camera.ray(&Point2::origin());
//! let across = (Point3::new(0.0, 0.1, 0.0) - eye).cross(&direction);
//! assert!(across.norm() < 1e-9);
//! ```

pub mod view;
#[cfg(feature = "window")]
pub mod window;
