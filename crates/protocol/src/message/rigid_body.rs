//! Rigid bodies on the wire: shapes, sizes, friction, and where they are at two moments.

use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::{DecodeError, EncodeError, Limits};

/// Pose of a body in the world: position x, y, z in m, then the unit quaternion w, x, y, z of its
/// rotation.
pub type Pose = [f64; 7];

/// Shape of a rigid body in the body's own frame, m.
#[derive(Clone, Debug, PartialEq)]
pub enum BodyShape {
    /// Ball around the origin.
    Sphere {
        /// Radius of the ball, m.
        radius: f64,
    },
    /// All points within a radius of a segment along z that is centred at the origin.
    Capsule {
        /// Radius around the segment, m.
        radius: f64,
        /// Length of the segment, m.
        length: f64,
    },
    /// Half space below a plane through the origin.
    Plane {
        /// Normal of the plane, out of the half space.
        normal: [f64; 3],
    },
    /// Box around the origin with edges along the axes.
    Box {
        /// Half the length of the edge along each axis, m.
        half: [f64; 3],
    },
    /// Box around the origin with edges along the axes, rounded within its sizes. A server without the
    /// capability `rounded-bodies` refuses it as `BadRequest`.
    RoundedBox {
        /// Half the length of the edge along each axis, m.
        half: [f64; 3],
        /// Radius of the edges and corners, m.
        radius: f64,
    },
    /// Inside of a closed surface of triangles.
    Mesh {
        /// Coordinates of the corners, m.
        vertices: Vec<[f64; 3]>,
        /// Corners of each triangle, counter-clockwise seen from outside.
        triangles: Vec<[u32; 3]>,
    },
    /// All points within a radius of the inside of a closed surface of triangles. A server without the
    /// capability `rounded-bodies` refuses it as `BadRequest`.
    RoundedMesh {
        /// Coordinates of the corners, m.
        vertices: Vec<[f64; 3]>,
        /// Corners of each triangle, counter-clockwise seen from outside.
        triangles: Vec<[u32; 3]>,
        /// Radius by which the body goes beyond its triangles, m.
        radius: f64,
    },
}

/// Rigid body that moves on a given way during one step.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyMotion {
    /// Shape of the body.
    pub shape: BodyShape,
    /// Pose in the world frame at the beginning of the step.
    pub start: Pose,
    /// Pose in the world frame at the end of the step.
    pub end: Pose,
    /// Coefficient of Coulomb friction between body and object.
    pub friction: f64,
    /// Displacement of the body for each unit of force on it, m/N; 0 for one that keeps to its poses.
    pub compliance: f64,
}

/// Numbers of a body besides its mesh: three sizes, two poses of seven, friction, compliance.
const NUMBERS: usize = 19;
/// Kinds of bodies that have more than the numbers.
const MESH: u32 = 4;
const ROUNDED_BOX: u32 = 5;
const ROUNDED_MESH: u32 = 6;
const BODIES: &str = "rigid bodies";
const SIZES: &str = "sizes of meshes of bodies";
const VERTICES: &str = "vertices of bodies";
const TRIANGLES: &str = "triangles of bodies";

impl BodyShape {
    fn kind(&self) -> u32 {
        match self {
            Self::Sphere { .. } => 0,
            Self::Capsule { .. } => 1,
            Self::Plane { .. } => 2,
            Self::Box { .. } => 3,
            Self::Mesh { .. } => MESH,
            Self::RoundedBox { .. } => ROUNDED_BOX,
            Self::RoundedMesh { .. } => ROUNDED_MESH,
        }
    }

    fn sizes(&self) -> [f64; 3] {
        match self {
            Self::Sphere { radius } => [*radius, 0.0, 0.0],
            Self::Capsule { radius, length } => [*radius, *length, 0.0],
            Self::Plane { normal: sizes }
            | Self::Box { half: sizes }
            | Self::RoundedBox { half: sizes, .. } => *sizes,
            Self::Mesh { .. } | Self::RoundedMesh { .. } => [0.0; 3],
        }
    }

    /// Radius of a rounded shape.
    fn radius(&self) -> Option<f64> {
        match self {
            Self::RoundedBox { radius, .. } | Self::RoundedMesh { radius, .. } => Some(*radius),
            _ => None,
        }
    }
}

/// Number of bodies, as the part announces it.
pub(super) fn count_of_bodies(bodies: &[BodyMotion]) -> Result<u32, EncodeError> {
    count_of(BODIES, bodies.len())
}

/// Compares the announced number of bodies with the limits.
pub(super) fn check_bodies(count: u32, limits: &Limits) -> Result<(), DecodeError> {
    check_count(BODIES, count, limits.node_count_max.min(u32::from(u16::MAX)))?;
    Ok(())
}

