//! Pictures of the scene against ones that a person has looked at.
//!
//! Different drivers round differently, so pictures are compared as an eye would: in a space of
//! even perception, pixel groups of 4 × 4 at a time, with a tolerance. Where nothing can draw, one
//! line says so. `GOLDEN=write` writes the pictures anew; whoever does that looks at them.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests fail and speak like tests")]

mod perception;

use std::path::{Path, PathBuf};
use std::process::Command;

use perception::distance;

/// Mean distance in OKLab that two drivers may have; black and white are 1 apart.
const MEAN_MAX: f64 = 0.006;
/// Share of groups of pixels that may be visibly off, by more than 0.06: edges move by a pixel.
const OFF_SHARE_MAX: f64 = 0.02;

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/pictures/golden/{name}.png"))
}

/// The picture that flags ask for; `None` where nothing can draw.
fn draw(folder: &Path, name: &str, flags: &str) -> Option<PathBuf> {
    let path = folder.join(format!("{name}.png"));
    let run = Command::new(env!("CARGO_BIN_EXE_glove-client"))
        .args(["run", "--headless", "--nodes", "400", "--threads", "2"])
        .args(["--picture-size", "480x320", "--light", "fair", "--snapshot"])
        .arg(&path)
        .args(flags.split_whitespace())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stderr);
    if said.contains("no graphics driver was found") {
        println!("skipped: {}", said.lines().next().unwrap());
        return None;
    }
    assert!(run.status.success(), "{name}: {said}");
    Some(path)
}

fn compare(name: &str, flags: &str) {
    let folder = tempfile::tempdir().unwrap();
    let Some(drawn) = draw(folder.path(), name, flags) else { return };
    if std::env::var_os("GOLDEN").is_some_and(|v| v == "write") {
        std::fs::copy(&drawn, golden(name)).unwrap();
        return;
    }
    let (mean, off_share) = distance(&drawn, &golden(name));
    assert!(
        mean <= MEAN_MAX && off_share <= OFF_SHARE_MAX,
        "{name}: mean distance {mean:.4} (at most {MEAN_MAX}), {:.2} % of the picture visibly off",
        100.0 * off_share
    );
}

#[test]
fn squeezed_strawberry_looks_as_it_did() {
    compare("strawberry", "--hand scripted:squeeze --at deforming");
}

#[test]
fn stress_of_a_cube_with_its_elements_looks_as_it_did() {
    let flags = "--object cube --hand scripted:squeeze --at deforming --shading von-mises \
                 --show elements,rest,colliders";
    compare("cube", flags);
}

#[test]
fn spheres_of_a_tube_look_as_they_did() {
    let flags = "--object toothpaste --hand scripted:approach --frames 2 --show spheres:4";
    compare("spheres", flags);
}

#[test]
fn another_picture_is_far_beyond_the_tolerance() {
    let (mean, off_share) = distance(&golden("strawberry"), &golden("cube"));
    assert!(mean > 3.0 * MEAN_MAX && off_share > 3.0 * OFF_SHARE_MAX, "{mean}, {off_share}");
}
