//! Finds the contacts of a hand in a tick, by the sphere tree and by the peer.

use nalgebra::{Isometry3, Point3, Vector3};
use parry3d::bounding_volume::Aabb;
use softgrasp_grasp::grasp::{Grasp, sense};
use softgrasp_grasp::hand::{FingerColliders, HandColliders};
use softgrasp_grasp::shape::{Cylinder, Sphere};
use softgrasp_grasp::sphere_tree::{
    Closeness, SphereTree, cylinder_meets_sphere, sphere_meets_sphere, tip_hits,
};

use super::brute::Inside;
use super::peer::{Leaf, Peer, cylinder_box, sphere_box};

/// Contacts of one finger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Felt {
    /// Whether each segment contains a vertex, from the palm outward; the last counts its tip too.
    pub collide: [bool; 3],
    /// Whether no vertex is within the release margin and the tip touches no vertex.
    pub clear: bool,
    /// Vertex that the fingertip touches.
    pub contact: Option<u32>,
}

/// A surface as the exact tests need it.
///
/// Shapes: `points` and `normals` one per vertex. Units: m. Frame: the object's.
#[derive(Clone, Copy)]
pub(super) struct SurfaceOf<'a> {
    pub points: &'a [Point3<f64>],
    pub normals: &'a [Vector3<f64>],
    pub triangles: &'a [[u32; 3]],
}

/// Distance to a vertex below which a finger does not count as clear, m.
const MARGIN: f64 = Grasp::RELEASE_MARGIN_M;

/// Contacts of all fingers by the sphere tree: `sense`, as the grasp calls it.
pub(super) fn by_tree(
    tree: &SphereTree,
    surface: SurfaceOf<'_>,
    hand: &HandColliders,
) -> [Felt; 5] {
    sense(tree, surface.normals, hand, &Isometry3::identity(), MARGIN).map(|finger| Felt {
        collide: finger.segments_collide,
        clear: finger.clear,
        contact: finger.tip_hits[0].map(|hit| hit.node),
    })
}

/// Contacts of the five fingertips by the sphere tree: `tip_hits`.
pub(super) fn contacts_by_tree(
    tree: &SphereTree,
    surface: SurfaceOf<'_>,
    hand: &HandColliders,
) -> [Option<u32>; 5] {
    hand.fingers.map(|finger| {
        let hits = tip_hits(tree, surface.normals, &finger.tip, &finger.contact_point);
        hits[0].map(|hit| hit.node)
    })
}

/// Contacts of all fingers by the peer: its boxes find leaves, and the same exact tests decide.
pub(super) fn by_peer(peer: &Peer, surface: SurfaceOf<'_>, hand: &HandColliders) -> [Felt; 5] {
    hand.fingers.map(|finger| {
        let mut closeness =
            finger.cylinders.map(|cylinder| cylinder_closeness(peer, surface, &cylinder));
        closeness[2] = closeness[2].max(tip_closeness(peer, surface, &finger.tip));
        let contact = contact_by_peer(peer, surface, &finger);
        Felt {
            collide: closeness.map(|c| c == Closeness::Colliding),
            clear: closeness == [Closeness::Clear; 3] && contact.is_none(),
            contact,
        }
    })
}

/// Contacts of the five fingertips by the peer.
pub(super) fn contacts_by_peer(
    peer: &Peer,
    surface: SurfaceOf<'_>,
    hand: &HandColliders,
) -> [Option<u32>; 5] {
    hand.fingers.map(|finger| contact_by_peer(peer, surface, &finger))
}

/// Number of results that brute force contradicts: segments, and contacts that are certain.
pub(super) fn wrong(felt: &[Felt; 5], inside: &Inside) -> usize {
    let mut wrong = 0;
    for (finger, felt) in felt.iter().enumerate() {
        let segments = inside.collide(finger);
        wrong += segments.iter().zip(felt.collide).filter(|(right, got)| **right != *got).count();
        wrong += usize::from(segments.contains(&true) && felt.clear);
    }
    wrong + wrong_contacts(&felt.map(|felt| felt.contact), inside)
}

/// Number of certain contacts that were not found.
pub(super) fn wrong_contacts(found: &[Option<u32>; 5], inside: &Inside) -> usize {
    let both = inside.contacts.iter().zip(found);
    both.filter(|(right, got)| right.is_some() && right != got).count()
}

/// The nearest vertex in the tip, if the contact point is behind its tangent plane (4.10).
fn contact_by_peer(peer: &Peer, surface: SurfaceOf<'_>, finger: &FingerColliders) -> Option<u32> {
    let mut nearest: Option<(f64, u32)> = None;
    peer.visit(&sphere_box(&finger.tip, 0.0), |leaf| {
        for node in vertices(peer.leaf(), leaf, surface.triangles) {
            let point = surface.points[*node as usize];
            if sphere_meets_sphere(&finger.tip, &Sphere { centre: point, radius: 0.0 }) {
                let distance = (finger.contact_point - point).norm();
                if nearest.is_none_or(|best| (distance, *node) < best) {
                    nearest = Some((distance, *node));
                }
            }
        }
        false
    });
    let (_, node) = nearest?;
    let d = finger.contact_point - surface.points[node as usize];
    (d.dot(&surface.normals[node as usize]) <= 0.0).then_some(node)
}

fn cylinder_closeness(peer: &Peer, surface: SurfaceOf<'_>, cylinder: &Cylinder) -> Closeness {
    let aabb = cylinder_box(cylinder, MARGIN);
    closeness(peer, surface, &aabb, |sphere| cylinder_meets_sphere(cylinder, sphere))
}

fn tip_closeness(peer: &Peer, surface: SurfaceOf<'_>, tip: &Sphere) -> Closeness {
    let aabb = sphere_box(tip, MARGIN);
    closeness(peer, surface, &aabb, |sphere| sphere_meets_sphere(tip, sphere))
}

/// Closeness to a collider, as the sphere tree defines it: the first vertex inside ends the search.
fn closeness(
    peer: &Peer,
    surface: SurfaceOf<'_>,
    aabb: &Aabb,
    meets: impl Fn(&Sphere) -> bool,
) -> Closeness {
    let mut closest = Closeness::Clear;
    peer.visit(aabb, |leaf| {
        for node in vertices(peer.leaf(), leaf, surface.triangles) {
            let centre = surface.points[*node as usize];
            if meets(&Sphere { centre, radius: 0.0 }) {
                closest = Closeness::Colliding;
                return true;
            }
            if meets(&Sphere { centre, radius: MARGIN }) {
                closest = Closeness::Near;
            }
        }
        false
    });
    closest
}

/// Vertices of a leaf.
fn vertices<'a>(kind: Leaf, leaf: &'a u32, triangles: &'a [[u32; 3]]) -> &'a [u32] {
    match kind {
        Leaf::Vertex => std::slice::from_ref(leaf),
        Leaf::Triangle => &triangles[*leaf as usize],
    }
}
