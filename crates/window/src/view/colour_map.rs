//! The colours that values are shown in, from dark violet for zero to bright yellow for the most.
//!
//! Equal steps of the value are equal steps to the eye: the ramp is a curve in OKLab, cut into
//! pieces of equal length. Its lightness rises all the way and carries the order alone, so it can
//! be read by who does not tell red from green or blue from yellow, and in a black-and-white print.

use std::f64::consts::PI;

use super::texture::Texture;

/// Number of colours of the ramp.
pub const COLOUR_COUNT: usize = 256;

/// Lightness, chroma and hue in degrees (OKLCh) that the ramp passes through: the hue goes from
/// violet over blue and green to yellow, as daylight does from shade to sun.
const ANCHORS: [[f64; 3]; 6] = [
    [0.24, 0.105, 285.0],
    [0.42, 0.125, 268.0],
    [0.58, 0.105, 222.0],
    [0.72, 0.115, 168.0],
    [0.84, 0.145, 125.0],
    [0.94, 0.155, 105.0],
];

/// Straight pieces that each part of the curve between two anchors is measured by.
const PIECES: usize = 64;

/// Lightness, green to red, blue to yellow of a colour: distances are those that the eye sees.
type OkLab = [f64; 3];

/// A sequential colour map of [`COLOUR_COUNT`] colours.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColourMap {
    table: Vec<[u8; 4]>,
}

impl Default for ColourMap {
    fn default() -> Self {
        Self::new()
    }
}

impl ColourMap {
    /// Works the ramp out.
    ///
    /// Source: OKLab by Ottosson, "A perceptual color space for image processing" (2020).
    pub fn new() -> Self {
        let table = evenly_along(&curve(), COLOUR_COUNT).into_iter().map(|colour| {
            let [r, g, b] = linear_rgb(colour).map(srgb_byte);
            [r, g, b, u8::MAX]
        });
        Self { table: table.collect() }
    }

    /// The colours, sRGB and opaque, from zero to the most.
    pub fn table(&self) -> &[[u8; 4]] {
        &self.table
    }

    /// Colour of a fraction of the most; outside of 0 to 1 that of the nearer end, and that of 0
    /// for what is no number.
    pub fn colour(&self, fraction: f64) -> [u8; 4] {
        self.table[(within(fraction) * (COLOUR_COUNT - 1) as f64).round() as usize]
    }

    /// The ramp as a texture; [`texture_u`] finds a fraction in it.
    pub fn image(&self, height: u32) -> Texture {
        let rgba = self.table.as_flattened().repeat(height as usize);
        Texture { width: COLOUR_COUNT as u32, height, rgba }
    }
}

/// Horizontal coordinate, 0 to 1, of a fraction in [`ColourMap::image`]: between the middles of the
/// outermost pixels, so that neither end is blended with what lies beyond.
pub fn texture_u(fraction: f64) -> f32 {
    let pixels = COLOUR_COUNT as f64;
    ((within(fraction) * (pixels - 1.0) + 0.5) / pixels) as f32
}

/// The fraction within 0 and 1; 0 for what is no number.
fn within(fraction: f64) -> f64 {
    if fraction.is_nan() { 0.0 } else { fraction.clamp(0.0, 1.0) }
}

/// Points of a smooth curve through the anchors (Catmull and Rom, with straight ends).
fn curve() -> Vec<OkLab> {
    let anchors = ANCHORS.map(|[lightness, chroma, hue]| {
        let hue = hue * PI / 180.0;
        [lightness, chroma * hue.cos(), chroma * hue.sin()]
    });
    let last = anchors.len() - 1;
    let beyond = |end: OkLab, next: OkLab| std::array::from_fn(|i| 2.0 * end[i] - next[i]);
    let mut through = vec![beyond(anchors[0], anchors[1])];
    through.extend(anchors);
    through.push(beyond(anchors[last], anchors[last - 1]));
    let parts = through
        .windows(4)
        .flat_map(|four| (0..PIECES).map(move |piece| between(four, piece as f64 / PIECES as f64)));
    parts.chain([anchors[last]]).collect()
}

/// Cubic between the second and the third of four points.
fn between(four: &[OkLab], t: f64) -> OkLab {
    std::array::from_fn(|i| {
        let [a, b, c, d] = [four[0][i], four[1][i], four[2][i], four[3][i]];
        let cubic = 3.0 * (b - c) + d - a;
        let square = 2.0 * a - 5.0 * b + 4.0 * c - d;
        b + 0.5 * t * (c - a + t * (square + t * cubic))
    })
}

