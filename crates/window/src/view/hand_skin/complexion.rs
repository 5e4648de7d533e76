//! Colours of the skin: where each vertex looks into one small picture of skin tones.

use nalgebra::{Point3, Vector3};

use super::bind_pose::BindPose;
use super::palm_body::SLEEVE_MM;
use super::round_cone::smooth_intersection;
use crate::view::blend::{mix, smooth_step};
use crate::view::texture::Texture;

/// Across: sleeve up to here, then skin from pale to reddened.
const SLEEVE_EDGE: f64 = 0.15;
/// Plain skin, between sleeve and reddened skin.
const PLAIN: f64 = 0.35;
/// On the palm's side the fields between the creases are plain skin by turns here and at
/// [`PLAIN`], and half way between lies the line of the crease.
const OTHER_PLAIN: f64 = 0.20;
const CREASE: f64 = 0.5 * (PLAIN + OTHER_PLAIN);
/// Millimetres from a crease at which the plain skin begins.
const CREASE_REACH_MM: f64 = 6.0;
/// Down: from the palm's skin (0) to the back's (here), then the surroundings of the nail.
const BACK: f64 = 0.5;
/// Edge of the nail. The picture's coordinate is a distance there, so that the edge is sharp
/// although the triangles are larger than its width.
const NAIL_EDGE: f64 = 0.7;
/// Change of v for each millimetre into the nail.
const NAIL_PER_MM: f64 = 0.04;

const WIDTH: u32 = 1024;
const HEIGHT: u32 = 256;

/// Where vertices of a right hand in the bind pose look into [`skin_texture`].
pub(super) fn uvs(
    bind: &BindPose,
    places: &[Point3<f64>],
    normals: &[Vector3<f64>],
) -> Vec<[f32; 2]> {
    let uv = |(place, normal)| {
        let [u, v] = uv_at(bind, place, normal);
        [u as f32, v as f32]
    };
    places.iter().zip(normals).map(uv).collect()
}

fn uv_at(bind: &BindPose, place: &Point3<f64>, normal: &Vector3<f64>) -> [f64; 2] {
    let mm = bind.radius(1.0);
    let nearest = nearest_digit(bind, place);
    let mut redness: f64 = 0.0;
    let mut back = smooth_step(-0.5, 0.5, normal.z);
    let mut nail = f64::NEG_INFINITY;
    if let Some((digit, q)) = nearest {
        let frame = bind.palm_from_segment[digit][0];
        let out = frame.inverse() * normal;
        let on_finger = smooth_step(-10.0 * mm, 10.0 * mm, q.y);
        back += (smooth_step(-0.5, 0.5, out.z) - back) * on_finger;
        redness = digit_redness(bind, digit, &q, out.z);
        nail = nail_depth(bind, digit, &q, &out);
    }
    let above_sleeve = (place.y - bind.place(0.0, SLEEVE_MM, 0.0).y) / mm;
    let field = (crease_distance(bind, place, nearest) / (CREASE_REACH_MM * mm)).clamp(-1.0, 1.0);
    let plain = CREASE + 0.5 * (PLAIN - OTHER_PLAIN) * field;
    let u_skin = plain + (1.0 - PLAIN) * redness.clamp(0.0, 1.0);
    let u = u_skin.min((SLEEVE_EDGE + 0.03 * above_sleeve).max(0.0));
    let v = (BACK * back).max((NAIL_EDGE + NAIL_PER_MM * nail / mm).min(1.0));
    // Half a pixel from the borders, so that no filter mixes in the opposite one.
    [u, v].map(|x| x.clamp(0.003, 0.997))
}

