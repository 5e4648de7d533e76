//! Five patches of surface that are pushed, and the same patches on a refined mesh.
//!
//! A single displaced node is a point load: its displacement field does not converge as the mesh
//! is refined. A patch that is a union of triangles of the first mesh is the same piece of surface
//! in every uniform refinement of it, so answers of all of them are answers to one question.

use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::QuadraticMesh;
use softgrasp_core::mesh::{MeshError, Surface, TetMesh, signed_volume};

use crate::report::ReportError;
use crate::scene::{TOUCHES, nearest};

/// Radius of a patch, as a share of the smallest distance between two touched nodes.
const RADIUS_SHARE: f64 = 0.35;

/// A piece of surface that moves as a whole.
///
/// Units: m. Frame: the object's.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pad {
    /// Triangles of the surface that it consists of.
    pub triangles: Vec<[u32; 3]>,
    /// Displacement of the patch, m.
    pub push: [f64; 3],
}

/// A mesh with its patches, and the nodes whose displacements are compared.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PaddedMesh {
    pub mesh: TetMesh,
    pub pads: Vec<Pad>,
    /// Surface nodes of the mesh that was refined first; refinement does not renumber them.
    pub watched: Vec<u32>,
}

impl PaddedMesh {
    /// Five patches where the other reports touch single nodes: the triangles within the radius,
    /// and at least those around the touched node.
    pub fn new(mesh: TetMesh) -> Self {
        let surface = Surface::from_mesh(&mesh);
        let (low, high) = mesh.bounds();
        let (centre, half) = (nalgebra::center(&low, &high), (high - low) / 2.0);
        let mut touched: Vec<u32> = Vec::new();
        for (place, _) in TOUCHES {
            let place = centre + half.component_mul(&Vector3::from(place));
            touched.extend(nearest(&mesh, &surface, &place, &touched));
        }
        let at = |node: u32| mesh.vertices()[node as usize];
        let radius = RADIUS_SHARE * smallest_distance(&touched, &at);
        let mut owner: Vec<Option<usize>> = vec![None; mesh.node_count()];
        let mut pads = Vec::new();
        for (index, (&node, (_, push))) in touched.iter().zip(TOUCHES).enumerate() {
            let is_free = |n: u32| owner[n as usize].is_none_or(|o| o == index);
            let is_near = |n: u32| (at(n) - at(node)).norm() <= radius;
            let belongs = |t: &[u32; 3]| {
                let is_covered = t.contains(&node) || t.iter().all(|&n| is_near(n));
                is_covered && t.iter().all(|&n| is_free(n))
            };
            let triangles: Vec<[u32; 3]> =
                surface.triangles.iter().copied().filter(belongs).collect();
            for &n in triangles.iter().flatten() {
                owner[n as usize] = Some(index);
            }
            pads.push(Pad { triangles, push: push.map(|u| u * mesh.size()) });
        }
        Self { mesh, pads, watched: surface.nodes }
    }

    /// Every element cut into eight, every triangle of a patch into four. Nodes keep their numbers,
    /// the middle of edge e becomes node N + e.
    ///
    /// # Errors
    /// [`ReportError::Model`] if there are too many edges, [`ReportError::Mesh`] if rounding turns
    /// an element over.
    pub fn refined(&self) -> Result<Self, ReportError> {
        let quadratic = quadratic(&self.mesh)?;
        let mesh = refined_mesh(&quadratic)?;
        let cut = |pad: &Pad| {
            let pieces = |&[a, b, c]: &[u32; 3]| {
                let (ab, bc, ca) = (
                    middle(&quadratic, a, b)?,
                    middle(&quadratic, b, c)?,
                    middle(&quadratic, c, a)?,
                );
                Some([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]])
            };
            let triangles = pad.triangles.iter().filter_map(pieces).flatten().collect();
            Pad { triangles, push: pad.push }
        };
        let pads = self.pads.iter().map(cut).collect();
        Ok(Self { mesh, pads, watched: self.watched.clone() })
    }

    /// Displacements of the nodes of all patches, by degree of freedom, ascending.
    pub fn corner_pairs(&self) -> Vec<(u32, f64)> {
        let nodes = |pad: &Pad| pad.triangles.iter().flatten().copied().collect();
        self.pairs(nodes)
    }

    /// Displacements of the corners and mid-edge nodes of all patches, for ten-node elements.
    ///
    /// # Errors
    /// [`ReportError::Model`] if there are too many edges.
    pub fn whole_pairs(&self) -> Result<Vec<(u32, f64)>, ReportError> {
        let quadratic = quadratic(&self.mesh)?;
        Ok(self.pairs(|pad| {
            let of_triangle = |&[a, b, c]: &[u32; 3]| {
                let middles =
                    [(a, b), (b, c), (c, a)].map(|(from, to)| middle(&quadratic, from, to));
                [a, b, c].into_iter().chain(middles.into_iter().flatten())
            };
            pad.triangles.iter().flat_map(of_triangle).collect()
        }))
    }

    fn pairs(&self, nodes: impl Fn(&Pad) -> Vec<u32>) -> Vec<(u32, f64)> {
        let mut pairs = Vec::new();
        for pad in &self.pads {
            let mut nodes = nodes(pad);
            nodes.sort_unstable();
            nodes.dedup();
            pairs.extend(
                nodes.iter().flat_map(|n| (0..3).zip(pad.push).map(move |(a, u)| (3 * n + a, u))),
            );
        }
        pairs.sort_by_key(|&(dof, _)| dof);
        pairs
    }
}

