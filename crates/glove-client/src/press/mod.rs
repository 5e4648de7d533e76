//! Rigid bodies that press on a soft object: the file that describes them, the course, the report.

pub mod bodies_file;
pub mod course;
pub mod report;
pub mod way;
pub mod world_fields;
