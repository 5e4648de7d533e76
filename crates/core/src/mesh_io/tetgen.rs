//! Reads TetGen `.node` and `.ele`: given either one, it asks for the other.

use nalgebra::Point3;

use super::cell_kind::{CellKind, Shape};
use super::companion::{Companion, FindCompanion};
use super::cursor::{Cursor, words};
use super::error::{Fault, MeshFileError};
use super::number::{parse_integer, parse_real};
use super::raw_mesh::RawMesh;

/// Which half of a TetGen mesh a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Half {
    Node,
    Ele,
}

/// Tells `.node` from `.ele` by the first two lines, `None` if they are neither.
///
/// The header of `.node` has dimension 3 in second place, that of `.ele` 4 or 10 nodes; where the
/// header is one number only, the number of columns decides.
pub(super) fn half(bytes: &[u8]) -> Option<Half> {
    let mut cursor = Cursor::with_comments("", bytes, b'#');
    let header: Option<Vec<i64>> = words(cursor.line()?).take(5).map(parse_integer).collect();
    let record: Option<Vec<f64>> = words(cursor.line()?).take(12).map(parse_real).collect();
    let (header, record) = (header?, record?);
    let whole = record.iter().all(|value| value.fract() == 0.0);
    match header.as_slice() {
        [count, ..] if *count < 0 => None,
        [_, 3, ..] if header.len() <= 4 && record.len() >= 4 => Some(Half::Node),
        [_, 4 | 10, ..] if header.len() <= 3 && record.len() >= 5 => Some(Half::Ele),
        [_] if record.len() == 4 => Some(Half::Node),
        [_] if record.len() >= 5 && whole => Some(Half::Ele),
        _ => None,
    }
}

/// Reads a TetGen mesh from one half and the companion that `find` returns.
///
/// # Errors
/// [`MeshFileError`]: the other half is missing, or a record is not as its header says.
///
/// Source: TetGen manual, "File formats".
pub(super) fn read(
    name: &str,
    bytes: &[u8],
    find: &mut FindCompanion,
) -> Result<RawMesh, MeshFileError> {
    let (other, other_extension) = match half(bytes) {
        Some(Half::Node) => (Half::Ele, "ele"),
        _ => (Half::Node, "node"),
    };
    let companion = Companion::Extension(other_extension);
    let Some(other_bytes) = find(&companion) else {
        let fault = Fault::MissingCompanion { companion };
        return Err(MeshFileError { file: name.to_owned(), fault });
    };
    let stem = name.strip_suffix(".node").or_else(|| name.strip_suffix(".ele")).unwrap_or(name);
    let other_name = format!("{stem}.{other_extension}");
    let here = Cursor::with_comments(name, bytes, b'#');
    let there = Cursor::with_comments(&other_name, &other_bytes, b'#');
    let (node, ele) = if other == Half::Ele { (here, there) } else { (there, here) };
    let mut raw = RawMesh { tets_file: Some(format!("{stem}.ele")), ..RawMesh::default() };
    read_nodes(node, &mut raw)?;
    read_tets(ele, &mut raw)?;
    settle_base(&mut raw);
    Ok(raw)
}

/// Header numbers; the header may leave out the last ones.
fn read_header(cursor: &mut Cursor, what: &str) -> Result<(usize, [i64; 3]), MeshFileError> {
    let before = cursor.clone();
    let Some(line) = cursor.line() else { return Err(before.expected(what)) };
    let mut fields = words(line).map(parse_integer);
    let count = fields.next().flatten().and_then(|count| usize::try_from(count).ok());
    let Some(count) = count else { return Err(cursor.expected_instead(what, line)) };
    let mut options = [-1; 3];
    for (option, field) in options.iter_mut().zip(fields) {
        *option = field.ok_or_else(|| cursor.expected_instead(what, line))?;
    }
    Ok((count, options))
}