/// So many points of a curve at equal distances along it, its ends among them.
fn evenly_along(curve: &[OkLab], count: usize) -> Vec<OkLab> {
    let mut along = vec![0.0];
    for pair in curve.windows(2) {
        along.push(along[along.len() - 1] + distance(pair[0], pair[1]));
    }
    let length = along[along.len() - 1];
    let at = |index: usize| {
        let wanted = length * index as f64 / (count - 1) as f64;
        let end = along.partition_point(|&reached| reached < wanted).clamp(1, curve.len() - 1);
        let (from, to) = (curve[end - 1], curve[end]);
        let t = (wanted - along[end - 1]) / (along[end] - along[end - 1]);
        std::array::from_fn(|i| from[i] + (to[i] - from[i]) * t)
    };
    (0..count).map(at).collect()
}

fn distance(a: OkLab, b: OkLab) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// Red, green and blue as amounts of light.
///
/// Source: Ottosson 2020.
fn linear_rgb([lightness, a, b]: OkLab) -> [f64; 3] {
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ]
}

/// An amount of light as a byte of sRGB (IEC 61966-2-1).
fn srgb_byte(light: f64) -> u8 {
    let light = light.clamp(0.0, 1.0);
    let signal = match light <= 0.003_130_8 {
        true => 12.92 * light,
        false => 1.055 * light.powf(1.0 / 2.4) - 0.055,
    };
    (255.0 * signal).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    /// OKLab of a colour of the table, by the inverse of what made it.
    fn oklab(rgba: [u8; 4]) -> OkLab {
        let light = |byte: u8| {
            let signal = f64::from(byte) / 255.0;
            match signal <= 0.040_45 {
                true => signal / 12.92,
                false => ((signal + 0.055) / 1.055).powf(2.4),
            }
        };
        let [r, g, b] = [rgba[0], rgba[1], rgba[2]].map(light);
        let cones = [
            0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b,
            0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b,
            0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b,
        ];
        let [l, m, s] = cones.map(f64::cbrt);
        [
            0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
            1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
            0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
        ]
    }

    fn ramp() -> Vec<OkLab> {
        ColourMap::new().table().iter().map(|&colour| oklab(colour)).collect()
    }

    /// Steps between colours that are far enough apart for the rounding to bytes not to count.
    fn steps_of(ramp: &[OkLab], step: impl Fn(OkLab, OkLab) -> f64) -> Vec<f64> {
        ramp.windows(17).map(|w| step(w[0], w[16])).collect()
    }

    fn extremes(steps: Vec<f64>) -> (f64, f64) {
        let least = steps.iter().copied().fold(f64::INFINITY, f64::min);
        (least, steps.into_iter().fold(0.0, f64::max))
    }

    #[test]
    fn lightness_rises_all_the_way_by_nearly_equal_steps() {
        let (least, most) = extremes(steps_of(&ramp(), |a, b| b[0] - a[0]));
        assert!(least > 0.7 * most, "{least} to {most}");
        assert!(ramp().windows(2).all(|pair| pair[1][0] > pair[0][0] - 5e-4));
        let ends = (ramp()[0][0], ramp()[COLOUR_COUNT - 1][0]);
        assert!(ends.0 < 0.3 && ends.1 > 0.9, "{ends:?}");
    }

    #[test]
    fn equal_steps_of_the_value_are_equal_steps_to_the_eye() {
        let (least, most) = extremes(steps_of(&ramp(), distance));
        assert!(least > 0.85 * most, "{least} to {most}");
    }

    #[test]
    fn who_sees_one_axis_of_colour_less_still_sees_every_step() {
        for blind_axis in [1, 2] {
            let mut seen = ramp();
            seen.iter_mut().for_each(|colour| colour[blind_axis] = 0.0);
            let (least, most) = extremes(steps_of(&seen, distance));
            assert!(least > 0.5 * most, "axis {blind_axis}: {least} to {most}");
        }
    }

    #[test]
    fn no_colour_is_cut_off_by_the_screen() {
        for colour in evenly_along(&curve(), COLOUR_COUNT) {
            assert!(linear_rgb(colour).iter().all(|c| (0.0..=1.0).contains(c)), "{colour:?}");
        }
    }

    #[test]
    fn fractions_find_their_colour_in_table_and_texture() {
        let map = ColourMap::new();
        assert_eq!(map.colour(0.0), map.table()[0]);
        assert_eq!(map.colour(2.0), map.table()[255]);
        assert_eq!(map.colour(0.2), map.table()[51]);
        assert_eq!(map.colour(f64::NAN), map.table()[0]);
        let image = map.image(2);
        assert_eq!((image.width, image.height, image.rgba.len()), (256, 2, 2 * 1024));
        for index in [0, 51, 255] {
            let u = f64::from(texture_u(index as f64 / 255.0));
            assert_eq!((u * 256.0) as usize, index);
            assert_eq!(image.rgba[1024 + 4 * index..][..4], map.table()[index]);
        }
        assert!((texture_u(-1.0), texture_u(f64::NAN)) == (0.5 / 256.0, 0.5 / 256.0));
    }
}
