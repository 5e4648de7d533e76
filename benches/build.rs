//! Tells the program which compiler built it, for the head of every report.

use std::process::Command;

fn main() {
    println!("cargo::rerun-if-env-changed=RUSTC");
    println!("cargo::rerun-if-changed=build.rs");
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let said = Command::new(rustc).arg("--version").output();
    let version = said.ok().and_then(|output| String::from_utf8(output.stdout).ok());
    let version = version.as_deref().map(str::trim).filter(|v| !v.is_empty()).unwrap_or("unknown");
    println!("cargo::rustc-env=SOFTGRASP_RUSTC={version}");
}
