//! The palm as a solid: wrist, metacarpals, pads, the ball of the thumb, the webs, the sleeve.

use nalgebra::{Isometry3, Point3};

use super::bind_pose::BindPose;
use super::loft::{Loft, Section};
use super::round_cone::{RoundCone, Sheet, smooth_intersection, smooth_union};

/// Where the sleeve begins, mm before the wrist crease of the default hand.
pub(super) const SLEEVE_MM: f64 = -30.0;
/// Where the sleeve is cut, likewise.
pub(super) const CUT_MM: f64 = -72.0;

/// Everything that is not a finger or the thumb beyond its metacarpal.
///
/// Units: m. Frame: palm of a right hand in the bind pose.
#[derive(Clone, Debug)]
pub(super) struct PalmBody {
    wrist: Loft,
    metacarpals: [RoundCone; 4],
    pads: Vec<RoundCone>,
    webs: [RoundCone; 3],
    thenar: [RoundCone; 2],
    thumb_web: Sheet,
    sleeve: Loft,
    cut_y: f64,
    fillet: f64,
}

impl PalmBody {
    /// The palm of a right hand.
    pub fn new(bind: &BindPose) -> Self {
        Self {
            wrist: wrist(bind),
            metacarpals: [1, 2, 3, 4].map(|digit| metacarpal(bind, digit)),
            pads: pads(bind),
            webs: [1, 2, 3].map(|digit| web(bind, digit)),
            thenar: thenar(bind),
            thumb_web: thumb_web(bind),
            sleeve: sleeve(bind),
            cut_y: bind.place(0.0, CUT_MM, 0.0).y,
            fillet: bind.radius(1.0),
        }
    }

    /// Signed distance to all of the palm but the sleeve.
    pub fn distance(&self, p: &Point3<f64>) -> f64 {
        let mm = self.fillet;
        let thumb = smooth_union(self.thenar_distance(p), self.thumb_web.distance(p), 9.0 * mm);
        let palm = smooth_union(self.metacarpal_distance(p), thumb, 9.0 * mm);
        let webs = self.webs.iter().map(|web| web.distance(p)).fold(f64::INFINITY, f64::min);
        smooth_union(palm, webs, 7.0 * mm)
    }

    /// Signed distance to wrist, metacarpals and pads.
    pub fn metacarpal_distance(&self, p: &Point3<f64>) -> f64 {
        let mm = self.fillet;
        let mut nearest = self.wrist.distance(p);
        for cone in &self.metacarpals {
            nearest = smooth_union(nearest, cone.distance(p), 13.0 * mm);
        }
        for cone in &self.pads {
            nearest = smooth_union(nearest, cone.distance(p), 9.0 * mm);
        }
        nearest
    }

    /// Signed distance to the ball of the thumb.
    pub fn thenar_distance(&self, p: &Point3<f64>) -> f64 {
        let [bone, ball] = &self.thenar;
        smooth_union(bone.distance(p), ball.distance(p), 8.0 * self.fillet)
    }

    /// Signed distance to the sleeve, cut flat at its lower end.
    pub fn sleeve_distance(&self, p: &Point3<f64>) -> f64 {
        let mm = self.fillet;
        smooth_intersection(self.sleeve.distance(p), self.cut_y - p.y, 5.0 * mm)
    }
}

/// Frame of wrist and sleeve: the middle of the arm lies a little below the palm's plane.
fn palm_from_arm(bind: &BindPose) -> Isometry3<f64> {
    let middle = bind.place(2.0, 0.0, -4.0);
    Isometry3::translation(middle.x, middle.y, middle.z)
}

/// Sections of the arm in mm of the default hand: place, half width, dorsal, palmar.
fn arm(bind: &BindPose, table: &[[f64; 4]], ends_mm: [f64; 2]) -> Loft {
    let [across, along] = bind.scales().map(|scale| 1e-3 * scale);
    let sections = table
        .iter()
        .map(|&[y, half_width, dorsal, palmar]| Section {
            along: y * along,
            half_width: half_width * across,
            dorsal: dorsal * across,
            palmar: palmar * across,
        })
        .collect();
    Loft::new(&palm_from_arm(bind), sections, ends_mm.map(|mm| mm * along))
}

