//! Priority of the thread that plays the ticks, by how long the object takes an answer.

use softgrasp_grasp::object::{ObjectError, SoftObject};

use crate::pace::tick_budget::{LIMIT, Priority, TickBudget};

/// Real-time priority for the ticks if the object takes an answer within half of the time that such a
/// thread may compute; the other half is for the rest of a tick.
///
/// # Errors
/// [`ObjectError`] if the object cannot be shown.
pub fn priority_for(object: &mut SoftObject) -> Result<Priority, ObjectError> {
    let mut trial = TickBudget::new(Priority::Ordinary);
    let still = vec![[0.0; 3]; object.surface().nodes.len()];
    // The second time the memory is there.
    for _ in 0..2 {
        trial.begin();
        object.apply_to_surface(&still)?;
        let computed = trial.end();
        object.relax()?;
        if computed <= LIMIT / 2 {
            return Ok(Priority::RealTime);
        }
    }
    Ok(Priority::Ordinary)
}
