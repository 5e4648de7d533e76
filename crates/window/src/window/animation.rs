//! A moving picture as a GIF: only what changes from picture to picture is stored.

use gif::{DisposalMethod, Encoder, EncodingError, Frame, Repeat};
use image::{ImageResult, RgbImage};

/// Pictures of one size, one after the other.
#[derive(Default)]
pub struct Animation {
    pictures: Vec<RgbImage>,
}

/// A pixel that differs by less than this in every colour stays as it was: noise costs bytes.
const SAME: u8 = 6;
/// Care that is taken with the palette, 1 (most) to 30.
const SPEED: i32 = 10;

impl Animation {
    /// Adds the next picture.
    pub fn add(&mut self, picture: RgbImage) {
        self.pictures.push(picture);
    }

    /// The GIF; it begins anew when it is over.
    ///
    /// Units: `period_s` s from picture to picture, rounded to hundredths.
    ///
    /// # Errors
    /// The error of the encoder, for pictures larger than a GIF can be.
    pub fn encode(self, period_s: f64) -> Result<Vec<u8>, EncodingError> {
        let mut bytes = Vec::new();
        let Some(first) = self.pictures.first() else { return Ok(bytes) };
        let side = |pixels: u32| u16::try_from(pixels).unwrap_or(u16::MAX);
        let (width, height) = (side(first.width()), side(first.height()));
        let mut encoder = Encoder::new(&mut bytes, width, height, &[])?;
        encoder.set_repeat(Repeat::Infinite)?;
        let mut shown: Option<RgbImage> = None;
        for picture in self.pictures {
            let mut rgba = match &mut shown {
                Some(shown) => change(shown, &picture),
                None => opaque(&picture),
            };
            shown.get_or_insert(picture);
            let mut frame = Frame::from_rgba_speed(width, height, &mut rgba, SPEED);
            frame.delay = (1e2 * period_s).round() as u16;
            // What does not change stays.
            frame.dispose = DisposalMethod::Keep;
            encoder.write_frame(&frame)?;
        }
        drop(encoder);
        Ok(bytes)
    }
}

fn opaque(picture: &RgbImage) -> Vec<u8> {
    picture.pixels().flat_map(|pixel| [pixel.0[0], pixel.0[1], pixel.0[2], u8::MAX]).collect()
}

/// What of a picture differs from what is shown, the rest transparent; `shown` follows.
///
/// Shapes: four bytes a pixel.
fn change(shown: &mut RgbImage, next: &RgbImage) -> Vec<u8> {
    let mut changed = Vec::with_capacity(4 * next.pixels().len());
    for (shown, next) in shown.pixels_mut().zip(next.pixels()) {
        let same = shown.0.iter().zip(next.0).all(|(a, b)| a.abs_diff(b) < SAME);
        if same {
            changed.extend([0; 4]);
        } else {
            *shown = *next;
            changed.extend([next.0[0], next.0[1], next.0[2], u8::MAX]);
        }
    }
    changed
}

/// A picture as PNG.
///
/// # Errors
/// The error of the encoder.
pub fn png(picture: &RgbImage) -> ImageResult<Vec<u8>> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png)?;
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use image::AnimationDecoder as _;
    use image::Rgb;
    use image::codecs::gif::GifDecoder;

    use super::*;

    #[test]
    fn decoded_animation_shows_the_pictures_that_went_in() {
        let picture = |at: u32| {
            RgbImage::from_fn(24, 16, |x, _| {
                Rgb(if x == at { [200, 30, 30] } else { [90, 120, 150] })
            })
        };
        let mut animation = Animation::default();
        (0..4).for_each(|n| animation.add(picture(5 * n)));
        let bytes = animation.encode(0.05).unwrap();
        let decoder = GifDecoder::new(std::io::Cursor::new(bytes)).unwrap();
        let frames = decoder.into_frames().collect_frames().unwrap();
        assert_eq!(frames.len(), 4);
        for (n, frame) in (0..).zip(&frames) {
            for (x, y, pixel) in frame.buffer().enumerate_pixels() {
                let expected = picture(5 * n).get_pixel(x, y).0;
                let close = pixel.0[..3].iter().zip(expected).all(|(a, b)| a.abs_diff(b) < 12);
                assert!(close, "frame {n} at {x}, {y}: {pixel:?} for {expected:?}");
            }
        }
    }
}
