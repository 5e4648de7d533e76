//! Order of the columns inside each supernode: those that a descendant couples to stand together,
//! so that its contribution is added in few long runs.
//!
//! Any order inside a supernode gives the same fronts and the same work.

use super::supernodes::Supernodes;

/// A set of columns this small has no runs to win.
const COLUMNS_MIN: usize = 2;

/// New places of all columns: `place[old] = new`.
///
/// Shapes: one entry for each vertex of the graph, in elimination order.
///
/// Source: the idea of Jacquelin, Ng and Peyton, "Fast and effective reordering of columns within
/// supernodes using partition refinement" (2018).
pub(super) fn places(supernodes: &Supernodes) -> Vec<u32> {
    let mut owner = vec![0u32; supernodes.order.len()];
    for v in 0..supernodes.len() {
        let columns = supernodes.columns(v);
        owner[columns.start as usize..columns.end as usize].fill(v as u32);
    }
    let mut sets: Vec<Vec<&[u32]>> = vec![Vec::new(); supernodes.len()];
    for v in 0..supernodes.len() {
        let of_one = |a: &u32, b: &u32| owner[*a as usize] == owner[*b as usize];
        for set in supernodes.rows(v).chunk_by(of_one).filter(|set| set.len() >= COLUMNS_MIN) {
            sets[owner[set[0] as usize] as usize].push(set);
        }
    }
    let mut place: Vec<u32> = (0..supernodes.order.len() as u32).collect();
    let mut classes = Classes::default();
    for (v, mut sets) in sets.into_iter().enumerate() {
        let columns = supernodes.columns(v);
        // Large sets carry most numbers; the order among equals is that of the fronts.
        sets.sort_by_key(|set| std::cmp::Reverse(set.len()));
        classes.begin(columns.clone());
        for set in sets.iter().filter(|set| set.len() < columns.len()) {
            classes.refine(set);
        }
        for (new, &old) in columns.zip(&classes.items) {
            place[old as usize] = new;
        }
    }
    place
}

/// Columns of one supernode in classes that follow each other.
#[derive(Default)]
struct Classes {
    first: u32,
    items: Vec<u32>,
    /// Whether an item is the first of its class.
    begins: Vec<bool>,
    is_in: Vec<bool>,
    scratch: Vec<u32>,
}

impl Classes {
    fn begin(&mut self, columns: std::ops::Range<u32>) {
        self.first = columns.start;
        self.begins = vec![false; columns.len()];
        self.is_in = vec![false; columns.len()];
        if let Some(first) = self.begins.first_mut() {
            *first = true;
        }
        self.items = columns.collect();
    }

    /// Splits every class into what is in a set and what is not: at the end of the first class that
    /// the set meets and at the beginning of later ones, so that the set stays together.
    fn refine(&mut self, set: &[u32]) {
        for &column in set {
            self.is_in[(column - self.first) as usize] = true;
        }
        let mut has_begun = false;
        let mut from = 0;
        while from < self.items.len() {
            let mut to = from + 1;
            while to < self.items.len() && !self.begins[to] {
                to += 1;
            }
            let class = &mut self.items[from..to];
            let is_in = |column: u32| self.is_in[(column - self.first) as usize];
            let count = class.iter().filter(|&&column| is_in(column)).count();
            if count > 0 && count < class.len() {
                let goes_first = |column: u32| is_in(column) == has_begun;
                self.scratch.clear();
                self.scratch.extend(class.iter().filter(|&&column| goes_first(column)));
                let middle = self.scratch.len();
                self.scratch.extend(class.iter().filter(|&&column| !goes_first(column)));
                class.copy_from_slice(&self.scratch);
                self.begins[from + middle] = true;
            }
            has_begun |= count > 0;
            from = to;
        }
        for &column in set {
            self.is_in[(column - self.first) as usize] = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_that_overlap_like_intervals_stand_together() {
        let mut classes = Classes::default();
        classes.begin(10..22);
        // Intervals of the hidden order 10 13 16 19 11 14 17 20 12 15 18 21.
        let sets: [&[u32]; 4] =
            [&[10, 13, 16, 19, 11, 14], &[19, 11, 14, 17, 20], &[20, 12, 15, 18], &[10, 13]];
        for set in sets {
            classes.refine(set);
        }
        for set in sets {
            let mut places: Vec<usize> = set
                .iter()
                .map(|column| classes.items.iter().position(|item| item == column).unwrap())
                .collect();
            places.sort_unstable();
            assert_eq!(places[places.len() - 1] - places[0] + 1, set.len(), "{set:?}");
        }
    }
}
