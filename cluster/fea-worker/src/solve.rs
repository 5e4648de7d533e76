//! Solves one question on all ranks together, and judges the answer by our own rows.
//!
//! Every function here is called by all ranks, which take the same way: what decides is joined over all
//! of them first.

use std::sync::atomic::{AtomicI32, Ordering};
use std::time::Instant;

use softgrasp_core::TetMesh;
use softgrasp_core::fem::summarise_strain;

use crate::order::{Order, Preparation};
use crate::part::Part;
use crate::petsc::{Ranks, RanksError};
use crate::rows::{DamagedPart, Rows};

/// Numbers of the degrees of freedom that rank 0 reads of each answer; empty on the others.
#[derive(Clone, Debug, Default)]
pub struct Wanted {
    /// Those of all nodes.
    pub displacements: Vec<i32>,
    /// Those that are known.
    pub reactions: Vec<i32>,
}

/// Displacements and reactions of one case as rank 0 wanted them.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// At [`Wanted::displacements`], m.
    pub displacements: Vec<f64>,
    /// At [`Wanted::reactions`], N.
    pub reactions: Vec<f64>,
}

/// How a question ended, the same on all ranks but for what only rank 0 wanted.
#[derive(Clone, Debug, Default)]
pub struct Solved {
    /// One for each case.
    pub cases: Vec<Found>,
    /// What the equations were prepared by.
    pub preparation: Option<Preparation>,
    /// Preparations that failed before, each with its reason.
    pub failed: Vec<String>,
    /// Steps of the case that took most.
    pub steps: u32,
    /// Unbalanced over given forces, of all cases the largest.
    pub residual_rel: f64,
    /// Largest correction of the last refinement over the largest displacement.
    pub error_rel: Option<f64>,
    /// Largest rotation and strain, if wanted.
    pub strain: Option<(f64, f64)>,
    /// Digest of the matrix, if wanted.
    pub digest: Option<u64>,
    /// Times of assembly, preparation and solves, ms.
    pub ms: [f64; 3],
    /// Largest resident memory of all ranks together, bytes.
    pub peak_bytes: u64,
}

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq)]
pub enum Unsolved {
    /// Nobody waits for it any more.
    Stopped,
    /// No preparation led to an answer; the reason of each.
    Failed(Vec<String>),
}

/// An error after which the job ends.
#[derive(Debug, thiserror::Error)]
pub enum Broken {
    /// MPI or PETSc failed.
    #[error(transparent)]
    Ranks(#[from] RanksError),
    /// A part did not come as it was sent.
    #[error(transparent)]
    Part(#[from] DamagedPart),
    /// An order or a part has not all its bytes.
    #[error("an order of rank 0 was cut")]
    Cut,
}

/// Residual to which the first solve goes, over the given forces.
const FIRST: f64 = 1e-10;
/// How much a refinement takes off the residual: enough to know how large the error was.
const REFINED: f64 = 1e-2;
/// Residual at which an answer is good.
const GOOD: f64 = 1e-10;
/// Residual up to which an answer is an answer.
const ACCEPTED: f64 = 1e-8;
const ROUNDS_MAX: usize = 4;
/// Steps of conjugate gradients before the next preparation is tried.
const STEPS_MAX: u32 = 1000;

/// What a rank holds while it works on a question.
struct Work<'a> {
    ranks: &'a mut Ranks,
    order: &'a Order,
    part: &'a Part,
    stop: Option<&'a AtomicI32>,
    rows: Rows,
    mesh: Option<TetMesh>,
    /// Numbers of the degrees of freedom of the part's nodes.
    numbers: Vec<i32>,
    /// Whether each degree of freedom of the rows is held.
    is_held: Vec<bool>,
}

/// Solves all cases of a question.
///
/// # Errors
/// [`Broken`]: the job must end.
pub fn solve(
    ranks: &mut Ranks,
    (order, part): (&Order, &Part),
    wanted: &Wanted,
    stop: Option<&AtomicI32>,
) -> Result<Result<Solved, Unsolved>, Broken> {
    let start = Instant::now();
    let (rows, mesh) = Rows::assemble(part)?;
    let digest = order.has_digest.then(|| ranks.xor(rows.digest(part))).transpose()?;
    let numbers = part.numbers.iter().flat_map(|&n| (0..3).map(move |axis| 3 * n as i32 + axis));
    let mut held = vec![false; 3 * part.nodes.len()];
    part.known.iter().for_each(|&dof| held[dof as usize] = true);
    let is_held = rows.nodes.iter().flat_map(|&at| (0..3).map(move |axis| 3 * at as usize + axis));
    let is_held: Vec<bool> = is_held.map(|dof| held[dof]).collect();
    let numbers = numbers.collect();
    let mut work = Work { ranks, order, part, stop, rows, mesh, numbers, is_held };
    work.hand_over()?;
    let mut solved = Solved { digest, ..Solved::default() };
    solved.ms[0] = ms_since(start);
    let ended = work.by_any_preparation(wanted, &mut solved)?;
    work.ranks.forget()?;
    let [peak] = work.ranks.sum([peak_bytes() as f64])?;
    solved.peak_bytes = peak as u64;
    Ok(ended.map(|()| solved))
}

impl Work<'_> {
    /// Gives the matrix to PETSc, with the known degrees of freedom held.
    fn hand_over(&mut self) -> Result<(), Broken> {
        let Self { ranks, part, rows, .. } = self;
        ranks.take_rows(rows, part.own[0], &part.numbers, &part.places)?;
        let [trace, count] = ranks.sum([rows.trace(), 3.0 * rows.nodes.len() as f64])?;
        // A power of two, so that no bit of a product with it depends on the order of the sum.
        let scale = (trace / count).log2().round().exp2();
        let own = self.is_held.iter().enumerate().filter(|(_, is_held)| **is_held);
        let first = 3 * part.own[0] as i32;
        let held: Vec<i32> = own.map(|(dof, _)| first + dof as i32).collect();
        Ok(self.ranks.hold(&held, scale)?)
    }

