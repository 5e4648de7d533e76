//! The ticks that were seen, so that a run that is played can be scrubbed.

use std::sync::Arc;

use super::frame::{News, NewsKind, ViewFrame};

/// Views of ticks in their order, within a limit of memory.
#[derive(Default)]
pub struct History {
    frames: Vec<Arc<ViewFrame>>,
    marks: Vec<News>,
    bytes: usize,
}

/// Memory for the ticks, bytes; beyond it every second one of the older half is dropped.
const BYTES_MAX: usize = 256 << 20;
/// Most events that are marked; the oldest are dropped.
const MARKS_MAX: usize = 4096;

impl History {
    /// Adds the newest tick. Ticks of a run that began anew replace those before.
    pub fn add(&mut self, frame: Arc<ViewFrame>) {
        if self.frames.last().is_some_and(|last| last.tick > frame.tick) {
            *self = Self::default();
        }
        let marks = frame.news.iter().filter(|news| news.kind == NewsKind::Grasp);
        self.marks.extend(marks.cloned());
        self.marks.drain(..self.marks.len().saturating_sub(MARKS_MAX));
        self.bytes += bytes_of(&frame);
        self.frames.push(frame);
        if self.bytes > BYTES_MAX {
            self.thin_out();
        }
    }

    /// Number of ticks in the history.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether the history is empty.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Numbers of the first and the last tick.
    pub fn ticks(&self) -> Option<(u64, u64)> {
        Some((self.frames.first()?.tick, self.frames.last()?.tick))
    }

    /// The view of a tick, or of the last one before it that was seen.
    pub fn at(&self, tick: u64) -> Option<&Arc<ViewFrame>> {
        let after = self.frames.partition_point(|frame| frame.tick <= tick);
        self.frames.get(after.saturating_sub(1))
    }

    /// Events of the grasp, oldest first.
    pub fn marks(&self) -> &[News] {
        &self.marks
    }

    /// Drops every second one of the older half: the older a tick, the less it is missed.
    fn thin_out(&mut self) {
        let half = self.frames.len() / 2;
        let mut place = 0;
        self.frames.retain(|_| {
            place += 1;
            place > half || place % 2 == 1
        });
        self.bytes = self.frames.iter().map(|frame| bytes_of(frame)).sum();
    }
}

fn bytes_of(frame: &ViewFrame) -> usize {
    let shapes = frame.objects().map(|object| size_of_val(object.displacement.as_slice()));
    size_of::<ViewFrame>() + shapes.sum::<usize>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::frame::samples::{frame, frame_with_news};

    #[test]
    fn tick_between_two_frames_shows_the_one_before_it() {
        let mut history = History::default();
        assert!(history.at(3).is_none() && history.ticks().is_none());
        for tick in [2, 5, 9] {
            history.add(Arc::new(frame_with_news(tick, "entered Free")));
        }
        assert_eq!(history.ticks(), Some((2, 9)));
        let shown = |tick| history.at(tick).unwrap().tick;
        assert_eq!(
            [shown(0), shown(2), shown(4), shown(5), shown(8), shown(99)],
            [2, 2, 2, 5, 5, 9]
        );
        assert_eq!(history.marks().len(), 3);
    }

    #[test]
    fn run_that_begins_anew_has_a_history_of_its_own() {
        let mut history = History::default();
        history.add(Arc::new(frame_with_news(40, "released")));
        history.add(Arc::new(frame(0)));
        assert_eq!((history.ticks(), history.len()), (Some((0, 0)), 1));
        assert!(history.marks().is_empty());
    }

    #[test]
    fn full_history_loses_every_second_frame_of_its_older_half() {
        let mut history = History::default();
        (0..8).for_each(|tick| history.add(Arc::new(frame(tick))));
        history.thin_out();
        let ticks: Vec<u64> = history.frames.iter().map(|frame| frame.tick).collect();
        assert_eq!(ticks, [0, 2, 4, 5, 6, 7]);
    }
}
