//! Netgen `.vol`: keywords with counts, domains with names, comments after `#`.

use super::cell_kind::{CellKind, Shape};
use super::cursor::{Cursor, words};
use super::error::{Fault, MeshFileError};
use super::number::parse_integer;
use super::raw_mesh::RawMesh;

/// Reads a Netgen mesh.
///
/// # Errors
/// [`MeshFileError`]: the file ends too early, or something else stands where a number should be.
///
/// Source: Netgen, `libsrc/meshing/meshclass.cpp`, which writes and reads the format; there is no
/// other description of it.
pub(super) fn read(mut cursor: Cursor) -> Result<RawMesh, MeshFileError> {
    let mut raw = RawMesh { first_label: 1, ..RawMesh::default() };
    cursor.word("mesh3d")?;
    while let Some(keyword) = cursor.token() {
        match keyword {
            b"dimension" => {
                let dimension = cursor.integer("the dimension")?;
                if dimension != 3 {
                    let found = format!("a mesh of dimension {dimension}");
                    return Err(cursor.fault(Fault::NoTetrahedra { found }));
                }
            }
            b"volumeelements" => read_volume_elements(&mut cursor, &mut raw)?,
            b"points" => read_points(&mut cursor, &mut raw)?,
            b"materials" => read_materials(&mut cursor, &mut raw)?,
            b"curvedelements" => {
                raw.findings.skip(keyword);
                if !cursor.skip_past(b"endmesh") {
                    return Err(cursor.expected("endmesh"));
                }
                return Ok(raw);
            }
            // Geometry may follow, which is no mesh.
            b"endmesh" => return Ok(raw),
            [b'a'..=b'z', ..] => skip_keyword(&mut cursor, keyword, &mut raw),
            _ => {
                let what = "a keyword such as points or volumeelements";
                return Err(cursor.expected_instead(what, keyword));
            }
        }
    }
    Err(cursor.expected("endmesh"))
}

fn read_points(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of points")?;
    cursor.check_count(count, 6, "points")?;
    raw.points.reserve(count);
    for _ in 0..count {
        raw.points.push(cursor.point()?);
    }
    Ok(())
}

/// Lines of domain, number of nodes, nodes.
///
/// Netgen orders the corners of a tetrahedron the other way round than Gmsh and VTK do.
fn read_volume_elements(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of volume elements")?;
    cursor.check_count(count, 12, "volumeelements")?;
    let mut nodes = Vec::new();
    for _ in 0..count {
        let domain = cursor.integer("the domain of an element")?;
        let node_count = cursor.count("the number of nodes of an element")?;
        let shape = match node_count {
            4 | 10 => Shape::Tetrahedron,
            5 | 13 => Shape::Pyramid,
            6 | 15 => Shape::Prism,
            8 | 20 => Shape::Hexahedron,
            _ => {
                let found = node_count.to_string();
                return Err(cursor.count_fault(
                    "nodes of a volume element",
                    "4, 5, 6, 8, 10, 13, 15 or 20",
                    &found,
                ));
            }
        };
        nodes.clear();
        for _ in 0..node_count {
            nodes.push(cursor.integer("a node of an element")?);
        }
        if shape == Shape::Tetrahedron {
            nodes.swap(2, 3);
        }
        // Netgen has the middles of edges 12, 13, 14, 23, 24, 34, of its own corners.
        if let [a, b, c, d, e12, e14, e13, e24, e23, e34] = nodes[..] {
            nodes = vec![a, b, c, d, e12, e23, e13, e14, e24, e34];
        }
        raw.add_cell(CellKind::new(shape, node_count), &nodes, [domain, 0]);
    }
    Ok(())
}

/// Names of the domains: lines `number name`.
fn read_materials(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of materials")?;
    cursor.check_count(count, 2, "materials")?;
    for _ in 0..count {
        let domain = cursor.integer("the number of a domain")?;
        let name = String::from_utf8_lossy(cursor.rest_of_line()).into_owned();
        if !name.is_empty() {
            raw.region_names.insert(domain, name);
        }
    }
    Ok(())
}

/// Moves past the lines of a keyword, up to the next one; faces and edges are counted.
fn skip_keyword(cursor: &mut Cursor, keyword: &[u8], raw: &mut RawMesh) {
    let faces = keyword.starts_with(b"surfaceelements");
    let edges = keyword.starts_with(b"edgesegments");
    let starts_keyword = |token: &[u8]| token.first().is_some_and(u8::is_ascii_alphabetic);
    cursor.rest_of_line();
    let mut lines = 0_usize;
    while cursor.peek().is_some_and(|token| !starts_keyword(token)) {
        let Some(line) = cursor.line() else { break };
        lines += 1;
        // The first line is a count, which the lines themselves tell as well.
        if lines == 1 {
            continue;
        }
        if faces {
            let nodes = words(line).nth(4).and_then(parse_integer).unwrap_or(3);
            let shape = if matches!(nodes, 4 | 8) { Shape::Quadrangle } else { Shape::Triangle };
            raw.count_cells(CellKind::new(shape, usize::try_from(nodes).unwrap_or(3)), 1);
        } else if edges {
            raw.count_cells(CellKind::new(Shape::Line, 2), 1);
        }
    }
    // One line is a number such as the type of the geometry, or a count of nothing.
    if !faces && !edges && lines > 1 {
        raw.findings.skip(keyword);
    }
}
