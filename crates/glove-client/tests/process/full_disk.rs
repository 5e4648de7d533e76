//! A disk that is full: the older file stays, nothing is left beside it, and the reason is told.

use std::path::Path;
use std::process::Command;

use crate::start::{Folder, fail, succeed};

/// A small file system of its own in memory; unmounted when dropped.
struct SmallDisk(String);

impl SmallDisk {
    /// `None`, with a line that says so, where this user may not mount one.
    fn mount(folder: &Folder, size: &str) -> Option<Self> {
        let path = folder.path("disk");
        std::fs::create_dir(&path).unwrap();
        let size = format!("size={size}");
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &size, "tmpfs", &path])
            .output()
            .is_ok_and(|output| output.status.success());
        if !mounted {
            println!("skipped: this user may not mount a small disk");
        }
        mounted.then_some(Self(path))
    }

    fn path(&self, name: &str) -> String {
        format!("{}/{name}", self.0)
    }

    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").args(["-l", &self.0]).status();
    }
}

#[test]
fn mesh_that_does_not_fit_leaves_the_older_one_whole() {
    let folder = Folder::new();
    let Some(disk) = SmallDisk::mount(&folder, "48k") else { return };
    let path = disk.path("cube.msh");
    succeed(&["mesh", "cube", "--nodes", "64", "--out", &path]);
    let older = std::fs::read(&path).unwrap();
    let said = fail(1, &["mesh", "cube", "--nodes", "8000", "--out", &path]);
    assert!(said.contains(&path) && said.contains("No space left"), "{said}");
    assert_eq!(std::fs::read(&path).unwrap(), older, "the older file has changed");
    assert_eq!(disk.names(), ["cube.msh"], "something is left beside it");
    // The disk is of use again.
    succeed(&["mesh", "cube", "--nodes", "64", "--out", &path]);
}

#[test]
fn run_whose_recording_does_not_fit_goes_on_and_the_part_that_fits_can_be_replayed() {
    let folder = Folder::new();
    let Some(disk) = SmallDisk::mount(&folder, "400k") else { return };
    let (recording, report) = (disk.path("run.mcap"), folder.path("report.json"));
    let run = ["run", "--headless", "--object", "cube", "--nodes", "64", "--record", &recording];
    let output = crate::start::run(&[&run[..], &["--report", &report]].concat());
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(Path::new(&report).exists(), "the run did not go on: {said}");
    let report: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&report).unwrap()).unwrap();
    let why = report["recording_failed"].as_str().unwrap_or_default();
    assert!(why.contains("No space left"), "{why}; {said}");
    assert!(report["ticks"].as_u64().unwrap() > 300, "{}", report["ticks"]);
    let replayed = folder.path("replayed.json");
    let hand = format!("replay:{recording}");
    let output = crate::start::run(&["run", "--headless", "--hand", &hand, "--report", &replayed]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(Path::new(&replayed).exists(), "the part that fits is not replayed: {said}");
    let replayed: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&replayed).unwrap()).unwrap();
    assert!(replayed["replay"]["cut"].is_string(), "{}", replayed["replay"]);
    assert_eq!(replayed["replay"]["difference"], serde_json::Value::Null);
}
