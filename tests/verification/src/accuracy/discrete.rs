//! A body made of one kind of element: its nodes, its equations, loads on it and integrals over it.

use std::collections::BTreeSet;

use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::{Element, Material, QuadraticMesh, dof, tet4, tet10};
use softgrasp_core::mesh::{Surface, TetMesh};
use softgrasp_core::model::{Model, ModelError};
use softgrasp_core::solve::{Factored, KnownDisplacements, Loads, Method, Partition, Solution};

use super::outcome::Solved;
use super::quadrature::POINTS;
use softgrasp_bench::report::ReportError;

/// Mesh with a kind of element and a material, mid-edge nodes included.
///
/// Shapes: `nodes` those of the mesh, then the mid-edge nodes if the element has them.
pub struct Discrete {
    element: Element,
    nodes: Vec<Point3<f64>>,
    /// Nodes of every element, one after the other.
    of_elements: Vec<u32>,
    /// Triangles of the surface: three corners, then the middles of their edges if there are any.
    surface: Vec<Vec<u32>>,
    model: Model,
}

/// Displacement given at one degree of freedom, m.
pub type Given = (u32, f64);

impl Discrete {
    /// Body of a mesh, an element and a material.
    ///
    /// # Errors
    /// [`ReportError::Model`] and [`ReportError::Material`].
    pub fn new(
        mesh: &TetMesh,
        element: Element,
        young: f64,
        poisson: f64,
    ) -> Result<Self, ReportError> {
        let material = Material::try_new(young, poisson)?;
        let mut surface: Vec<Vec<u32>> =
            Surface::from_mesh(mesh).triangles.iter().map(|t| t.to_vec()).collect();
        let (nodes, of_elements) = if element.node_count() == 10 {
            let quadratic = QuadraticMesh::try_new(mesh).map_err(ModelError::from)?;
            let edges = quadratic.edges();
            let middle = |a: u32, b: u32| {
                let edge = edges.partition_point(|e| *e < [a.min(b), a.max(b)]);
                (quadratic.corner_count() + edge) as u32
            };
            for t in &mut surface {
                let [a, b, c] = [t[0], t[1], t[2]];
                t.extend([middle(a, b), middle(b, c), middle(c, a)]);
            }
            (quadratic.vertices().to_vec(), quadratic.tets().concat())
        } else {
            (mesh.vertices().to_vec(), mesh.tets().concat())
        };
        let model = Model::try_new(mesh.clone(), element, &[material], Vec::new(), &mut |_| {})?;
        Ok(Self { element, nodes, of_elements, surface, model })
    }

    /// Model of the body.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Kind of element.
    pub fn element(&self) -> Element {
        self.element
    }

    /// Coordinates of every node, m.
    pub fn nodes(&self) -> &[Point3<f64>] {
        &self.nodes
    }

    /// For every node, whether it is on the surface.
    pub fn on_surface(&self) -> Vec<bool> {
        self.on_triangles(|_| true)
    }

    /// For every node, whether it is on a triangle of the surface that `is_meant` selects by its corners.
    pub fn on_triangles(&self, is_meant: impl Fn(&[Point3<f64>; 3]) -> bool) -> Vec<bool> {
        let mut on = vec![false; self.nodes.len()];
        for triangle in &self.surface {
            if is_meant(&[0, 1, 2].map(|i| self.nodes[triangle[i] as usize])) {
                triangle.iter().for_each(|&n| on[n as usize] = true);
            }
        }
        on
    }

    /// Degrees of freedom along `axis` of the nodes that `is_meant` selects, all given `value`.
    pub fn give(
        &self,
        axis: usize,
        value: f64,
        is_meant: impl Fn(&Point3<f64>) -> bool,
    ) -> Vec<Given> {
        let meant = self.nodes.iter().enumerate().filter(|(_, p)| is_meant(p));
        meant.map(|(n, _)| (dof(n, axis) as u32, value)).collect()
    }

    /// All three displacements of the nodes that `is_meant` selects by number, from a field.
    pub fn give_field(
        &self,
        is_meant: &[bool],
        field: impl Fn(&Point3<f64>) -> Vector3<f64>,
    ) -> Vec<Given> {
        let meant = self.nodes.iter().enumerate().filter(|(n, _)| is_meant[*n]);
        let of_node = |(n, p): (usize, &Point3<f64>)| {
            let u = field(p);
            (0..3).map(move |axis| (dof(n, axis) as u32, u[axis]))
        };
        meant.flat_map(of_node).collect()
    }

