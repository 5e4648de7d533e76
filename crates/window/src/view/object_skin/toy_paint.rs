//! The toys: a ball in two colours and a block of foam with a grid.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use super::bake::Paint;
use crate::view::blend::{mix, smooth_step};
use crate::view::texture::Texture;

/// A ball about a centre: segments in two colours, a round cap at each end. Units: m.
pub(super) fn ball(centre: &Point3<f64>, p: &Point3<f64>) -> Paint {
    // The poles lean towards the viewer, so that they are seen.
    let ray = (p - centre).normalize();
    let axis = Vector3::new(0.28, 0.86, 0.42).normalize();
    let side = axis.cross(&Vector3::x()).normalize();
    let other = axis.cross(&side);
    let up = ray.dot(&axis);
    let across = (1.0 - up * up).max(1e-9).sqrt();
    let angle = ray.dot(&side).atan2(ray.dot(&other));
    // Positive in the coloured segments; by the factor a length on the unit ball.
    let turn = (angle / TAU * SEGMENTS).rem_euclid(2.0) - 1.0;
    let in_segment = (0.5 - (turn.abs() - 0.5).abs()) * turn.signum() * across * TAU / SEGMENTS;
    let in_cap = across - CAP;
    let edge = |length: f64| smooth_step(0.0, 1.0, 0.5 + length / BLUR);
    let colour = mix(CREAM, TEAL, edge(in_segment));
    let colour = mix(CORAL, colour, edge(in_cap));
    // A fine groove where two colours meet.
    let groove = (-(in_segment / 0.018).powi(2)).exp().min(edge(in_cap));
    Paint { colour: mix(colour, SEAM, 0.35 * groove), slope: Vector3::zeros() }
}

/// One face of the foam block: a grid, finer lines between stronger ones.
pub(super) fn foam() -> Texture {
    Texture::painted(1024, 1024, |u, v| {
        let line = |x: f64, count: f64, half: f64| {
            let from_line = ((x * count + 0.5).fract() - 0.5).abs() / count;
            smooth_step(0.0, 1.0, 0.5 + (half - from_line) / 0.0022)
        };
        let strong = line(u, 4.0, 0.0042).max(line(v, 4.0, 0.0042));
        let fine = line(u, 16.0, 0.0016).max(line(v, 16.0, 0.0016));
        // Foam is not quite even.
        let speck = (u * 611.0 + 3.0 * (v * 397.0).sin()).sin() * (v * 533.0).sin();
        let base = mix(YELLOW, YELLOW_DEEP, 0.5 + 0.5 * speck);
        mix(mix(base, LINE_FINE, 0.55 * fine), LINE, 0.85 * strong)
    })
}

/// Coloured and white segments together.
const SEGMENTS: f64 = 8.0;
/// Sine of the angle that a cap reaches from its pole.
const CAP: f64 = 0.24;
/// Width over which edges fade, on the unit ball.
const BLUR: f64 = 0.008;
const TEAL: [f64; 3] = [0.05, 0.58, 0.62];
const CREAM: [f64; 3] = [0.96, 0.94, 0.88];
const CORAL: [f64; 3] = [0.96, 0.45, 0.34];
const SEAM: [f64; 3] = [0.25, 0.38, 0.40];
const YELLOW: [f64; 3] = [0.98, 0.76, 0.24];
const YELLOW_DEEP: [f64; 3] = [0.96, 0.73, 0.21];
const LINE: [f64; 3] = [0.78, 0.46, 0.08];
const LINE_FINE: [f64; 3] = [0.88, 0.60, 0.14];
