//! Splits the nodes of a mesh among ranks by planes: recursive coordinate bisection.

use nalgebra::Point3;

/// Which rank owns each node, and the numbers of the nodes among all: the first rank's come first.
///
/// Shapes: N nodes; `owner` and `number` N, [`NOBODY`] for nodes that no element uses; rank r owns the
/// numbers `start[r] .. start[r + 1]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Numbering {
    /// Rank of each node.
    pub owner: Vec<u32>,
    /// Number of each node.
    pub number: Vec<u32>,
    /// First number of each rank, and one more.
    pub start: Vec<u32>,
}

/// Owner and number of a node that no element uses.
pub const NOBODY: u32 = u32::MAX;

impl Numbering {
    /// Splits the used nodes into `ranks` parts of equal size, each by a plane across the longest side of
    /// what is to be split. The same nodes always give the same parts.
    pub fn new(places: &[Point3<f64>], used: &[bool], ranks: usize) -> Self {
        let mut owner = vec![NOBODY; places.len()];
        let mut nodes: Vec<u32> = (0..places.len() as u32).filter(|&n| used[n as usize]).collect();
        bisect(places, &mut nodes, 0, ranks.max(1), &mut owner);
        let mut start = vec![0; ranks.max(1) + 1];
        for &rank in owner.iter().filter(|&&rank| rank != NOBODY) {
            start[rank as usize + 1] += 1;
        }
        for rank in 1..start.len() {
            start[rank] += start[rank - 1];
        }
        let mut next = start.clone();
        let number = owner.iter().map(|&rank| match next.get_mut(rank as usize) {
            Some(next) => {
                *next += 1;
                *next - 1
            }
            None => NOBODY,
        });
        let number = number.collect();
        Self { owner, number, start }
    }
}

/// Gives `nodes` to the ranks `first .. first + ranks`.
fn bisect(
    places: &[Point3<f64>],
    nodes: &mut [u32],
    first: usize,
    ranks: usize,
    owner: &mut [u32],
) {
    if ranks == 1 || nodes.len() < 2 {
        nodes.iter().for_each(|&node| owner[node as usize] = first as u32);
        return;
    }
    let axis = longest_side(places, nodes);
    let below = ranks / 2;
    let at = (nodes.len() * below / ranks).clamp(1, nodes.len() - 1);
    nodes.select_nth_unstable_by(at, |&a, &b| {
        let of = |n: u32| places[n as usize][axis];
        // Nodes of one plane go by their numbers, so that nothing depends on the order before.
        of(a).total_cmp(&of(b)).then(a.cmp(&b))
    });
    let (low, high) = nodes.split_at_mut(at);
    bisect(places, low, first, below, owner);
    bisect(places, high, first + below, ranks - below, owner);
}

fn longest_side(places: &[Point3<f64>], nodes: &[u32]) -> usize {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for &node in nodes {
        for axis in 0..3 {
            let at = places[node as usize][axis];
            low[axis] = low[axis].min(at);
            high[axis] = high[axis].max(at);
        }
    }
    let side = |axis: &usize| high[*axis] - low[*axis];
    (0..3).max_by(|a, b| side(a).total_cmp(&side(b)).then(b.cmp(a))).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, generate};

    #[test]
    fn parts_are_equal_and_numbers_are_a_permutation() {
        let mesh = generate(BuiltIn::Strawberry, 1000).unwrap();
        for ranks in [1, 2, 3, 4, 7] {
            let used = mesh.used_nodes();
            let numbering = Numbering::new(mesh.vertices(), &used, ranks);
            let count = used.iter().filter(|used| **used).count();
            assert_eq!(numbering.start[ranks] as usize, count);
            let sizes: Vec<u32> = numbering.start.windows(2).map(|s| s[1] - s[0]).collect();
            let (least, most) = (sizes.iter().min().unwrap(), sizes.iter().max().unwrap());
            assert!(most - least <= 2, "{sizes:?}");
            let mut numbers: Vec<u32> =
                numbering.number.iter().copied().filter(|n| *n != NOBODY).collect();
            numbers.sort_unstable();
            assert!(numbers.iter().enumerate().all(|(i, n)| i as u32 == *n));
            for (node, &number) in numbering.number.iter().enumerate() {
                let rank = numbering.owner[node] as usize;
                assert!(rank >= ranks || number >= numbering.start[rank]);
                assert!(rank >= ranks || number < numbering.start[rank + 1]);
            }
        }
    }

    #[test]
    fn more_ranks_than_nodes_leave_some_without_and_orphans_belong_to_nobody() {
        let places = vec![Point3::origin(); 3];
        let numbering = Numbering::new(&places, &[true, false, true], 4);
        assert_eq!(numbering.number, [0, NOBODY, 1]);
        assert_eq!(numbering.start.last(), Some(&2));
        assert_eq!(numbering.start.len(), 5);
    }
}