/// The digit whose axis is nearest, and the place in the frame of its first segment.
fn nearest_digit(bind: &BindPose, place: &Point3<f64>) -> Option<(usize, Point3<f64>)> {
    let reach = bind.radius(19.0);
    (0..5)
        .map(|digit| {
            let q = bind.palm_from_segment[digit][0].inverse() * place;
            let length: f64 = bind.dimensions.segment_lengths()[digit].iter().sum();
            let below = if digit == 0 { 0.0 } else { -bind.radius(25.0) };
            let off = q - Point3::new(0.0, q.y.clamp(below, length), 0.0);
            (off.norm(), digit, q)
        })
        .filter(|(off, ..)| *off < reach)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, digit, q)| (digit, q))
}

/// Distance to the nearest crease of the palm's side: positive on the ball of the thumb, on the
/// fingers' first and on all last segments, negative on the fields between them.
fn crease_distance(
    bind: &BindPose,
    place: &Point3<f64>,
    nearest: Option<(usize, Point3<f64>)>,
) -> f64 {
    // The line around the thumb's ball, an oval seen from the palm, bends away at the wrist.
    let from_centre = place - bind.place(-40.0, 38.0, 0.0);
    let oval = from_centre.x.hypot(0.8 * from_centre.y) - bind.radius(37.0);
    let below_wrist = bind.place(0.0, -6.0, 0.0).y - place.y;
    let ball = -smooth_intersection(oval, below_wrist, bind.radius(30.0));
    let Some((digit, q)) = nearest else { return ball };
    let [first, second, _] = bind.dimensions.segment_lengths()[digit];
    let last_joint = first + second;
    if q.y > first + 0.5 * second {
        return q.y - last_joint;
    }
    let before_first = first - q.y;
    if digit == 0 {
        return ball.min(before_first);
    }
    // A finger begins for the eye where the web ends.
    let beyond_web = q.y - 0.44 * first;
    ball.max(beyond_web.min(before_first))
}

/// Redness 0 to 1: fingertips, and the backs of the joints.
fn digit_redness(bind: &BindPose, digit: usize, q: &Point3<f64>, out: f64) -> f64 {
    let mm = bind.radius(1.0);
    let [first, second, third] = bind.dimensions.segment_lengths()[digit];
    let bump = |joint: f64, width: f64| (-((q.y - joint) / (width * mm)).powi(2)).exp();
    let joints = if digit == 0 {
        0.2 * bump(first, 9.0) + 0.45 * bump(first + second, 6.0)
    } else {
        0.4 * bump(-2.0 * mm, 9.0) + 0.55 * bump(first, 6.5) + 0.4 * bump(first + second, 5.0)
    };
    let dorsal = smooth_step(0.0, 0.9, out);
    let tip = smooth_step(first + second + 0.1 * third, first + second + third, q.y);
    joints * dorsal + 0.9 * tip
}

/// How far a place lies within the outline of the nail, seen from the back; negative outside.
fn nail_depth(bind: &BindPose, digit: usize, q: &Point3<f64>, out: &Vector3<f64>) -> f64 {
    let lengths = bind.dimensions.segment_lengths()[digit];
    let radius = bind.dimensions.tip_radii()[digit];
    let end: f64 = lengths.iter().sum();
    let (half_width, half_length) = (0.74 * radius, 0.98 * radius);
    let middle = end - 0.06 * radius - half_length;
    let corner = 0.62 * half_width;
    // A rectangle with round corners.
    let over = |x: f64, half: f64| x.abs() - half + corner;
    let (x, y) = (over(q.x, half_width), over(q.y - middle, half_length));
    let outside = x.max(0.0).hypot(y.max(0.0)) + x.max(y).min(0.0) - corner;
    // Only where the skin looks backward; steeply away from there, down to the palm's colours.
    (-outside).min(3.0 * radius * (out.z - 0.25)).min(3.0 * q.z)
}

/// The picture of skin tones.
pub(super) fn skin_texture() -> Texture {
    Texture::painted(WIDTH, HEIGHT, |u, v| colour(u, v).map(|c| c / 255.0))
}

type Rgb = [f64; 3];

