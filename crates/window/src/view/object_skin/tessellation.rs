//! Small triangles over curved ones: which are drawn, and where their vertices sit.

use std::collections::BTreeMap;

use super::crease::CreasedSurface;

/// A drawn vertex: a place on a curved triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Source {
    pub(super) triangle: u32,
    /// Number in the lattice of [`lattice_places`].
    pub(super) place: u32,
}

/// Every curved triangle cut into `level` × `level` small ones.
///
/// Vertices on a smooth edge are shared by its two sides; on a crease each side has its own.
pub(super) struct Tessellation {
    /// Pieces along each side of a triangle.
    pub(super) level: usize,
    /// Place of each drawn vertex on the curved surface.
    pub(super) sources: Vec<Source>,
    /// Drawn triangles, those of one curved triangle together.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Pieces of the edges of the computed surface, each edge once.
    pub(super) wireframe: Vec<[u32; 2]>,
}

impl Tessellation {
    /// Cuts all triangles of a surface.
    pub(super) fn new(surface: &CreasedSurface, level: usize) -> Self {
        let mut of_corner = vec![None; surface.corner_nodes.len()];
        let mut of_edge: Vec<Option<Vec<u32>>> = vec![None; surface.edges.len()];
        let mut out = Self { level, sources: vec![], triangles: vec![], wireframe: vec![] };
        let place_count = (level + 1) * (level + 2) / 2;
        for t in 0..surface.corners.len() {
            let mut ids = vec![u32::MAX; place_count];
            for (i, corner) in surface.corners[t].iter().enumerate() {
                let place = side_place(level, i, 0);
                let id = *of_corner[*corner as usize].get_or_insert_with(|| out.add(t, place));
                ids[place] = id;
            }
            for (side, along) in surface.edges_of[t].iter().enumerate() {
                let edge = along.edge as usize;
                let shared = of_edge[edge].clone().filter(|_| surface.edges[edge].is_smooth);
                let steps = (1..level).map(|s| if along.is_reversed { level - s } else { s });
                let inner: Vec<u32> = shared.unwrap_or_else(|| {
                    steps.clone().map(|s| out.add(t, side_place(level, side, s))).collect()
                });
                for (s, id) in steps.zip(&inner) {
                    ids[side_place(level, side, s)] = *id;
                }
                if of_edge[edge].is_none() {
                    let ends = [0, level].map(|s| ids[side_place(level, side, s)]);
                    out.add_wire(ends, &inner, along.is_reversed);
                    of_edge[edge] = Some(inner);
                }
            }
            for (place, id) in ids.iter_mut().enumerate().filter(|(_, id)| **id == u32::MAX) {
                *id = out.add(t, place);
            }
            out.add_triangles(&ids);
        }
        out
    }

    /// Gives each vertex that lies between charts one copy per chart; returns the charts of all.
    ///
    /// Shapes: `charts` one per drawn triangle.
    pub(super) fn split_by_chart(&mut self, charts: &[u8]) -> Vec<u8> {
        let mut of_vertex = vec![None; self.sources.len()];
        let mut copies: BTreeMap<(u32, u8), u32> = BTreeMap::new();
        for (triangle, &chart) in self.triangles.iter_mut().zip(charts) {
            for vertex in triangle {
                let first = *of_vertex[*vertex as usize].get_or_insert(chart);
                if first != chart {
                    let source = self.sources[*vertex as usize];
                    *vertex = *copies.entry((*vertex, chart)).or_insert_with(|| {
                        self.sources.push(source);
                        self.sources.len() as u32 - 1
                    });
                    of_vertex.resize(self.sources.len(), Some(chart));
                }
            }
        }
        of_vertex.into_iter().map(Option::unwrap_or_default).collect()
    }

    fn add(&mut self, triangle: usize, place: usize) -> u32 {
        self.sources.push(Source { triangle: triangle as u32, place: place as u32 });
        self.sources.len() as u32 - 1
    }

    /// Adds the pieces of an edge; `inner` runs from its lower node to its higher.
    fn add_wire(&mut self, [from, to]: [u32; 2], inner: &[u32], is_reversed: bool) {
        let mut line = inner.to_vec();
        if is_reversed {
            line.reverse();
        }
        line.insert(0, from);
        line.push(to);
        self.wireframe.extend(line.windows(2).map(|w| [w[0], w[1]]));
    }

