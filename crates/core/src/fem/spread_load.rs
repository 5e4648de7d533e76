//! Loads that are spread over a body, as forces at its nodes: weight, and pressure on its boundary.

use nalgebra::{Point3, Vector3};

use super::QuadraticMesh;
use super::six_node_face::pressure_forces;
use super::tet10::{QUADRATURE, shape_functions};
use crate::mesh::{Surface, TetMesh};

/// A body that loads are spread over.
///
/// The forces at the nodes do the same work as the load in every displacement that the elements can have
/// (consistent forces). Shapes: forces three for each node of the system. Units: m, N, kg/m³, m/s², Pa. Frame: that of the mesh.
#[derive(Clone, Copy, Debug)]
pub struct SpreadLoads<'a> {
    mesh: &'a TetMesh,
    quadratic: Option<&'a QuadraticMesh>,
}

/// A load that does not fit the body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpreadLoadError {
    /// Neither one density nor one for each region.
    #[error(
        "{given} densities were given; one for the whole body or one for each of {regions} regions are needed"
    )]
    Densities {
        /// Number of densities.
        given: usize,
        /// Number of regions.
        regions: usize,
    },
    /// A density below zero, or a number that is not finite.
    #[error("the density is {value}; it must be a finite number, 0 or above")]
    Density {
        /// The density, kg/m³.
        value: f64,
    },
    /// An acceleration or a pressure that is not finite.
    #[error("{what} is {value}, which is not a finite number")]
    NotFinite {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// Pressure on what is no triangle of the boundary.
    #[error(
        "pressure is put on the triangle of nodes {}, {} and {}, which is no face of the boundary \
         (0-based)", triangle[0], triangle[1], triangle[2]
    )]
    NotOnBoundary {
        /// Nodes of the triangle.
        triangle: [u32; 3],
    },
}

/// Share of an element's weight at each corner and at each middle of an edge of a ten-node tetrahedron with
/// straight edges: the integrals of its shape functions.
const CORNER_OF_TEN: f64 = -1.0 / 20.0;
const MIDDLE_OF_TEN: f64 = 1.0 / 5.0;

impl<'a> SpreadLoads<'a> {
    /// Of a mesh, with its mid-edge nodes if it has ten-node elements.
    pub fn new(mesh: &'a TetMesh, quadratic: Option<&'a QuadraticMesh>) -> Self {
        Self { mesh, quadratic }
    }

    /// Integrals of the shape functions, one for each node of the system: the share that a node has of a load
    /// that is even over the volume. Those of corners of ten-node elements may be below zero.
    ///
    /// Units: m³.
    pub fn nodal_volumes(self) -> Vec<f64> {
        let mut volumes = vec![0.0; self.node_count()];
        for (tet, corners) in self.mesh.tets().iter().enumerate() {
            match self.quadratic {
                None => {
                    let quarter = 0.25 * self.mesh.signed_volume(tet);
                    corners.iter().for_each(|&node| volumes[node as usize] += quarter);
                }
                Some(quadratic) => {
                    let (volume, shares) = self.shares(quadratic, tet);
                    let nodes = quadratic.tets()[tet].iter().zip(shares);
                    nodes.for_each(|(&node, share)| volumes[node as usize] += share * volume);
                }
            }
        }
        volumes
    }

