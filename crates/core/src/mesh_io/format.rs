//! Names of the file formats: those that are read, and those that are only recognised.

use std::fmt;

/// A format this program reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Format {
    /// Gmsh MSH 1 (`$NOD`, `$ELM`), text.
    GmshMsh1,
    /// Gmsh MSH 2.x, text.
    GmshMsh2Ascii,
    /// Gmsh MSH 2.x, binary (also what TetWild and fTetWild write).
    GmshMsh2Binary,
    /// Gmsh MSH 4.0 or 4.1, text.
    GmshMsh4Ascii,
    /// Gmsh MSH 4.1, binary.
    GmshMsh4Binary,
    /// VTK legacy, text or big-endian binary.
    VtkLegacy,
    /// VTK XML unstructured grid.
    Vtu,
    /// TetGen `.node` with `.ele`.
    TetGen,
    /// MEDIT `.mesh`, text.
    Medit,
    /// MEDIT `.meshb`, binary.
    MeditBinary,
    /// Netgen `.vol`, text.
    Netgen,
    /// FEBio `.feb`.
    Febio,
    /// XDMF with numbers in the text or in raw files beside it.
    Xdmf,
    /// Abaqus or CalculiX deck `.inp`, text.
    Deck,
    /// Vega FEM `.veg`, text.
    Vega,
    /// Lines `v x y z` and `t a b c d` (Isaac Gym, FleX).
    Tet,
    /// The three lists of thesis Table 3.1, as `docs/files.md` writes them down.
    ThesisLists,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::GmshMsh1 => "Gmsh MSH 1",
            Self::GmshMsh2Ascii => "Gmsh MSH 2 (text)",
            Self::GmshMsh2Binary => "Gmsh MSH 2 (binary)",
            Self::GmshMsh4Ascii => "Gmsh MSH 4 (text)",
            Self::GmshMsh4Binary => "Gmsh MSH 4 (binary)",
            Self::VtkLegacy => "VTK legacy",
            Self::Vtu => "VTK XML (VTU)",
            Self::TetGen => "TetGen .node/.ele",
            Self::Medit => "MEDIT .mesh",
            Self::MeditBinary => "MEDIT .meshb (binary)",
            Self::Netgen => "Netgen .vol",
            Self::Febio => "FEBio .feb",
            Self::Xdmf => "XDMF",
            Self::Deck => "Abaqus or CalculiX deck",
            Self::Vega => "Vega .veg",
            Self::Tet => ".tet",
            Self::ThesisLists => "thesis lists (Table 3.1)",
        })
    }
}

/// A format that is recognised so that the refusal can name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Foreign {
    /// MFEM `.mesh`.
    Mfem,
    /// MuJoCo's legacy binary surface mesh, also called `.msh`.
    MujocoLegacy,
    /// gemlab's own text, also called `.msh`.
    Gemlab,
    /// ANSYS Fluent, also called `.msh`.
    Fluent,
    /// Gmsh MSH of a version other than 1, 2 and 4.
    GmshOther,
    /// Universal Scene Description, text or crate.
    Usd,
    /// STL surface, text or binary.
    Stl,
    /// Wavefront OBJ surface.
    Obj,
    /// PLY surface.
    Ply,
    /// OFF surface.
    Off,
    /// glTF surface, text or binary.
    Gltf,
    /// DOLFIN XML.
    DolfinXml,
    /// netCDF in its classic form (Exodus).
    NetCdf,
    /// HDF5 container (Exodus, MED, VTKHDF).
    Hdf5,
    /// gzip file inside another one.
    Gzip,
    /// zip archive (also `.usdz`).
    Zip,
    /// xz, bzip2 or zstd stream.
    OtherCompression,
}

impl Foreign {
    /// What to do about it, as the second half of a sentence.
    pub fn advice(self) -> &'static str {
        match self {
            Self::Stl | Self::Obj | Self::Ply | Self::Off | Self::Gltf => {
                "it has no tetrahedra; `glove-client fill` makes them"
            }
            Self::MujocoLegacy => "it has no tetrahedra; write it as OBJ and fill that",
            Self::Gzip | Self::Zip | Self::OtherCompression => "unpack it first",
            _ => "convert it with Gmsh or meshio to MSH 4.1",
        }
    }
}

impl fmt::Display for Foreign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Mfem => "an MFEM mesh",
            Self::MujocoLegacy => "a MuJoCo legacy binary surface mesh",
            Self::Gemlab => "a gemlab mesh",
            Self::Fluent => "an ANSYS Fluent mesh",
            Self::GmshOther => "a Gmsh MSH file of a version other than 1, 2 and 4",
            Self::Usd => "a USD scene",
            Self::Stl => "an STL surface",
            Self::Obj => "a Wavefront OBJ surface",
            Self::Ply => "a PLY surface",
            Self::Off => "an OFF surface",
            Self::Gltf => "a glTF scene",
            Self::DolfinXml => "a DOLFIN XML mesh",
            Self::NetCdf => "a netCDF file (Exodus)",
            Self::Hdf5 => "an HDF5 file (Exodus, MED, VTKHDF)",
            Self::Gzip => "a gzip file inside another one",
            Self::Zip => "a zip archive",
            Self::OtherCompression => "a compressed file (xz, bzip2 or zstd)",
        })
    }
}
