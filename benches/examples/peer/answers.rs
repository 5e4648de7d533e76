//! Numbers in files: little-endian, nothing else, one file per array.

use std::path::Path;

/// Writes doubles.
pub fn write_f64(folder: &Path, name: &str, values: &[f64]) -> std::io::Result<()> {
    std::fs::write(folder.join(name), bytes(values, f64::to_le_bytes))
}

/// Writes 32-bit integers without sign.
pub fn write_u32(folder: &Path, name: &str, values: &[u32]) -> std::io::Result<()> {
    std::fs::write(folder.join(name), bytes(values, u32::to_le_bytes))
}

fn bytes<T: Copy, const N: usize>(values: &[T], to_bytes: fn(T) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|&v| to_bytes(v)).collect()
}