    /// Places of the nodes of the system at rest, m.
    pub fn vertices(self) -> &'a [Point3<f64>] {
        self.quadratic.map_or(self.mesh.vertices(), QuadraticMesh::vertices)
    }

    /// Forces of the weight `ρ a` of every unit of volume, in an even field of acceleration.
    ///
    /// Shapes: `densities` one for the whole body, or one for each region. Units: kg/m³, m/s².
    ///
    /// # Errors
    /// [`SpreadLoadError`] for densities that do not fit, and for numbers that are none.
    pub fn weight(
        self,
        densities: &[f64],
        acceleration: Vector3<f64>,
    ) -> Result<Vec<f64>, SpreadLoadError> {
        self.check_weight(densities, acceleration)?;
        let mut forces = vec![0.0; 3 * self.node_count()];
        let regions = self.mesh.regions();
        for tet in 0..self.mesh.tets().len() {
            let region = regions.get(tet).map_or(0, |region| *region as usize);
            let density = densities.get(region).copied().unwrap_or(densities[0]);
            match self.quadratic {
                None => {
                    let volume = self.mesh.signed_volume(tet).abs();
                    let quarter = 0.25 * (density * volume * acceleration);
                    self.mesh.tets()[tet].iter().for_each(|&node| add(&mut forces, node, quarter));
                }
                Some(quadratic) => {
                    let (volume, shares) = self.shares(quadratic, tet);
                    let weight = density * volume * acceleration;
                    let nodes = quadratic.tets()[tet].iter().zip(shares);
                    nodes.for_each(|(&node, share)| add(&mut forces, node, share * weight));
                }
            }
        }
        Ok(forces)
    }

    /// Forces of an even pressure on triangles of the boundary, against their outward normal at rest. The
    /// corners of a triangle come in any order; one that is named twice is pressed twice.
    ///
    /// Units: Pa.
    ///
    /// # Errors
    /// [`SpreadLoadError::NotOnBoundary`], [`SpreadLoadError::NotFinite`].
    pub fn pressure(
        self,
        triangles: &[[u32; 3]],
        pressure: f64,
    ) -> Result<Vec<f64>, SpreadLoadError> {
        self.check_pressure(pressure)?;
        let mut forces = vec![0.0; 3 * self.node_count()];
        for corners in self.outward(triangles)? {
            let face = self.face(corners);
            let (places, carriers) = (face.places(self), face.carriers());
            for (&node, force) in carriers.iter().zip(face.forces(&places, pressure)) {
                add(&mut forces, node, force);
            }
        }
        Ok(forces)
    }

    /// Derivative by the places of nodes at rest of the work of an even pressure in a virtual displacement.
    ///
    /// Shapes: `v` and the result three for each node of the system. Units: Pa; N for `v` in m.
    ///
    /// # Errors
    /// As [`SpreadLoads::pressure`].
    pub fn pressure_by_places(
        self,
        triangles: &[[u32; 3]],
        pressure: f64,
        v: &[f64],
    ) -> Result<Vec<f64>, SpreadLoadError> {
        self.check_pressure(pressure)?;
        let mut slopes = vec![0.0; 3 * self.node_count()];
        for corners in self.outward(triangles)? {
            let face = self.face(corners);
            let places = face.places(self);
            let work = |places: &[Point3<f64>]| -> f64 {
                let of_nodes = face.carriers().iter().zip(face.forces(places, pressure));
                of_nodes.map(|(&node, force)| force.dot(&vector(v, node))).sum()
            };
            // The work is quadratic in the places, so that a difference over any step is its slope.
            let step = places.iter().map(|p| (p - places[0]).amax()).fold(0.0, f64::max);
            for (i, &node) in face.nodes().iter().enumerate() {
                let along = |axis: usize| {
                    let [up, down] = [step, -step].map(|step| {
                        let mut moved = places.clone();
                        moved[i][axis] += step;
                        work(&moved)
                    });
                    (up - down) / (2.0 * step)
                };
                add(&mut slopes, node, Vector3::from_fn(|axis, _| along(axis)));
            }
        }
        Ok(slopes)
    }

    /// Triangles of the boundary with their corners counter-clockwise seen from outside.
    fn outward(self, triangles: &[[u32; 3]]) -> Result<Vec<[u32; 3]>, SpreadLoadError> {
        let mut outward: Vec<([u32; 3], [u32; 3])> = Surface::from_mesh(self.mesh)
            .triangles
            .into_iter()
            .map(|triangle| (sorted(triangle), triangle))
            .collect();
        outward.sort_unstable();
        let found = |&triangle: &[u32; 3]| {
            let at = outward.binary_search_by_key(&sorted(triangle), |(sorted, _)| *sorted);
            at.map(|at| outward[at].1).map_err(|_| SpreadLoadError::NotOnBoundary { triangle })
        };
        triangles.iter().map(found).collect()
    }

    /// A face of the boundary, from its corners.
    fn face(self, corners: [u32; 3]) -> Face {
        let carriers = self.carriers(corners);
        match self.quadratic.is_some_and(QuadraticMesh::is_curved) {
            false => Face::Flat { corners, carriers },
            true => {
                let ([a, b, c], [d, e, f]) = (corners, carriers);
                Face::Curved([a, b, c, d, e, f])
            }
        }
    }

    /// Volume of a ten-node element, m³, and the shares of it that its nodes carry.
    fn shares(self, quadratic: &QuadraticMesh, tet: usize) -> (f64, [f64; 10]) {
        if !quadratic.is_curved() {
            let share = |i| if i < 4 { CORNER_OF_TEN } else { MIDDLE_OF_TEN };
            return (self.mesh.signed_volume(tet).abs(), std::array::from_fn(share));
        }
        let points = quadratic.points(tet);
        let mut shares = [0.0; 10];
        for (l, of_point) in QUADRATURE.into_iter().zip(points.shares) {
            shares.iter_mut().zip(shape_functions(l)).for_each(|(sum, n)| *sum += of_point * n);
        }
        (points.volume, shares)
    }

    /// Nodes that carry a third each of an even pressure on a triangle: the integral of a corner's shape
    /// function over a triangle of six nodes is zero.
    fn carriers(self, [a, b, c]: [u32; 3]) -> [u32; 3] {
        match self.quadratic {
            None => [a, b, c],
            Some(quadratic) => [[a, b], [b, c], [c, a]].map(|[a, b]| {
                quadratic
                    .middle(a, b)
                    .expect("a face of the boundary has its edges from an element")
            }),
        }
    }

    fn node_count(self) -> usize {
        self.quadratic.map_or(self.mesh.node_count(), QuadraticMesh::node_count)
    }

    /// Whether densities and acceleration are such as [`SpreadLoads::weight`] takes, without the work of it.
    ///
    /// # Errors
    /// As there.
    pub fn check_weight(
        self,
        densities: &[f64],
        acceleration: Vector3<f64>,
    ) -> Result<(), SpreadLoadError> {
        let labels = || self.mesh.regions().iter().max().map_or(1, |label| *label as usize + 1);
        if densities.len() != 1 && densities.len() != labels() {
            let given = densities.len();
            return Err(SpreadLoadError::Densities { given, regions: labels() });
        }
        if let Some(&value) = densities.iter().find(|d| !(**d >= 0.0 && d.is_finite())) {
            return Err(SpreadLoadError::Density { value });
        }
        match acceleration.iter().find(|a| !a.is_finite()) {
            Some(&value) => Err(SpreadLoadError::NotFinite { what: "the acceleration", value }),
            None => Ok(()),
        }
    }

    /// Whether a pressure is a number.
    ///
    /// # Errors
    /// [`SpreadLoadError::NotFinite`].
    pub fn check_pressure(self, pressure: f64) -> Result<(), SpreadLoadError> {
        match pressure.is_finite() {
            true => Ok(()),
            false => Err(SpreadLoadError::NotFinite { what: "the pressure", value: pressure }),
        }
    }
}

