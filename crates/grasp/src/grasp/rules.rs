//! The rules one by one: recall, leave, touch (thesis 4.5).

use nalgebra::Point3;

use super::event::GraspEvent;
use super::sense::FingerInput;
use super::state::{Contact, Hold};
use crate::hand::Finger;
use crate::sphere_tree::ContactHit;

/// How many segments of a finger are recalled, given how many were.
///
/// A colliding segment takes all segments between it and the palm with it. The tip's contact counts
/// as the distal segment's collision. The number only grows until the finger is clear of the object
/// by the margin: noise at the surface must not make the shown finger jump.
///
/// Source: thesis 4.5.3, Figure 4.23.
pub(super) fn recall(before: u8, finger: &FingerInput) -> u8 {
    match penetration(finger) {
        0 if finger.clear => 0,
        now => now.max(before),
    }
}

/// Whether no part of the finger is at or near the object.
pub(super) fn is_clear(finger: &FingerInput) -> bool {
    finger.clear && penetration(finger) == 0
}

/// Segments from the palm to the outermost one that penetrates.
fn penetration(finger: &FingerInput) -> u8 {
    let [proximal, middle, distal] = finger.segments_collide;
    match (distal || finger.tip_hits[0].is_some(), middle, proximal) {
        (true, _, _) => 3,
        (false, true, _) => 2,
        (false, false, true) => 1,
        (false, false, false) => 0,
    }
}

/// Whether a tip has moved outward along its contact's normal by more than the margin.
pub(super) fn has_left(contact: &Contact, tip_in_object: &Point3<f64>, margin: f64) -> bool {
    (tip_in_object - contact.tip_at_contact_in_object).dot(&contact.normal_in_object) > margin
}

/// Lets go of the contacts whose tips have moved out, and re-arms those seen outside since.
pub(super) fn leave(
    holds: &mut [Hold; 5],
    fingers: &[FingerInput; 5],
    margin: f64,
    events: &mut Vec<GraspEvent>,
) {
    for finger in Finger::ALL {
        let (hold, input) = (&mut holds[finger.index()], &fingers[finger.index()]);
        match hold {
            Hold::Held(contact) if has_left(contact, &input.tip_in_object, margin) => {
                *hold = Hold::Left;
                events.push(GraspEvent::TipLeft(finger));
            }
            Hold::Left if input.tip_hits[0].is_none() => *hold = Hold::Open,
            Hold::Open | Hold::Held(_) | Hold::Left => {}
        }
    }
}

/// Records contacts for the open fingers that `may_touch` and are inside the object.
///
/// No two fingers share a node: who holds it keeps it, then the finger nearer to its first choice
/// chooses first; another one takes its next nearest vertex, or is refused when none is left.
pub(super) fn touch(
    holds: &mut [Hold; 5],
    fingers: &[FingerInput; 5],
    may_touch: impl Fn(Finger) -> bool,
    events: &mut Vec<GraspEvent>,
) {
    let mut queue: Vec<(f64, Finger)> = Finger::ALL
        .into_iter()
        .filter(|f| holds[f.index()] == Hold::Open && may_touch(*f))
        .filter_map(|f| Some((fingers[f.index()].tip_hits[0]?.distance, f)))
        .collect();
    queue.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let first_new = events.len();
    for (_, finger) in queue {
        let input = &fingers[finger.index()];
        let is_free = |hit: &&ContactHit| {
            holds.iter().all(|hold| hold.contact().is_none_or(|c| c.node != hit.node))
        };
        if let Some(hit) = input.tip_hits.iter().flatten().find(is_free) {
            events.push(GraspEvent::TipTouched(finger, hit.node));
            holds[finger.index()] = Hold::Held(Contact {
                node: hit.node,
                tip_at_contact_in_object: input.tip_in_object,
                normal_in_object: hit.normal,
            });
        }
    }
    events[first_new..].sort_unstable();
}

/// Whether any, and whether all, of index, middle and ring finger are held.
pub(super) fn grip(holds: &[Hold; 5]) -> (bool, bool) {
    let mut attaching = Finger::ALL.into_iter().filter(|f| f.attaches());
    let held = |f: Finger| holds[f.index()].contact().is_some();
    (attaching.clone().any(held), attaching.all(held))
}
