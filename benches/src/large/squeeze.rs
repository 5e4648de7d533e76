//! Five fingertips that press an object and turn a little: the hand of report `large`.

use std::sync::Arc;

use nalgebra::{Point3, Rotation3, Vector3};
use softgrasp_core::contact::Mask;
use softgrasp_core::fem::hyperelastic::Law;
use softgrasp_core::fem::{Element, Material};
use softgrasp_core::mesh::{BuiltIn, generate};
use softgrasp_core::model::Model;
use softgrasp_core::solve::equilibrium::{Hold, Path};

use crate::report::ReportError;

/// Depth of the press at the end, relative to the object's size, and its limit relative to the smallest
/// extent.
const DEPTH: f64 = 0.08;
const DEPTH_OF_SMALLEST: f64 = 0.15;
/// Rotation of the hand meanwhile, rad.
const TURN: f64 = 0.2;
/// Radius of the patch that a fingertip holds, relative to the object's size.
const RADIUS: f64 = 0.12;

/// Object, and the masks that five fingertips hold.
pub(super) struct Squeeze {
    pub model: Model,
    pub masks: Vec<Mask>,
    /// Weighted mean position of each mask at rest, m.
    centres: Vec<Point3<f64>>,
    inward: Vec<Vector3<f64>>,
    size: f64,
    /// Depth at the end, relative to the size.
    depth: f64,
}

impl Squeeze {
    /// Squeeze of a built-in shape by five fingertips.
    ///
    /// Units: Young's modulus 20 kPa.
    ///
    /// # Errors
    /// [`ReportError`] where mesh or model cannot be made.
    pub fn new(shape: BuiltIn, nodes: usize, poisson: f64) -> Result<Self, ReportError> {
        let mesh = generate(shape, nodes)?;
        let material = Material::try_new(2.0e4, poisson)?;
        let model = Model::try_new(mesh, Element::Tet4, &[material], Vec::new(), &mut |_| {})?;
        let mesh = model.mesh();
        let (low, high) = mesh.bounds();
        let (centre, size) = (nalgebra::center(&low, &high), mesh.size());
        let directions = [
            [1.0, 0.2, 0.1],
            [-0.8, 0.6, 0.1],
            [-0.7, -0.2, 0.5],
            [-0.8, -0.4, -0.1],
            [-0.5, 0.5, -0.6],
        ];
        let (mut masks, mut centres, mut inward) = (Vec::new(), Vec::new(), Vec::new());
        for direction in directions.map(|d| Vector3::from(d).normalize()) {
            // By shares of the box, so that a slender object is held all along its length.
            let along =
                |p: &&Point3<f64>| (*p - centre).component_div(&(high - low)).dot(&direction);
            let tip = mesh.vertices().iter().max_by(|a, b| along(a).total_cmp(&along(b)));
            let tip = tip.copied().unwrap_or(centre);
            // At least the three nodes next to the tip, however coarse the mesh is.
            let mut near: Vec<(f64, u32)> = (0u32..)
                .zip(mesh.vertices())
                .map(|(node, place)| ((place - tip).norm(), node))
                .collect();
            near.sort_by(|a, b| a.0.total_cmp(&b.0));
            let held = near.iter().filter(|(distance, _)| *distance < RADIUS * size).count();
            let entries = near[..held.max(3)].iter().map(|&(_, node)| (node, 1.0)).collect();
            let mask = Mask::try_new(entries)?;
            let mean = |axis: usize| mask.mean(|n| mesh.vertices()[n as usize][axis]);
            centres.push(Point3::new(mean(0), mean(1), mean(2)));
            inward.push(-direction);
            masks.push(mask);
        }
        let depth = DEPTH.min(DEPTH_OF_SMALLEST * (high - low).min() / size);
        Ok(Self { model, masks, centres, inward, size, depth })
    }

    /// Mean displacements of the masks at a share of the whole squeeze, m.
    pub fn at(&self, share: f64) -> Vec<f64> {
        self.posed(self.depth * share, TURN * share)
    }

    /// Mean displacements of the masks pressed in by `depth` of the size and rotated by `turn` rad.
    pub fn posed(&self, depth: f64, turn: f64) -> Vec<f64> {
        let turn = Rotation3::new(Vector3::new(0.2, 0.3, 1.0).normalize() * turn);
        let moved = |(centre, inward): (&Point3<f64>, &Vector3<f64>)| {
            let place = turn * (centre + inward * (depth * self.size));
            <[f64; 3]>::from(place - centre)
        };
        self.centres.iter().zip(&self.inward).flat_map(moved).collect()
    }

    /// The same squeeze, half as deep.
    pub fn gentler(self) -> Self {
        Self { depth: 0.5 * self.depth, ..self }
    }

    /// Largest depth of the squeeze, relative to the size.
    pub fn depth(&self) -> f64 {
        self.depth
    }

    /// Length of the object, m.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Path that begins at rest, held by the fingertips.
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
        let hold = Arc::new(self.hold()?);
        let elements = Arc::new(self.model.hyperelastic(Law::NeoHookean)?);
        Ok(Path::new(elements, self.model.stiffness(), hold, shape, is_single))
    }

    fn hold(&self) -> Result<Hold, ReportError> {
        Ok(self.model.hold(&[], self.masks.clone(), None)?)
    }
}
