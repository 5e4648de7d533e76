//! Objects that are compared: built-in ones, and mesh files of other authors.

use std::path::{Path, PathBuf};

use clap::Parser;
use glove_client::commands::mesh::MeshCommand;
use glove_client::object::mesh_file::read_mesh_file;
use softgrasp_core::mesh::{BuiltIn, TetMesh};
use softgrasp_tests::shared::shared;

/// Mesh, and the file that it was read from.
pub struct Object {
    pub name: String,
    pub file: PathBuf,
    pub mesh: TetMesh,
}

#[derive(Parser)]
struct MeshArguments {
    #[command(flatten)]
    mesh: MeshCommand,
}

/// Whether the full form is asked for.
pub fn is_full() -> bool {
    std::env::var("SOFTGRASP_REFEREE").is_ok_and(|form| form == "full")
}

impl Object {
    fn read(name: &str, file: PathBuf) -> Self {
        let mesh = read_mesh_file(&file).unwrap().mesh;
        Self { name: name.to_owned(), file, mesh }
    }
}

/// Built-in objects, each written by `glove-client mesh` and read again.
pub fn built_in(folder: &Path, nodes: usize) -> Vec<Object> {
    let nodes = nodes.to_string();
    let make = |shape: BuiltIn| {
        let file = folder.join(format!("{shape}.msh"));
        let arguments = ["mesh", shape.name(), "--nodes", &nodes, "--out", file.to_str().unwrap()];
        MeshArguments::parse_from(arguments).mesh.run().unwrap();
        Object::read(shape.name(), file)
    };
    BuiltIn::ALL.into_iter().map(make).collect()
}

/// Files of `shared/meshes`, in the order of their names; in the short form those of few nodes. `None`,
/// with a line that the test is skipped, if there is no such folder.
pub fn files() -> Option<Vec<Object>> {
    let entries = std::fs::read_dir(shared("meshes")?).unwrap().map(|entry| entry.unwrap().path());
    // An .ele file is read with its .node file.
    let is_mesh = |path: &PathBuf| {
        !["md", "ele"].contains(&path.extension().and_then(|e| e.to_str()).unwrap_or("md"))
    };
    let mut paths: Vec<PathBuf> = entries.filter(is_mesh).collect();
    paths.sort();
    let read = |path: PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        Object::read(&name, path)
    };
    let objects = paths.into_iter().map(read);
    Some(objects.filter(|o| is_full() || o.mesh.node_count() <= SHORT_NODES_MAX).collect())
}

/// Largest number of nodes of a file in the short form, which must leave time for other tests.
const SHORT_NODES_MAX: usize = 360;