    /// Nodal forces of a traction that is constant on every triangle it acts on.
    ///
    /// `traction` gets the corners and the outward normal. Units: Pa, N.
    pub fn traction(
        &self,
        traction: impl Fn(&[Point3<f64>; 3], Vector3<f64>) -> Option<Vector3<f64>>,
    ) -> Vec<f64> {
        let mut forces = vec![0.0; 3 * self.nodes.len()];
        for triangle in &self.surface {
            let corners = [triangle[0], triangle[1], triangle[2]].map(|n| self.nodes[n as usize]);
            let area = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])) * 0.5;
            let Some(load) = traction(&corners, area.normalize()) else { continue };
            // ∫ N dA is a third of the area at each corner of a linear triangle, and none at the
            // corners but a third at each mid-edge node of a quadratic one.
            let sharing = if triangle.len() == 6 { &triangle[3..] } else { &triangle[..3] };
            for &n in sharing {
                for axis in 0..3 {
                    forces[dof(n as usize, axis)] += load[axis] * area.norm() / 3.0;
                }
            }
        }
        forces
    }

    /// Nodal forces `∫ N b dV` of a body force, N/m³.
    pub fn body_force(&self, density: impl Fn(&Point3<f64>) -> Vector3<f64>) -> Vec<f64> {
        let mut forces = vec![0.0; 3 * self.nodes.len()];
        self.integrate(|nodes, shape, p, weight| {
            let b = density(&p) * weight;
            for (&n, shape) in nodes.iter().zip(shape) {
                for axis in 0..3 {
                    forces[dof(n as usize, axis)] += shape * b[axis];
                }
            }
        });
        forces
    }

    /// Solves with known displacements (of any node; the same one twice counts once) and nodal forces (3
    /// for each node, or none; those at known degrees of freedom go into the support).
    ///
    /// # Errors
    /// [`ReportError::Model`], [`ReportError::Solve`].
    pub fn solve(&self, given: Vec<Given>, mut forces: Vec<f64>) -> Result<Answer, ReportError> {
        let known = KnownDisplacements::try_new(given).map_err(ModelError::from)?;
        if !forces.is_empty() {
            known.dofs().iter().for_each(|&d| forces[d as usize] = 0.0);
        }
        let used = vec![true; self.nodes.len()];
        let partition = Partition::try_new(&used, known.dofs()).map_err(ModelError::from)?;
        let unknown = partition.unknown().len();
        let stiffness = self.model.stiffness();
        let factored = Factored::try_new(stiffness, partition, Method::Front, &mut |_| {})?;
        let loads = Loads { q_known: known.values(), forces: &forces, residual_rel: 0.0 };
        let solution = factored.solve(stiffness, loads, &mut |_| {})?;
        Ok(Answer { known: known.dofs().to_vec(), solution, unknown })
    }

    /// `(∫ |u − exact|² dV / ∫ |exact|² dV)^½`.
    pub fn error(&self, u: &[f64], exact: impl Fn(&Point3<f64>) -> Vector3<f64>) -> f64 {
        let (mut error, mut whole) = (0.0, 0.0);
        self.integrate(|nodes, shape, p, weight| {
            let terms = nodes.iter().zip(shape).map(|(&n, shape)| at(u, n as usize) * *shape);
            let (found, exact) = (terms.sum::<Vector3<f64>>(), exact(&p));
            error += (found - exact).norm_squared() * weight;
            whole += exact.norm_squared() * weight;
        });
        (error / whole).sqrt()
    }

    /// Calls `visit(nodes, N, position, weight in m³)` for every quadrature point.
    fn integrate(&self, mut visit: impl FnMut(&[u32], &[f64], Point3<f64>, f64)) {
        for nodes in self.of_elements.chunks_exact(self.element.node_count()) {
            let corners: [Point3<f64>; 4] = std::array::from_fn(|i| self.nodes[nodes[i] as usize]);
            let volume = tet4::gradients(&corners).volume;
            for (l, weight) in POINTS.iter() {
                let p = corners.iter().zip(l).fold(Point3::origin(), |p, (c, l)| p + c.coords * *l);
                let ten = tet10::shape_functions(*l);
                let shape = if nodes.len() == 10 { ten.as_slice() } else { l.as_slice() };
                visit(nodes, shape, p, weight * volume);
            }
        }
    }
}

/// Displacements and support forces.
pub struct Answer {
    known: Vec<u32>,
    solution: Solution,
    /// Number of unknown degrees of freedom.
    pub unknown: usize,
}

impl Discrete {
    /// Case, element and size that an answer for this body belongs to.
    pub fn solved(
        &self,
        case: &'static str,
        poisson: f64,
        cells: usize,
        answer: &Answer,
    ) -> Solved {
        let (element, nodes, unknown) = (self.element, self.nodes.len(), answer.unknown);
        Solved { case, element, poisson, cells, nodes, unknown }
    }
}

impl Answer {
    /// Displacement of every degree of freedom, m.
    pub fn displacement(&self) -> &[f64] {
        &self.solution.displacement
    }

    /// Displacement of one node, m.
    pub fn at(&self, node: usize) -> Vector3<f64> {
        at(&self.solution.displacement, node)
    }

    /// Sum of the support forces at the known degrees of freedom that are in `of`, N.
    pub fn support(&self, of: &[Given]) -> f64 {
        let meant: BTreeSet<u32> = of.iter().map(|(dof, _)| *dof).collect();
        let pairs = self.known.iter().zip(&self.solution.reaction);
        pairs.filter(|(dof, _)| meant.contains(dof)).map(|(_, force)| force).sum()
    }

    /// Largest difference of a node's displacement from a field, relative to the field's largest value.
    pub fn error_at_nodes(
        &self,
        nodes: &[Point3<f64>],
        exact: impl Fn(&Point3<f64>) -> Vector3<f64>,
    ) -> f64 {
        let largest = nodes.iter().map(|p| exact(p).amax()).fold(0.0, f64::max);
        let off = |(n, p): (usize, &Point3<f64>)| (self.at(n) - exact(p)).amax();
        nodes.iter().enumerate().map(off).fold(0.0, f64::max) / largest
    }
}

fn at(u: &[f64], node: usize) -> Vector3<f64> {
    Vector3::new(u[dof(node, 0)], u[dof(node, 1)], u[dof(node, 2)])
}
