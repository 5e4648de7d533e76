//! The window and the pictures: everything that draws (feature `window`).

mod animation;
mod app;
mod changes;
mod director;
mod drawing_pace;
mod drawn_hand;
mod drawn_marks;
mod drawn_mesh;
mod drawn_object;
mod drawn_spheres;
mod environment;
mod finger_keys;
mod graphics;
mod grips;
mod input;
mod lost_display;
mod panels;
#[cfg(test)]
mod panels_tests;
mod picture;
mod plain_material;
#[cfg(test)]
mod read_words_tests;
mod recorder;
mod running;
mod scene;
mod scene_input;
mod seen_window;
mod shown_view;
mod stage;
mod start;
mod story;
mod ui;
mod units;
mod window_run;

pub use animation::{Animation, png};
pub use app::App;
pub use changes::SQUEEZE_TIMES;
pub use graphics::{Graphics, NoGraphics};
pub use image::RgbImage;
pub use lost_display::End;
pub use picture::Pictures;
pub use running::{About, Ticks, WhenLost};
pub use start::Opening;
pub use start::{Start, Started};
