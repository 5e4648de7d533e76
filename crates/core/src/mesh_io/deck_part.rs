//! A part of an Abaqus or CalculiX deck: nodes, elements, sets, and the regions that these make.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use nalgebra::Point3;

use super::cell_kind::{CellKind, Shape};

/// Looking up the elements of sets takes at most so many steps for one part; sets that name each
/// other and wide ranges could make a small file last for hours.
const MAX_STEPS: usize = 1 << 28;

/// What an element set is made of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Member {
    /// One element by its label.
    Label(i64),
    /// `GENERATE`: labels from `first` to `last`.
    Labels { first: i64, last: i64, step: i64 },
    /// Another set, by its name in capitals.
    Set(String),
    /// Tetrahedra that an `*ELEMENT` put in, by record.
    Tets(Range<usize>),
}

/// An element set.
#[derive(Clone, Debug)]
struct ElementSet {
    name: String,
    members: Vec<Member>,
    /// Whether an `*ELSET` lists members, or an `*ELEMENT` only.
    is_listed: bool,
}

/// The data of a part, of an instance, or of a deck that has none of them.
#[derive(Debug, Default)]
pub(super) struct DeckPart {
    /// Name of the part, as given; empty outside parts.
    pub(super) name: String,
    pub(super) points: Vec<Point3<f64>>,
    pub(super) node_labels: Vec<i64>,
    /// Corner labels.
    pub(super) tets: Vec<[i64; 4]>,
    /// Labels of the nodes of each tetrahedron behind its corners.
    pub(super) further: Vec<Option<[i64; 6]>>,
    element_labels: Vec<i64>,
    sets: Vec<ElementSet>,
    /// Place of each set by its name in capitals.
    set_places: BTreeMap<String, usize>,
    /// Name of the set in capitals, material.
    sections: Vec<(String, String)>,
    pub(super) other_cells: BTreeMap<CellKind, usize>,
    /// Elements of unknown kinds by plural name.
    pub(super) odd_cells: BTreeMap<String, usize>,
}

/// Region of each tetrahedron as a number from 1 (0: in none), and the names of the numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct PartRegions {
    pub(super) numbers: Vec<i64>,
    pub(super) names: Vec<String>,
    pub(super) notes: Vec<String>,
}