fn wrist(bind: &BindPose) -> Loft {
    let table = [
        [-60.0, 30.5, 21.0, 23.0],
        [-30.0, 29.5, 19.5, 21.0],
        [-8.0, 29.5, 17.5, 19.0],
        [12.0, 30.5, 14.0, 16.5],
    ];
    arm(bind, &table, [8.0, 34.0])
}

fn sleeve(bind: &BindPose) -> Loft {
    let table = [
        [-90.0, 37.0, 28.5, 30.5],
        [-60.0, 35.0, 26.5, 28.5],
        [SLEEVE_MM - 10.0, 34.0, 25.0, 27.0],
    ];
    arm(bind, &table, [20.0, 15.0])
}

/// A finger's metacarpal with the flesh on the back of the hand.
fn metacarpal(bind: &BindPose, digit: usize) -> RoundCone {
    let knuckle = bind.root(digit);
    let radius = bind.dimensions.fingers[digit - 1].radii[0];
    let carpus_x_mm = [-13.0, -4.0, 6.0, 15.0][digit - 1];
    RoundCone {
        ends: [bind.place(carpus_x_mm, 10.0, -2.5), knuckle + bind.place(0.0, -3.0, -1.5).coords],
        radii: [bind.radius(11.5), radius * 1.02],
    }
}

/// Flesh on the palm's side: under each knuckle, and at the little finger's edge.
fn pads(bind: &BindPose) -> Vec<RoundCone> {
    let under_knuckle = |digit: usize| {
        let knuckle = bind.root(digit);
        let start_x_mm = [-12.0, -3.0, 7.0, 17.0][digit - 1];
        let radius = bind.dimensions.fingers[digit - 1].radii[0];
        RoundCone {
            ends: [bind.place(start_x_mm, 34.0, -4.0), knuckle + bind.place(0.0, 6.0, -5.5).coords],
            radii: [bind.radius(8.0), radius * 0.95],
        }
    };
    let edge = RoundCone {
        ends: [bind.place(23.0, 15.0, -9.0), bind.place(33.5, 54.0, -5.5)],
        radii: [bind.radius(13.0), bind.radius(10.5)],
    };
    [1, 2, 3, 4].map(under_knuckle).into_iter().chain([edge]).collect()
}

/// The fold between a finger and the next one, at two fifths of their first segments.
fn web(bind: &BindPose, digit: usize) -> RoundCone {
    let at = |digit: usize| {
        let length = bind.dimensions.fingers[digit - 1].lengths[0];
        let in_segment = Point3::new(0.0, 0.30 * length, 0.0) - bind.place(0.0, 0.0, 3.5);
        bind.palm_from_segment[digit][0] * Point3::from(in_segment)
    };
    RoundCone { ends: [at(digit), at(digit + 1)], radii: [bind.radius(5.5); 2] }
}

/// The thumb's metacarpal and the muscle on its palm side.
fn thenar(bind: &BindPose) -> [RoundCone; 2] {
    let thumb = &bind.dimensions.thumb;
    let [lower, upper] = [thumb.radii[0], thumb.radii[1]];
    let on_bone = |share: f64, x_mm: f64, z_mm: f64| {
        let shift = bind.place(x_mm, 0.0, z_mm).coords;
        bind.palm_from_segment[0][0] * (Point3::new(0.0, share * thumb.lengths[0], 0.0) + shift)
    };
    let bone = RoundCone {
        ends: [on_bone(0.08, 3.0, -1.0), on_bone(1.0, 0.0, 0.0)],
        radii: [lower * 0.64, upper * 0.74],
    };
    let ball = RoundCone {
        ends: [on_bone(0.2, 8.0, -7.5), on_bone(0.64, 3.0, -6.5)],
        radii: [lower * 0.72, lower * 0.62],
    };
    [bone, ball]
}

/// The skin between thumb and index finger.
fn thumb_web(bind: &BindPose) -> Sheet {
    let thumb = &bind.dimensions.thumb;
    let on_thumb = Point3::new(0.0, 0.80 * thumb.lengths[0], 0.0);
    let root = bind.root(1);
    let wrist = bind.place(-14.0, 22.0, -6.0);
    Sheet {
        corners: [
            wrist,
            bind.palm_from_segment[0][0] * on_thumb,
            root + (wrist - root) * 0.25 - bind.place(0.0, 0.0, 3.0).coords,
        ],
        radius: bind.radius(5.0),
    }
}
