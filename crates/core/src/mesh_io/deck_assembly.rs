//! Puts the parts of an Abaqus deck where its instances are.

use nalgebra::{Point3, Rotation3, Unit, Vector3};

use super::cursor::Cursor;
use super::deck_keyword::fields;
use super::deck_part::{DeckPart, PartRegions};
use super::error::{Fault, MeshFileError};
use super::labels::NodeLabels;
use super::number::parse_real;
use super::raw_mesh::RawMesh;

/// Instances with tetrahedra; each of them takes the memory of its part.
const MAX_INSTANCES: usize = 64;

/// A part and where it stands.
#[derive(Clone, Debug)]
pub(super) struct Instance {
    pub(super) name: String,
    /// Name of the part.
    pub(super) part: String,
    /// Place among the parts of the data that the instance itself holds.
    pub(super) own: usize,
    pub(super) shift: Vector3<f64>,
    /// Two points of an axis and an angle in radians; after the shift.
    pub(super) turn: Option<(Point3<f64>, Vector3<f64>, f64)>,
    /// Data lines read.
    pub(super) lines: usize,
}

impl Instance {
    /// The first data line is a translation, the second one an axis and an angle in degrees.
    pub(super) fn read_line(&mut self, cursor: &Cursor, line: &[u8]) -> Result<(), MeshFileError> {
        let numbers: Option<Vec<f64>> = fields(line)
            .into_iter()
            .map(|field| if field.is_empty() { Some(0.0) } else { parse_real(field) })
            .collect();
        match (self.lines, numbers.as_deref()) {
            (0, Some(given)) if given.len() <= 3 => {
                for (axis, value) in given.iter().enumerate() {
                    self.shift[axis] = *value;
                }
            }
            (1, Some(&[ax, ay, az, bx, by, bz, degrees])) => {
                let from = Point3::new(ax, ay, az);
                self.turn = Some((from, Point3::new(bx, by, bz) - from, degrees.to_radians()));
            }
            _ => {
                let what = "the translation of an instance, then its axis and angle";
                return Err(cursor.expected_instead(what, line));
            }
        }
        self.lines += 1;
        Ok(())
    }

    /// Where a point of the part is.
    fn place(&self, point: Point3<f64>) -> Point3<f64> {
        let shifted = point + self.shift;
        match self.turn.and_then(|(from, axis, angle)| {
            Unit::try_new(axis, 0.0).map(|axis| (from, Rotation3::from_axis_angle(&axis, angle)))
        }) {
            Some((from, rotation)) => from + rotation * (shifted - from),
            None => shifted,
        }
    }
}

/// The mesh of a deck: its only part, or the parts at their instances one after the other.
///
/// # Errors
/// [`MeshFileError`]: several parts and nothing that says where they are, an instance of a part
/// that is not there, a tetrahedron with a node that is not there.
pub(super) fn assemble(
    cursor: &Cursor,
    parts: Vec<DeckPart>,
    instances: Vec<Instance>,
    raw: RawMesh,
) -> Result<RawMesh, MeshFileError> {
    if instances.is_empty() {
        return only_part(cursor, parts, raw);
    }
    let mut placed = Vec::new();
    let mut without_tets = Vec::new();
    for instance in instances {
        let is_own = |part: &&DeckPart| !part.points.is_empty();
        let named = || {
            let mut parts = parts.iter().filter(|part| !part.name.is_empty());
            parts.find(|part| part.name.eq_ignore_ascii_case(&instance.part))
        };
        let Some(part) = parts.get(instance.own).filter(is_own).or_else(named) else {
            let what = format!(
                "instance {} of part {}, which is not in the deck,",
                instance.name.escape_debug(),
                instance.part.escape_debug()
            );
            return Err(cursor.unsupported(&what));
        };
        match part.tets.is_empty() {
            true => without_tets.push(part),
            false => placed.push((instance, part)),
        }
    }
    if placed.len() > MAX_INSTANCES {
        let (expected, found) = (format!("at most {MAX_INSTANCES}"), placed.len().to_string());
        return Err(cursor.count_fault("instances", &expected, &found));
    }
    let mut joined = Joined { raw, part_offset: 0 };
    for part in without_tets {
        joined.count_others(part);
    }
    let several = placed.len() > 1;
    for (instance, part) in &placed {
        let prefix = if several { format!("{}.", instance.name) } else { String::new() };
        joined.add(cursor, part, instance, &prefix)?;
    }
    if several {
        joined.raw.findings.note(format!("{} instances, nodes are not joined", placed.len()));
    }
    Ok(joined.raw)
}

