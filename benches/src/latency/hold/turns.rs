//! Runs loops in turns of a second, so that other work on the machine disturbs all of them alike.

use glove_client::pace::be_urgent;

use super::holder::Holder;
use super::kept::Kept;
use crate::report::ReportError;

/// Loop with a server and loop without, both with or both without real-time scheduling.
pub(super) struct Pair {
    /// Whether the threads have real-time scheduling.
    pub real_time: bool,
    /// Ticks in which a server was asked.
    pub asking: Kept,
    /// Ticks of the same sleeps in which no server was asked.
    pub control: Kept,
}

/// Whether the system grants real-time scheduling to a thread of this process.
pub(super) fn is_granted() -> bool {
    std::thread::scope(|scope| scope.spawn(be_urgent).join().unwrap_or(false))
}

/// Runs all loops in `turns` turns of as many ticks each; each turn begins with another one.
///
/// # Errors
/// [`ReportError`] of the first loop that fails.
pub(super) fn take_turns(
    holders: Vec<(bool, Holder<'_>)>,
    turns: usize,
    ticks: usize,
) -> Result<Vec<Pair>, ReportError> {
    let empty = |real_time| Pair { real_time, asking: Kept::default(), control: Kept::default() };
    let mut loops: Vec<_> = holders.into_iter().map(|(rt, h)| (h, empty(rt))).collect();
    let count = loops.len();
    for turn in 0..turns {
        for place in 0..count {
            let (holder, pair) = &mut loops[(turn + place) % count];
            // The first turn asks first: the control stays awake as long as an answer takes.
            let order = if turn % 2 == 0 { [false, true] } else { [true, false] };
            for is_control in order {
                let kept = on_a_thread(pair.real_time, || match is_control {
                    true => holder.idle_for(ticks),
                    false => holder.ask_for(ticks),
                })?;
                match is_control {
                    true => pair.control.append(kept),
                    false => pair.asking.append(kept),
                }
            }
        }
    }
    Ok(loops.into_iter().map(|(_, pair)| pair).collect())
}

/// Runs `work` on a thread of its own, because real-time scheduling belongs to a thread.
fn on_a_thread(
    real_time: bool,
    work: impl FnOnce() -> Result<Kept, ReportError> + Send,
) -> Result<Kept, ReportError> {
    std::thread::scope(|scope| {
        let turn = scope.spawn(|| {
            if real_time {
                be_urgent();
            }
            work()
        });
        turn.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}