fn read_nodes(mut cursor: Cursor, raw: &mut RawMesh) -> Result<(), MeshFileError> {
    let (count, [dimension, ..]) =
        read_header(&mut cursor, "a header: number of points, 3, attributes, markers")?;
    if !matches!(dimension, 3 | -1) {
        return Err(cursor.count_fault("dimensions of a point", "3", &dimension.to_string()));
    }
    cursor.check_count(count, 8, "nodes")?;
    raw.points.reserve(count);
    raw.node_labels.reserve(count);
    for _ in 0..count {
        let what = "a point: index, x, y, z";
        let Some(line) = cursor.line() else { return Err(cursor.expected(what)) };
        let mut fields = words(line);
        let label = fields.next().and_then(parse_integer);
        let mut real = || fields.next().and_then(parse_real);
        let (Some(label), Some(x), Some(y), Some(z)) = (label, real(), real(), real()) else {
            return Err(cursor.expected_instead(what, line));
        };
        raw.node_labels.push(label);
        raw.points.push(Point3::new(x, y, z));
    }
    expect_end(&mut cursor, "points", count)
}

fn read_tets(mut cursor: Cursor, raw: &mut RawMesh) -> Result<(), MeshFileError> {
    let (count, [node_count, attributes, _]) =
        read_header(&mut cursor, "a header: number of tetrahedra, 4 or 10, attributes")?;
    let node_count = match node_count {
        4 | -1 => 4,
        10 => 10,
        other => {
            return Err(cursor.count_fault(
                "nodes of a tetrahedron",
                "4 or 10",
                &other.to_string(),
            ));
        }
    };
    cursor.check_count(count, 10, "tetrahedra")?;
    raw.tets.reserve(count);
    raw.regions.reserve(count);
    let kind = CellKind::new(Shape::Tetrahedron, node_count);
    let mut nodes = Vec::with_capacity(node_count);
    for _ in 0..count {
        let what = "a tetrahedron: index, nodes, attributes";
        let Some(line) = cursor.line() else { return Err(cursor.expected(what)) };
        let mut fields = words(line);
        let index = fields.next().and_then(parse_integer);
        nodes.clear();
        nodes.extend(fields.by_ref().take(node_count).map_while(parse_integer));
        // Attributes are real numbers; a missing one is as good as zero.
        let region =
            if attributes > 0 { fields.next().map_or(Some(0.0), parse_real) } else { Some(0.0) };
        let (Some(_), Some(region)) = (index, region) else {
            return Err(cursor.expected_instead(what, line));
        };
        if nodes.len() != node_count {
            return Err(cursor.expected_instead(what, line));
        }
        let region = region_label(region, raw);
        // TetGen has the middles of edges 34, 14, 12, 23, 24, 13.
        if let [a, b, c, d, e34, e14, e12, e23, e24, e13] = nodes[..] {
            nodes = vec![a, b, c, d, e12, e23, e13, e14, e24, e34];
        }
        raw.add_cell(kind, &nodes, [region, 0]);
    }
    expect_end(&mut cursor, "tetrahedra", count)
}

/// A whole number stands for itself; another one for its bits, with its text as the name.
fn region_label(attribute: f64, raw: &mut RawMesh) -> i64 {
    if attribute.fract() == 0.0 && attribute.abs() < 1e15 {
        return attribute as i64;
    }
    let label = attribute.to_bits() as i64;
    raw.region_names.entry(label).or_insert_with(|| attribute.to_string());
    label
}

fn expect_end(cursor: &mut Cursor, array: &str, count: usize) -> Result<(), MeshFileError> {
    match cursor.line() {
        None => Ok(()),
        Some(_) => {
            let announced = count.to_string();
            Err(cursor.count_fault(array, &announced, "at least one line more"))
        }
    }
}

/// Decides from the smallest and largest node used whether elements count from 0 or from 1.
///
/// The two files need not agree: one can be numbered from 1 and the other from 0.
fn settle_base(raw: &mut RawMesh) {
    let first = raw.node_labels.first().copied().unwrap_or(0);
    let in_sequence = raw
        .node_labels
        .iter()
        .enumerate()
        .all(|(i, &label)| label.checked_sub(i as i64) == Some(first));
    if !in_sequence {
        return;
    }
    let smallest = raw.tets.iter().flatten().copied().min().unwrap_or(first);
    let largest = raw.tets.iter().flatten().copied().max().unwrap_or(first);
    let base = if smallest == 0 {
        0
    } else if usize::try_from(largest) == Ok(raw.points.len()) {
        1
    } else {
        first
    };
    if base != first {
        raw.findings
            .note(format!("points are numbered from {first}, tetrahedra count from {base}"));
    }
    raw.node_labels.clear();
    raw.first_label = base;
}
