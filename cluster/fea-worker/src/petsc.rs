//! The ranks of one job: MPI and PETSc behind safe functions. The one file with `unsafe`.
//!
//! Every function of [`Ranks`] is called by all ranks together unless it says otherwise. An error means
//! that the ranks may stand at different places; nothing but the end of the job ends that.

use std::ffi::{CString, c_char, c_int, c_longlong, c_ulonglong};
use std::marker::PhantomData;
use std::sync::atomic::AtomicI32;

use crate::order::Preparation;
use crate::rows::Rows;

unsafe extern "C" {
    fn sg_start(options: *const c_char, rank: *mut c_int, size: *mut c_int) -> c_int;
    fn sg_end() -> c_int;
    fn sg_abort();
    fn sg_tell(number: *mut c_longlong) -> c_int;
    fn sg_send(to: c_int, bytes: *const u8, len: usize) -> c_int;
    fn sg_receive(bytes: *mut u8, len: usize) -> c_int;
    fn sg_sum(values: *mut f64, count: c_int) -> c_int;
    fn sg_max(values: *mut f64, count: c_int) -> c_int;
    fn sg_xor(value: *mut c_ulonglong) -> c_int;
    fn sg_drop() -> c_int;
    fn sg_new(
        nodes: c_int,
        first: c_int,
        row_start: *const u64,
        columns: *const c_int,
        blocks: *const [f64; 9],
        places: *const [f64; 3],
    ) -> c_int;
    fn sg_hold(count: c_int, dofs: *const c_int, scale: f64) -> c_int;
    fn sg_prepare(kind: c_int, megabytes: c_int, failed: *mut c_int) -> c_int;
    fn sg_solve(
        count: c_int,
        b: *const f64,
        x: *mut f64,
        tolerance: f64,
        most: c_int,
        stop: *const c_int,
        steps: *mut c_int,
        reason: *mut c_int,
        over: *mut c_int,
    ) -> c_int;
    fn sg_read(
        own_count: c_int,
        own: *const f64,
        count: c_int,
        dofs: *const c_int,
        read: *mut f64,
    ) -> c_int;
}

/// All ranks of a job, seen from one of them. There is one in a process, on its main thread.
pub struct Ranks {
    rank: usize,
    size: usize,
    // MPI is called by the thread that started it.
    _is_of_one_thread: PhantomData<*const ()>,
}

/// MPI or PETSc failed; the job must end.
#[derive(Debug, thiserror::Error)]
#[error("{doing} failed in MPI or PETSc (error {code})")]
pub struct RanksError {
    doing: &'static str,
    code: c_int,
}

/// How a solve ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended {
    /// Steps that were taken.
    pub steps: u32,
    /// Whether the residual wanted was reached.
    pub is_reached: bool,
    /// Whether rank 0 stopped it.
    pub is_stopped: bool,
}

fn done(doing: &'static str, code: c_int) -> Result<(), RanksError> {
    match code {
        0 => Ok(()),
        code => Err(RanksError { doing, code }),
    }
}

/// A length for MPI and PETSc, which count in 32 bits.
fn int(count: usize) -> Result<c_int, RanksError> {
    c_int::try_from(count).map_err(|_| RanksError { doing: "counting in 32 bits", code: 0 })
}

impl Ranks {
    /// Starts MPI and PETSc; `options` are read as from PETSc's command line.
    ///
    /// # Errors
    /// [`RanksError`].
    pub fn start(options: &str) -> Result<Self, RanksError> {
        let options = CString::new(options)
            .map_err(|_| RanksError { doing: "reading the options of PETSc", code: 0 })?;
        let (mut rank, mut size) = (0, 0);
        // SAFETY: the text ends with a zero byte, and both numbers are written before it returns.
        done("starting", unsafe { sg_start(options.as_ptr(), &raw mut rank, &raw mut size) })?;
        let [rank, size] = [rank, size].map(|n| usize::try_from(n).unwrap_or(0));
        Ok(Self { rank, size, _is_of_one_thread: PhantomData })
    }

