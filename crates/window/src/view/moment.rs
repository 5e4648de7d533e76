//! A moment of a run that a picture is taken of: a tick, or the end of a state.

use std::fmt;
use std::str::FromStr;

use softgrasp_grasp::grasp::StateName;

/// Moment of a run at which a picture is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// In the tick of this number.
    Tick(u64),
    /// In the last tick of the n-th visit to a state, counted from 1: the fingers have squeezed as
    /// far as they do.
    EndOf(StateName, u32),
}

/// The text is not the name of a moment.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "'{0}' is no moment; there are free, avoiding, attached, deforming, detached, each also with \
     :N for its N-th visit, and the number of a tick"
)]
pub struct UnknownMoment(String);

const STATES: [StateName; 5] = [
    StateName::Free,
    StateName::Avoiding,
    StateName::Attached,
    StateName::Deforming,
    StateName::Detached,
];

impl FromStr for Moment {
    type Err = UnknownMoment;

    fn from_str(text: &str) -> Result<Self, UnknownMoment> {
        let unknown = || UnknownMoment(text.to_owned());
        if let Ok(tick) = text.parse() {
            return Ok(Self::Tick(tick));
        }
        let (name, visit) = text.split_once(':').unwrap_or((text, "1"));
        let visit = visit.parse().ok().filter(|visit| *visit > 0).ok_or_else(unknown)?;
        let named = |state: &&StateName| state.to_string().eq_ignore_ascii_case(name);
        let state = STATES.iter().find(named).ok_or_else(unknown)?;
        Ok(Self::EndOf(*state, visit))
    }
}

impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tick(tick) => write!(f, "tick {tick}"),
            Self::EndOf(state, 1) => write!(f, "the end of {state}"),
            Self::EndOf(state, visit) => write!(f, "the end of visit {visit} to {state}"),
        }
    }
}

/// Watches a run for a moment.
#[derive(Clone, Debug)]
pub struct Watch {
    moment: Moment,
    state: Option<StateName>,
    visits: u32,
}

impl Watch {
    /// Watches for a moment.
    pub fn new(moment: Moment) -> Self {
        Self { moment, state: None, visits: 0 }
    }

    /// Takes a tick in. Returns whether the moment may be this tick, so that it is worth keeping, and
    /// whether the one that was kept before it was the moment.
    pub fn see(&mut self, tick: u64, state: Option<StateName>) -> (bool, bool) {
        match self.moment {
            Moment::Tick(moment) => (tick <= moment, tick > moment),
            Moment::EndOf(awaited, visit) => {
                let was_there = self.state == Some(awaited) && self.visits == visit;
                if state == Some(awaited) && self.state != state {
                    self.visits += 1;
                }
                self.state = state;
                let is_there = state == Some(awaited) && self.visits == visit;
                (is_there, was_there && !is_there)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_read_and_nonsense_is_refused() {
        assert_eq!("77".parse(), Ok(Moment::Tick(77)));
        assert_eq!("deforming".parse(), Ok(Moment::EndOf(StateName::Deforming, 1)));
        assert_eq!("Attached:2".parse(), Ok(Moment::EndOf(StateName::Attached, 2)));
        for text in ["", "squeezed", "deforming:0", "deforming:x", "-3", ":2"] {
            assert!(text.parse::<Moment>().is_err(), "{text}");
        }
    }

    #[test]
    fn last_tick_of_the_visit_that_was_asked_for_is_the_moment() {
        use StateName::{Deforming, Free};
        let states = [Free, Deforming, Deforming, Free, Deforming, Deforming, Deforming, Free];
        let found = |visit| {
            let mut watch = Watch::new(Moment::EndOf(Deforming, visit));
            let mut kept = None;
            for (tick, state) in (0..).zip(states) {
                let (keeps, done) = watch.see(tick, Some(state));
                if done {
                    return kept;
                }
                kept = if keeps { Some(tick) } else { kept };
            }
            None
        };
        assert_eq!((found(1), found(2), found(3)), (Some(2), Some(6), None));
    }
}
