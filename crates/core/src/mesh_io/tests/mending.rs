//! Tests of mending: what is changed in broken files, and that mended files have no faults.

use nalgebra::Point3;
use proptest::prelude::*;

use super::samples::read;
use crate::mesh::{BuiltIn, Surface, TetMesh, generate};
use crate::mesh_io::{
    MeshFile, TetFault, write_msh41_labelled, write_thesis_lists_labelled, write_vtu_labelled,
};

/// A mesh of Medit text: nodes, tetrahedra (from 0) with region labels.
fn medit(points: &[Point3<f64>], tets: &[([u32; 4], i32)]) -> String {
    let mut text = format!("MeshVersionFormatted 2\nDimension 3\nVertices\n{}\n", points.len());
    for p in points {
        text.push_str(&format!("{:?} {:?} {:?} 0\n", p.x, p.y, p.z));
    }
    text.push_str(&format!("Tetrahedra\n{}\n", tets.len()));
    for ([a, b, c, d], label) in tets {
        text.push_str(&format!("{} {} {} {} {label}\n", a + 1, b + 1, c + 1, d + 1));
    }
    text + "End\n"
}

/// Orders the corners as the format wants them.
fn upright([a, b, c, d]: [u32; 4]) -> [u32; 4] {
    [a, b, d, c]
}

/// Corners and region of each element of a file.
type Elements = Vec<([u32; 4], i32)>;

/// A small cube as file records, sound.
fn cube() -> (Vec<Point3<f64>>, Elements) {
    let mesh = generate(BuiltIn::Cube, 27).unwrap();
    let region = |tet: usize| if tet.is_multiple_of(3) { 7 } else { 12 };
    let tets = mesh.tets().iter().enumerate().map(|(t, &c)| (upright(c), region(t))).collect();
    (mesh.vertices().to_vec(), tets)
}

fn volume(mesh: &TetMesh) -> f64 {
    (0..mesh.tets().len()).map(|tet| mesh.signed_volume(tet)).sum()
}

#[test]
fn every_bad_element_is_listed_with_what_is_done() {
    let (points, mut tets) = cube();
    let sound = read(medit(&points, &tets)).unwrap();
    assert_eq!(sound.findings.mending, None);
    tets[4].0.swap(0, 1);
    let flat = [tets[9].0[0], tets[9].0[1], tets[9].0[2], tets[9].0[2]];
    tets.push((flat, 12));
    let [a, b, c, d] = tets[2].0;
    tets.push(([d, b, a, c], 7));
    let count = tets.len();
    let file = read(medit(&points, &tets)).unwrap();
    let mending = file.findings.mending.unwrap();
    let listed: Vec<_> = mending.bad.iter().map(|bad| (bad.tet, bad.fault)).collect();
    let expected = [
        (4, TetFault::Inverted),
        (count - 2, TetFault::Flat),
        (count - 1, TetFault::Repeated { of: 2 }),
    ];
    assert_eq!(listed, expected);
    assert_eq!(mending.bad[0].fault.action(), "turn");
    assert_eq!(mending.bad[2].fault.action(), "drop");
    assert_eq!(file.mesh.tets().len(), count - 2);
    let whole = volume(&sound.mesh);
    assert!((mending.volume - whole).abs() < 1e-12 * whole);
    // The inverted one counts negative in the file, the repeated one twice.
    let of = |record: usize| sound.mesh.signed_volume(record);
    let sign = if mending.bad[2].volume < 0.0 { -1.0 } else { 1.0 };
    let in_file = whole - 2.0 * of(4) + sign * of(2);
    assert!((mending.volume_in_file - in_file).abs() < 1e-12 * whole);
    assert!(mending.lost_nodes.is_empty() && mending.fallen_apart.is_empty());
    assert_eq!((mending.bodies_in_file, mending.bodies, mending.vanished), (1, 1, 0));
}

#[test]
fn nodes_without_a_tetrahedron_and_bodies_that_fall_apart_are_told() {
    // Two tetrahedra that only a flat one joins, and a body that is nothing but flat.
    let at = |x: f64, y: f64, z: f64| Point3::new(x, y, z);
    let points = [
        at(0.0, 0.0, 0.0),
        at(1.0, 0.0, 0.0),
        at(0.0, 1.0, 0.0),
        at(0.0, 0.0, 1.0),
        at(5.0, 0.0, 0.0),
        at(6.0, 0.0, 0.0),
        at(5.0, 1.0, 0.0),
        at(5.0, 0.0, 1.0),
        at(3.0, 0.0, 0.0),
        at(9.0, 0.0, 0.0),
        at(9.0, 1.0, 0.0),
        at(9.0, 2.0, 0.0),
        at(9.0, 3.0, 0.0),
    ];
    let tets = [([0, 1, 2, 3], 0), ([1, 8, 4, 5], 0), ([4, 5, 6, 7], 0), ([9, 10, 11, 12], 0)];
    let mending = read(medit(&points, &tets)).unwrap().findings.mending.unwrap();
    assert_eq!(mending.lost_nodes, [8, 9, 10, 11, 12]);
    assert_eq!((mending.bodies_in_file, mending.bodies), (2, 2));
    assert_eq!((mending.fallen_apart.as_slice(), mending.vanished), (&[2][..], 1));
}

