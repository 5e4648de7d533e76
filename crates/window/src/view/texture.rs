//! Pictures that are laid over surfaces.

/// A picture, row by row from (0, 0), four bytes a texel: red, green, blue, alpha.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    /// Texels in a row.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Bytes of all texels: `width` × `height` × 4.
    pub rgba: Vec<u8>,
}

impl Texture {
    /// A picture whose texel at the place (u, v) has the colour `paint(u, v)`, 0 to 1 each.
    pub fn painted(width: u32, height: u32, paint: impl Fn(f64, f64) -> [f64; 3]) -> Self {
        let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
        for row in 0..height {
            for column in 0..width {
                let u = (f64::from(column) + 0.5) / f64::from(width);
                let v = (f64::from(row) + 0.5) / f64::from(height);
                rgba.extend_from_slice(&texel(paint(u, v)));
            }
        }
        Self { width, height, rgba }
    }
}

/// Four bytes of a colour with components 0 to 1.
pub fn texel(colour: [f64; 3]) -> [u8; 4] {
    let [red, green, blue] = colour.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
    [red, green, blue, u8::MAX]
}
