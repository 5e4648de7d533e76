//! Client of Softgrasp: grasp loop, link to the server, commands.
//!
//! The way of one tick, [`run::grasp_loop`]: device bytes (`softgrasp_hand`) → hand pose → contacts
//! and grasp (`softgrasp_grasp`) → request ([`ask::link`]) → answer → deformed object
//! (`softgrasp_grasp::object`). What can take longer than a tick is done beside it
//! ([`object::object_work`]). The folders follow the data: [`object`] is what is grasped, [`ask`] what
//! the server is asked, [`run`] the ticks, [`inspect`] what a mesh file holds, [`commands`] what a
//! person types.
//!
//! ```
//! use glove_client::object::scene::{SceneFile, load_object};
//!
//! let scene = SceneFile::of_text("object = \"cube\"\nnodes = 64")?;
//! let choice = scene.object().unwrap_or("strawberry").parse()?;
//! let object = load_object(&choice, scene.nodes.unwrap_or(1000), scene.object_size_m)?;
//! assert_eq!(object.mesh.node_count(), 64);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod ask;
pub mod commands;
pub mod inspect;
pub mod object;
pub mod pace;
pub mod press;
pub mod run;
