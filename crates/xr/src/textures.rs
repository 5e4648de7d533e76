//! Textures of surfaces, packed once and fetched by number.

use std::collections::BTreeMap;
use std::io::Write;
use std::sync::{Arc, Mutex, PoisonError};

use flate2::Compression;
use flate2::write::GzEncoder;
use softgrasp_window::view::texture::Texture;

/// Textures by number; clones share them.
#[derive(Clone, Default)]
pub struct Textures(Arc<Mutex<Kept>>);

#[derive(Default)]
struct Kept {
    last: u32,
    packed: BTreeMap<u32, Arc<Vec<u8>>>,
}

/// Largest number of textures kept; the oldest are dropped. An object has three at most, a hand one, and a
/// table eight objects.
const KEPT_MAX: usize = 40;

impl Textures {
    /// Packs a texture and returns its number, from 1 on; 0, which is none, if it cannot be packed.
    pub fn add(&self, texture: &Texture) -> u32 {
        let Some(packed) = packed(texture) else { return 0 };
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.last = kept.last.wrapping_add(1).max(1);
        let number = kept.last;
        kept.packed.insert(number, Arc::new(packed));
        while kept.packed.len() > KEPT_MAX {
            kept.packed.pop_first();
        }
        number
    }

    /// Packed texture: gzip of width and height as 32-bit numbers, then red, green, blue and alpha of
    /// each texel.
    pub fn get(&self, number: u32) -> Option<Arc<Vec<u8>>> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.packed.get(&number).cloned()
    }
}

fn packed(texture: &Texture) -> Option<Vec<u8>> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(&texture.width.to_le_bytes()).ok()?;
    encoder.write_all(&texture.height.to_le_bytes()).ok()?;
    encoder.write_all(&texture.rgba).ok()?;
    encoder.finish().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::read::GzDecoder;
    use std::io::Read;

    #[test]
    fn picture_comes_back_by_its_number_and_the_oldest_go() {
        let textures = Textures::default();
        let texture = Texture::painted(4, 2, |u, v| [u, v, 0.5]);
        let first = textures.add(&texture);
        let mut bytes = Vec::new();
        GzDecoder::new(&textures.get(first).unwrap()[..]).read_to_end(&mut bytes).unwrap();
        assert_eq!((bytes[0], bytes[4], &bytes[8..]), (4, 2, &texture.rgba[..]));
        let more: Vec<_> = (0..KEPT_MAX).map(|_| textures.add(&texture)).collect();
        let last = more[KEPT_MAX - 1];
        assert!(textures.get(first).is_none() && textures.get(last).is_some());
    }
}