const SLEEVE: Rgb = [52.0, 70.0, 98.0];
const PALM_PALE: Rgb = [238.0, 190.0, 163.0];
const PALM_RED: Rgb = [236.0, 170.0, 146.0];
const CREASE_SHADE: Rgb = [196.0, 128.0, 106.0];
const BACK_PALE: Rgb = [224.0, 170.0, 138.0];
const BACK_RED: Rgb = [214.0, 138.0, 110.0];
const NAIL: Rgb = [236.0, 178.0, 162.0];
const NAIL_TIP: Rgb = [248.0, 228.0, 214.0];

fn colour(u: f64, v: f64) -> Rgb {
    let redness = ((u - PLAIN) / (1.0 - PLAIN)).clamp(0.0, 1.0);
    let palm = mix(PALM_PALE, PALM_RED, redness);
    let back = mix(BACK_PALE, BACK_RED, redness);
    // Soft, a millimetre and a half wide, on the palm's side only.
    let crease_mm = (u - CREASE) / (PLAIN - CREASE) * CREASE_REACH_MM;
    let line = 0.42 * (-(crease_mm / 0.85).powi(2)).exp() * smooth_step(0.14, 0.0, v);
    let palm = mix(palm, CREASE_SHADE, line);
    let skin = mix(palm, back, smooth_step(0.0, BACK, v));
    let nail_mm = (v - NAIL_EDGE) / NAIL_PER_MM;
    let nail = mix(NAIL, NAIL_TIP, smooth_step(0.912, 0.928, u));
    // The skin around the nail is a little redder, its edge a little darker.
    let around = mix(skin, BACK_RED, 0.5 * smooth_step(-2.5, -0.2, nail_mm));
    let hand = mix(around, nail, smooth_step(-0.15, 0.25, nail_mm));
    let edge = 1.0 - 0.16 * (-(nail_mm / 0.35).powi(2)).exp();
    let hand = hand.map(|c| c * edge);
    mix(SLEEVE, hand, smooth_step(SLEEVE_EDGE - 0.012, SLEEVE_EDGE, u))
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_grasp::hand::HandDimensions;

    fn colour_at(place: Point3<f64>, normal: Vector3<f64>) -> Rgb {
        let [u, v] = uv_at(&BindPose::right(&HandDimensions::default()), &place, &normal);
        colour(u, v)
    }

    #[test]
    fn nails_are_on_the_backs_of_the_fingertips_only() {
        let bind = BindPose::right(&HandDimensions::default());
        for digit in 0..5 {
            let frame = bind.palm_from_segment[digit][2];
            let (length, radius) =
                (bind.dimensions.segment_lengths()[digit][2], bind.dimensions.tip_radii()[digit]);
            let v_of = |side: f64| {
                let place = frame * Point3::new(0.0, length - radius, side * radius);
                uv_at(&bind, &place, &(frame * Vector3::new(0.0, 0.0, side)))[1]
            };
            assert!(v_of(1.0) > NAIL_EDGE && v_of(-1.0) < 0.2 * BACK, "{digit}");
        }
    }

    #[test]
    fn palm_is_paler_than_the_back_and_the_sleeve_is_cloth() {
        let brightness = |c: Rgb| c.iter().sum::<f64>();
        let palm = colour_at(Point3::new(0.01, 0.04, -0.014), -Vector3::z());
        let back = colour_at(Point3::new(0.01, 0.04, 0.01), Vector3::z());
        assert!(brightness(palm) > brightness(back));
        assert_eq!(colour_at(Point3::new(0.0, -0.05, 0.03), Vector3::z()), SLEEVE);
    }

    #[test]
    fn picture_is_opaque_and_full() {
        let picture = skin_texture();
        assert_eq!(picture.rgba.len(), (picture.width * picture.height * 4) as usize);
        assert!(picture.rgba.chunks(4).all(|pixel| pixel[3] == 255));
    }
}