/// Writes the arrays: kinds, numbers, radii of rounded bodies, and of the meshes sizes, vertices and
/// triangles.
pub(super) fn write_bodies(
    writer: &mut PayloadWriter<'_>,
    bodies: &[BodyMotion],
) -> Result<(), EncodeError> {
    let kinds: Vec<u32> = bodies.iter().map(|body| body.shape.kind()).collect();
    writer.array(&kinds);
    let mut numbers = Vec::with_capacity(NUMBERS * bodies.len());
    let mut radii = Vec::new();
    let (mut sizes, mut vertices, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for body in bodies {
        numbers.extend(body.shape.sizes());
        numbers.extend(body.start);
        numbers.extend(body.end);
        numbers.extend([body.friction, body.compliance]);
        radii.extend(body.shape.radius());
        if let BodyShape::Mesh { vertices: of_body, triangles: faces }
        | BodyShape::RoundedMesh { vertices: of_body, triangles: faces, .. } = &body.shape
        {
            sizes.extend([count_of(VERTICES, of_body.len())?, count_of(TRIANGLES, faces.len())?]);
            vertices.extend_from_slice(of_body);
            triangles.extend_from_slice(faces);
        }
    }
    writer.array(&numbers);
    writer.array(&radii);
    writer.array(&sizes);
    writer.array(&vertices);
    writer.array(triangles.as_flattened());
    Ok(())
}

/// Reads the arrays that [`write_bodies`] wrote; the count has been checked.
pub(super) fn read_bodies(
    reader: &mut PayloadReader<'_>,
    count: usize,
    limits: &Limits,
) -> Result<Vec<BodyMotion>, DecodeError> {
    let kinds: Vec<u32> = reader.array(BODIES, count)?;
    let numbers: Vec<f64> = reader.array("numbers of bodies", NUMBERS * count)?;
    let count_of = |wanted: [u32; 2]| kinds.iter().filter(|kind| wanted.contains(kind)).count();
    let rounded = count_of([ROUNDED_BOX, ROUNDED_MESH]);
    let radii: Vec<f64> = reader.array("radii of rounded bodies", rounded)?;
    let meshes = count_of([MESH, ROUNDED_MESH]);
    let sizes: Vec<u32> = reader.array(SIZES, 2 * meshes)?;
    let total = |which: usize| sizes.iter().skip(which).step_by(2).map(|&n| u64::from(n)).sum();
    let vertex_count = checked_sum(VERTICES, total(0), limits.node_count_max)?;
    let triangle_count = checked_sum(TRIANGLES, total(1), limits.tet_count_max)?;
    let vertices: Vec<[f64; 3]> = reader.array(VERTICES, vertex_count)?;
    let corners: Vec<u32> = reader.array(TRIANGLES, 3 * triangle_count)?;
    let (triangles, _) = corners.as_chunks::<3>();
    let (mut vertices, mut triangles, mut sizes) = (&vertices[..], triangles, &sizes[..]);
    let mut radii = radii.into_iter();
    let mut radius = |kind| radii.next().ok_or(DecodeError::UnknownShape { kind });
    let mut bodies = Vec::with_capacity(count);
    for (&kind, numbers) in kinds.iter().zip(numbers.chunks_exact(NUMBERS)) {
        let at = |first: usize| [numbers[first], numbers[first + 1], numbers[first + 2]];
        let pose = |first: usize| std::array::from_fn(|k| numbers[first + k]);
        let shape = match kind {
            0 => BodyShape::Sphere { radius: numbers[0] },
            1 => BodyShape::Capsule { radius: numbers[0], length: numbers[1] },
            2 => BodyShape::Plane { normal: at(0) },
            3 => BodyShape::Box { half: at(0) },
            ROUNDED_BOX => BodyShape::RoundedBox { half: at(0), radius: radius(kind)? },
            MESH | ROUNDED_MESH => {
                let (mine, rest) = sizes.split_at(2);
                let (of_body, vertices_left) = vertices.split_at(mine[0] as usize);
                let (faces, triangles_left) = triangles.split_at(mine[1] as usize);
                (vertices, triangles, sizes) = (vertices_left, triangles_left, rest);
                let (vertices, triangles) = (of_body.to_vec(), faces.to_vec());
                match kind {
                    MESH => BodyShape::Mesh { vertices, triangles },
                    _ => BodyShape::RoundedMesh { vertices, triangles, radius: radius(kind)? },
                }
            }
            kind => return Err(DecodeError::UnknownShape { kind }),
        };
        bodies.push(BodyMotion {
            shape,
            start: pose(3),
            end: pose(10),
            friction: numbers[17],
            compliance: numbers[18],
        });
    }
    Ok(bodies)
}

/// Sum of announced counts as a length, if it is within the limit.
fn checked_sum(what: &'static str, sum: u64, count_max: u32) -> Result<usize, DecodeError> {
    check_count(what, u32::try_from(sum).unwrap_or(u32::MAX), count_max)
}
