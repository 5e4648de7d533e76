//! Softgrasp's side of the table against codes that others wrote: one line in, one line out.
//!
//! It makes the problems that all solve, and runs our methods on request, so that a program that
//! asks several such sides in turn lets only one of them compute at a time. A line is a request as
//! JSON, the answer another; `benches/peers/README.md` lists them. It ends with its input.

mod answers;
mod methods;
mod over_wire;
mod problem;
mod still_frames;

use std::io::{BufRead, Write};
use std::path::PathBuf;

use softgrasp_bench::threads::pool;

use problem::Problem;

/// A line of standard input.
#[derive(serde::Deserialize)]
#[serde(tag = "ask", rename_all = "kebab-case")]
enum Request {
    /// Make the cube of about so many nodes, and write it to the folder.
    Cube { nodes: usize, folder: PathBuf },
    /// Make the problem of a mesh file.
    File { mesh: PathBuf, folder: PathBuf },
    /// Order, factor and solve once; the answers are written to the folder of the problem.
    Run { method: String },
    /// The same by a server of our own, over a loopback socket.
    OverWire { method: String },
    /// Solve by what is kept of the shape.
    Frames,
}

fn main() -> anyhow::Result<()> {
    let threads = match std::env::args().nth(1) {
        Some(count) => count.parse()?,
        None => anyhow::bail!("usage: peer THREADS; requests are read from standard input"),
    };
    let pool = pool(threads)?;
    let mut problem: Option<Problem> = None;
    for line in std::io::stdin().lock().lines() {
        let request: Request = serde_json::from_str(&line?)?;
        let answer = match &request {
            // The server has a pool of its own.
            Request::OverWire { method } => over_wire::run(given(&problem)?, method, threads)?,
            request => pool.install(|| answer(request, &mut problem))?,
        };
        let mut out = std::io::stdout().lock();
        writeln!(out, "{answer}")?;
        out.flush()?;
    }
    Ok(())
}

fn answer(request: &Request, problem: &mut Option<Problem>) -> anyhow::Result<serde_json::Value> {
    let made = match request {
        Request::Cube { nodes, folder } => Problem::cube(*nodes, folder)?,
        Request::File { mesh, folder } => Problem::of_file(mesh, folder)?,
        Request::Run { method } => return methods::run(given(problem)?, method),
        Request::Frames => return still_frames::run(given(problem)?),
        Request::OverWire { .. } => anyhow::bail!("the server is asked by the main thread"),
    };
    let head = made.write()?;
    *problem = Some(made);
    Ok(head)
}

fn given(problem: &Option<Problem>) -> anyhow::Result<&Problem> {
    problem.as_ref().ok_or_else(|| anyhow::anyhow!("ask for a cube or a file first"))
}
