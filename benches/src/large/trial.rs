//! Random squeezes of any mesh: patches, material, depth, rotation and slide, drawn from a seed.

use std::sync::Arc;

use nalgebra::{Point3, Rotation3, Vector3};
use softgrasp_core::contact::Mask;
use softgrasp_core::fem::hyperelastic::Law;
use softgrasp_core::fem::{Element, Material};
use softgrasp_core::mesh::{BuiltIn, Surface, TetMesh, generate};
use softgrasp_core::model::Model;
use softgrasp_core::solve::equilibrium::Path;

use crate::random::Random;
use crate::report::ReportError;

/// Largest depth of the press, relative to the object's size and to its smallest extent.
const DEPTH: (f64, f64) = (0.25, 0.5);
/// Largest rotation of the hand, rad.
const TURN: f64 = 0.8;
/// Number of draws of patches, if they do not hold the object.
const DRAWS: usize = 20;

/// Object, the patches that fingertips hold, and their motion.
pub(super) struct Trial {
    pub model: Model,
    pub frames: usize,
    law: Law,
    masks: Vec<Mask>,
    /// Mean position of each mask at rest, and its displacement at the end without the rotation, m.
    ways: Vec<(Point3<f64>, Vector3<f64>)>,
    axis: Vector3<f64>,
    turn: f64,
    slide: Vector3<f64>,
}

impl Trial {
    /// Draws a squeeze of a mesh.
    ///
    /// # Errors
    /// [`ReportError`] where no draw holds the object.
    pub fn draw(mesh: TetMesh, seed: u64) -> Result<Self, ReportError> {
        let mut random = Random(seed.wrapping_mul(0x2545_f491_4f6c_dd1d));
        let poisson = [0.0, 0.2, 0.3, 0.4, 0.45, 0.47][random.below(6)];
        let law = [Law::NeoHookean, Law::NeoHookeanLog][random.below(2)];
        let material = Material::try_new(2.0e4, poisson)?;
        let model = Model::try_new(mesh, Element::Tet4, &[material], Vec::new(), &mut |_| {})?;
        let (low, high) = model.mesh().bounds();
        let size = model.mesh().size();
        let depth = (DEPTH.0 * size).min(DEPTH.1 * (high - low).min());
        let depth = depth * (0.3 + 0.7 * random.share());
        let axis = direction(&mut random);
        let turn = TURN * random.share() * random.share();
        let slide = direction(&mut random) * (0.1 * size * random.share() * random.share());
        let frames = 12 + random.below(30);
        let mut drawn = patches(&model, depth, &mut random)?;
        for _ in 1..DRAWS {
            if model.hold(&[], drawn.0.clone(), None).is_ok() {
                break;
            }
            drawn = patches(&model, depth, &mut random)?;
        }
        let (masks, ways) = drawn;
        Ok(Self { model, frames, law, masks, ways, axis, turn, slide })
    }

    /// Mean displacements of the masks at a share of the whole squeeze, m.
    pub fn at(&self, share: f64) -> Vec<f64> {
        let turn = Rotation3::new(self.axis * (self.turn * share));
        let moved = |(centre, way): &(Point3<f64>, Vector3<f64>)| {
            <[f64; 3]>::from(turn * (centre + way * share) + self.slide * share - centre)
        };
        self.ways.iter().flat_map(moved).collect()
    }

    /// Path that begins at rest.
    ///
    /// # Errors
    /// [`ReportError`] where the tips do not hold the object.
    pub fn path(&self, is_single: bool) -> Result<Path, ReportError> {
        self.path_from(vec![0.0; 3 * self.model.system_node_count()], is_single)
    }

    /// Path that begins at a shape (3N displacements of the system, m).
    ///
    /// # Errors
    /// [`ReportError`] where the tips do not hold the object.
    pub fn path_from(&self, shape: Vec<f64>, is_single: bool) -> Result<Path, ReportError> {
        let hold = Arc::new(self.model.hold(&[], self.masks.clone(), None)?);
        let elements = Arc::new(self.model.hyperelastic(self.law)?);
        Ok(Path::new(elements, self.model.stiffness(), hold, shape, is_single))
    }
}

