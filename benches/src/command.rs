//! The command line of the programs that make reports: which one, how large, where to.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Parser, ValueEnum};

use crate::report::{Options, Report, ReportError};

/// Measure a report and write it as CSV, Markdown and SVG.
#[derive(Parser)]
#[command(version)]
struct Arguments<Name: ValueEnum + Clone + Send + Sync + 'static> {
    /// Which report.
    #[arg(value_enum)]
    report: Name,
    /// A small form of it, to see that it works; its figures mean little.
    #[arg(long)]
    quick: bool,
    /// Folder for the files.
    #[arg(long, default_value = "reports", value_name = "DIR")]
    out: PathBuf,
    /// A remark for the head of the report, for example what else the machine was doing.
    #[arg(long, default_value = "", value_name = "TEXT", hide_default_value = true)]
    note: String,
    /// Folder with mesh files of others; what is not there is left out.
    #[arg(long, default_value = MESHES, value_name = "DIR")]
    meshes: PathBuf,
}

/// Folder of mesh files, beside the repository.
const MESHES: &str = "../shared/meshes";

/// Reads the command line of `program`, makes the report that it names by `measure`, writes its files and shows it.
///
/// # Errors
/// Errors of the measurement and of writing the files.
pub fn main<Name: ValueEnum + Clone + Send + Sync + 'static>(
    program: &str,
    measure: impl FnOnce(Name, &Options) -> Result<Report, ReportError>,
) -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let options = Options {
        is_quick: arguments.quick,
        command: command(program, &arguments),
        out: arguments.out,
        note: arguments.note,
        meshes: arguments.meshes,
    };
    let mut report = measure(arguments.report, &options)?;
    let files = report.finish(&options.out)?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}", report.markdown())?;
    for file in files {
        writeln!(out, "wrote {}", file.display())?;
    }
    Ok(())
}

/// The command to type to get this report again; the remark is not part of it.
fn command<Name: ValueEnum + Clone + Send + Sync + 'static>(
    program: &str,
    arguments: &Arguments<Name>,
) -> String {
    let quick = if arguments.quick { " --quick" } else { "" };
    let folder = |option: &str, given: &Path, usual: &str| match given.to_str() {
        Some(given) if given != usual => format!(" --{option} {given}"),
        _ => String::new(),
    };
    let out = folder("out", &arguments.out, "reports");
    let meshes = folder("meshes", &arguments.meshes, MESHES);
    let name = arguments.report.to_possible_value().expect("no report is hidden");
    format!("cargo run --release --bin {program} -- {}{quick}{out}{meshes}", name.get_name())
}
