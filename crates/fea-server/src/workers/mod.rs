//! Hands work from tokio to rayon: frames on what is prepared, requests by their predicted cost, and
//! what nobody waits for.

mod fair_queue;
mod lane;
mod pool;
mod pools;

pub(crate) use fair_queue::{Asker, Turn};
pub(crate) use pool::EndedAbnormally;
pub(crate) use pool::Rest;
pub(crate) use pools::Workers;