impl DeckPart {
    /// A part without data.
    pub(super) fn named(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::default() }
    }

    /// Place of a set, which is made where it is not there yet.
    pub(super) fn set(&mut self, name: &str) -> usize {
        let place = self.sets.len();
        *self.set_places.entry(name.to_uppercase()).or_insert_with(|| {
            let set = ElementSet { name: name.to_owned(), members: Vec::new(), is_listed: false };
            self.sets.push(set);
            place
        })
    }

    /// Adds to a set what an `*ELSET` lists.
    pub(super) fn add_member(&mut self, set: usize, member: Member) {
        if let Some(set) = self.sets.get_mut(set) {
            set.members.push(member);
            set.is_listed = true;
        }
    }

    /// Adds a section: a set has a material.
    pub(super) fn add_section(&mut self, set: &str, material: &str) {
        self.sections.push((set.to_uppercase(), material.to_owned()));
    }

    /// Adds an element; only tetrahedra are kept, by their corners and mid-edge nodes.
    pub(super) fn add_element(
        &mut self,
        kind: CellKind,
        label: i64,
        nodes: &[i64],
        set: Option<usize>,
    ) {
        let (Shape::Tetrahedron, &[a, b, c, d, ref further @ ..]) = (kind.shape, nodes) else {
            *self.other_cells.entry(kind).or_default() += 1;
            return;
        };
        let tet = self.tets.len();
        self.tets.push([a, b, c, d]);
        self.element_labels.push(label);
        self.further.push(further.try_into().ok());
        let Some(set) = set.and_then(|set| self.sets.get_mut(set)) else { return };
        match set.members.last_mut() {
            Some(Member::Tets(tets)) if tets.end == tet => tets.end += 1,
            _ => set.members.push(Member::Tets(tet..tet + 1)),
        }
    }

    /// Regions from sections, else from listed sets that hold every tetrahedron once, else from
    /// the sets that the elements are put in when they are given.
    ///
    /// # Errors
    /// A sentence when the sets take too long to look up.
    pub(super) fn regions(&self) -> Result<PartRegions, String> {
        let mut lookup = Lookup::new(self);
        if !self.sections.is_empty() {
            return self.section_regions(&mut lookup);
        }
        match self.listed_regions(&mut lookup)? {
            Some(regions) => Ok(regions),
            None => Ok(self.given_regions()),
        }
    }

    fn section_regions(&self, lookup: &mut Lookup) -> Result<PartRegions, String> {
        let mut regions = PartRegions { numbers: vec![0; self.tets.len()], ..Default::default() };
        let mut done = BTreeSet::new();
        // From the last section to the first, each set once: the first one to come stays.
        for (index, (set, _)) in self.sections.iter().enumerate().rev() {
            let Some(&place) = self.set_places.get(set) else {
                if regions.notes.len() < 10 {
                    regions.notes.push(format!("section of unknown set {}", set.escape_debug()));
                }
                continue;
            };
            if !done.insert(place) {
                continue;
            }
            for tet in lookup.tets_of(place)? {
                if let Some(region) = regions.numbers.get_mut(tet).filter(|region| **region == 0) {
                    *region = index as i64 + 1;
                }
            }
        }
        let name = |(set, material): &(String, String)| {
            let place = self.set_places.get(set).and_then(|&place| self.sets.get(place));
            let set = place.map_or(set, |set| &set.name);
            if material.is_empty() { set.clone() } else { format!("{set} ({material})") }
        };
        regions.names = self.sections.iter().map(name).collect();
        Ok(regions)
    }

    /// `None` unless two or more listed sets hold every tetrahedron exactly once.
    fn listed_regions(&self, lookup: &mut Lookup) -> Result<Option<PartRegions>, String> {
        let mut regions = PartRegions { numbers: vec![0; self.tets.len()], ..Default::default() };
        let mut missing = self.tets.len();
        for (place, set) in self.sets.iter().enumerate().filter(|(_, set)| set.is_listed) {
            let tets = lookup.tets_of(place)?;
            if tets.is_empty() {
                continue;
            }
            regions.names.push(set.name.clone());
            let number = regions.names.len() as i64;
            for tet in tets {
                match regions.numbers.get_mut(tet) {
                    Some(region) if *region == 0 => *region = number,
                    _ => return Ok(None),
                }
                missing -= 1;
            }
        }
        Ok((missing == 0 && regions.names.len() > 1).then_some(regions))
    }

    fn given_regions(&self) -> PartRegions {
        let mut regions = PartRegions { numbers: vec![0; self.tets.len()], ..Default::default() };
        for set in &self.sets {
            let mut is_used = false;
            for member in &set.members {
                let Member::Tets(tets) = member else { continue };
                is_used = true;
                let number = regions.names.len() as i64 + 1;
                if let Some(slots) = regions.numbers.get_mut(tets.clone()) {
                    slots.fill(number);
                }
            }
            if is_used {
                regions.names.push(set.name.clone());
            }
        }
        regions
    }
}

/// Finds the tetrahedra of sets.
struct Lookup<'p> {
    part: &'p DeckPart,
    /// Label and record of each tetrahedron, in order of the label.
    by_label: Vec<(i64, usize)>,
    steps: usize,
}

impl<'p> Lookup<'p> {
    fn new(part: &'p DeckPart) -> Self {
        let mut by_label: Vec<(i64, usize)> =
            part.element_labels.iter().enumerate().map(|(tet, &label)| (label, tet)).collect();
        by_label.sort_unstable();
        Self { part, by_label, steps: 0 }
    }

