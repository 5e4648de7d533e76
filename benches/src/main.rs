//! `softgrasp-bench REPORT`: measured figures, each with its error.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Parser;
use softgrasp_bench::{Options, ReportName, run};

/// Measure a report and write it as CSV, Markdown and SVG.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Which report.
    report: ReportName,
    /// A small form of it, to see that it works; its figures mean little.
    #[arg(long)]
    quick: bool,
    /// Folder for the files.
    #[arg(long, default_value = "reports", value_name = "DIR")]
    out: PathBuf,
    /// A remark for the head of the report, for example what else the machine was doing.
    #[arg(long, default_value = "", value_name = "TEXT", hide_default_value = true)]
    note: String,
    /// Folder with mesh files of others, for `frontier` and `session`; what is not there is left out.
    #[arg(long, default_value = MESHES, value_name = "DIR")]
    meshes: PathBuf,
}

/// Beside the repository.
const MESHES: &str = "../shared/meshes";

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let options = Options {
        is_quick: arguments.quick,
        command: command(&arguments),
        out: arguments.out,
        note: arguments.note,
        meshes: arguments.meshes,
    };
    let (report, files) = run(arguments.report, &options)?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}", report.markdown())?;
    for file in files {
        writeln!(out, "wrote {}", file.display())?;
    }
    Ok(())
}

/// The command to type to get this report again; the remark is not part of it.
fn command(arguments: &Arguments) -> String {
    let quick = if arguments.quick { " --quick" } else { "" };
    let folder = |option: &str, given: &Path, usual: &str| match given.to_str() {
        Some(given) if given != usual => format!(" --{option} {given}"),
        _ => String::new(),
    };
    let out = folder("out", &arguments.out, "reports");
    let meshes = folder("meshes", &arguments.meshes, MESHES);
    let name = arguments.report.name();
    format!("cargo run --release --bin softgrasp-bench -- {name}{quick}{out}{meshes}")
}
