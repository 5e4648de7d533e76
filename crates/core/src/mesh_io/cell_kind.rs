//! Kinds of cells in mesh files, and what Gmsh and VTK call them by number.

use std::fmt;

/// Shape of a cell, whatever its order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Shape {
    Point,
    Line,
    Triangle,
    Quadrangle,
    Tetrahedron,
    Hexahedron,
    Prism,
    Pyramid,
    Polygon,
    Polyhedron,
    /// `Corners`, links, display facets and the like: named by the format, plural.
    Named(&'static str),
    /// A number that is in no table here.
    Unknown(i64),
}

/// Shape and number of nodes of a cell; a tetrahedron of 10 nodes is a quadratic one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct CellKind {
    pub(super) shape: Shape,
    pub(super) nodes: usize,
}

impl CellKind {
    /// Kind from its parts.
    pub(super) const fn new(shape: Shape, nodes: usize) -> Self {
        Self { shape, nodes }
    }

    /// Nodes of the linear cell of this shape, where that is one number.
    fn corners(self) -> Option<usize> {
        match self.shape {
            Shape::Point => Some(1),
            Shape::Line => Some(2),
            Shape::Triangle => Some(3),
            Shape::Quadrangle | Shape::Tetrahedron => Some(4),
            Shape::Hexahedron => Some(8),
            Shape::Prism => Some(6),
            Shape::Pyramid => Some(5),
            _ => None,
        }
    }
}

impl fmt::Display for CellKind {
    /// Plural, as in "3012 triangles"; the number of nodes is said where it is not the usual one.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.shape {
            Shape::Point => f.write_str("points")?,
            Shape::Line => f.write_str("lines")?,
            Shape::Triangle => f.write_str("triangles")?,
            Shape::Quadrangle => f.write_str("quadrangles")?,
            Shape::Tetrahedron => f.write_str("tetrahedra")?,
            Shape::Hexahedron => f.write_str("hexahedra")?,
            Shape::Prism => f.write_str("prisms")?,
            Shape::Pyramid => f.write_str("pyramids")?,
            Shape::Polygon => f.write_str("polygons")?,
            Shape::Polyhedron => f.write_str("polyhedra")?,
            Shape::Named(name) => f.write_str(name)?,
            Shape::Unknown(number) => write!(f, "cells of unknown type {number}")?,
        }
        match self.corners() {
            Some(corners) if corners != self.nodes => write!(f, " ({} nodes)", self.nodes),
            _ => Ok(()),
        }
    }
}

/// Cell kind of a Gmsh element type number; `None` if it is in no table here.
///
/// Source: Gmsh reference manual, section "MSH file format", and `GmshDefines.h` for the numbers.
pub(super) fn gmsh_cell(number: i64) -> Option<CellKind> {
    let (shape, nodes) = match number {
        1 => (Shape::Line, 2),
        2 => (Shape::Triangle, 3),
        3 => (Shape::Quadrangle, 4),
        4 => (Shape::Tetrahedron, 4),
        5 => (Shape::Hexahedron, 8),
        6 => (Shape::Prism, 6),
        7 => (Shape::Pyramid, 5),
        8 => (Shape::Line, 3),
        9 => (Shape::Triangle, 6),
        10 => (Shape::Quadrangle, 9),
        11 => (Shape::Tetrahedron, 10),
        12 => (Shape::Hexahedron, 27),
        13 => (Shape::Prism, 18),
        14 => (Shape::Pyramid, 14),
        15 => (Shape::Point, 1),
        16 => (Shape::Quadrangle, 8),
        17 => (Shape::Hexahedron, 20),
        18 => (Shape::Prism, 15),
        19 => (Shape::Pyramid, 13),
        20 => (Shape::Triangle, 9),
        21 => (Shape::Triangle, 10),
        22 => (Shape::Triangle, 12),
        23 | 24 => (Shape::Triangle, 15),
        25 => (Shape::Triangle, 21),
        26 => (Shape::Line, 4),
        27 => (Shape::Line, 5),
        28 => (Shape::Line, 6),
        29 => (Shape::Tetrahedron, 20),
        30 => (Shape::Tetrahedron, 35),
        31 => (Shape::Tetrahedron, 56),
        36 => (Shape::Quadrangle, 16),
        37 => (Shape::Quadrangle, 25),
        38 => (Shape::Quadrangle, 36),
        42 => (Shape::Triangle, 28),
        71 => (Shape::Tetrahedron, 84),
        92 => (Shape::Hexahedron, 64),
        93 => (Shape::Hexahedron, 125),
        _ => return None,
    };
    Some(CellKind::new(shape, nodes))
}

/// Cell kind of a VTK cell type number with the number of nodes the file gives it.
///
/// Source: VTK user's guide, section "VTK file formats", and `vtkCellType.h` for the numbers.
pub(super) fn vtk_cell(number: i64, nodes: usize) -> CellKind {
    let shape = match number {
        1 => Shape::Point,
        2 => Shape::Named("point clouds"),
        3 | 21 | 35 | 60 | 68 | 75 => Shape::Line,
        4 => Shape::Named("polylines"),
        5 | 22 | 34 | 61 | 69 | 76 => Shape::Triangle,
        6 => Shape::Named("triangle strips"),
        7 | 36 => Shape::Polygon,
        8 | 9 | 23 | 28 | 30 | 62 | 70 | 77 => Shape::Quadrangle,
        10 | 24 | 64 | 71 | 78 => Shape::Tetrahedron,
        11 | 12 | 25 | 29 | 33 | 67 | 72 | 79 => Shape::Hexahedron,
        13 | 26 | 31 | 32 | 65 | 73 | 80 => Shape::Prism,
        14 | 27 | 37 | 66 | 74 | 81 => Shape::Pyramid,
        42 => Shape::Polyhedron,
        _ => Shape::Unknown(number),
    };
    CellKind::new(shape, nodes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_the_order_only_when_it_is_not_linear() {
        assert_eq!(gmsh_cell(2).unwrap().to_string(), "triangles");
        assert_eq!(gmsh_cell(9).unwrap().to_string(), "triangles (6 nodes)");
        assert_eq!(vtk_cell(12, 8).to_string(), "hexahedra");
        assert_eq!(vtk_cell(99, 3).to_string(), "cells of unknown type 99");
    }
}
