//! The distance of two pictures as an eye sees it.

use std::path::Path;

use image::RgbImage;

/// Pixels a side that are seen as one.
const GROUP: u32 = 4;
/// Distance from which on a group is visibly off.
const VISIBLE: f64 = 0.06;

/// Mean distance of two pictures in OKLab, and the share of groups of pixels that are visibly off.
/// Pictures of different sizes are infinitely far apart.
pub fn distance(a: &Path, b: &Path) -> (f64, f64) {
    let open = |path: &Path| image::open(path).unwrap().into_rgb8();
    let (a, b) = (open(a), open(b));
    if a.dimensions() != b.dimensions() {
        return (f64::INFINITY, 1.0);
    }
    let (width, height) = (a.width() / GROUP, a.height() / GROUP);
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let distances: Vec<f64> = places
        .map(|(x, y)| {
            let (a, b) = (group(&a, x, y), group(&b, x, y));
            a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
        })
        .collect();
    let count = distances.len() as f64;
    let off = distances.iter().filter(|d| **d > VISIBLE).count() as f64;
    (distances.iter().sum::<f64>() / count, off / count)
}

/// Mean colour of a group of pixels, in OKLab.
fn group(picture: &RgbImage, x: u32, y: u32) -> [f64; 3] {
    let mut linear = [0.0; 3];
    for dy in 0..GROUP {
        for dx in 0..GROUP {
            let pixel = picture.get_pixel(GROUP * x + dx, GROUP * y + dy).0;
            for (sum, value) in linear.iter_mut().zip(pixel) {
                *sum += linear_light(value) / f64::from(GROUP * GROUP);
            }
        }
    }
    oklab(linear)
}

/// Light of an sRGB value (IEC 61966-2-1).
fn linear_light(value: u8) -> f64 {
    let v = f64::from(value) / 255.0;
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Source: Ottosson, "A perceptual color space for image processing" (2020).
fn oklab([r, g, b]: [f64; 3]) -> [f64; 3] {
    let l = (0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b).cbrt();
    let m = (0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b).cbrt();
    let s = (0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b).cbrt();
    [
        0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
        1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
        0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
    ]
}

#[test]
fn white_and_black_are_one_apart_and_grey_has_no_colour() {
    let [l, a, b] = oklab([linear_light(255); 3]);
    assert!((l - 1.0).abs() < 1e-3 && a.abs() < 1e-3 && b.abs() < 1e-3);
    assert_eq!(oklab([0.0; 3]), [0.0; 3]);
}
