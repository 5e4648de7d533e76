//! Changes that take their time: another object, another hand; made beside window and ticks.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use nalgebra::Isometry3;
use softgrasp_grasp::object::{ContactModel, ObjectChoice, RestShape};
use softgrasp_hand::hand_request::HandChoice;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::hand_source::HandSource;
use softgrasp_hand::loaded_object::{LoadStage, LoadedObject};
use softgrasp_hand::mouse::MouseHand;
use softgrasp_hand::scripted::{PlanRequest, Planner, ScriptedHand};

use crate::view::control::Control;
use crate::view::loading::{LoadObject, Loading, ObjectWish};

/// A hand that a person watches squeezes and holds so many times as long.
pub const SQUEEZE_TIMES: u32 = 3;

/// A change that is under way beside window and ticks.
#[derive(Default)]
pub enum Change {
    /// No change is under way.
    #[default]
    None,
    /// An object that is being loaded.
    Object(Loading, ObjectChoice),
    /// A hand that is being made.
    Hand(Receiver<Result<HandSource, String>>, HandChoice),
}

/// Outcome of a change.
pub enum Changed {
    /// The object is loaded, and is to be handed to the ticks.
    Object(Box<LoadedObject>, ObjectChoice),
    /// The hand is made, and the control that puts it in the place of the old one.
    Hand(Control, HandChoice),
    /// The change failed; why, in a sentence.
    Failed(String),
    /// The file gives no object; why, in a sentence.
    Refused(PathBuf, String),
}

impl Change {
    /// Begins to load an object.
    ///
    /// # Errors
    /// A sentence, where the system gives no thread.
    pub fn object(load: LoadObject, wish: ObjectWish) -> Result<Self, String> {
        let choice = wish.choice.clone();
        match Loading::start(load, wish) {
            Ok(loading) => Ok(Self::Object(loading, choice)),
            Err(error) => Err(format!("cannot load {choice}: {error}")),
        }
    }

    /// Begins to make a hand for an object at rest; `contact` is what its fingertips hold. A hand
    /// that the person moves takes over at `world_from_palm`.
    pub fn hand(
        wish: HandChoice,
        object: Arc<RestShape>,
        contact: ContactModel,
        tick_s: f64,
        world_from_palm: Option<Isometry3<f64>>,
    ) -> Self {
        let (made, result) = channel();
        let thread = std::thread::Builder::new().name("hand".to_owned());
        let started = thread.spawn(move || {
            // Nobody may be waiting any more.
            let _ = made.send(hand(wish, object, contact, tick_s, world_from_palm));
        });
        if let Err(error) = started {
            tracing::warn!(%error, "cannot start a thread that makes a hand");
        }
        Self::Hand(result, wish)
    }

    /// The stage of an object that is being loaded, and its name.
    pub fn stage(&self) -> Option<(LoadStage, String)> {
        match self {
            Self::Object(loading, choice) => Some((loading.stage(), choice.to_string())),
            Self::None | Self::Hand(..) => None,
        }
    }

    /// What has become of the change, once that is known.
    pub fn take(&mut self) -> Option<Changed> {
        let changed = match self {
            Self::None => return None,
            Self::Object(loading, choice) => match loading.take()? {
                Ok(loaded) => Changed::Object(Box::new(loaded), choice.clone()),
                Err(error) => match choice {
                    ObjectChoice::File(path) => Changed::Refused(path.clone(), error),
                    ObjectChoice::BuiltIn(_) => Changed::Failed(error),
                },
            },
            Self::Hand(result, wish) => match result.try_recv() {
                Err(TryRecvError::Empty) => return None,
                Ok(Ok(hand)) => Changed::Hand(Control::ReplaceHand(Box::new(hand)), *wish),
                Ok(Err(text)) => Changed::Failed(text),
                Err(TryRecvError::Disconnected) => {
                    Changed::Failed("the hand could not be made; choose it again".to_owned())
                }
            },
        };
        *self = Self::None;
        Some(changed)
    }
}

/// A hand that plans its approaches beside the ticks.
fn hand(
    wish: HandChoice,
    object: Arc<RestShape>,
    contact: ContactModel,
    tick_s: f64,
    world_from_palm: Option<Isometry3<f64>>,
) -> Result<HandSource, String> {
    let setup = HandSetup::default();
    let planner = Planner::beside().map_err(|error| format!("cannot start a thread: {error}"))?;
    match wish {
        HandChoice::Mouse => {
            let hand = MouseHand::new(setup, planner, tick_s).holding(contact);
            Ok(match world_from_palm {
                Some(palm) => hand.taking_over_at(palm).into(),
                None => hand.into(),
            })
        }
        HandChoice::Live | HandChoice::Replay => {
            Err("name the devices or the recording with --hand when you start the program"
                .to_owned())
        }
        HandChoice::Scripted(script) => {
            let request = PlanRequest::new(object, setup.clone(), contact);
            let grip = request.grip().map_err(|error| error.to_string())?;
            let hand = ScriptedHand::following(script, setup, grip).squeezing_longer(SQUEEZE_TIMES);
            Ok(hand.holding(contact).with_planner(planner).into())
        }
    }
}
