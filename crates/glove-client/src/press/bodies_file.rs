//! Reads the rigid bodies of a press from a TOML file: names, shapes, sizes, friction, poses.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::Vector3;
use serde::Deserialize;
use softgrasp_core::mesh::Surface;
use softgrasp_core::rigid_body::{RigidMesh, RigidMeshError, RigidShape, ShapeError};
use softgrasp_protocol::BodyShape;

use super::way::{Way, WayError};
use crate::object::mesh_file::{MeshFileReadError, read_mesh_file};
use crate::object::object_file::{holds_surface, read_surface_file};

/// Rigid body of the file.
#[derive(Clone, Debug)]
pub struct PressBody {
    /// Name of the body in the report.
    pub name: String,
    /// Shape of the body.
    pub shape: RigidShape,
    /// Shape of the body on the wire.
    pub on_the_wire: BodyShape,
    /// Coefficient of friction of this body; `None` takes the common one.
    pub friction: Option<f64>,
    /// Displacement of the body for each unit of force on it, m/N.
    pub compliance: f64,
    /// Motion of the body: its poses by time.
    pub way: Way,
}

/// All bodies, and the time until which they are followed.
#[derive(Clone, Debug)]
pub struct PressBodies {
    /// The bodies, in the order of the file.
    pub bodies: Vec<PressBody>,
    /// Time at which the press ends, s.
    pub end: f64,
}

/// Why a file of bodies cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BodiesError {
    /// The file cannot be read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is no valid description of bodies.
    #[error("{path}: {source}")]
    Parse {
        /// Path of the file.
        path: PathBuf,
        /// Error of the TOML reader, with line and column.
        source: Box<toml::de::Error>,
    },
    /// The file contains no body.
    #[error("{path} has no [[body]]")]
    Empty {
        /// Path of the file.
        path: PathBuf,
    },
    /// The end of the press is no positive time.
    #[error("{path}: end is {end} s; it must be above 0")]
    End {
        /// Path of the file.
        path: PathBuf,
        /// End as it was given, s.
        end: f64,
    },
    /// A body of the file is invalid.
    #[error("{path}: body {name:?}: {reason}")]
    Body {
        /// Path of the file.
        path: PathBuf,
        /// Name of the body.
        name: String,
        /// Fault of the body.
        reason: Box<BodyError>,
    },
}

