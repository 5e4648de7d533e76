//! Letters made of pen strokes: lines and arcs, one small letter high.

use std::f64::consts::TAU;

/// A stroke of the pen. Units: heights of a small letter; the base line is at 0.
enum Stroke {
    /// From one point to another.
    Line([f64; 2], [f64; 2]),
    /// Centre, radius, and the angles in degrees between which it runs counter-clockwise.
    Arc([f64; 2], f64, [f64; 2]),
}

/// Distance from a point to the lettering of a word that begins at (0, 0).
///
/// Letters without strokes here are left blank. Units: heights of a small letter.
pub(super) fn distance_to_word(word: &str, [x, y]: [f64; 2]) -> f64 {
    let mut left = 0.0;
    let mut nearest = f64::INFINITY;
    for letter in word.chars() {
        let (width, strokes) = strokes_of(letter);
        if (-1.0..width + 1.0).contains(&(x - left)) {
            let point = [x - left, y];
            nearest = strokes.iter().map(|s| s.distance(point)).fold(nearest, f64::min);
        }
        left += width + GAP;
    }
    nearest
}

/// Length of a word. Units: heights of a small letter.
pub(super) fn word_width(word: &str) -> f64 {
    let widths: f64 = word.chars().map(|letter| strokes_of(letter).0 + GAP).sum();
    (widths - GAP).max(0.0)
}

impl Stroke {
    fn distance(&self, [x, y]: [f64; 2]) -> f64 {
        match *self {
            Self::Line([ax, ay], [bx, by]) => {
                let (dx, dy) = (bx - ax, by - ay);
                let along = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy);
                let t = along.clamp(0.0, 1.0);
                (x - ax - t * dx).hypot(y - ay - t * dy)
            }
            Self::Arc([cx, cy], radius, [from, to]) => {
                let (from, to) = (from.to_radians(), to.to_radians());
                let turned = ((y - cy).atan2(x - cx) - from).rem_euclid(TAU);
                if turned <= to - from {
                    return ((x - cx).hypot(y - cy) - radius).abs();
                }
                let end = |angle: f64| {
                    (x - cx - radius * angle.cos()).hypot(y - cy - radius * angle.sin())
                };
                end(from).min(end(to))
            }
        }
    }
}

/// Width and strokes of a letter.
fn strokes_of(letter: char) -> (f64, &'static [Stroke]) {
    use Stroke::{Arc, Line};
    const BOWL: Stroke = Arc([0.5, 0.5], 0.5, [0.0, 360.0]);
    match letter {
        'a' => (1.0, &[BOWL, Line([1.0, 1.0], [1.0, 0.0])]),
        'f' => (
            0.62,
            &[
                Line([0.25, 0.0], [0.25, 1.15]),
                Arc([0.55, 1.15], 0.30, [70.0, 180.0]),
                Line([0.0, 0.95], [0.58, 0.95]),
            ],
        ),
        'g' => (1.0, &[BOWL, Line([1.0, 1.0], [1.0, -0.1]), Arc([0.5, -0.1], 0.5, [-150.0, 0.0])]),
        'o' => (1.0, &[BOWL]),
        'p' => (1.0, &[BOWL, Line([0.0, 1.0], [0.0, -0.6])]),
        'r' => (0.62, &[Line([0.0, 0.0], [0.0, 1.0]), Arc([0.42, 0.58], 0.42, [55.0, 180.0])]),
        's' => (
            0.66,
            &[Arc([0.34, 0.745], 0.255, [25.0, 270.0]), Arc([0.32, 0.245], 0.245, [-155.0, 90.0])],
        ),
        't' => (
            0.60,
            &[
                Line([0.25, 1.40], [0.25, 0.28]),
                Arc([0.53, 0.28], 0.28, [180.0, 290.0]),
                Line([0.0, 0.95], [0.58, 0.95]),
            ],
        ),
        _ => (0.4, &[]),
    }
}

/// Space between letters.
const GAP: f64 = 0.34;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pen_passes_where_the_strokes_are_and_nowhere_else() {
        assert!(distance_to_word("o", [1.0, 0.5]) < 1e-12);
        assert!((distance_to_word("o", [0.5, 0.5]) - 0.5).abs() < 1e-12);
        assert!((distance_to_word("p", [0.0, -0.7]) - 0.1).abs() < 1e-12);
        // The second letter begins after the first one's width and a gap.
        assert!(distance_to_word("oo", [1.0 + GAP, 0.5]) < 1e-12);
        assert!((distance_to_word("r", [0.42, 0.58]) - 0.42).abs() < 0.01);
        assert_eq!(distance_to_word("", [0.0, 0.0]), f64::INFINITY);
        assert!((word_width("op") - (2.0 + GAP)).abs() < 1e-12);
    }
}