    /// Records of the tetrahedra of a set and of the sets it names, each once.
    fn tets_of(&mut self, place: usize) -> Result<BTreeSet<usize>, String> {
        let mut tets = BTreeSet::new();
        let mut seen = BTreeSet::from([place]);
        let mut open = vec![place];
        let part = self.part;
        while let Some(set) = open.pop().and_then(|place| part.sets.get(place)) {
            for member in &set.members {
                self.count(1)?;
                match member {
                    Member::Tets(range) => {
                        self.count(range.len())?;
                        tets.extend(range.clone());
                    }
                    Member::Label(label) => self.add_labels(*label, *label, 1, &mut tets)?,
                    Member::Labels { first, last, step } => {
                        self.add_labels(*first, *last, *step, &mut tets)?;
                    }
                    Member::Set(name) => {
                        let named = part.set_places.get(name).copied();
                        open.extend(named.filter(|&place| seen.insert(place)));
                    }
                }
            }
        }
        Ok(tets)
    }

    fn add_labels(
        &mut self,
        first: i64,
        last: i64,
        step: i64,
        tets: &mut BTreeSet<usize>,
    ) -> Result<(), String> {
        let from = self.by_label.partition_point(|pair| pair.0 < first);
        let to = self.by_label.partition_point(|pair| pair.0 <= last);
        let pairs = self.by_label.get(from..to).unwrap_or_default();
        let is_in = |pair: &&(i64, usize)| {
            pair.0.checked_sub(first).is_some_and(|offset| offset % step.max(1) == 0)
        };
        tets.extend(pairs.iter().filter(is_in).map(|pair| pair.1));
        self.count(to.saturating_sub(from))
    }

    fn count(&mut self, steps: usize) -> Result<(), String> {
        self.steps = self.steps.saturating_add(steps);
        match self.steps <= MAX_STEPS {
            true => Ok(()),
            false => Err(format!("element sets that take more than {MAX_STEPS} steps to look up")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(labels: &[i64]) -> DeckPart {
        let mut part = DeckPart::default();
        let kind = CellKind::new(Shape::Tetrahedron, 4);
        for &label in labels {
            part.add_element(kind, label, &[1, 2, 3, 4], None);
        }
        part
    }

    #[test]
    fn sets_of_sets_that_name_each_other_end() {
        let mut part = part(&[7, 1_000_000_007, -3]);
        let (a, b) = (part.set("A"), part.set("b"));
        part.add_member(a, Member::Set("B".to_owned()));
        part.add_member(b, Member::Set("A".to_owned()));
        part.add_member(b, Member::Label(-3));
        part.add_member(a, Member::Labels { first: 7, last: i64::MAX, step: 1_000_000_000 });
        let tets = Lookup::new(&part).tets_of(a).unwrap();
        assert_eq!(tets.into_iter().collect::<Vec<_>>(), [0, 1, 2]);
    }

    #[test]
    fn ranges_that_cover_everything_again_and_again_are_given_up() {
        let mut part = part(&(0..1000).collect::<Vec<_>>());
        let set = part.set("all");
        for _ in 0..300_000 {
            part.add_member(set, Member::Labels { first: 1, last: 1, step: 1 });
        }
        assert!(part.regions().is_ok());
        part.add_section("ALL", "m");
        part.add_member(set, Member::Labels { first: 0, last: i64::MAX, step: 1 });
        assert_eq!(part.regions().unwrap().names, ["all (m)"]);
        let mut lookup = Lookup::new(&part);
        lookup.steps = MAX_STEPS;
        assert!(lookup.tets_of(set).unwrap_err().contains("steps"));
    }

    #[test]
    fn the_last_section_of_an_element_wins_and_sets_that_overlap_are_no_regions() {
        let mut part = part(&[1, 2, 3]);
        let (all, some) = (part.set("All"), part.set("Some"));
        part.add_member(all, Member::Labels { first: 1, last: 3, step: 1 });
        part.add_member(some, Member::Label(2));
        assert_eq!(part.regions().unwrap().numbers, [0, 0, 0]);
        part.add_section("ALL", "soft");
        part.add_section("some", "hard");
        part.add_section("none", "x");
        let regions = part.regions().unwrap();
        assert_eq!(regions.numbers, [1, 2, 1]);
        assert_eq!(regions.names, ["All (soft)", "Some (hard)", "NONE (x)"]);
        assert_eq!(regions.notes, ["section of unknown set NONE"]);
    }
}
