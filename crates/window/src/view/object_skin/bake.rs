//! Paints a picture for a surface by asking for the colour at every place of its rest shape.

use nalgebra::{Point3, Vector3};

use crate::view::texture::{Texture, texel};

/// Look of a place of the surface: colour and slope of the relief.
#[derive(Clone, Copy)]
pub(super) struct Paint {
    /// Red, green, blue as sRGB, 0 to 1.
    pub(super) colour: [f64; 3],
    /// Gradient of the height of a fine relief, m per m, in the object's frame.
    pub(super) slope: Vector3<f64>,
}

/// A spread surface at rest: triangles with places in space and in the picture.
pub(super) struct Spread<'a> {
    pub(super) triangles: &'a [[u32; 3]],
    /// Positions of the vertices. Units: m.
    pub(super) positions: &'a [Point3<f64>],
    /// Places of the vertices in the picture, each coordinate 0 to 1.
    pub(super) uvs: &'a [[f64; 2]],
}

/// Pictures of colours and of the relief, painted together.
pub(super) struct Baked {
    pub(super) colours: Texture,
    pub(super) relief: Texture,
}

impl Spread<'_> {
    /// Paints every texel that a triangle covers, and a rim around them.
    pub(super) fn bake(
        &self,
        width: u32,
        height: u32,
        paint: impl Fn(&Point3<f64>) -> Paint,
    ) -> Baked {
        let mut canvas = Canvas::new(width as usize, height as usize);
        for triangle in self.triangles {
            self.fill(&mut canvas, triangle, &paint);
        }
        for _ in 0..RIM_TEXELS {
            canvas.grow();
        }
        let of = |rgba: Vec<[u8; 4]>| Texture { width, height, rgba: rgba.concat() };
        Baked { colours: of(canvas.colours), relief: of(canvas.relief) }
    }

    fn fill(
        &self,
        canvas: &mut Canvas,
        triangle: &[u32; 3],
        paint: &impl Fn(&Point3<f64>) -> Paint,
    ) {
        let size = [canvas.width as f64, canvas.height as f64];
        let p = triangle.map(|v| self.positions[v as usize]);
        let q = triangle.map(|v| self.uvs[v as usize]);
        let (b, c) =
            ([q[1][0] - q[0][0], q[1][1] - q[0][1]], [q[2][0] - q[0][0], q[2][1] - q[0][1]]);
        let area = b[0] * c[1] - b[1] * c[0];
        if area == 0.0 || !area.is_finite() {
            return;
        }
        // The directions in space in which u and v grow, of one length as shaders take them.
        let (side_b, side_c) = (p[1] - p[0], p[2] - p[0]);
        let normal = side_b.cross(&side_c);
        let square = normal.norm_squared().max(f64::MIN_POSITIVE);
        let (dual_b, dual_c) = (side_c.cross(&normal) / square, normal.cross(&side_b) / square);
        let along_u = dual_b * b[0] + dual_c * c[0];
        let along_v = dual_b * b[1] + dual_c * c[1];
        let [unit_u, unit_v] = [along_u, along_v]
            .map(|d| d.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector3::zeros));
        let range = |d: usize| {
            let texel = q.map(|at| at[d] * size[d] - 0.5);
            let low = texel.iter().copied().fold(f64::INFINITY, f64::min).ceil().max(0.0);
            let high = texel.iter().copied().fold(f64::NEG_INFINITY, f64::max).floor();
            (low as usize, high.min(size[d] - 1.0))
        };
        let ((left, right), (top, bottom)) = (range(0), range(1));
        for row in (top..canvas.height).take_while(|r| *r as f64 <= bottom) {
            for column in (left..canvas.width).take_while(|r| *r as f64 <= right) {
                let at = [
                    (column as f64 + 0.5) / size[0] - q[0][0],
                    (row as f64 + 0.5) / size[1] - q[0][1],
                ];
                let share_b = (at[0] * c[1] - at[1] * c[0]) / area;
                let share_c = (b[0] * at[1] - b[1] * at[0]) / area;
                if share_b < -1e-9 || share_c < -1e-9 || share_b + share_c > 1.0 + 1e-9 {
                    continue;
                }
                let painted = paint(&(p[0] + side_b * share_b + side_c * share_c));
                let slopes = [painted.slope.dot(&unit_u), painted.slope.dot(&unit_v)];
                canvas.set(row * canvas.width + column, painted.colour, slopes);
            }
        }
    }
}