    fn by_any_preparation(
        &mut self,
        wanted: &Wanted,
        solved: &mut Solved,
    ) -> Result<Result<(), Unsolved>, Broken> {
        let megabytes = self.order.memory_per_rank.0 >> 20;
        for &how in &self.order.preparations.clone() {
            if self.is_stopped()? {
                return Ok(Err(Unsolved::Stopped));
            }
            let start = Instant::now();
            let is_ready = self.ranks.prepare(how, megabytes)?;
            solved.ms[1] += ms_since(start);
            if !is_ready {
                let why = match how {
                    Preparation::Mumps => "it did not fit into the memory of the ranks",
                    _ => "it could not be made",
                };
                solved.failed.push(format!("{}: {why}", how.name()));
                continue;
            }
            let start = Instant::now();
            let ended = self.all_cases(wanted, solved);
            solved.ms[2] += ms_since(start);
            match ended? {
                Ok(()) => {
                    solved.preparation = Some(how);
                    return Ok(Ok(()));
                }
                Err(None) => return Ok(Err(Unsolved::Stopped)),
                Err(Some(why)) => solved.failed.push(format!("{}: {why}", how.name())),
            }
        }
        Ok(Err(Unsolved::Failed(solved.failed.clone())))
    }

    /// Solves all cases; the reason if one is not solved, none if it was stopped.
    fn all_cases(
        &mut self,
        wanted: &Wanted,
        solved: &mut Solved,
    ) -> Result<Result<(), Option<String>>, Broken> {
        solved.cases.clear();
        (solved.residual_rel, solved.error_rel, solved.strain) = (0.0, None, None);
        for case in 0..self.part.cases as usize {
            if self.is_stopped()? {
                return Ok(Err(None));
            }
            match self.case(case, wanted, solved)? {
                Ok(found) => solved.cases.push(found),
                Err(why) => return Ok(Err(why)),
            }
        }
        Ok(Ok(()))
    }