/// Fault of one body.
#[derive(Debug, thiserror::Error)]
pub enum BodyError {
    /// Another body has the same name.
    #[error("another body has the same name")]
    Name,
    /// A size that the shape needs is missing.
    #[error("{shape} needs {what}")]
    Missing {
        /// Name of the shape.
        shape: &'static str,
        /// Name of the missing field.
        what: &'static str,
    },
    /// There is no shape of this name.
    #[error("no shape is called {0:?}; there are sphere, capsule, plane, box and mesh")]
    Shape(String),
    /// A number has an impossible value.
    #[error("{what} is {value}; it must be a number, at least 0")]
    Number {
        /// Name of the field.
        what: &'static str,
        /// Value as it was given.
        value: f64,
    },
    /// The sizes make no shape.
    #[error(transparent)]
    Size(#[from] ShapeError),
    /// The poses make no motion.
    #[error(transparent)]
    Way(#[from] WayError),
    /// The file of a mesh cannot be read.
    #[error(transparent)]
    File(#[from] MeshFileReadError),
    /// The surface of a mesh makes no rigid body.
    #[error(transparent)]
    Mesh(#[from] RigidMeshError),
}

impl PressBodies {
    /// Names of boxes and meshes whose edges are sharp: contact there often does not converge.
    pub fn sharp(&self) -> impl Iterator<Item = &str> {
        let is_sharp = |body: &&PressBody| {
            matches!(body.on_the_wire, BodyShape::Box { .. } | BodyShape::Mesh { .. })
        };
        self.bodies.iter().filter(is_sharp).map(|body| body.name.as_str())
    }

    /// Name of a body with rounded edges, which a server without the capability `rounded-bodies` does not
    /// know.
    pub fn rounded(&self) -> Option<&str> {
        let is_rounded = |body: &&PressBody| {
            matches!(body.on_the_wire, BodyShape::RoundedBox { .. } | BodyShape::RoundedMesh { .. })
        };
        self.bodies.iter().find(is_rounded).map(|body| body.name.as_str())
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    end: Option<f64>,
    #[serde(default)]
    body: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    name: Option<String>,
    shape: String,
    radius: Option<f64>,
    length: Option<f64>,
    half: Option<[f64; 3]>,
    normal: Option<[f64; 3]>,
    file: Option<PathBuf>,
    friction: Option<f64>,
    compliance: Option<f64>,
    poses: Vec<[f64; 8]>,
}

/// Reads a file of bodies; paths in it count from its folder.
///
/// # Errors
/// [`BodiesError`] in one line, with file and body.
pub fn read_bodies(path: &Path) -> Result<PressBodies, BodiesError> {
    let read = |source| BodiesError::Read { path: path.to_owned(), source };
    let text = std::fs::read_to_string(path).map_err(read)?;
    let parse = |source| BodiesError::Parse { path: path.to_owned(), source: Box::new(source) };
    let file: File = toml::from_str(&text).map_err(parse)?;
    if file.body.is_empty() {
        return Err(BodiesError::Empty { path: path.to_owned() });
    }
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut names = BTreeSet::new();
    let mut bodies = Vec::with_capacity(file.body.len());
    for (at, entry) in file.body.into_iter().enumerate() {
        let name = entry.name.clone().unwrap_or_else(|| format!("body{at}"));
        let refuse = |reason| {
            let (path, name) = (path.to_owned(), name.clone());
            BodiesError::Body { path, name, reason: Box::new(reason) }
        };

        if !names.insert(name.clone()) {
            return Err(refuse(BodyError::Name));
        }
        bodies.push(body(folder, name.clone(), entry).map_err(refuse)?);
    }
    let last = bodies.iter().map(|body| body.way.end()).fold(0.0, f64::max);
    let end = file.end.unwrap_or(last);
    match end > 0.0 && end.is_finite() {
        true => Ok(PressBodies { bodies, end }),
        false => Err(BodiesError::End { path: path.to_owned(), end }),
    }
}

fn body(folder: &Path, name: String, entry: Entry) -> Result<PressBody, BodyError> {
    let (shape, on_the_wire) = shape_of(folder, &entry)?;
    let number = |what, value: Option<f64>| match value {
        Some(value) if !(value >= 0.0 && value.is_finite()) => {
            Err(BodyError::Number { what, value })
        }
        value => Ok(value),
    };
    Ok(PressBody {
        name,
        shape,
        on_the_wire,
        friction: number("friction", entry.friction)?,
        compliance: number("compliance", entry.compliance)?.unwrap_or(0.0),
        way: Way::try_new(&entry.poses)?,
    })
}

fn shape_of(folder: &Path, entry: &Entry) -> Result<(RigidShape, BodyShape), BodyError> {
    fn need<T>(shape: &'static str, what: &'static str, field: Option<T>) -> Result<T, BodyError> {
        field.ok_or(BodyError::Missing { shape, what })
    }
    Ok(match entry.shape.as_str() {
        "sphere" => {
            let radius = need("a sphere", "radius", entry.radius)?;
            (RigidShape::sphere(radius)?, BodyShape::Sphere { radius })
        }
        "capsule" => {
            let radius = need("a capsule", "radius", entry.radius)?;
            let length = need("a capsule", "length", entry.length)?;
            (RigidShape::capsule(radius, length)?, BodyShape::Capsule { radius, length })
        }
        "plane" => {
            let normal = need("a plane", "normal", entry.normal)?;
            (RigidShape::plane(Vector3::from(normal))?, BodyShape::Plane { normal })
        }
        "box" => {
            let half = need("a box", "half", entry.half)?;
            let radius = entry.radius.unwrap_or(0.0);
            let shape = RigidShape::rounded_cuboid(Vector3::from(half), radius)?;
            // A sharp box is of the kind that every server knows.
            let is_rounded = radius > 0.0;
            let on_the_wire = match is_rounded {
                true => BodyShape::RoundedBox { half, radius },
                false => BodyShape::Box { half },
            };
            (shape, on_the_wire)
        }
        "mesh" => {
            let file = need("a mesh", "file", entry.file.as_ref())?;
            mesh_of(&folder.join(file), entry.radius.unwrap_or(0.0))?
        }
        other => return Err(BodyError::Shape(other.to_owned())),
    })
}

/// The boundary of a mesh file, or a closed surface file, with all points within a radius of it, as a rigid body.
fn mesh_of(path: &Path, radius: f64) -> Result<(RigidShape, BodyShape), BodyError> {
    let (vertices, triangles) = match holds_surface(path)? {
        true => {
            let surface = read_surface_file(path)?.surface;
            (surface.points().to_vec(), surface.triangles().to_vec())
        }
        false => {
            let mesh = read_mesh_file(path)?.mesh;
            (mesh.vertices().to_vec(), Surface::from_mesh(&mesh).triangles)
        }
    };
    let mesh = RigidMesh::try_new(&vertices, &triangles)?.with_radius(radius)?;
    let vertices = vertices.into_iter().map(Into::into).collect();
    let is_rounded = radius > 0.0;
    let on_the_wire = match is_rounded {
        true => BodyShape::RoundedMesh { vertices, triangles, radius },
        false => BodyShape::Mesh { vertices, triangles },
    };
    Ok((RigidShape::Mesh(Arc::new(mesh)), on_the_wire))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<PressBodies, BodiesError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bodies.toml");
        std::fs::write(&path, text).unwrap();
        read_bodies(&path)
    }

    #[test]
    fn bodies_of_every_simple_shape_are_read() {
        let pose = "poses = [[0, 0, 0, 0, 1, 0, 0, 0]]";
        let text = format!(
            "end = 2.0\n[[body]]\nname = \"table\"\nshape = \"plane\"\nnormal = [0, 0, 1]\n{pose}\n\
             [[body]]\nname = \"tip\"\nshape = \"sphere\"\nradius = 0.008\nfriction = 0.7\n\
             poses = [[0, 0, 0, 0.1, 1, 0, 0, 0], [1, 0, 0, 0.05, 1, 0, 0, 0]]\n\
             [[body]]\nshape = \"capsule\"\nradius = 0.01\nlength = 0.03\n{pose}\n\
             [[body]]\nshape = \"box\"\nhalf = [0.1, 0.1, 0.01]\n{pose}\n\
             [[body]]\nshape = \"box\"\nhalf = [0.1, 0.1, 0.01]\nradius = 0.001\n{pose}\n"
        );
        let read = read(&text).unwrap();
        let names: Vec<&str> = read.bodies.iter().map(|b| b.name.as_str()).collect();
        assert_eq!(names, ["table", "tip", "body2", "body3", "body4"]);
        assert_eq!(read.rounded(), Some("body4"));
        assert_eq!(read.sharp().collect::<Vec<_>>(), ["body3"]);
        let half = [0.1, 0.1, 0.01];
        assert_eq!(read.bodies[3].on_the_wire, BodyShape::Box { half });
        assert_eq!(read.bodies[4].on_the_wire, BodyShape::RoundedBox { half, radius: 0.001 });
        assert_eq!((read.end, read.bodies[1].friction), (2.0, Some(0.7)));
        assert!((read.bodies[1].way.at(0.5).translation.z - 0.075).abs() < 1e-15);
    }

    #[test]
    fn faults_are_told_with_the_name_of_the_body() {
        let told = |text: &str| read(text).unwrap_err().to_string();
        let pose = "poses = [[0, 0, 0, 0, 1, 0, 0, 0]]";
        assert!(told("end = 1.0").contains("no [[body]]"));
        let no_radius = format!("end = 1.0\n[[body]]\nname = \"tip\"\nshape = \"sphere\"\n{pose}");
        assert!(told(&no_radius).contains("\"tip\": a sphere needs radius"));
        let other = format!("end = 1.0\n[[body]]\nshape = \"cone\"\n{pose}");
        assert!(told(&other).contains("no shape is called \"cone\""));
        let round =
            format!("end = 1.0\n[[body]]\nshape = \"box\"\nhalf = [1, 2, 3]\nradius = 1.5\n{pose}");
        assert!(told(&round).contains("\"body0\": the radius of the edges of a box is 1.5"));
        let still = format!("[[body]]\nshape = \"sphere\"\nradius = 1\n{pose}");
        assert!(told(&still).contains("end is 0 s"));
        let unknown = format!("end = 1.0\n[[body]]\nshape = \"sphere\"\nradios = 1\n{pose}");
        assert!(told(&unknown).contains("radios"));
    }
}
