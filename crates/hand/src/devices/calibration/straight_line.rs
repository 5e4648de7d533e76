//! The straight line through measured points of one sensor.

use super::linear::SensorCalibration;

/// One measured point of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    /// Raw reading of the sensor.
    pub(super) counts: f64,
    /// Angle of the joint in this program's convention.
    pub(super) angle_rad: f64,
}

/// The line of the least squared error through the points.
///
/// Points that all have one reading or one angle say nothing about a slope: the line that was
/// there stays.
pub(super) fn line_through(start: &SensorCalibration, points: &[Point]) -> SensorCalibration {
    let n = points.len() as f64;
    let mean = |value: fn(&Point) -> f64| points.iter().map(value).sum::<f64>() / n;
    let (counts, angle) = (mean(|p| p.counts), mean(|p| p.angle_rad));
    let spread: f64 = points.iter().map(|p| (p.counts - counts).powi(2)).sum();
    let joint: f64 = points.iter().map(|p| (p.counts - counts) * (p.angle_rad - angle)).sum();
    let gain_rad_per_count = joint / spread;
    if gain_rad_per_count.is_nan() || gain_rad_per_count.abs() < 1e-5 {
        return *start;
    }
    let offset_counts = counts - angle / gain_rad_per_count;
    SensorCalibration { offset_counts, gain_rad_per_count, ..*start }
}