    /// Number of this rank, from 0.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Number of all ranks.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Ends MPI and PETSc.
    ///
    /// # Errors
    /// [`RanksError`].
    pub fn end(self) -> Result<(), RanksError> {
        // SAFETY: both were started, by this thread, and nothing of them is used afterwards.
        done("ending", unsafe { sg_end() })
    }

    /// Ends the whole job at once; called by one rank.
    pub fn abort(&self) {
        // SAFETY: MPI was started.
        unsafe { sg_abort() }
    }

    /// The number that rank 0 gives; the others sleep until it comes.
    ///
    /// # Errors
    /// [`RanksError`].
    pub fn tell(&mut self, number: u64) -> Result<u64, RanksError> {
        let mut told = number as c_longlong;
        // SAFETY: one number is read on rank 0 and written on the others.
        done("waiting for an order", unsafe { sg_tell(&raw mut told) })?;
        Ok(told as u64)
    }

    /// Sends bytes from rank 0 to another, which receives them; called by these two.
    ///
    /// # Errors
    /// [`RanksError`].
    pub fn send(&mut self, to: usize, bytes: &[u8]) -> Result<(), RanksError> {
        let len = (bytes.len() as u64).to_le_bytes();
        let to = int(to)?;
        // SAFETY: as many bytes are read as there are.
        done("sending", unsafe { sg_send(to, len.as_ptr(), len.len()) })?;
        // SAFETY: as many bytes are read as there are.
        done("sending", unsafe { sg_send(to, bytes.as_ptr(), bytes.len()) })
    }

    /// Bytes that rank 0 sends to this one.
    ///
    /// # Errors
    /// [`RanksError`].
    pub fn receive(&mut self) -> Result<Vec<u8>, RanksError> {
        let mut len = [0; 8];
        // SAFETY: as many bytes are written as there is room.
        done("receiving", unsafe { sg_receive(len.as_mut_ptr(), len.len()) })?;
        let mut bytes = vec![0; u64::from_le_bytes(len) as usize];
        // SAFETY: as many bytes are written as there is room.
        done("receiving", unsafe { sg_receive(bytes.as_mut_ptr(), bytes.len()) })?;
        Ok(bytes)
    }

    /// Sums of numbers over all ranks.
    ///
    /// # Errors
    /// [`RanksError`].
    pub fn sum<const N: usize>(&mut self, mut values: [f64; N]) -> Result<[f64; N], RanksError> {
        // SAFETY: N numbers are read and written.
        done("summing", unsafe { sg_sum(values.as_mut_ptr(), int(N)?) })?;
        Ok(values)
    }

    /// Largest of numbers over all ranks.
    ///
    /// # Errors
    /// [`RanksError`].
    pub fn max<const N: usize>(&mut self, mut values: [f64; N]) -> Result<[f64; N], RanksError> {
        // SAFETY: N numbers are read and written.
        done("comparing", unsafe { sg_max(values.as_mut_ptr(), int(N)?) })?;
        Ok(values)
    }

    /// The words of all ranks joined by exclusive or.
    ///
    /// # Errors
    /// [`RanksError`].
    pub fn xor(&mut self, value: u64) -> Result<u64, RanksError> {
        let mut joined: c_ulonglong = value;
        // SAFETY: one word is read and written.
        done("joining", unsafe { sg_xor(&raw mut joined) })?;
        Ok(joined)
    }