/// Generated object of about `nodes` nodes: a built-in shape, stretched, flattened, bent and twisted.
///
/// # Errors
/// [`ReportError`] where the mesh cannot be made.
pub(super) fn drawn_object(seed: u64, nodes: usize) -> Result<(String, TetMesh), ReportError> {
    let mut random = Random(seed.wrapping_mul(0x9e6c_63d0_876a_68ed));
    let shapes = [("sphere", BuiltIn::Sphere), ("cube", BuiltIn::Cube)];
    let (name, shape) = shapes[random.below(2)];
    let mesh = generate(shape, nodes)?;
    let (low, high) = mesh.bounds();
    let centre = nalgebra::center(&low, &high);
    let stretch = Vector3::new(1.0, 0.3 + 0.7 * random.share(), 0.2 + 0.8 * random.share());
    let (bend, twist) = (1.2 * random.share(), 1.0 * random.share());
    let half = 0.5 * (high - low).x;
    let vertices = mesh.vertices().iter().map(|place| {
        let p = (place - centre).component_mul(&stretch);
        let along = p.x / half;
        let p = Rotation3::from_axis_angle(&Vector3::x_axis(), twist * along) * p;
        let p = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.5 * bend * along) * p;
        Point3::from(p)
    });
    let mesh = mesh.with_vertices(vertices.collect())?;
    Ok((format!("drawn-out {name}"), mesh))
}

/// Masks, and position and displacement of each.
type Patches = (Vec<Mask>, Vec<(Point3<f64>, Vector3<f64>)>);

/// Three to five round patches of the surface, each pressed inward.
fn patches(model: &Model, depth: f64, random: &mut Random) -> Result<Patches, ReportError> {
    let mesh = model.mesh();
    let surface = Surface::from_mesh(mesh);
    let (mut masks, mut ways) = (Vec::new(), Vec::new());
    let count = 3 + random.below(3);
    let radius = mesh.size() * (0.06 + 0.09 * random.share());
    for _ in 0..count {
        // Away from what is held already: the farthest of three.
        let far = |node: &u32| {
            let place = mesh.vertices()[*node as usize];
            let distance = |(centre, _): &(Point3<f64>, Vector3<f64>)| (place - centre).norm();
            ways.iter().map(distance).fold(f64::INFINITY, f64::min)
        };
        let some: Vec<u32> =
            (0..3).map(|_| surface.nodes[random.below(surface.nodes.len())]).collect();
        let Some(tip) = some.into_iter().max_by(|a, b| far(a).total_cmp(&far(b))) else { continue };
        let tip = mesh.vertices()[tip as usize];
        let mut near: Vec<(f64, u32)> = surface
            .nodes
            .iter()
            .map(|&n| ((mesh.vertices()[n as usize] - tip).norm(), n))
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let held = near.iter().filter(|(distance, _)| *distance < radius).count();
        let held = &near[..held.max(3).min(near.len())];
        let mask = Mask::try_new(held.iter().map(|&(_, node)| (node, 1.0)).collect())?;
        let mut outward = Vector3::zeros();
        for triangle in &surface.triangles {
            let [a, b, c] = triangle.map(|n| mesh.vertices()[n as usize]);
            if triangle.iter().any(|n| held.iter().any(|(_, node)| node == n)) {
                outward += (b - a).cross(&(c - a));
            }
        }
        let mean = |axis: usize| mask.mean(|n| mesh.vertices()[n as usize][axis]);
        let centre = Point3::new(mean(0), mean(1), mean(2));
        let inward = -outward.try_normalize(0.0).unwrap_or_else(Vector3::x);
        ways.push((centre, inward * (depth * (0.4 + 0.6 * random.share()))));
        masks.push(mask);
    }
    Ok((masks, ways))
}

fn direction(random: &mut Random) -> Vector3<f64> {
    let mut number = || 2.0 * random.share() - 1.0;
    Vector3::new(number(), number(), number()).try_normalize(0.0).unwrap_or_else(Vector3::z)
}