/// A face of the boundary under pressure.
enum Face {
    /// Corners, and the nodes that carry a third each.
    Flat { corners: [u32; 3], carriers: [u32; 3] },
    /// Corners and middles of the edges 12, 23, 31.
    Curved([u32; 6]),
}

impl Face {
    /// Nodes whose places make it.
    fn nodes(&self) -> &[u32] {
        match self {
            Self::Flat { corners, .. } => corners,
            Self::Curved(nodes) => nodes,
        }
    }

    /// Nodes that carry the pressure.
    fn carriers(&self) -> &[u32] {
        match self {
            Self::Flat { carriers, .. } => carriers,
            Self::Curved(nodes) => nodes,
        }
    }

    fn places(&self, of: SpreadLoads<'_>) -> Vec<Point3<f64>> {
        let vertices = of.quadratic.map_or(of.mesh.vertices(), QuadraticMesh::vertices);
        self.nodes().iter().map(|&node| vertices[node as usize]).collect()
    }

    /// Forces of a pressure on the carriers, where its nodes are at some places.
    fn forces(&self, places: &[Point3<f64>], pressure: f64) -> Vec<Vector3<f64>> {
        match (self, places) {
            (Self::Curved(_), &[a, b, c, d, e, f]) => {
                pressure_forces(&[a, b, c, d, e, f], pressure).to_vec()
            }
            (_, &[a, b, c, ..]) => vec![(b - a).cross(&(c - a)) * (-pressure / 6.0); 3],
            _ => Vec::new(),
        }
    }
}

