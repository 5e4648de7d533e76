//! `glove-client devices [PATH…] [--probe]`: which serial ports there are and what is on them.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use softgrasp_hand::serial::probe::{BAUDS, Found, probe, serial_ports, why_unusable};

use super::output::print;

/// List the serial ports of this machine, and whether each can be opened.
#[derive(Args)]
pub struct DevicesCommand {
    /// Look at these ports only.
    paths: Vec<PathBuf>,
    /// Ask each port at several speeds whether a glove or a tracker is there. This sends a few bytes
    /// to whatever is connected.
    #[arg(long)]
    probe: bool,
}

impl DevicesCommand {
    /// Lists the ports, and asks them if wanted.
    ///
    /// # Errors
    /// A system that cannot list its ports.
    pub fn run(&self) -> anyhow::Result<()> {
        let ports = match self.paths.is_empty() {
            true => serial_ports().context("this system cannot list its serial ports")?,
            false => self.paths.clone(),
        };
        if ports.is_empty() {
            return print(NONE);
        }
        for port in &ports {
            let told = match (why_unusable(port), self.probe) {
                (Some(why), _) => why,
                (None, false) => "can be opened".to_owned(),
                (None, true) => who(port),
            };
            print(&format!("{}: {told}\n", port.display()))?;
        }
        Ok(())
    }
}

const NONE: &str = "no serial port found: no adapter is plugged in, or the system does not know it \
                    (`dmesg` tells); `glove-client emulate` makes ports without hardware\n";

fn who(port: &Path) -> String {
    match probe(port) {
        Ok(Some(Found::Glove { baud, sensors, identity })) => {
            let sensors = sensors.map(|count| format!(", {count} sensors")).unwrap_or_default();
            let identity = identity.map(|text| format!(" ({text})")).unwrap_or_default();
            format!("glove at {baud} baud{sensors}{identity}")
        }
        Ok(Some(Found::Tracker { baud, status })) => format!("tracker at {baud} baud ({status})"),
        Ok(None) => {
            let bauds = BAUDS.map(|baud| baud.to_string()).join(", ");
            format!("can be opened; neither glove nor tracker answers at {bauds} baud")
        }
        Err(why) => why,
    }
}
