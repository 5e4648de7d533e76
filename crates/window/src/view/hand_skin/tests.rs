//! Tests of the whole skin: closed, outward, near the colliders, mirrored.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use softgrasp_grasp::hand::{FingerPose, HandDimensions, HandPose, Handedness, JointAngles, pose};

use super::bind_pose::bind_angles;
use super::round_cone::Sheet;
use super::skin::HandSkin;

/// A man's, a woman's and a child's hand, and a short, broad one.
const SIZES: [(f64, f64); 4] = [(0.185, 0.084), (0.166, 0.075), (0.13, 0.06), (0.16, 0.1)];

fn segments(hand: &HandPose) -> [[Isometry3<f64>; 3]; 5] {
    hand.fingers.map(|f| f.segments.map(|s| s.world_from_segment))
}

/// Vertices and normals of a skin in a pose.
fn posed(
    skin: &HandSkin,
    dimensions: &HandDimensions,
    angles: &JointAngles,
    world_from_palm: Isometry3<f64>,
) -> (Vec<Point3<f64>>, Vec<Vector3<f64>>) {
    let hand = pose(dimensions, angles, world_from_palm);
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    skin.pose(&world_from_palm, &segments(&hand), &mut positions, &mut normals);
    let wide = |v: &[f32; 3]| v.map(f64::from);
    (
        positions.iter().map(|p| Point3::from(wide(p))).collect(),
        normals.iter().map(|n| Vector3::from(wide(n))).collect(),
    )
}

/// Enclosed volume, m³, positive if the triangles look outward.
fn volume(skin: &HandSkin, places: &[Point3<f64>]) -> f64 {
    let corner = |i: u32| places[i as usize].coords;
    let cone = |t: &[u32; 3]| corner(t[0]).cross(&corner(t[1])).dot(&corner(t[2])) / 6.0;
    skin.triangles().iter().map(cone).sum()
}

/// Triangles of one fingertip: those within two radii of its centre in the bind pose. The others
/// may pass anywhere, because a hand's parts can be bent into each other.
fn tip_triangles(skin: &HandSkin, dimensions: &HandDimensions, digit: usize) -> Vec<[u32; 3]> {
    let bind = pose(dimensions, &bind_angles(), Isometry3::identity());
    let (centre, reach) = (bind.fingers[digit].tip_centre, 2.0 * dimensions.tip_radii()[digit]);
    let is_near = |i: &u32| (skin.places[*i as usize] - centre.coords).norm() < reach;
    skin.triangles().iter().copied().filter(|t| t.iter().all(is_near)).collect()
}

/// Distance to the nearest of some triangles, positive outside: the sum of the solid angles
/// under which they are seen tells, as long as they leave less than half of the sky open.
fn signed_distance(triangles: &[[u32; 3]], places: &[Point3<f64>], p: &Point3<f64>) -> f64 {
    let (mut nearest, mut angle) = (f64::INFINITY, 0.0);
    for triangle in triangles {
        let corners = triangle.map(|i| places[i as usize]);
        nearest = nearest.min(Sheet { corners, radius: 0.0 }.distance(p));
        let [a, b, c] = corners.map(|corner| corner - p);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        angle += 2.0 * a.dot(&b.cross(&c)).atan2(below);
    }
    if angle > 2.0 * std::f64::consts::PI { -nearest } else { nearest }
}

/// Joint angles that a hand can take.
fn any_angles() -> impl Strategy<Value = JointAngles> {
    prop::array::uniform23(0.0..1.0f64).prop_map(|shares| {
        let mut angles = JointAngles::from_array(&shares.map(|share| -0.2 + 1.7 * share));
        let [.., arch, _, _] = shares;
        angles.palm_arch = 0.4 * arch;
        angles.thumb.abduction = 0.6 * shares[3] - 0.3;
        for (finger, slot) in [
            (&mut angles.index, 7),
            (&mut angles.middle, 11),
            (&mut angles.ring, 15),
            (&mut angles.little, 19),
        ] {
            finger.abduction = 0.5 * shares[slot] - 0.25;
        }
        angles
    })
}

#[test]
fn skin_is_closed_and_looks_outward_for_hands_of_all_sizes() {
    for (length, breadth) in SIZES {
        let dimensions = HandDimensions::scaled(length, breadth).unwrap();
        let skin = HandSkin::new(&dimensions);
        let mut edges = BTreeMap::new();
        for t in skin.triangles() {
            for i in 0..3 {
                *edges.entry((t[i], t[(i + 1) % 3])).or_insert(0) += 1;
            }
        }
        for (&(from, to), &count) in &edges {
            assert_eq!((count, edges.get(&(to, from))), (1, Some(&1)), "{length} × {breadth}");
        }
        let (places, normals) =
            posed(&skin, &dimensions, &JointAngles::flat(), Isometry3::identity());
        assert_eq!(skin.uvs().len(), places.len());
        // A hand with a short sleeve fills about a tenth of length · breadth · length.
        let share = volume(&skin, &places) / (length * length * breadth);
        assert!((0.1..0.4).contains(&share), "{share}");
        assert!(normals.iter().all(|n| (n.norm() - 1.0).abs() < 1e-5));
    }
}

