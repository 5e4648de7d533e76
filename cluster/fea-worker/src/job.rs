//! The way of a question from the sockets of rank 0 to all ranks and back.
//!
//! The threads of the sockets never call MPI: they put questions into a queue, which the main thread of
//! rank 0 takes them from, one after the other. The other ranks sleep until they are told.

use std::sync::atomic::{AtomicI32, Ordering};
use std::sync::{Arc, mpsc};

use fea_server::engine::{Answered, Engine, Equations, Outcome, Task};
use softgrasp_protocol::{Answer, RejectCode, Rejected};
use tokio::sync::oneshot;

use crate::order::Order;
use crate::part::{Part, Whole};
use crate::partition::Numbering;
use crate::petsc::Ranks;
use crate::report::{chosen, outcome, refusal};
use crate::settings::{Choice, Settings};
use crate::solve::{Broken, Solved, Unsolved, Wanted, solve};

/// A question in the queue.
pub struct Asked {
    task: Task,
    /// Not 0 once nobody waits any more.
    stop: Arc<AtomicI32>,
    reply: oneshot::Sender<Result<Answer, Rejected>>,
}

/// The engine of rank 0's server: puts questions into the queue.
#[derive(Debug)]
pub struct Job {
    queue: mpsc::Sender<Asked>,
}

/// Sets a flag when the future that waits for an answer is dropped.
struct StopWhenDropped(Arc<AtomicI32>);

/// What rank 0 tells the others: to end, or to receive an order and their parts.
const END: u64 = 0;
const WORK: u64 = 1;

impl Job {
    /// The engine, and the end of the queue for [`lead`].
    pub fn new() -> (Self, mpsc::Receiver<Asked>) {
        let (queue, asked) = mpsc::channel();
        (Self { queue }, asked)
    }
}

impl Engine for Job {
    fn takes_all(&self) -> bool {
        true
    }

    fn answer(&self, task: Task) -> Answered<'_> {
        Box::pin(async move {
            let stop = Arc::new(AtomicI32::new(0));
            let _waits = StopWhenDropped(Arc::clone(&stop));
            let (reply, replied) = oneshot::channel();
            let ended = || Rejected::new(RejectCode::ShuttingDown, "the job is ending");
            self.queue.send(Asked { task, stop, reply }).map_err(|_| ended())?;
            replied.await.map_err(|_| ended())?
        })
    }
}

impl Drop for StopWhenDropped {
    fn drop(&mut self) {
        self.0.store(1, Ordering::Relaxed);
    }
}

/// The main thread of rank 0: works on the questions of the queue until there is no more engine.
///
/// # Errors
/// [`Broken`]: the job must end.
pub fn lead(
    ranks: &mut Ranks,
    settings: &Settings,
    asked: &mpsc::Receiver<Asked>,
) -> Result<(), Broken> {
    while let Ok(Asked { task, stop, reply }) = asked.recv() {
        if stop.load(Ordering::Relaxed) != 0 {
            continue;
        }
        let answer = answered(ranks, settings, &task, &stop)?;
        // Whoever has gone is not told.
        let _ = reply.send(answer);
    }
    ranks.tell(END)?;
    Ok(())
}

/// The main thread of every other rank: works on what rank 0 sends until that ends.
///
/// # Errors
/// [`Broken`]: the job must end.
pub fn follow(ranks: &mut Ranks) -> Result<(), Broken> {
    while ranks.tell(END)? != END {
        let bytes = ranks.receive()?;
        let (order, part) = Order::from_bytes(&bytes)
            .and_then(|(order, part)| Some((order, Part::from_bytes(part)?)))
            .ok_or(Broken::Cut)?;
        drop(bytes);
        // How it ended is rank 0's to tell.
        let _ = solve(ranks, (&order, &part), &Wanted::default(), None)?;
    }
    Ok(())
}

/// Answers one question with all ranks.
fn answered(
    ranks: &mut Ranks,
    settings: &Settings,
    task: &Task,
    stop: &AtomicI32,
) -> Result<Result<Answer, Rejected>, Broken> {
    let equations = match Equations::of(task) {
        Ok(equations) => equations,
        Err(rejected) => return Ok(Err(rejected)),
    };
    let choice = match settings.choose(task, &equations, ranks.size()) {
        Ok(choice) => choice,
        Err(rejected) => return Ok(Err(rejected)),
    };
    let Choice { order, .. } = &choice;
    let numbering = Numbering::new(equations.mesh.vertices(), &equations.used, ranks.size());
    let part = hand_out(ranks, order, &equations, &numbering)?;
    let wanted = wanted(&equations, &numbering);
    let solved = solve(ranks, (order, &part), &wanted, Some(stop))?;
    Ok(match solved {
        Ok(solved) => told(&solved, &choice, ranks.size(), task, &equations, &numbering),
        Err(unsolved) => {
            tracing::info!(?unsolved, "no answer");
            Err(match unsolved {
                Unsolved::Stopped => Rejected::new(RejectCode::Cancelled, "nobody waits any more"),
                Unsolved::Failed(why) => refusal(&why),
            })
        }
    })
}

/// Cuts the mesh and sends each rank its part; returns that of rank 0.
fn hand_out(
    ranks: &mut Ranks,
    order: &Order,
    equations: &Equations,
    numbering: &Numbering,
) -> Result<Part, Broken> {
    let whole = Whole {
        mesh: &equations.mesh,
        element: equations.element,
        materials: &equations.materials,
        known: [&equations.known].into_iter().chain(&equations.cases).collect(),
        forces: &equations.forces,
    };
    ranks.tell(WORK)?;
    for rank in 1..ranks.size() {
        let mut bytes = order.to_bytes();
        bytes.extend(Part::cut(&whole, numbering, rank).to_bytes());
        ranks.send(rank, &bytes)?;
    }
    Ok(Part::cut(&whole, numbering, 0))
}

/// What rank 0 reads: the displacements of all used nodes, in the order of the mesh, and the reactions.
fn wanted(equations: &Equations, numbering: &Numbering) -> Wanted {
    let number = |node: usize| 3 * numbering.number[node] as i32;
    let used = (0..equations.used.len()).filter(|&node| equations.used[node]);
    let reactions = equations.known.dofs.iter();
    Wanted {
        displacements: used.flat_map(|node| (0..3).map(move |axis| number(node) + axis)).collect(),
        reactions: reactions.map(|&dof| number(dof as usize / 3) + dof as i32 % 3).collect(),
    }
}

fn told(
    solved: &Solved,
    choice: &Choice,
    ranks: usize,
    task: &Task,
    equations: &Equations,
    numbering: &Numbering,
) -> Result<Answer, Rejected> {
    let outcome: Outcome = outcome(solved, (choice, ranks), (task, equations));
    let nodes = numbering.start.last().copied().unwrap_or(0);
    tracing::info!(
        nodes,
        method = outcome.report.method,
        steps = solved.steps,
        residual_rel = solved.residual_rel,
        error_rel = solved.error_rel,
        assemble_ms = solved.ms[0],
        prepare_ms = solved.ms[1],
        solve_ms = solved.ms[2],
        peak_mib = solved.peak_bytes >> 20,
        why = chosen(solved, choice, ranks),
        "answered"
    );
    if let Some(digest) = solved.digest {
        tracing::info!("matrix {digest:016x}");
    }
    if outcome.has_no_certain_digit() {
        return Err(refusal(&["no digit of the answer would be certain".to_owned()]));
    }
    Ok(outcome.answer(task, equations))
}
