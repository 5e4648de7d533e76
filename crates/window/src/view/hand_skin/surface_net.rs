//! A closed triangle mesh of the zero level of sampled distances: one vertex per cell that the
//! surface passes through, one quadrilateral per edge that it cuts (surface nets, Gibson 1998).

use nalgebra::Point3;

use super::grid::Grid;

const NO_VERTEX: u32 = u32::MAX;

/// Corners of the net and quadrilaterals between them, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default)]
pub(super) struct SurfaceNet {
    /// Corners of the net. Units: m. Frame: the grid's.
    pub places: Vec<Point3<f64>>,
    /// Quadrilaterals: four vertices each.
    pub quads: Vec<[u32; 4]>,
}

impl SurfaceNet {
    /// The net of a grid whose outermost corners all lie outside.
    pub fn new(grid: &Grid) -> Self {
        let cells = [0, 1, 2].map(|axis| grid.planes[axis].len() - 1);
        let cell_index = |at: [usize; 3]| (at[2] * cells[1] + at[1]) * cells[0] + at[0];
        let mut net = Self::default();
        let mut vertex_of_cell = vec![NO_VERTEX; cells.iter().product()];
        for z in 0..cells[2] {
            for y in 0..cells[1] {
                for x in 0..cells[0] {
                    if let Some(place) = crossing_middle(grid, [x, y, z]) {
                        vertex_of_cell[cell_index([x, y, z])] = number(net.places.len());
                        net.places.push(place);
                    }
                }
            }
        }
        for z in 1..cells[2] {
            for y in 1..cells[1] {
                for x in 1..cells[0] {
                    for axis in 0..3 {
                        let around = |cell: [usize; 3]| vertex_of_cell[cell_index(cell)];
                        net.quads.extend(quad(grid, [x, y, z], axis, around));
                    }
                }
            }
        }
        net
    }
}

/// Mean of the points where the surface cuts the edges of a cell, `None` if it cuts none.
fn crossing_middle(grid: &Grid, cell: [usize; 3]) -> Option<Point3<f64>> {
    let corner = |i: usize| [cell[0] + (i & 1), cell[1] + ((i >> 1) & 1), cell[2] + (i >> 2)];
    let value = |i: usize| grid.distances[grid.index(corner(i))];
    let inside = (0..8).filter(|&i| value(i) < 0.0).count();
    if inside == 0 || inside == 8 {
        return None;
    }
    let (mut sum, mut count) = (nalgebra::Vector3::zeros(), 0.0);
    for low in 0..8usize {
        for bit in [1, 2, 4] {
            let high = low | bit;
            let (a, b) = (value(low), value(high));
            if high != low && (a < 0.0) != (b < 0.0) {
                let (from, to) = (grid.corner(corner(low)), grid.corner(corner(high)));
                sum += from.coords + (to - from) * (a / (a - b));
                count += 1.0;
            }
        }
    }
    Some(Point3::from(sum / count))
}

/// The quadrilateral around the edge that starts at a corner and runs along an axis.
fn quad(
    grid: &Grid,
    corner: [usize; 3],
    axis: usize,
    vertex_of_cell: impl Fn([usize; 3]) -> u32,
) -> Option<[u32; 4]> {
    let mut end = corner;
    end[axis] += 1;
    let (a, b) = (grid.distances[grid.index(corner)], grid.distances[grid.index(end)]);
    if (a < 0.0) == (b < 0.0) {
        return None;
    }
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let around = [(1, 1), (0, 1), (0, 0), (1, 0)].map(|(du, dv)| {
        let mut cell = corner;
        cell[u] -= du;
        cell[v] -= dv;
        vertex_of_cell(cell)
    });
    // Counter-clockwise about +axis, which points outward if the edge leaves the body.
    Some(if a < 0.0 { around } else { [around[3], around[2], around[1], around[0]] })
}

/// A vertex number; a hand has some ten thousand.
fn number(count: usize) -> u32 {
    u32::try_from(count).expect("a grid of fewer than four thousand million cells")
}

#[cfg(test)]
mod tests {
    use super::super::grid::planes;
    use super::*;

    #[test]
    fn net_of_a_ball_is_closed_outward_and_near_the_ball() {
        let line = || planes(-1.3, 1.3, |x| 0.08 + 0.02 * x);
        let grid = Grid::sample([line(), line(), line()], |p| p.coords.norm() - 1.0);
        let net = SurfaceNet::new(&grid);
        let mut volume = 0.0;
        let mut edges = std::collections::BTreeMap::new();
        for quad in &net.quads {
            let p = quad.map(|i| net.places[i as usize].coords);
            volume += p[0].cross(&p[1]).dot(&p[2]) / 6.0 + p[0].cross(&p[2]).dot(&p[3]) / 6.0;
            for i in 0..4 {
                *edges.entry((quad[i], quad[(i + 1) % 4])).or_insert(0) += 1;
            }
        }
        let ball = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((volume / ball - 1.0).abs() < 0.02, "{volume}");
        assert!(net.places.iter().all(|p| (p.coords.norm() - 1.0).abs() < 0.02));
        for (&(from, to), &count) in &edges {
            assert_eq!((count, edges.get(&(to, from))), (1, Some(&1)));
        }
    }
}
