//! Says in the log where the things are that can be clicked, for those who drive the window by a
//! program.

use std::collections::BTreeMap;

use egui::{Context, Id, Response};

/// Where each thing was last, in pixels of the window, and in which picture.
#[derive(Clone, Default)]
struct Places(BTreeMap<String, ([i32; 4], u64)>);

/// Writes into the log where a thing is, when it has moved or was not there in the picture before:
/// `RUST_LOG=softgrasp_window::places=debug`.
pub fn tell(context: &Context, name: &str, response: &Response) {
    // Tests have no subscriber, and ask `of`.
    if !cfg!(test) && !tracing::enabled!(target: "softgrasp_window::places", tracing::Level::DEBUG)
    {
        return;
    }
    let pixels = context.pixels_per_point();
    let r = response.rect;
    let place = [r.center().x, r.center().y, r.width(), r.height()].map(|v| (v * pixels) as i32);
    let picture = context.cumulative_pass_nr();
    let is_news = context.data_mut(|data| {
        let places = data.get_temp_mut_or_default::<Places>(Id::new("places"));
        let before = places.0.insert(name.to_owned(), (place, picture));
        before.is_none_or(|(then, seen)| then != place || seen + 1 < picture)
    });
    if is_news {
        let [x, y, width, height] = place;
        tracing::debug!(target: "softgrasp_window::places", name, x, y, width, height);
    }
}

/// Place of a thing in the last picture that had it: its centre, width and height, pixels.
#[cfg(test)]
pub fn of(context: &Context, name: &str) -> Option<[i32; 4]> {
    context.data(|data| data.get_temp::<Places>(Id::new("places"))?.0.get(name).map(|at| at.0))
}