/// The mesh of a deck without instances.
fn only_part(
    cursor: &Cursor,
    parts: Vec<DeckPart>,
    mut raw: RawMesh,
) -> Result<RawMesh, MeshFileError> {
    let with_tets = parts.iter().filter(|part| !part.tets.is_empty()).count();
    if with_tets > 1 {
        return Err(cursor.unsupported("a deck of several parts without instances"));
    }
    let chosen = parts.iter().position(|part| !part.tets.is_empty());
    for (place, part) in parts.into_iter().enumerate() {
        add_others(&mut raw, &part);
        if place != chosen.unwrap_or(0) {
            continue;
        }
        let regions = part.regions().map_err(|what| cursor.unsupported(&what))?;
        add_regions(&mut raw, regions, 0, "");
        (raw.points, raw.node_labels) = (part.points, part.node_labels);
        for (corners, further) in part.tets.into_iter().zip(&part.further) {
            raw.add_tet(corners, further.as_ref().map_or(&[], |middles| middles.as_slice()));
        }
    }
    Ok(raw)
}

/// The parts joined so far.
struct Joined {
    raw: RawMesh,
    /// Names of regions so far.
    part_offset: i64,
}

impl Joined {
    fn count_others(&mut self, part: &DeckPart) {
        add_others(&mut self.raw, part);
    }

    /// Adds a part where its instance puts it; labels become record numbers.
    fn add(
        &mut self,
        cursor: &Cursor,
        part: &DeckPart,
        instance: &Instance,
        prefix: &str,
    ) -> Result<(), MeshFileError> {
        add_others(&mut self.raw, part);
        let labels = NodeLabels::try_new(&part.node_labels).map_err(|fault| cursor.fault(fault))?;
        self.raw.findings.labels_mapped |= labels.mapped();
        let first = self.raw.points.len() as i64;
        for (corners, further) in part.tets.iter().zip(&part.further) {
            let mut indices = [0; 4];
            for (index, &label) in indices.iter_mut().zip(corners) {
                let Some(at) = labels.index(label) else {
                    let (tet, nodes) = (self.raw.tets.len(), labels.describe());
                    return Err(cursor.fault(Fault::UnknownNode { tet, label, nodes }));
                };
                *index = first + i64::from(at);
            }
            // A mid-edge node that the part does not have is none of another part either.
            let of_label = |label| labels.index(label).map_or(-1, |at| first + i64::from(at));
            let middles = further.map(|middles| middles.map(of_label));
            self.raw.add_tet(indices, middles.as_ref().map_or(&[], |nodes| nodes.as_slice()));
        }
        self.raw.points.extend(part.points.iter().map(|&point| instance.place(point)));
        let mut regions = part.regions().map_err(|what| cursor.unsupported(&what))?;
        if regions.names.is_empty() {
            // The instance itself is the region.
            regions.numbers.fill(1);
            regions.names.push(instance.name.clone());
            self.part_offset = add_regions(&mut self.raw, regions, self.part_offset, "");
        } else {
            self.part_offset = add_regions(&mut self.raw, regions, self.part_offset, prefix);
        }
        Ok(())
    }
}

/// Adds the regions of a part after those that are there; how many there are now.
fn add_regions(raw: &mut RawMesh, regions: PartRegions, offset: i64, prefix: &str) -> i64 {
    for note in regions.notes {
        raw.findings.note(note);
    }
    if !regions.names.is_empty() {
        raw.region_names.insert(0, "in no set".to_owned());
    }
    let count = regions.names.len() as i64;
    for (number, name) in (offset + 1..).zip(regions.names) {
        raw.region_names.insert(number, format!("{prefix}{name}"));
    }
    raw.regions.extend(regions.numbers.into_iter().map(|number| match number {
        0 => [0, 0],
        _ => [number + offset, 0],
    }));
    offset + count
}

/// Counts the cells of a part that are not tetrahedra.
fn add_others(raw: &mut RawMesh, part: &DeckPart) {
    for (&kind, &count) in &part.other_cells {
        raw.count_cells(kind, count);
    }
    for (name, count) in &part.odd_cells {
        *raw.findings.other_cells.entry(name.clone()).or_default() += count;
    }
}
