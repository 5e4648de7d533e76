//! Emulated glove and tracker as a process.

#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use softgrasp_hand::serial::SerialSource;

use crate::start::command;

/// An emulator that has printed its two paths.
pub struct Emulator {
    child: Child,
    pub source: SerialSource,
}

impl Emulator {
    pub fn start(arguments: &[&str]) -> Self {
        let mut child = command();
        let child = child.arg("emulate").args(arguments).stdout(Stdio::piped());
        let mut child = child.spawn().unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines().take(2);
        let lines: Vec<String> = lines.map(|line| line.unwrap().replacen(' ', "=", 1)).collect();
        Self { child, source: lines.join(",").parse().unwrap() }
    }

    pub fn stop(mut self) {
        let kill = format!("kill -TERM {}", self.child.id());
        assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
        assert_eq!(self.child.wait().unwrap().code(), Some(0));
    }
}
