//! The object in the scene: read, made ready, changed, kept, written.

pub mod element_nodes;
pub mod field_writing;
pub mod file_writing;
pub mod loading;
pub mod mesh_file;
pub mod object_file;
pub mod object_place;
pub mod object_work;
pub mod region_choice;
pub mod saving;
pub mod scene;
pub mod scene_objects;
pub mod series;
pub mod shape_history;
pub mod table_layout;
