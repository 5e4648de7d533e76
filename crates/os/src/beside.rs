//! One kind of long work on a thread of its own, without real-time priority, beside the ticks.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};

/// A thread that does one job after the other, and what has become of them.
///
/// To be started before its owner asks for real-time priority, which a new thread would inherit.
/// When it is dropped the thread ends by itself after the job it is at.
pub struct Beside<Job, Done> {
    jobs: Sender<Job>,
    done: Receiver<Done>,
    /// Outcomes that were waited for and have not been taken.
    settled: VecDeque<Done>,
    /// Jobs whose outcome has not been taken.
    waiting: usize,
}

impl<Job: Send + 'static, Done: Send + 'static> Beside<Job, Done> {
    /// Starts the thread.
    ///
    /// # Errors
    /// The error of the operating system, when it starts no thread.
    pub fn start(
        name: &str,
        mut work: impl FnMut(Job) -> Done + Send + 'static,
    ) -> std::io::Result<Self> {
        let (jobs, to_do) = channel::<Job>();
        let (finished, done) = channel();
        let thread = std::thread::Builder::new().name(name.to_owned());
        thread.spawn(move || {
            for job in to_do {
                if finished.send(work(job)).is_err() {
                    return;
                }
            }
        })?;
        Ok(Self { jobs, done, settled: VecDeque::new(), waiting: 0 })
    }

    /// Hands a job over. A thread that has panicked does nothing any more: the job is lost.
    pub fn begin(&mut self, job: Job) {
        self.waiting += usize::from(self.jobs.send(job).is_ok());
    }

    /// Whether a job was handed over whose outcome has not been taken.
    pub fn is_busy(&self) -> bool {
        self.waiting > 0
    }

    /// The next outcome, if it is there; never waits.
    pub fn take(&mut self) -> Option<Done> {
        if let Some(done) = self.settled.pop_front() {
            self.waiting = self.waiting.saturating_sub(1);
            return Some(done);
        }
        match self.done.try_recv() {
            Ok(done) => {
                self.waiting = self.waiting.saturating_sub(1);
                Some(done)
            }
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                self.waiting = 0;
                None
            }
        }
    }

    /// The next outcome of a job that was handed over; waits for it.
    pub fn wait(&mut self) -> Option<Done> {
        self.settle();
        self.take()
    }

    /// Waits until every job that was handed over is done; the outcomes are still to be taken.
    pub fn settle(&mut self) {
        while self.settled.len() < self.waiting {
            match self.done.recv() {
                Ok(done) => self.settled.push_back(done),
                // The thread has panicked: what is not done is lost.
                Err(_) => self.waiting = self.settled.len(),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jobs_are_done_in_order_while_the_owner_goes_on() {
        let (gate, passed) = channel::<()>();
        let mut beside = Beside::start("squares", move |n: u32| {
            // Stays at its job until the owner lets it go on.
            let _ = passed.recv();
            n * n
        })
        .unwrap();
        assert!(!beside.is_busy() && beside.take().is_none() && beside.wait().is_none());
        beside.begin(3);
        beside.begin(4);
        assert!(beside.is_busy() && beside.take().is_none());
        gate.send(()).unwrap();
        gate.send(()).unwrap();
        beside.settle();
        assert!(beside.is_busy(), "an outcome that nobody has taken");
        assert_eq!((beside.take(), beside.wait(), beside.take()), (Some(9), Some(16), None));
        assert!(!beside.is_busy());
    }

    #[test]
    fn job_that_panics_leaves_nothing_to_wait_for() {
        let mut beside = Beside::start("fault", |n: u32| {
            assert!(n < 2, "this panic is part of the test");
            n
        })
        .unwrap();
        beside.begin(7);
        assert_eq!(beside.wait(), None);
        assert!(!beside.is_busy());
    }
}
