//! Tables of the command contract: `node,ux,uy,uz` and `node,fx,fy,fz`, nodes counted from 0.

use std::fmt::Write as _;

use softgrasp_protocol::DofValue;

/// Why a table cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The header differs from the expected one.
    #[error("{name}, line 1: the header is '{found}'; expected '{expected}'")]
    Header {
        /// Name of the file.
        name: String,
        /// Header of the file.
        found: String,
        /// Header that is expected.
        expected: String,
    },
    /// A cell is no number.
    #[error("{name}, line {line}: '{found}' in column {column} is not a {expected}")]
    Cell {
        /// Name of the file.
        name: String,
        /// Number of the line, from 1.
        line: u64,
        /// Name of the column.
        column: &'static str,
        /// Text of the cell.
        found: String,
        /// Kind of number that is expected.
        expected: &'static str,
    },
    /// A line has too few or too many cells, or bytes that are no text.
    #[error("{name}: {source}")]
    Csv {
        /// Name of the file.
        name: String,
        /// Error of the CSV reader, with the line.
        source: csv::Error,
    },
    /// The table has no row.
    #[error("{name} names no degree of freedom; every row is empty or there is none")]
    Empty {
        /// Name of the file.
        name: String,
    },
    /// A row names a node that the mesh does not have.
    #[error(
        "{name}, line {line}: node {node} does not exist; the mesh has {node_count} nodes, counted from 0 in the order of the file"
    )]
    NoSuchNode {
        /// Name of the file.
        name: String,
        /// Number of the line, from 1.
        line: u64,
        /// Number of the node in the row.
        node: u64,
        /// Number of nodes of the mesh.
        node_count: usize,
    },
}

/// Column names of a table of prescribed displacements.
pub const DISPLACEMENT_COLUMNS: [&str; 4] = ["node", "ux", "uy", "uz"];
/// Column names of a table of forces.
pub const FORCE_COLUMNS: [&str; 4] = ["node", "fx", "fy", "fz"];

/// Degrees of freedom and values of a table; an empty cell leaves its degree of freedom out.
///
/// Units: those of the file (m or N).
///
/// # Errors
/// [`TableError`] with file, line and column.
pub fn read_table(
    name: &str,
    bytes: &[u8],
    columns: [&'static str; 4],
    node_count: usize,
) -> Result<Vec<DofValue>, TableError> {
    let csv_error = |source| TableError::Csv { name: name.to_owned(), source };
    // A byte order mark is what some spreadsheets begin with.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
    let header = reader.headers().map_err(csv_error)?;
    if header.iter().ne(columns) {
        let found = header.iter().collect::<Vec<_>>().join(",");
        let expected = columns.join(",");
        return Err(TableError::Header { name: name.to_owned(), found, expected });
    }
    let mut values = Vec::new();
    for record in reader.into_records() {
        let record = record.map_err(csv_error)?;
        let line = record.position().map_or(0, csv::Position::line);
        let cell_error = |column: usize, expected| TableError::Cell {
            name: name.to_owned(),
            line,
            column: columns[column],
            found: record.get(column).unwrap_or("").to_owned(),
            expected,
        };
        let cell = |column: usize| record.get(column).unwrap_or("");
        let node: u64 = cell(0).parse().map_err(|_| cell_error(0, "node number, 0 or above"))?;
        if node >= node_count as u64 {
            return Err(TableError::NoSuchNode { name: name.to_owned(), line, node, node_count });
        }
        for axis in 0..3 {
            let text = cell(axis + 1);
            if text.is_empty() {
                continue;
            }
            let value: f64 = text.parse().map_err(|_| cell_error(axis + 1, "number"))?;
            if !value.is_finite() {
                return Err(cell_error(axis + 1, "finite number"));
            }
            values.push(DofValue { dof: 3 * node as u32 + axis as u32, value });
        }
    }
    Ok(values)
}

/// Table of the displacements of every node, as the shortest decimals that give the same bits when read.
///
/// Units: m.
pub fn write_displacements(displacements: &[[f64; 3]]) -> String {
    let mut out = String::with_capacity(64 * displacements.len() + 16);
    out.push_str("node,ux,uy,uz\n");
    for (node, u) in displacements.iter().enumerate() {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "{node},{:e},{:e},{:e}", u[0], u[1], u[2]);
    }
    out
}

/// Table of forces: every node with a force along some axis; the other axes have zero.
///
/// Shapes: `forces` ascending by degree of freedom. Units: N.
pub fn write_reactions(forces: &[DofValue]) -> String {
    let mut out = String::with_capacity(64 * forces.len() + 16);
    out.push_str("node,fx,fy,fz\n");
    for of_node in forces.chunk_by(|a, b| a.dof / 3 == b.dof / 3) {
        let mut f = [0.0; 3];
        of_node.iter().for_each(|force| f[force.dof as usize % 3] = force.value);
        let node = of_node[0].dof / 3;
        // Writing to a String cannot fail.
        let _ = writeln!(out, "{node},{:e},{:e},{:e}", f[0], f[1], f[2]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<DofValue>, TableError> {
        read_table("K.csv", text.as_bytes(), DISPLACEMENT_COLUMNS, 10)
    }

    #[test]
    fn reactions_stand_node_by_node() {
        let force = |dof, value| DofValue { dof, value };
        let table = write_reactions(&[force(3, 1.5), force(5, -2.0), force(7, 0.25)]);
        assert_eq!(table, "node,fx,fy,fz\n1,1.5e0,0e0,-2e0\n2,0e0,2.5e-1,0e0\n");
    }

    #[test]
    fn empty_cells_leave_their_degree_of_freedom_free() {
        let values = read("node,ux,uy,uz\r\n3, 1.5 ,,-2e-3\r\n").unwrap();
        let dofs: Vec<(u32, f64)> = values.iter().map(|v| (v.dof, v.value)).collect();
        assert_eq!(dofs, [(9, 1.5), (11, -2e-3)]);
    }

    #[test]
    fn faults_name_line_and_column() {
        let message = |text: &str| read(text).unwrap_err().to_string();
        assert!(message("node,x,y,z\n").contains("expected 'node,ux,uy,uz'"));
        assert!(message("node,ux,uy,uz\n1,0,0,0\n2,a,0,0\n").contains("line 3: 'a' in column ux"));
        assert!(message("node,ux,uy,uz\n1,inf,0,0\n").contains("finite number"));
        assert!(message("node,ux,uy,uz\n10,0,0,0\n").contains("node 10 does not exist"));
        assert!(message("node,ux,uy,uz\n-1,0,0,0\n").contains("node number"));
        assert!(message("node,ux,uy,uz\n1,0,0\n").contains("K.csv"));
        assert!(message("").contains("header is ''"));
    }

    #[test]
    fn written_table_reads_back_to_the_same_bits() {
        let u = [[1.0 / 3.0, -0.0, 1e-300], [f64::MIN_POSITIVE, 2.5e17, -1.0]];
        let values = read(&write_displacements(&u)).unwrap();
        let bits = |v: f64| v.to_bits();
        assert!(values.iter().zip(u.iter().flatten()).all(|(a, b)| bits(a.value) == bits(*b)));
    }
}
