//! Objects that are compared: built-in ones, and mesh files of other authors.

use std::path::{Path, PathBuf};

use clap::Parser;
use glove_client::commands::mesh::MeshCommand;
use glove_client::object::mesh_file::{encode_mesh, read_mesh_file};
use glove_client::object::region_choice::{Ellipsoid, MeshOfRegions, RegionChoice};
use softgrasp_core::fem::Element;
use softgrasp_core::mesh::{BuiltIn, Surface, TetMesh, generate};
use softgrasp_protocol::Material;
use softgrasp_tests::curved::round_sphere;
use softgrasp_tests::shared::shared;

/// Mesh, and the file that it was read from.
pub struct Object {
    pub name: String,
    pub file: PathBuf,
    pub mesh: TetMesh,
    /// Whether the region `stone` of the file is of a material of its own.
    pub has_stone: bool,
}

/// Young's modulus of the stone over that of the body, and Poisson's ratio of the stone.
const STONE: (f64, f64) = (50.0, 0.2);

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
        Self { name: name.to_owned(), file, mesh, has_stone: false }
    }

    /// Elements that it is compared with, which CalculiX has too (C3D4 and C3D10); one with mid-edge nodes
    /// of its own with ten-node ones alone.
    pub fn elements(&self) -> &'static [Element] {
        match self.mesh.mid_edge_nodes().is_empty() {
            true => &[Element::Tet4, Element::Tet10],
            false => &[Element::Tet10],
        }
    }

    /// Materials of a question in which the body is of Young's modulus `young` and Poisson's ratio `poisson`:
    /// that of the body, and that of the stone if there is one.
    pub fn materials(&self, young: f64, poisson: f64) -> Vec<Material> {
        let stone = Material { young: STONE.0 * young, poisson: STONE.1 };
        let body = Material { young, poisson };
        [body].into_iter().chain(self.has_stone.then_some(stone)).collect()
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

/// A sphere with a stone in it, off its middle, written with its regions and read again.
pub fn sphere_with_stone(folder: &Path, nodes: usize) -> Object {
    let file = folder.join("sphere-with-stone.msh");
    let mesh = generate(BuiltIn::Sphere, nodes).unwrap();
    let size = mesh.size();
    let of = Ellipsoid { centre_m: [0.1 * size, 0.0, 0.0], radii_m: [0.2 * size; 3] };
    let (young_pa, poisson) = (1.0, 0.0);
    let stone = RegionChoice { name: "stone".to_owned(), young_pa, poisson, ellipsoid: Some(of) };
    let made = MeshOfRegions::try_new(mesh, &["flesh".to_owned()], &[stone]).unwrap();
    let surface = Surface::from_mesh(&made.mesh);
    let bytes = encode_mesh(&file, &made.mesh, made.regions.names(), &surface, &[]).unwrap();
    std::fs::write(&file, bytes).unwrap();
    Object { has_stone: true, ..Object::read("sphere with a stone", file) }
}

/// A sphere whose boundary edges are arcs, written with its mid-edge nodes and read again.
pub fn round(folder: &Path, corners: usize) -> Object {
    let file = folder.join("round-sphere.msh");
    let mesh = round_sphere(corners);
    let surface = Surface::from_mesh(&mesh);
    std::fs::write(&file, encode_mesh(&file, &mesh, &[], &surface, &[]).unwrap()).unwrap();
    let object = Object::read("round sphere", file);
    assert_eq!(object.mesh, mesh);
    object
}

/// Files of `shared/meshes`, in the order of their names; in the short form those of few nodes.
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
