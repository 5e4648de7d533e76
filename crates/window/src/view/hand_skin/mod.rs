//! The skin of the hand: one smooth surface over the segments of the kinematic model.
//!
//! Built once per hand size: bodies (`loft`, `round_cone`) → one signed distance
//! (`hand_body`) → triangles (`surface_net`, `fairing`) → weights (`bone_weights`) and colours
//! (`complexion`). Posed in every picture (`skin`, `rigid_motion`).

mod bind_pose;
mod bone_weights;
mod complexion;
mod fairing;
mod grid;
mod hand_body;
mod loft;
mod palm_body;
mod rigid_motion;
mod round_cone;
mod skin;
mod surface_net;
#[cfg(test)]
mod tests;

pub use bone_weights::BONE_COUNT;
pub use skin::HandSkin;
