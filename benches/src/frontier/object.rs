//! The objects of the report: built-in ones and files of others.

use std::path::Path;

use glove_client::object::mesh_file::read_mesh_file;
use softgrasp_core::mesh::{BuiltIn, generate};
use softgrasp_core::model::Element;

use super::pads::PaddedMesh;
use super::system::assembled;
use crate::report::{Options, ReportError};

/// Object with its patches.
pub(super) struct Object {
    pub name: String,
    pub padded: PaddedMesh,
}

/// Built-in objects, and their approximate numbers of nodes.
const BUILT_IN: [BuiltIn; 3] = [BuiltIn::Cube, BuiltIn::Strawberry, BuiltIn::Toothpaste];
const NODES: usize = 1000;
const NODES_QUICK: usize = 64;
/// Files of other authors: a small organ of few elements, and an animal with thin limbs.
const FILES: [&str; 2] = ["liver.msh1.msh", "armadillo_4k.node"];

/// All objects that are available, and a line for each file that is not.
///
/// # Errors
/// [`ReportError`] for built-in objects only.
pub(super) fn objects(options: &Options) -> Result<(Vec<Object>, Vec<String>), ReportError> {
    let nodes = if options.is_quick { NODES_QUICK } else { NODES };
    let mut objects = Vec::new();
    for shape in BUILT_IN {
        let padded = PaddedMesh::new(generate(shape, nodes)?);
        objects.push(Object { name: shape.name().to_owned(), padded });
    }
    let mut left_out = Vec::new();
    let files = if options.is_quick { &FILES[..1] } else { &FILES };
    for file in files {
        match imported(&options.meshes, file) {
            Ok(object) => objects.push(object),
            Err(why) => left_out.push(format!("{file} is left out: {why}")),
        }
    }
    Ok((objects, left_out))
}

/// Object from a file, with its patches, if it is one body that the patches hold.
fn imported(folder: &Path, file: &str) -> Result<Object, String> {
    let path = folder.join(file);
    if !path.is_file() {
        return Err(format!(
            "there is no such file in the folder {}; name another by --meshes",
            folder.display()
        ));
    }
    let read = read_mesh_file(&path).map_err(|error| error.to_string())?;
    let padded = PaddedMesh::new(read.mesh);
    let model = assembled(padded.mesh.clone(), Element::Tet4).map_err(|error| error.to_string())?;
    let dofs: Vec<u32> = padded.corner_pairs().iter().map(|&(dof, _)| dof).collect();
    model.check_held(&dofs, &[]).map_err(|error| error.to_string())?;
    let name = file.split('.').next().unwrap_or(file).to_owned();
    Ok(Object { name, padded })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_not_there_is_left_out_with_a_line() {
        let folder = tempfile::tempdir().unwrap();
        let options = Options {
            is_quick: true,
            out: folder.path().to_owned(),
            meshes: folder.path().join("none"),
            ..Options::default()
        };
        let (objects, left_out) = objects(&options).unwrap();
        let names: Vec<&str> = objects.iter().map(|o| o.name.as_str()).collect();
        assert_eq!(names, ["cube", "strawberry", "toothpaste"]);
        assert_eq!(left_out.len(), 1);
        let line = &left_out[0];
        assert!(line.contains("liver") && line.contains("--meshes"), "{line}");
        // A file that is there but is no mesh says what is wrong with it.
        std::fs::write(folder.path().join("m.msh"), "words").unwrap();
        assert!(imported(folder.path(), "m.msh").is_err_and(|why| why.contains("m.msh")));
    }
}
