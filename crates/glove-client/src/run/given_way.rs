//! The hand that is shown: where the object pushes it back to.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// Segments of a hand that gives way to forces. A joint moves as far as the segments on both sides of it,
/// and those before it, are pushed back, so that none stays inside the object; every segment turns so
/// that it still joins its two ends.
///
/// Shapes: `segments` world from segment, thumb first, from the palm outward, +Y along the bone; `ends`
/// the tip of each finger. Units: m. Frame: world.
pub fn given_way(
    segments: &[[Isometry3<f64>; 3]; 5],
    ends: &[Point3<f64>; 5],
    pushed_back: &[[Vector3<f64>; 3]; 5],
) -> [[Isometry3<f64>; 3]; 5] {
    std::array::from_fn(|digit| {
        let push = &pushed_back[digit];
        if push.iter().all(|p| *p == Vector3::zeros()) {
            return segments[digit];
        }
        let joint = |i: usize| Point3::from(segments[digit][i].translation.vector);
        let before = [joint(0), joint(1), joint(2), ends[digit]];
        // What pushes a segment moves both its ends and all beyond it.
        let after = [
            before[0] + push[0],
            before[1] + longest(&push[..2]),
            before[2] + longest(push),
            before[3] + longest(push),
        ];
        std::array::from_fn(|i| {
            let (old, new) = (before[i + 1] - before[i], after[i + 1] - after[i]);
            let turn = UnitQuaternion::rotation_between(&old, &new).unwrap_or_default();
            let rotation = turn * segments[digit][i].rotation;
            Isometry3::from_parts(Translation3::from(after[i].coords), rotation)
        })
    })
}

fn longest(pushes: &[Vector3<f64>]) -> Vector3<f64> {
    pushes.iter().copied().max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_default()
}
