//! Grasp rules (thesis 4.5–4.6) as a pure state machine.
