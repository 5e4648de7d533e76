//! Reads a scene (object, size, material, method) from a TOML file, and loads its object.

use std::path::{Path, PathBuf};

use nalgebra::Point3;
use serde::Deserialize;
use softgrasp_core::mesh::{Bodies, BuiltIn, GenerateError, MeshError, TetMesh, generate};
use softgrasp_core::mesh_io::MeshFile;
use softgrasp_grasp::object::ObjectChoice;

use crate::object::mesh_file::MeshFileReadError;
use crate::object::object_file::{ObjectFile, read_object_file};
use crate::object::region_choice::RegionChoice;
use crate::object::scene_objects::{SceneEntry, SceneObjects};

/// Content of a scene file; every field can also be set by a flag, which wins.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct SceneFile {
    /// cube, sphere, strawberry, toothpaste, or a file of a mesh or a surface (relative to the scene
    /// file); or a list of several objects.
    pub object: Option<SceneObjects>,
    /// Number of nodes of a built-in object, or of a surface that is filled.
    pub nodes: Option<usize>,
    /// Longest extent of the object, m; a mesh file is scaled to it.
    pub object_size_m: Option<f64>,
    /// Young's modulus, Pa.
    pub young_pa: Option<f64>,
    /// Poisson's ratio.
    pub poisson: Option<f64>,
    /// Name of the solution method, or `auto`.
    pub method: Option<String>,
    /// Name of the element: t4, t4-anp or auto.
    pub element: Option<String>,
    /// What a fingertip holds: vertex, patch or mask.
    pub contact: Option<String>,
    /// How the hand grasps: contact (with friction and weight) or thesis.
    pub grasp: Option<String>,
    /// Coefficient of friction of hand and table.
    pub friction: Option<f64>,
    /// Density, kg/m³.
    pub density_kg_m3: Option<f64>,
    /// Equations of the deformation: linear, large or auto.
    pub deformation: Option<String>,
    /// Law of large deformation: neo-hookean or neo-hookean-log.
    pub material: Option<String>,
    /// Yield stress, Pa.
    pub yield_pa: Option<f64>,
    /// Regions of a material of their own.
    pub region: Vec<RegionChoice>,
}

