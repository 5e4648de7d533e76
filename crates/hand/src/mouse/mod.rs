//! The mouse hand: moved, turned and closed by mouse and keyboard, sent as device bytes.

mod glide;
mod grip;
mod hand;
mod input;
mod speed;

pub use grip::CLOSING_MAX;
pub use hand::MouseHand;
pub use input::{Digits, MouseInput};
pub use speed::{SPEED_MAX_M_S, TURN_MAX_RAD_S};
