//! Hands work from tokio to rayon: frames on what is prepared, requests by their predicted cost, and
//! what nobody waits for.

mod caught;
mod fair_queue;
mod lane;
mod pool;
mod pools;
mod rest;

pub(crate) use caught::EndedAbnormally;
pub(crate) use fair_queue::{Asker, Turn};
pub(crate) use pools::Workers;
pub(crate) use rest::Rest;