    /// Hands the rows of this rank to PETSc.
    ///
    /// Shapes: `numbers` and `places` of the nodes of the part; `first` the number of the first row.
    ///
    /// # Errors
    /// [`RanksError`].
    pub fn take_rows(
        &mut self,
        rows: &Rows,
        first: u32,
        numbers: &[u32],
        places: &[[f64; 3]],
    ) -> Result<(), RanksError> {
        let nodes = rows.nodes.len();
        let columns: Vec<c_int> =
            rows.columns.iter().map(|&at| numbers[at as usize] as c_int).collect();
        let places: Vec<[f64; 3]> = rows.nodes.iter().map(|&at| places[at as usize]).collect();
        assert_eq!(rows.start.len(), nodes + 1, "each row begins somewhere");
        assert_eq!(rows.start.last().copied(), Some(columns.len() as u64), "rows hold all blocks");
        assert_eq!(rows.blocks.len(), columns.len(), "each block has a column");
        let (nodes, first) = (int(nodes)?, int(first as usize)?);
        // SAFETY: the lengths are those that the asserts compare, and nothing is kept afterwards.
        done("making the matrix", unsafe {
            sg_new(
                nodes,
                first,
                rows.start.as_ptr(),
                columns.as_ptr(),
                rows.blocks.as_ptr(),
                places.as_ptr(),
            )
        })
    }

    /// Holds degrees of freedom of this rank's rows, by number; `scale` stands on their diagonal.
    ///
    /// # Errors
    /// [`RanksError`].
    pub fn hold(&mut self, dofs: &[i32], scale: f64) -> Result<(), RanksError> {
        let count = int(dofs.len())?;
        // SAFETY: as many numbers are read as there are.
        done("holding", unsafe { sg_hold(count, dofs.as_ptr(), scale) })
    }

    /// Makes a hierarchy or a factor; returns whether that succeeded.
    ///
    /// Units: `megabytes` of this rank, for a factor.
    ///
    /// # Errors
    /// [`RanksError`].
    pub fn prepare(&mut self, how: Preparation, megabytes: u64) -> Result<bool, RanksError> {
        let megabytes = c_int::try_from(megabytes).unwrap_or(c_int::MAX);
        let mut failed = 0;
        // SAFETY: one number is written.
        done("preparing", unsafe {
            sg_prepare(c_int::from(how.number()), megabytes, &raw mut failed)
        })?;
        Ok(failed == 0)
    }

    /// Solves for this rank's right-hand side; `stop` is looked at on rank 0 in each step.
    ///
    /// # Errors
    /// [`RanksError`].
    pub fn solve(
        &mut self,
        b: &[f64],
        x: &mut [f64],
        (tolerance, most): (f64, u32),
        stop: Option<&AtomicI32>,
    ) -> Result<Ended, RanksError> {
        assert_eq!(b.len(), x.len(), "one answer for each row");
        let stop = stop.map_or(std::ptr::null(), |stop| stop.as_ptr().cast_const());
        let (mut steps, mut reason, mut over) = (0, 0, 0);
        let (count, most) = (int(b.len())?, int(most as usize)?);
        // SAFETY: both slices have `count` numbers; the flag outlives the call; three numbers are written.
        done("solving", unsafe {
            sg_solve(
                count,
                b.as_ptr(),
                x.as_mut_ptr(),
                tolerance,
                most,
                stop,
                &raw mut steps,
                &raw mut reason,
                &raw mut over,
            )
        })?;
        Ok(Ended {
            steps: u32::try_from(steps).unwrap_or(0),
            is_reached: reason > 0,
            is_stopped: over != 0,
        })
    }

    /// Entries of a vector of which each rank has its own part; `dofs` are numbers in the whole.
    ///
    /// # Errors
    /// [`RanksError`].
    pub fn read(&mut self, own: &[f64], dofs: &[i32]) -> Result<Vec<f64>, RanksError> {
        let mut read = vec![0.0; dofs.len()];
        let (own_count, count) = (int(own.len())?, int(dofs.len())?);
        // SAFETY: the lengths are those of the slices, and nothing is kept afterwards.
        done("reading a vector", unsafe {
            sg_read(own_count, own.as_ptr(), count, dofs.as_ptr(), read.as_mut_ptr())
        })?;
        Ok(read)
    }

    /// Drops matrix and preparation.
    ///
    /// # Errors
    /// [`RanksError`].
    pub fn forget(&mut self) -> Result<(), RanksError> {
        // SAFETY: what is not there is not dropped.
        done("dropping the matrix", unsafe { sg_drop() })
    }
}