/// Why a scene or its object cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The scene file cannot be read.
    #[error("cannot read the scene {path}: {source}")]
    Read {
        /// Path of the scene file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The scene file is no valid scene.
    #[error("{path}: {source}")]
    Parse {
        /// Path of the scene file.
        path: PathBuf,
        /// Error of the TOML reader, with line and column.
        source: Box<toml::de::Error>,
    },
    /// The object's file cannot be used.
    #[error(transparent)]
    Mesh(#[from] MeshFileReadError),
    /// The object cannot be generated.
    #[error(transparent)]
    Generate(#[from] GenerateError),
    /// The object cannot be scaled.
    #[error("the object cannot be scaled to {size_m} m: {source}")]
    Scale {
        /// Size that was asked for, m.
        size_m: f64,
        /// Fault of the scaled mesh.
        source: MeshError,
    },
    /// The size is no length.
    #[error("--object-size is {size_m} m; it must be a finite number above 0")]
    Size {
        /// Size that was asked for, m.
        size_m: f64,
    },
}

/// Extent of an imported object that fits the hand, m.
pub const IMPORTED_SIZE_M: f64 = 0.08;
/// Number of nodes of a built-in object by default.
pub const NODES_DEFAULT: usize = 1000;

impl SceneFile {
    /// Reads the text of a scene; the path of a mesh file stays as it is written.
    ///
    /// # Errors
    /// Fault of the text, with line and column.
    pub fn of_text(text: &str) -> Result<Self, toml::de::Error> {
        toml::from_str(text)
    }

    /// Reads a scene file; the path of a mesh file counts from the scene's folder.
    ///
    /// # Errors
    /// [`SceneError`] with the path and, for a fault inside, line and column.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let read_error = |source| SceneError::Read { path: path.to_owned(), source };
        let text = std::fs::read_to_string(path).map_err(read_error)?;
        let mut scene = Self::of_text(&text)
            .map_err(|e| SceneError::Parse { path: path.to_owned(), source: Box::new(e) })?;
        let beside = |object: &mut String| {
            if let Ok(ObjectChoice::File(file)) = object.parse() {
                let beside = path.parent().unwrap_or(Path::new("")).join(file);
                *object = beside.to_string_lossy().into_owned();
            }
        };
        match &mut scene.object {
            Some(SceneObjects::One(object)) => beside(object),
            Some(SceneObjects::Several(entries)) => {
                entries.iter_mut().for_each(|entry| beside(&mut entry.shape));
            }
            None => {}
        }
        Ok(scene)
    }

    /// Name of the object, if the scene names one alone.
    pub fn object(&self) -> Option<&str> {
        match &self.object {
            Some(SceneObjects::One(name)) => Some(name),
            Some(SceneObjects::Several(_)) | None => None,
        }
    }

    /// The several objects of the scene; none where it has one or names none.
    pub fn entries(&self) -> &[SceneEntry] {
        match &self.object {
            Some(SceneObjects::Several(entries)) => entries,
            Some(SceneObjects::One(_)) | None => &[],
        }
    }

    /// Scene with one of several objects alone, which has from this one what it leaves out.
    #[must_use]
    pub fn of_entry(&self, entry: &SceneEntry) -> Self {
        let name = |own: &Option<String>, usual: &Option<String>| own.clone().or(usual.clone());
        Self {
            object: Some(SceneObjects::One(entry.shape.clone())),
            nodes: entry.nodes.or(self.nodes),
            object_size_m: entry.size_m.or(self.object_size_m),
            young_pa: entry.young_pa.or(self.young_pa),
            poisson: entry.poisson.or(self.poisson),
            element: name(&entry.element, &self.element),
            friction: entry.friction.or(self.friction),
            density_kg_m3: entry.density_kg_m3.or(self.density_kg_m3),
            deformation: name(&entry.deformation, &self.deformation),
            material: name(&entry.material, &self.material),
            yield_pa: entry.yield_pa.or(self.yield_pa),
            region: entry.region.clone(),
            method: self.method.clone(),
            contact: self.contact.clone(),
            grasp: self.grasp.clone(),
        }
    }
}

/// Longest extent of a built-in object that the hand grips best, m, if that is not its own: around a
/// small strawberry the thumb would close beside the fingers and not opposite to them.
pub fn size_to_hold(object: &ObjectChoice) -> Option<f64> {
    match object {
        ObjectChoice::BuiltIn(BuiltIn::Strawberry) => Some(0.08),
        ObjectChoice::BuiltIn(_) | ObjectChoice::File(_) => None,
    }
}

/// Object ready for the hand, and remarks on how it was made.
#[derive(Debug)]
pub struct SceneObject {
    /// Mesh of the object, m, centred at the origin.
    pub mesh: TetMesh,
    /// Names of its regions; none where no file names them.
    pub region_names: Vec<String>,
    /// Remarks for the user, in sentences.
    pub notes: Vec<String>,
}

/// Makes or reads the object and brings it to the hand's size.
///
/// # Errors
/// [`SceneError`] if the object cannot be made, read or scaled.
pub fn load_object(
    choice: &ObjectChoice,
    nodes: usize,
    size_m: Option<f64>,
) -> Result<SceneObject, SceneError> {
    if let Some(size_m) = size_m.filter(|s| !(s.is_finite() && *s > 0.0)) {
        return Err(SceneError::Size { size_m });
    }
    let (mut notes, mut region_names) = (Vec::new(), Vec::new());
    let mesh = match choice {
        ObjectChoice::BuiltIn(shape) => generate(*shape, nodes)?,
        ObjectChoice::File(path) => match read_object_file(path, nodes)? {
            ObjectFile::Mesh(file) => {
                region_names.clone_from(&file.findings.region_labels);
                read_mesh(path, &file, &mut notes)
            }
            ObjectFile::Surface(surface) => {
                notes.push(surface.told(path));
                notes.extend(surface.faults());
                surface.filled.mesh
            }
        },
    };
    let size_m = match choice {
        ObjectChoice::BuiltIn(_) => size_m,
        ObjectChoice::File(_) => Some(size_m.unwrap_or(IMPORTED_SIZE_M)),
    };
    let Some(size_m) = size_m else { return Ok(SceneObject { mesh, region_names, notes }) };
    let factor = size_m / mesh.size();
    notes.push(format!("scaled by {factor:.3} to {size_m} m and centred (--object-size)"));
    let mesh =
        scaled_and_centred(&mesh, factor).map_err(|source| SceneError::Scale { size_m, source })?;
    Ok(SceneObject { mesh, region_names, notes })
}

/// Largest piece of a mesh file; adds the remarks on the file to `notes`.
fn read_mesh(path: &Path, file: &MeshFile, notes: &mut Vec<String>) -> TetMesh {
    let findings = &file.findings;
    notes.push(format!(
        "{}: {}, {} nodes, {} tetrahedra",
        path.display(),
        file.format,
        file.mesh.node_count(),
        file.mesh.tets().len()
    ));
    if !findings.flipped.is_empty() {
        notes.push(format!("{} inverted tetrahedra were turned", findings.flipped.len()));
    }
    let dropped = findings.degenerate.len() + findings.repeated.len();
    if dropped > 0 {
        notes.push(format!(
            "{dropped} tetrahedra without volume, or repeated, were dropped; `glove-client inspect` \
             lists them"
        ));
    }
    if !file.mesh.mid_edge_nodes().is_empty() {
        notes.push(
            "mid-edge nodes of the file are left out: the edges are straight here".to_owned(),
        );
    }
    largest_piece(&file.mesh, notes)
}

fn scaled_and_centred(mesh: &TetMesh, factor: f64) -> Result<TetMesh, MeshError> {
    let (low, high) = mesh.bounds();
    let centre = nalgebra::center(&low, &high);
    let moved = |p: &Point3<f64>| Point3::from((p - centre) * factor);
    mesh.with_vertices(mesh.vertices().iter().map(moved).collect())
}

/// Largest piece of a mesh, because a hand holds one body. Bodies, and pieces joined by an edge or a node
/// only, are left out, and so are nodes without elements.
fn largest_piece(mesh: &TetMesh, notes: &mut Vec<String>) -> TetMesh {
    let bodies = Bodies::from_mesh(mesh);
    let largest = bodies
        .piece_tet_counts
        .iter()
        .enumerate()
        .max_by_key(|&(piece, count)| (count, std::cmp::Reverse(piece)))
        .map_or(0, |(piece, _)| piece as u32);
    let kept = |tet: &usize| bodies.piece_of_tet[*tet] == largest;
    let tets: Vec<usize> = (0..mesh.tets().len()).filter(kept).collect();
    let mut new_index = vec![None; mesh.node_count()];
    let mut vertices: Vec<Point3<f64>> = Vec::new();
    for &n in tets.iter().flat_map(|&t| &mesh.tets()[t]) {
        new_index[n as usize].get_or_insert_with(|| {
            vertices.push(mesh.vertices()[n as usize]);
            vertices.len() as u32 - 1
        });
    }
    let renumbered = |t: &usize| mesh.tets()[*t].map(|n| new_index[n as usize].unwrap_or(0));
    let regions = match mesh.regions() {
        [] => Vec::new(),
        regions => tets.iter().map(|&t| regions[t]).collect(),
    };
    match TetMesh::try_new(vertices, tets.iter().map(renumbered).collect(), regions) {
        Ok(piece) => {
            if bodies.piece_count() > 1 {
                notes.push(format!(
                    "the largest of {} pieces is grasped: {} of {} tetrahedra",
                    bodies.piece_count(),
                    piece.tets().len(),
                    mesh.tets().len()
                ));
            }
            piece
        }
        // The same elements were good before, so this is not reached; the whole mesh is as good.
        Err(_) => mesh.clone(),
    }
}