/// Pictures that are being painted.
struct Canvas {
    width: usize,
    height: usize,
    colours: Vec<[u8; 4]>,
    relief: Vec<[u8; 4]>,
    is_painted: Vec<bool>,
}

impl Canvas {
    fn new(width: usize, height: usize) -> Self {
        let count = width * height;
        Self {
            width,
            height,
            colours: vec![[128, 128, 128, 255]; count],
            relief: vec![[128, 128, 255, 255]; count],
            is_painted: vec![false; count],
        }
    }

    fn set(&mut self, at: usize, colour: [f64; 3], [slope_u, slope_v]: [f64; 2]) {
        self.colours[at] = texel(colour);
        let length = (slope_u * slope_u + slope_v * slope_v + 1.0).sqrt();
        // The normal leans against the slope, (−slope_u, −slope_v, 1). kiss3d 0.47 takes red along
        // −u and green along +v, because the screen's rows count downward where it derives its axes.
        let normal = [slope_u / length, -slope_v / length, 1.0 / length];
        self.relief[at] = texel(normal.map(|n| 0.5 + 0.5 * n));
        self.is_painted[at] = true;
    }

    /// Copies the rim of what is painted one texel outward, so that blending finds no gaps.
    fn grow(&mut self) {
        let mut copies = Vec::new();
        for at in (0..self.is_painted.len()).filter(|at| !self.is_painted[*at]) {
            let (row, column) = (at / self.width, at % self.width);
            let beside = [
                (column > 0).then(|| at - 1),
                (column + 1 < self.width).then_some(at + 1),
                (row > 0).then(|| at - self.width),
                (row + 1 < self.height).then_some(at + self.width),
            ];
            if let Some(from) = beside.into_iter().flatten().find(|b| self.is_painted[*b]) {
                copies.push((at, from));
            }
        }
        for (to, from) in copies {
            self.colours[to] = self.colours[from];
            self.relief[to] = self.relief[from];
            self.is_painted[to] = true;
        }
    }
}

/// Width of the rim around what is painted.
const RIM_TEXELS: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_square_shows_its_own_coordinates_and_slopes() {
        let positions =
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Point3::new(x, y, 0.0));
        let uvs = positions.map(|p| [p.x, p.y]);
        let triangles = [[0, 1, 2], [0, 2, 3]];
        let spread = Spread { triangles: &triangles, positions: &positions, uvs: &uvs };
        let baked = spread
            .bake(8, 4, |p| Paint { colour: [p.x, p.y, 0.0], slope: Vector3::new(1.0, 0.0, 0.0) });
        assert_eq!(baked.colours.rgba.len(), 8 * 4 * 4);
        for row in 0..4usize {
            for column in 0..8usize {
                let at = 4 * (8 * row + column);
                let expected = texel([(column as f64 + 0.5) / 8.0, (row as f64 + 0.5) / 4.0, 0.0]);
                assert_eq!(baked.colours.rgba[at..at + 4], expected);
                // Uphill along u, so the normal leans by 45° to −u, where red counts up.
                let lean = (0.5 + 0.5 * 0.5f64.sqrt()) * 255.0;
                assert_eq!(baked.relief.rgba[at], lean.round() as u8);
                assert_eq!(baked.relief.rgba[at + 1], 128);
            }
        }
    }
}
