//! What a person asks of a run while it is played: the menu, the mouse hand, pause and stop.

use std::path::PathBuf;

use nalgebra::UnitQuaternion;
use softgrasp_hand::hand_source::HandSource;
use softgrasp_hand::loaded_object::LoadedObject;
use softgrasp_hand::mouse::MouseInput;
use softgrasp_protocol::{Material, MethodName};

/// One wish. It takes effect at the beginning of the next tick; what becomes of it is told by a
/// [`softgrasp_hand::notice::Notice`].
pub enum Control {
    /// Make the deformed shape the rest shape.
    KeepShape,
    /// Go back to the rest shape before the last one that was kept.
    UndoKeepShape,
    /// Let the object go where it is.
    Detach,
    /// Put the object back to where it began.
    ReturnHome,
    /// Write the object as it is now, whole, in the format that the extension names. An older file
    /// is replaced.
    Save(PathBuf),
    /// Put another object in the place of this one.
    ReplaceObject(Box<LoadedObject>),
    /// Put another hand in the place of this one.
    ReplaceHand(Box<HandSource>),
    /// Make the object of another elastic material; what holds it goes on holding it.
    SetMaterial(Material),
    /// Solve by another method.
    SetMethod(MethodName),
    /// Largest relative error of an answer; `None` leaves it to the method.
    SetMaxError(Option<f64>),
    /// Whether answers hold the forces at the fingertips.
    SetForces(bool),
    /// Whether answers hold every node, or the surface only.
    SetWhole(bool),
    /// Turn the object about its centre by a rotation in the world.
    TurnObject(UnitQuaternion<f64>),
    /// A wish to the mouse hand.
    Mouse(MouseInput),
    /// Play the script again from its beginning.
    Restart,
    /// Play no more ticks until told to.
    Pause,
    /// Go on with the ticks after a pause.
    Resume,
    /// Play one tick of a run that is paused.
    Step,
    /// End the run with the script; at once, if a person moves the hand: nobody watches any more.
    EndWithScript,
    /// End the run.
    Stop,
}
