//! Which nodes an element has, and which elements lie around a node.

use rayon::prelude::*;

use crate::fem::tet4::Gradients;
use crate::mesh::{Incidence, TetMesh};

/// Elements that one task works on.
pub(super) const ELEMENTS_TOGETHER: usize = 256;

/// Elements of K nodes, and where each node's contributions lie when every element has K places.
///
/// Shapes: M elements; places `K e + local`.
#[derive(Clone, Debug)]
pub(super) struct Locals<const K: usize> {
    pub tets: Vec<[u32; K]>,
    start: Vec<u32>,
    places: Vec<u32>,
}

impl<const K: usize> Locals<K> {
    /// Places of the nodes of some elements; every node must be below `node_count`.
    pub fn new(node_count: usize, tets: &[[u32; K]]) -> Self {
        let mut start = vec![0u32; node_count + 1];
        for &node in tets.iter().flatten() {
            start[node as usize + 1] += 1;
        }
        for node in 0..node_count {
            start[node + 1] += start[node];
        }
        let mut next = start.clone();
        let mut places = vec![0u32; K * tets.len()];
        for (place, &node) in tets.iter().flatten().enumerate() {
            places[next[node as usize] as usize] = place as u32;
            next[node as usize] += 1;
        }
        Self { tets: tets.to_vec(), start, places }
    }

    /// Sums what the elements contribute to each node, in the order of the elements.
    ///
    /// Shapes: `contributions` K for each element; result 3N.
    pub fn gather(&self, contributions: &[[[f64; 3]; K]]) -> Vec<f64> {
        let contributions = contributions.as_flattened();
        let mut sums = vec![0.0; 3 * (self.start.len() - 1)];
        sums.par_chunks_exact_mut(3).with_min_len(512).enumerate().for_each(|(node, sum)| {
            let places = self.start[node] as usize..self.start[node + 1] as usize;
            for &place in &self.places[places] {
                for (sum, part) in sum.iter_mut().zip(contributions[place as usize]) {
                    *sum += part;
                }
            }
        });
        sums
    }

    /// Works on pieces of the elements, in parallel; the pieces have a fixed size.
    ///
    /// `work(first element of the piece, contributions of its elements)`.
    pub fn for_each_piece<T: Send>(
        &self,
        contributions: &mut Vec<[[f64; 3]; K]>,
        work: impl Fn(usize, &mut [[[f64; 3]; K]]) -> T + Sync,
    ) -> Vec<T> {
        contributions.resize(self.tets.len(), [[0.0; 3]; K]);
        let pieces = contributions.par_chunks_mut(ELEMENTS_TOGETHER).enumerate();
        pieces.map(|(piece, part)| work(piece * ELEMENTS_TOGETHER, part)).collect()
    }

    /// Works on every element, in parallel and in pieces of fixed size, so that sums over pieces
    /// have the same bits for any number of threads.
    ///
    /// `work(element, its contributions, what the piece has so far)`.
    pub fn for_each<T: Send + Default>(
        &self,
        contributions: &mut Vec<[[f64; 3]; K]>,
        work: impl Fn(usize, &mut [[f64; 3]; K], &mut T) + Sync,
    ) -> Vec<T> {
        self.for_each_piece(contributions, |first, contributions| {
            let mut so_far = T::default();
            for (i, contributions) in contributions.iter_mut().enumerate() {
                work(first + i, contributions, &mut so_far);
            }
            so_far
        })
    }
}

/// Patches: the elements of one region around one node.
///
/// Shapes: P patches.
#[derive(Clone, Debug)]
pub(super) struct Averaging {
    start: Vec<u32>,
    /// Elements of patch p: `tets[start[p] .. start[p + 1]]`, ascending.
    tets: Vec<u32>,
    /// Volume `V_a` at rest of every patch, m³.
    volumes: Vec<f64>,
    /// Patch of each corner of each element.
    pub of_corners: Vec<[u32; 4]>,
}

impl Averaging {
    /// The patches of a mesh, by node, then by region.
    pub fn new(mesh: &TetMesh, rest: &[Gradients]) -> Self {
        let around = Incidence::new(mesh.node_count(), mesh.tets());
        let region = |tet: u32| mesh.regions().get(tet as usize).copied().unwrap_or(0);
        let mut of_corners = vec![[0u32; 4]; mesh.tets().len()];
        let (mut start, mut tets, mut volumes) = (vec![0u32], Vec::new(), Vec::new());
        for node in 0..mesh.node_count() {
            let mut here = around.tets(node as u32).to_vec();
            here.sort_by_key(|&tet| (region(tet), tet));
            for patch in here.chunk_by(|&a, &b| region(a) == region(b)) {
                let number = volumes.len() as u32;
                for &tet in patch {
                    for (corner, patch_of) in of_corners[tet as usize].iter_mut().enumerate() {
                        if mesh.tets()[tet as usize][corner] as usize == node {
                            *patch_of = number;
                        }
                    }
                }
                volumes.push(patch.iter().map(|&t| rest[t as usize].volume / 4.0).sum());
                tets.extend_from_slice(patch);
                start.push(tets.len() as u32);
            }
        }
        Self { start, tets, volumes, of_corners }
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.volumes.len()
    }

    /// Elements of one patch, ascending.
    pub fn tets(&self, patch: usize) -> &[u32] {
        &self.tets[self.start[patch] as usize..self.start[patch + 1] as usize]
    }

    /// `V_a` of one patch, m³.
    pub fn volume(&self, patch: usize) -> f64 {
        self.volumes[patch]
    }

    /// `J_a − 1` of every patch from `J_e − 1` of every element.
    pub fn average(&self, rest: &[Gradients], of_tets: &[f64]) -> Vec<f64> {
        let mean = |patch: usize| {
            let weighted = |&t: &u32| rest[t as usize].volume / 4.0 * of_tets[t as usize];
            self.tets(patch).iter().map(weighted).sum::<f64>() / self.volumes[patch]
        };
        let patches = (0..self.len()).into_par_iter().with_min_len(256);
        patches.map(mean).collect()
    }
}