#[test]
fn hinge_left_by_a_dropped_element_shows_in_the_pieces() {
    // Two tetrahedra over the halves of a square whose diagonal a flat one covers.
    let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
        .map(|[x, y]| Point3::new(x, y, 0.0))
        .into_iter()
        .chain([Point3::new(0.5, 0.2, 1.0), Point3::new(0.5, 0.8, -1.0)]);
    let points: Vec<_> = points.collect();
    let tets = [([0, 1, 2, 4], 0), ([0, 1, 2, 3], 0), ([0, 3, 2, 5], 0)];
    let mending = read(medit(&points, &tets)).unwrap().findings.mending.unwrap();
    assert_eq!((mending.pieces_in_file, mending.pieces), (1, 2));
    assert_eq!((mending.bodies_in_file, mending.bodies), (1, 1));
}

/// One way to break a file.
#[derive(Clone, Copy, Debug)]
enum Break {
    Flip(usize),
    Flatten(usize),
    Repeat(usize, usize),
    Orphan,
}

fn breaks() -> impl Strategy<Value = Vec<Break>> {
    let one = prop_oneof![
        (0usize..1000).prop_map(Break::Flip),
        (0usize..1000).prop_map(Break::Flatten),
        ((0usize..1000), 0usize..4).prop_map(|(tet, turn)| Break::Repeat(tet, turn)),
        Just(Break::Orphan),
    ];
    prop::collection::vec(one, 0..12)
}

fn broken(breaks: &[Break], labels: [i32; 2]) -> String {
    let (mut points, mut tets) = cube();
    tets.iter_mut().for_each(|tet| tet.1 = labels[usize::from(tet.1 == 7)]);
    for &what in breaks {
        let count = tets.len();
        match what {
            Break::Flip(tet) => tets[tet % count].0.swap(1, 2),
            Break::Flatten(tet) => {
                let tet = &mut tets[tet % count].0;
                tet[3] = tet[0];
            }
            Break::Repeat(tet, turn) => {
                let mut again = tets[tet % count];
                again.0.rotate_left(turn);
                tets.push(again);
            }
            Break::Orphan => points.push(Point3::new(9.0, 9.0, 9.0)),
        }
    }
    medit(&points, &tets)
}

/// The file of each format that the mended mesh is written to.
fn mended(file: &MeshFile) -> [Vec<u8>; 3] {
    let (mesh, labels) = (&file.mesh, &file.findings.region_labels);
    let display = Surface::from_mesh(mesh).triangles;
    [
        write_msh41_labelled(mesh, labels),
        write_vtu_labelled(mesh, labels, &[]).unwrap(),
        write_thesis_lists_labelled(mesh, labels, &display).unwrap(),
    ]
}

proptest! {
    #[test]
    fn mended_files_have_nothing_to_mend_and_keep_numbers_and_regions(
        breaks in breaks(),
        labels in prop_oneof![Just([1, 2]), Just([-3, 4]), Just([0, 9])]
    ) {
        let file = read(broken(&breaks, labels)).unwrap();
        for bytes in mended(&file) {
            let again = read(bytes).unwrap();
            prop_assert_eq!(&again.findings.mending, &None);
            prop_assert_eq!(&again.mesh, &file.mesh);
            prop_assert_eq!(again.findings.orphans, file.findings.orphans);
            prop_assert_eq!(&again.findings.region_labels, &file.findings.region_labels);
        }
    }

    #[test]
    fn mending_accounts_for_every_record(breaks in breaks()) {
        let file = read(broken(&breaks, [1, 2])).unwrap();
        let findings = &file.findings;
        let dropped = findings.degenerate.len() + findings.repeated.len();
        prop_assert_eq!(file.mesh.tets().len() + dropped, findings.file_tets);
        let bad = findings.mending.as_ref().map_or(0, |mending| mending.bad.len());
        prop_assert_eq!(bad, dropped + findings.flipped.len());
        if let Some(mending) = &findings.mending {
            prop_assert!(mending.bad.is_sorted_by(|a, b| a.tet < b.tet));
            let whole = volume(&file.mesh);
            prop_assert!((mending.volume - whole).abs() <= 1e-12 * whole);
            let used = file.mesh.used_nodes();
            prop_assert!(mending.lost_nodes.iter().all(|&node| !used[node as usize]));
        }
        // No two elements of the mesh have the same corners.
        let mut corners: Vec<[u32; 4]> = file.mesh.tets().to_vec();
        corners.iter_mut().for_each(|tet| tet.sort_unstable());
        corners.sort_unstable();
        prop_assert!(corners.windows(2).all(|pair| pair[0] != pair[1]));
    }
}

#[test]
fn named_regions_keep_their_names_in_msh_and_their_parts_elsewhere() {
    let (points, tets) = cube();
    let mut file = read(medit(&points, &tets)).unwrap();
    file.findings.region_labels = vec!["left \"lung\"".to_owned(), "7".to_owned()];
    let [msh, vtu, txt] = mended(&file).map(|bytes| read(bytes).unwrap());
    assert_eq!(msh.findings.region_labels, ["left 'lung'", "7"]);
    for again in [&vtu, &txt] {
        assert_eq!(again.findings.region_labels, ["0", "1"]);
    }
    for again in [msh, vtu, txt] {
        assert_eq!(again.mesh, file.mesh);
    }
}