#[test]
fn bind_pose_gives_back_the_surface_with_its_own_normals() {
    let dimensions = HandDimensions::default();
    let skin = HandSkin::new(&dimensions);
    let (places, normals) = posed(&skin, &dimensions, &bind_angles(), Isometry3::identity());
    for ((place, normal), (kept, kept_normal)) in
        places.iter().zip(&normals).zip(skin.places.iter().zip(&skin.normals))
    {
        assert!((place.coords - kept).norm() < 1e-7);
        assert!((normal - kept_normal).norm() < 1e-6);
    }
    // The triangles look where the normals look.
    let agreeing = skin.triangles().iter().filter(|t| {
        let [a, b, c] = t.map(|i| places[i as usize]);
        (b - a).cross(&(c - a)).dot(&normals[t[0] as usize]) > 0.0
    });
    assert!(agreeing.count() * 1000 > skin.triangles().len() * 998);
}

#[test]
fn left_skin_is_the_mirror_image_of_the_right_one() {
    let right = HandDimensions::default();
    let left = right.with_handedness(Handedness::Left);
    let angles = JointAngles::flat().lerp(&JointAngles::fist(), 0.6);
    let skins = [right, left].map(|dimensions| HandSkin::new(&dimensions));
    let (r, rn) = posed(&skins[0], &right, &angles, Isometry3::identity());
    let (l, ln) = posed(&skins[1], &left, &angles, Isometry3::identity());
    let mirror = Vector3::new(-1.0, 1.0, 1.0);
    for i in 0..r.len() {
        assert!((r[i].coords.component_mul(&mirror) - l[i].coords).norm() < 1e-6);
        assert!((rn[i].component_mul(&mirror) - ln[i]).norm() < 1e-5);
    }
    let volumes = [volume(&skins[0], &r), volume(&skins[1], &l)];
    assert!(volumes[1] > 0.0 && (volumes[0] / volumes[1] - 1.0).abs() < 1e-4);
}

#[test]
fn moving_palm_and_segments_together_moves_the_skin() {
    let dimensions = HandDimensions::default();
    let skin = HandSkin::new(&dimensions);
    let angles = JointAngles::fist();
    let motion = Isometry3::new(Vector3::new(0.3, -0.2, 0.5), Vector3::new(0.4, 2.0, -1.0));
    let (here, here_normals) = posed(&skin, &dimensions, &angles, Isometry3::identity());
    let (there, there_normals) = posed(&skin, &dimensions, &angles, motion);
    for i in 0..here.len() {
        assert!((motion * here[i] - there[i]).norm() < 1e-6);
        assert!((motion * here_normals[i] - there_normals[i]).norm() < 1e-5);
    }
}

#[test]
fn bending_keeps_the_volume_of_a_hand() {
    let dimensions = HandDimensions::default();
    let skin = HandSkin::new(&dimensions);
    let of = |angles| volume(&skin, &posed(&skin, &dimensions, &angles, Isometry3::identity()).0);
    let flat = of(JointAngles::flat());
    for share in [0.3, 0.6, 1.0] {
        let bent = of(JointAngles::flat().lerp(&JointAngles::fist(), share));
        // The inner side of a joint loses a little.
        assert!((bent / flat - 1.0).abs() < 0.05, "{share}: {}", bent / flat);
    }
}

/// Distances of contact point and tip centre from the skin of one fingertip, both 0 where the
/// skin is the model's fingertip ball.
fn tip_errors(
    tip: &[[u32; 3]],
    places: &[Point3<f64>],
    finger: &FingerPose,
    radius: f64,
) -> [f64; 2] {
    let at_contact = signed_distance(tip, places, &finger.contact_point);
    let depth = -signed_distance(tip, places, &finger.tip_centre);
    [at_contact, depth - radius]
}

#[test]
fn visible_fingertips_touch_where_the_model_touches() {
    for (length, breadth) in SIZES {
        let dimensions = HandDimensions::scaled(length, breadth).unwrap();
        let skin = HandSkin::new(&dimensions);
        let tips = [0, 1, 2, 3, 4].map(|digit| tip_triangles(&skin, &dimensions, digit));
        let radii = dimensions.tip_radii();
        // 1.5 mm on the default hand.
        let tolerance = 0.0015 * breadth / 0.084;
        let mut runner = TestRunner::new(ProptestConfig::with_cases(12));
        let outcome = runner.run(&any_angles(), |angles| {
            let hand = pose(&dimensions, &angles, Isometry3::identity());
            let (places, _) = posed(&skin, &dimensions, &angles, Isometry3::identity());
            for (digit, finger) in hand.fingers.iter().enumerate() {
                let errors = tip_errors(&tips[digit], &places, finger, radii[digit]);
                prop_assert!(
                    errors.iter().all(|error| error.abs() < tolerance),
                    "{}: {errors:?}",
                    finger.finger
                );
            }
            Ok(())
        });
        outcome.unwrap();
    }
}