fn quadratic(mesh: &TetMesh) -> Result<QuadraticMesh, ReportError> {
    Ok(QuadraticMesh::try_new(mesh).map_err(softgrasp_core::model::ModelError::from)?)
}

fn smallest_distance(nodes: &[u32], at: &dyn Fn(u32) -> Point3<f64>) -> f64 {
    let pairs = nodes.iter().enumerate().flat_map(|(i, a)| nodes[..i].iter().map(move |b| (a, b)));
    pairs.map(|(&a, &b)| (at(a) - at(b)).norm()).fold(f64::INFINITY, f64::min)
}

/// Node in the middle of an edge.
fn middle(quadratic: &QuadraticMesh, a: u32, b: u32) -> Option<u32> {
    let edge = quadratic.edges().binary_search(&[a.min(b), a.max(b)]).ok()?;
    Some((quadratic.corner_count() + edge) as u32)
}

/// Positions of the middles of edges 12, 23, 13, 14, 24, 34 among the ten nodes of an element: the
/// ends of each inner diagonal, and the four middles around it.
const DIAGONALS: [([usize; 2], [usize; 4]); 3] =
    [([4, 9], [6, 5, 8, 7]), ([5, 7], [4, 8, 9, 6]), ([6, 8], [4, 5, 9, 7])];

/// Four elements at the corners, and four around the shortest diagonal of what is left.
///
/// Source: Bey, Tetrahedral grid refinement, Computing 55 (1995), with the diagonal by length.
fn refined_mesh(quadratic: &QuadraticMesh) -> Result<TetMesh, MeshError> {
    let vertices = quadratic.vertices();
    let at = |n: u32| vertices[n as usize];
    let mut tets = Vec::with_capacity(8 * quadratic.tets().len());
    for t in quadratic.tets() {
        tets.extend([
            [t[0], t[4], t[6], t[7]],
            [t[4], t[1], t[5], t[8]],
            [t[6], t[5], t[2], t[9]],
            [t[7], t[8], t[9], t[3]],
        ]);
        let length = |[p, q]: [usize; 2]| (at(t[p]) - at(t[q])).norm_squared();
        let shortest =
            DIAGONALS.iter().min_by(|a, b| length(a.0).total_cmp(&length(b.0))).into_iter();
        for &([p, q], ring) in shortest {
            for i in 0..4 {
                let (r, s) = (t[ring[i]], t[ring[(i + 1) % 4]]);
                let tet = [t[p], t[q], r, s];
                let is_turned = signed_volume(&tet.map(at)) < 0.0;
                tets.push(if is_turned { [t[p], t[q], s, r] } else { tet });
            }
        }
    }
    let regions = quadratic.regions().iter().flat_map(|&r| [r; 8]).collect();
    TetMesh::try_new(vertices.to_vec(), tets, regions)
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, generate};

    fn volume(mesh: &TetMesh) -> f64 {
        (0..mesh.tets().len()).map(|i| mesh.signed_volume(i)).sum()
    }

    fn area(mesh: &TetMesh, pad: &Pad) -> f64 {
        let at = |n: u32| mesh.vertices()[n as usize];
        let of = |&[a, b, c]: &[u32; 3]| 0.5 * (at(b) - at(a)).cross(&(at(c) - at(a))).norm();
        pad.triangles.iter().map(of).sum()
    }

    #[test]
    fn refinement_keeps_volume_surface_patches_and_numbers() {
        for shape in BuiltIn::ALL {
            let coarse = PaddedMesh::new(generate(shape, 400).unwrap());
            let fine = coarse.refined().unwrap();
            assert_eq!(fine.mesh.tets().len(), 8 * coarse.mesh.tets().len());
            let (before, after) = (volume(&coarse.mesh), volume(&fine.mesh));
            assert!((after / before - 1.0).abs() < 1e-12, "{shape}");
            let n = coarse.mesh.node_count();
            assert_eq!(coarse.mesh.vertices(), &fine.mesh.vertices()[..n]);
            // A conforming mesh has a closed surface of four times as many triangles.
            let (rough, smooth) =
                (Surface::from_mesh(&coarse.mesh), Surface::from_mesh(&fine.mesh));
            assert_eq!(smooth.triangles.len(), 4 * rough.triangles.len());
            assert_eq!(smooth.non_manifold_edges(), rough.non_manifold_edges());
            for (a, b) in coarse.pads.iter().zip(&fine.pads) {
                assert!(!a.triangles.is_empty(), "{shape}");
                let (before, after) = (area(&coarse.mesh, a), area(&fine.mesh, b));
                assert!((after / before - 1.0).abs() < 1e-12, "{shape}");
            }
        }
    }

    #[test]
    fn patches_do_not_share_nodes_and_middles_are_held_with_their_corners() {
        for shape in BuiltIn::ALL {
            let padded = PaddedMesh::new(generate(shape, 100).unwrap());
            let corners = padded.corner_pairs();
            assert_eq!(padded.pads.len(), 5);
            assert!(corners.windows(2).all(|w| w[0].0 < w[1].0), "{shape}: a node in two patches");
            // The corners of the refined patches are the corners and middles of the first ones.
            let whole = padded.whole_pairs().unwrap();
            assert_eq!(whole, padded.refined().unwrap().corner_pairs());
            assert!(whole.len() > corners.len());
        }
    }
}
