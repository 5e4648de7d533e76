//! Tests of messages to a page: read back byte by byte as `docs/xr.md` says.

use std::sync::Arc;

use super::*;
use crate::picture::{HandMesh, ObjectMesh};
use crate::quantised::QuantisedBox;

/// Length of a picture's message before the parts of varying length, bytes.
const PICTURE_HEAD: usize = 96;

fn picture(numbers: Vec<[u16; 3]>, shares: Vec<u8>) -> Picture {
    Picture {
        tick: 70_000,
        object: Arc::new(ObjectMesh { version: 5, message: Vec::new() }),
        hands: [None, None],
        record: Some(9),
        world_from_object: [0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0],
        ground_y: -0.03,
        capsules: vec![[1.0; 8]],
        space: QuantisedBox { origin: [-1.0, -2.0, -3.0], step: 1e-5, error: 6e-6 },
        normals: vec![[7, -7]; numbers.len()],
        numbers,
        shares,
        status: "".into(),
    }
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

#[test]
fn first_picture_has_every_vertex_at_the_documented_places() {
    let first = picture(vec![[1, 2, 3], [65_535, 5, 6]], vec![0, 255]);
    let bytes = picture_message(&first, None, 3, 12.5);
    assert_eq!((bytes[0], bytes[1]), (PICTURE, COLOURED | WHOLE));
    assert_eq!(u16::from_le_bytes([bytes[2], bytes[3]]), 1, "capsules");
    assert_eq!([4, 8, 12].map(|at| u32_at(&bytes, at)), [3, 5, 0], "number, object, hand");
    assert_eq!(u64::from_le_bytes(bytes[16..24].try_into().unwrap()), 70_000);
    assert_eq!(f64::from_le_bytes(bytes[24..32].try_into().unwrap()), 12.5);
    assert_eq!((u32_at(&bytes, 32), f32_at(&bytes, 36)), (9, -0.03));
    assert_eq!((f32_at(&bytes, 40), f32_at(&bytes, 64)), (0.1, 1.0), "pose");
    assert_eq!([68, 80, 84].map(|at| f32_at(&bytes, at)), [-1.0, 1e-5, 6e-6], "box");
    assert_eq!([88, 92].map(|at| u32_at(&bytes, at)), [1, 2], "runs, vertices");
    let runs = PICTURE_HEAD + 32;
    assert_eq!([runs, runs + 4].map(|at| u32_at(&bytes, at)), [0, 2]);
    let places = runs + 8;
    assert_eq!(bytes[places..places + 8], [1, 0, 2, 0, 3, 0, 255, 255]);
    let normals = places + 12;
    assert_eq!(bytes[normals..normals + 4], [7, 0, 249, 255]);
    assert_eq!(bytes[normals + 8..], [0, 255], "shares end the message");
}

#[test]
fn second_hand_comes_after_the_first_with_its_own_version_and_alone_where_the_first_is_lost() {
    let hand = |version: u32, number: f32| {
        let mesh = Arc::new(HandMesh { version, message: Vec::new() });
        Some((mesh, [[number; 8]; BONE_COUNT]))
    };
    let bones = 4 * 8 * BONE_COUNT;
    let mut both = picture(Vec::new(), vec![]);
    both.hands = [hand(6, 0.25), hand(7, 0.75)];
    let bytes = picture_message(&both, None, 3, 12.5);
    assert_eq!(bytes[1] & (WITH_HAND | WITH_SECOND_HAND), WITH_HAND | WITH_SECOND_HAND);
    assert_eq!((u32_at(&bytes, 12), f32_at(&bytes, PICTURE_HEAD)), (6, 0.25));
    let second = PICTURE_HEAD + bones;
    assert_eq!((u32_at(&bytes, second), f32_at(&bytes, second + 4)), (7, 0.75));
    assert_eq!(f32_at(&bytes, second + bones), 0.75, "its last number");
    assert_eq!(f32_at(&bytes, second + 4 + bones), 1.0, "then the capsules");
    both.hands[0] = None;
    let bytes = picture_message(&both, None, 3, 12.5);
    assert_eq!(bytes[1] & (WITH_HAND | WITH_SECOND_HAND), WITH_SECOND_HAND);
    assert_eq!((u32_at(&bytes, 12), u32_at(&bytes, PICTURE_HEAD)), (0, 7));
}

#[test]
fn later_picture_has_only_the_vertices_that_differ() {
    let before = picture(vec![[1; 3], [2; 3], [3; 3], [4; 3], [5; 3]], vec![]);
    let same = picture_message(&before, Some(&before), 1, f64::NAN);
    assert_eq!(same.len(), PICTURE_HEAD + 32, "nothing has moved");
    let mut after = picture(before.numbers.clone(), vec![]);
    (after.numbers[1], after.numbers[2], after.normals[4]) = ([9; 3], [8; 3], [0, 0]);
    let bytes = picture_message(&after, Some(&before), 2, f64::NAN);
    assert_eq!(bytes[1] & WHOLE, 0);
    assert_eq!([88, 92].map(|at| u32_at(&bytes, at)), [2, 3], "runs, vertices");
    let runs = PICTURE_HEAD + 32;
    assert_eq!([0, 4, 8, 12].map(|at| u32_at(&bytes, runs + at)), [1, 2, 4, 1]);
    assert_eq!(bytes.len(), runs + 16 + 3 * 10);
}

#[test]
fn picture_in_another_box_or_with_other_colours_comes_whole() {
    let before = picture(vec![[1; 3], [2; 3]], vec![]);
    let coloured = picture(before.numbers.clone(), vec![1, 2]);
    let mut moved = picture(before.numbers.clone(), vec![]);
    moved.space.step = 2e-5;
    for other in [coloured, moved] {
        let bytes = picture_message(&other, Some(&before), 2, f64::NAN);
        assert_eq!((bytes[1] & WHOLE, u32_at(&bytes, 92)), (WHOLE, 2));
    }
}

#[test]
fn object_has_its_parts_then_uvs_then_triangles() {
    let part = ObjectPart {
        first_triangle: 0,
        triangles: 1,
        colour: [0.1, 0.2, 0.3],
        roughness: 0.4,
        metallic: 0.5,
        clearcoat: (0.6, 0.7),
        subsurface: 0.8,
        texture: 11,
        relief: 12,
        two_sided: true,
    };
    let bytes = object_message(4, &[part], &[[0.0, 1.0]; 3], &[[0, 1, 2]]);
    assert_eq!((bytes[0], u32_at(&bytes, 4)), (OBJECT, 4));
    assert_eq!([8, 12, 16].map(|at| u32_at(&bytes, at)), [3, 1, 1]);
    let floats: [f32; 8] = std::array::from_fn(|i| f32_at(&bytes, 28 + 4 * i));
    assert_eq!(floats, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]);
    assert_eq!([60, 64, 68].map(|at| u32_at(&bytes, at)), [11, 12, 1]);
    assert_eq!(f32_at(&bytes, 76), 1.0);
    assert_eq!(bytes.len(), 72 + 24 + 12);
    assert_eq!(u32_at(&bytes, 72 + 24 + 8), 2);
}
