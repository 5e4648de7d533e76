//! The surface of a real banana is filled, sound and damaged.

use std::path::Path;

use crate::fill::{FillTarget, fill};
use crate::mesh::{Surface, TetMesh};
use crate::mesh_io::parse;
use crate::surface::TriangleSurface;

/// The banana of the shared folder, if this machine has it; says so when it has not.
fn banana() -> Option<TetMesh> {
    let named = std::env::var_os("SOFTGRASP_SHARED").map(std::path::PathBuf::from);
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|dir| dir.join("shared"));
    let file = |folder: std::path::PathBuf| std::fs::read(folder.join("meshes/banana.vtk")).ok();
    let Some(bytes) = named.into_iter().chain(above).find_map(file) else {
        println!("skipped: no file shared/meshes/banana.vtk here");
        return None;
    };
    Some(parse("banana.vtk", &bytes, &mut |_| None).unwrap().mesh)
}

fn surface_of(mesh: &TetMesh) -> TriangleSurface {
    let triangles = Surface::from_mesh(mesh).triangles;
    TriangleSurface::try_new(mesh.vertices().to_vec(), triangles).unwrap()
}

#[test]
fn banana_with_missing_turned_and_doubled_faces_is_filled_alike() {
    let Some(own) = banana() else { return };
    let sound = surface_of(&own);
    let mut triangles: Vec<[u32; 3]> = sound
        .triangles()
        .iter()
        .enumerate()
        .filter(|(t, _)| t % 27 != 5)
        .map(|(_, t)| *t)
        .collect();
    assert!(sound.triangles().len() - triangles.len() >= 40);
    (0..30).for_each(|i| triangles[31 * i].swap(1, 2));
    triangles.extend_from_within(500..530);
    let damaged = TriangleSurface::try_new(sound.points().to_vec(), triangles).unwrap();
    let [a, b] = [&sound, &damaged].map(|s| fill(s, FillTarget::Size(0.014)).unwrap());
    assert_eq!((b.mending.turned, b.mending.doubled), (30, 30));
    assert_eq!((b.hinges, b.pieces_left_out), (0, 0));
    assert!((b.volume / a.volume - 1.0).abs() < 0.01, "{}", b.volume / a.volume);
    assert!(b.mesh.node_count().abs_diff(a.mesh.node_count()) * 50 < a.mesh.node_count());
    assert!(b.surface_to_mesh.max < 1.5 * a.surface_to_mesh.max);
}