/// The vector of a node.
fn vector(field: &[f64], node: u32) -> Vector3<f64> {
    Vector3::from_column_slice(&field[3 * node as usize..3 * node as usize + 3])
}

fn add(forces: &mut [f64], node: u32, force: Vector3<f64>) {
    let at = 3 * node as usize;
    forces[at..at + 3].iter_mut().zip(force.iter()).for_each(|(sum, f)| *sum += f);
}

fn sorted(mut triangle: [u32; 3]) -> [u32; 3] {
    triangle.sort_unstable();
    triangle
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{BuiltIn, generate};

    fn sphere() -> TetMesh {
        let mesh = generate(BuiltIn::Sphere, 300).unwrap();
        let regions = (0..mesh.tets().len()).map(|tet| u32::from(tet % 3 == 0)).collect();
        TetMesh::try_new(mesh.vertices().to_vec(), mesh.tets().to_vec(), regions).unwrap()
    }

    /// Work of forces in a displacement that is linear in the place.
    fn work(
        forces: &[f64],
        places: &[Point3<f64>],
        of: impl Fn(&Point3<f64>) -> Vector3<f64>,
    ) -> f64 {
        let forces = forces.as_chunks::<3>().0.iter().map(|f| Vector3::from(*f));
        forces.zip(places).map(|(force, place)| force.dot(&of(place))).sum()
    }

    #[test]
    fn weight_does_the_work_of_the_integral_in_linear_and_quadratic_fields() {
        let mesh = sphere();
        let quadratic = QuadraticMesh::try_new(&mesh).unwrap();
        let acceleration = Vector3::new(0.4, -9.0, 2.0);
        let densities = [900.0, 2000.0];
        let linear = |p: &Point3<f64>| Vector3::new(1.0 + 2.0 * p.y, p.x - p.z, 3.0 * p.z);
        let expected: f64 = (0..mesh.tets().len())
            .map(|tet| {
                let corners = mesh.corners(tet);
                let middle = corners.iter().map(|p| p.coords).sum::<Vector3<f64>>() / 4.0;
                let mass = densities[mesh.regions()[tet] as usize] * mesh.signed_volume(tet).abs();
                mass * acceleration.dot(&linear(&middle.into()))
            })
            .sum();
        for quadratic in [None, Some(&quadratic)] {
            let loads = SpreadLoads::new(&mesh, quadratic);
            let forces = loads.weight(&densities, acceleration).unwrap();
            let places = quadratic.map_or(mesh.vertices(), QuadraticMesh::vertices);
            let found = work(&forces, places, linear);
            assert!((found - expected).abs() < 1e-12 * expected.abs(), "{found} of {expected}");
        }
        // ∫ x² over a tetrahedron is V/20 (Σ xᵢ² + (Σ xᵢ)²); linear elements do not have that field.
        let forces = SpreadLoads::new(&mesh, Some(&quadratic)).weight(&densities, acceleration);
        let found = work(&forces.unwrap(), quadratic.vertices(), |p| Vector3::x() * p.x * p.x);
        let expected: f64 = (0..mesh.tets().len())
            .map(|tet| {
                let x = mesh.corners(tet).map(|p| p.x);
                let sum: f64 = x.iter().sum();
                let squares: f64 = x.iter().map(|x| x * x).sum();
                let mass = densities[mesh.regions()[tet] as usize] * mesh.signed_volume(tet).abs();
                mass * acceleration.x * (squares + sum * sum) / 20.0
            })
            .sum();
        assert!((found - expected).abs() < 1e-12 * expected.abs(), "{found} of {expected}");
    }

    #[test]
    fn an_even_pressure_on_a_closed_surface_balances_and_does_the_work_of_its_volume() {
        let mesh = sphere();
        let quadratic = QuadraticMesh::try_new(&mesh).unwrap();
        let volume: f64 = (0..mesh.tets().len()).map(|tet| mesh.signed_volume(tet).abs()).sum();
        let triangles = Surface::from_mesh(&mesh).triangles;
        // The order of the corners does not matter.
        let turned: Vec<[u32; 3]> = triangles.iter().map(|&[a, b, c]| [c, b, a]).collect();
        for quadratic in [None, Some(&quadratic)] {
            let loads = SpreadLoads::new(&mesh, quadratic);
            let forces = loads.pressure(&turned, 500.0).unwrap();
            assert_eq!(forces, loads.pressure(&triangles, 500.0).unwrap());
            let places = quadratic.map_or(mesh.vertices(), QuadraticMesh::vertices);
            // div x = 3: by Gauss the pressure's work on x is −3 p V, and on any rigid motion none.
            let grown = work(&forces, places, |p| p.coords);
            assert!((grown + 1500.0 * volume).abs() < 1e-12 * 1500.0 * volume, "{grown}");
            let size = 500.0 * volume;
            let moved = work(&forces, places, |_| Vector3::new(1.0, 2.0, 3.0)) * mesh.size();
            let spun = work(&forces, places, |p| Vector3::new(1.0, 2.0, 3.0).cross(&p.coords));
            assert!(moved.abs() < 1e-11 * size && spun.abs() < 1e-11 * size, "{moved} {spun}");
        }
    }

    #[test]
    fn loads_that_do_not_fit_the_body_are_named() {
        let mesh = sphere();
        let loads = SpreadLoads::new(&mesh, None);
        let weight = |densities: &[f64], x: f64| {
            loads.weight(densities, Vector3::new(x, 0.0, 0.0)).unwrap_err().to_string()
        };
        assert!(weight(&[], 1.0).contains("0 densities") && weight(&[], 1.0).contains("2 regions"));
        assert!(weight(&[1.0; 3], 1.0).contains("3 densities"));
        assert!(weight(&[-1.0], 1.0).contains("-1"));
        assert!(weight(&[1.0, f64::NAN], 1.0).contains("NaN"));
        assert!(weight(&[1.0], f64::INFINITY).contains("acceleration"));
        let [a, b, c, _] = mesh.tets()[0];
        let surface = Surface::from_mesh(&mesh).triangles;
        let is_face = |face: [u32; 3]| surface.iter().any(|t| sorted(*t) == sorted(face));
        let inner = mesh.tets().iter().map(|&[a, b, c, _]| [a, b, c]).find(|t| !is_face(*t));
        for triangle in [inner.unwrap(), [a, b, b], [a, b, u32::MAX], [c, c, c]] {
            let error = loads.pressure(&[triangle], 1.0).unwrap_err();
            assert_eq!(error, SpreadLoadError::NotOnBoundary { triangle });
        }
        let error = loads.pressure(&surface, f64::NAN).unwrap_err();
        assert!(error.to_string().contains("pressure"), "{error}");
    }
}