    fn add_triangles(&mut self, ids: &[u32]) {
        let at = |j, k| ids[place_at(self.level, j, k)];
        for j in 0..self.level {
            for k in 0..self.level - j {
                self.triangles.push([at(j, k), at(j + 1, k), at(j, k + 1)]);
                if j + k + 1 < self.level {
                    self.triangles.push([at(j + 1, k), at(j + 1, k + 1), at(j, k + 1)]);
                }
            }
        }
    }
}

/// Barycentric coordinates of all places of a lattice, in the order of their numbers.
pub(super) fn lattice_places(level: usize) -> Vec<[f64; 3]> {
    let part = |n: usize| n as f64 / level as f64;
    (0..=level)
        .flat_map(|j| (0..=level - j).map(move |k| [part(level - j - k), part(j), part(k)]))
        .collect()
}

/// How often to cut so that pieces are about `piece` long and not too many.
///
/// Units: m.
pub(super) fn level_for(edge_mean: f64, piece: f64, triangle_count: usize) -> usize {
    let wanted = (edge_mean / piece).ceil();
    let affordable = (TRIANGLES_MAX as f64 / triangle_count.max(1) as f64).sqrt().floor();
    wanted.min(affordable).clamp(1.0, LEVEL_MAX) as usize
}

/// Number of the place `j` steps towards the second corner and `k` towards the third.
fn place_at(level: usize, j: usize, k: usize) -> usize {
    j * (level + 1) - (j * j - j) / 2 + k
}

/// Number of the place `step` steps along a side.
fn side_place(level: usize, side: usize, step: usize) -> usize {
    match side {
        0 => place_at(level, step, 0),
        1 => place_at(level, level - step, step),
        _ => place_at(level, 0, level - step),
    }
}

/// Drawn triangles at most, unless the computed surface alone has more.
pub(super) const TRIANGLES_MAX: usize = 60_000;
/// Finest cut; coarser meshes have no detail that would need more.
const LEVEL_MAX: f64 = 16.0;

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, Surface, generate};

    #[test]
    fn places_are_numbered_in_the_order_of_the_lattice() {
        for level in 1..6 {
            let places = lattice_places(level);
            let close =
                |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-12);
            for step in 0..=level {
                let t = step as f64 / level as f64;
                assert!(close(places[side_place(level, 0, step)], [1.0 - t, t, 0.0]));
                assert!(close(places[side_place(level, 1, step)], [0.0, 1.0 - t, t]));
                assert!(close(places[side_place(level, 2, step)], [t, 0.0, 1.0 - t]));
            }
        }
    }

    #[test]
    fn cut_surface_is_closed_and_has_the_counted_vertices() {
        let mesh = generate(BuiltIn::Sphere, 200).unwrap();
        let surface = Surface::from_mesh(&mesh);
        let smooth = CreasedSurface::new(mesh.vertices(), &surface.triangles, 4.0);
        for level in [1, 2, 5] {
            let cut = Tessellation::new(&smooth, level);
            assert_eq!(cut.triangles.len(), level * level * surface.triangles.len());
            // Euler: as many vertices as a closed surface of so many triangles has.
            assert_eq!(cut.sources.len(), cut.triangles.len() / 2 + 2);
            assert_eq!(cut.wireframe.len(), level * surface.triangles.len() * 3 / 2);
            let closed = Surface { triangles: cut.triangles, nodes: vec![] };
            assert_eq!(closed.non_manifold_edges(), 0);
        }
    }

    #[test]
    fn level_keeps_within_the_number_of_triangles() {
        assert_eq!(level_for(0.0024, 0.0012, 1000), 2);
        assert_eq!(level_for(0.0001, 0.0012, 1000), 1);
        assert_eq!(level_for(0.01, 0.001, 6000), 3);
        assert_eq!(level_for(0.01, 0.001, 100_000), 1);
        assert_eq!(level_for(f64::NAN, 0.001, 10), 16);
    }
}