    /// Solves one case: with the known displacements first, then for what is left, and once more for what
    /// is left of that, which tells how wrong it was.
    fn case(
        &mut self,
        case: usize,
        wanted: &Wanted,
        solved: &mut Solved,
    ) -> Result<Result<Found, Option<String>>, Broken> {
        let known = self.known(case);
        let mut u = known.clone();
        let (mut residual, mut local) = self.residual(&u)?;
        let given = self.norm(&residual)?;
        let (mut left, mut steps, mut error_rel) = (given, 0, None);
        for round in 0..ROUNDS_MAX {
            let is_estimated = error_rel.is_some() || !self.order.has_estimate;
            if given == 0.0 || (round > 0 && is_estimated && left <= GOOD * given) {
                break;
            }
            let free: Vec<f64> = self.free(&residual);
            let mut step = vec![0.0; free.len()];
            let tolerance = if round == 0 { FIRST } else { REFINED };
            let ended = self.ranks.solve(&free, &mut step, (tolerance, STEPS_MAX), self.stop)?;
            steps += ended.steps;
            if ended.is_stopped {
                return Ok(Err(None));
            }
            let is_free = self.is_held.iter().map(|is_held| !is_held);
            u.iter_mut()
                .zip(&step)
                .zip(is_free)
                .filter(|(_, free)| *free)
                .for_each(|((u, step), _)| *u += step);
            let largest = |v: &[f64]| v.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            let [most, of_step] = self.ranks.max([largest(&u), largest(&step)])?;
            if round > 0 && most > 0.0 {
                error_rel = Some((of_step / most).max(f64::EPSILON));
            }
            (residual, local) = self.residual(&u)?;
            let before = std::mem::replace(&mut left, self.norm(&residual)?);
            // Rounding has its say, or it has failed: more rounds would not help.
            let is_nearer = left < 0.5 * before;
            if round > 0 && !is_nearer {
                break;
            }
        }
        let residual_rel = if given > 0.0 { left / given } else { left };
        // One that is not a number is not accepted.
        let is_accepted = residual_rel <= ACCEPTED;
        if !is_accepted {
            let text =
                format!("after {steps} steps the residual is {residual_rel:.1e} of the forces");
            return Ok(Err(Some(text)));
        }
        self.note(solved, (steps, residual_rel, error_rel), &local)?;
        let reaction: Vec<f64> = residual.iter().map(|r| -r).collect();
        Ok(Ok(Found {
            displacements: self.ranks.read(&u, &wanted.displacements)?,
            reactions: self.ranks.read(&reaction, &wanted.reactions)?,
        }))
    }

    /// Adds what a case tells about itself.
    fn note(
        &mut self,
        solved: &mut Solved,
        (steps, residual_rel, error_rel): (u32, f64, Option<f64>),
        local: &[f64],
    ) -> Result<(), Broken> {
        solved.steps = solved.steps.max(steps);
        solved.residual_rel = solved.residual_rel.max(residual_rel);
        if self.order.has_estimate {
            let found = self.mesh.as_ref().map(|mesh| summarise_strain(mesh, local, &mut || {}));
            let of_part = found.map_or([0.0; 2], |found| [found.rotation_max, found.strain_max]);
            let [rotation, strain] = self.ranks.max(of_part)?;
            let (rotation_before, strain_before) = solved.strain.unwrap_or_default();
            solved.strain = Some((rotation.max(rotation_before), strain.max(strain_before)));
            let before = solved.error_rel.unwrap_or(0.0);
            // A body that nothing deforms is exact.
            solved.error_rel = Some(error_rel.unwrap_or(0.0).max(before));
        }
        Ok(())
    }

    /// Known displacements of the rows; zero where none is known.
    fn known(&self, case: usize) -> Vec<f64> {
        let part = self.part;
        let mut local = vec![0.0; 3 * part.nodes.len()];
        let values = &part.values[case * part.known.len()..][..part.known.len()];
        part.known.iter().zip(values).for_each(|(&dof, &value)| local[dof as usize] = value);
        let of_row = |&at: &u32| [0, 1, 2].map(|axis| local[3 * at as usize + axis]);
        self.rows.nodes.iter().flat_map(of_row).collect()
    }

    /// `f − K u` on the rows, and u on all nodes of the part.
    fn residual(&mut self, u: &[f64]) -> Result<(Vec<f64>, Vec<f64>), Broken> {
        let local = self.ranks.read(u, &self.numbers)?;
        Ok((self.rows.residual(&local, &self.part.forces), local))
    }

    /// A residual with zeros where nothing is to be solved for.
    fn free(&self, residual: &[f64]) -> Vec<f64> {
        let pairs = residual.iter().zip(&self.is_held);
        pairs.map(|(&r, &is_held)| if is_held { 0.0 } else { r }).collect()
    }

    /// Norm of the free part of a residual, over all ranks.
    fn norm(&mut self, residual: &[f64]) -> Result<f64, Broken> {
        let free = residual.iter().zip(&self.is_held).filter(|(_, is_held)| !**is_held);
        let own: f64 = free.map(|(r, _)| r * r).sum();
        let [sum] = self.ranks.sum([own])?;
        Ok(sum.sqrt())
    }

    /// Whether rank 0 wants to stop.
    fn is_stopped(&mut self) -> Result<bool, Broken> {
        let own = self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed) != 0);
        let [any] = self.ranks.max([f64::from(u8::from(own))])?;
        Ok(any > 0.0)
    }
}

fn ms_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// Largest resident memory of this process; 0 where the system does not tell.
fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kibibytes = line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse().ok());
    kibibytes.map_or(0, |kib: u64| kib << 10)
}
