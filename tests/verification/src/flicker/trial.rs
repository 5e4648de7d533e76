//! A hand with noise: number of changes of a held grasp, and delay of its release.

use anyhow::Context;
use glove_client::object::loading::{ObjectRequest, load};
use glove_client::object::scene::size_to_hold;
use nalgebra::Isometry3;
use softgrasp_core::mesh::BuiltIn;
use softgrasp_grasp::grasp::{Grasp, StateName, StepInput, sense};
use softgrasp_grasp::hand::HandColliders;
use softgrasp_grasp::object::{ContactModel, ObjectChoice};
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::loaded_object::LoadedObject;
use softgrasp_hand::scripted::{ScriptName, ScriptedHand, Seen};
use softgrasp_hand::sent::Arrival;
use softgrasp_protocol::ElementName;

use super::noise::Noise;

/// Number of ticks without motion above which a hand counts as still; one that closes slowly stops for
/// fewer.
const STILL_TICKS: usize = 8;
/// Ticks per second.
pub const RATE_HZ: f64 = 60.0;

/// Object, and the plan to grasp it.
pub struct Stage {
    loaded: LoadedObject,
}

/// Grasp that follows device bytes, without a server: the contacts do not depend on it.
struct Follower<'a> {
    stage: &'a Stage,
    grasp: Grasp,
    reader: HandReader,
    tick: u64,
    seen: Seen,
}

impl Stage {
    /// Stage with the strawberry of the default run.
    ///
    /// # Errors
    /// The object cannot be made.
    pub fn strawberry() -> anyhow::Result<Self> {
        let choice = ObjectChoice::BuiltIn(BuiltIn::Strawberry);
        let request = ObjectRequest {
            regions: Vec::new(),
            nodes: 1000,
            size_m: size_to_hold(&choice),
            setup: HandSetup::default(),
            contact: ContactModel::default(),
            element: ElementName::T4,
            choice,
        };
        let loaded = load(&request, |_| true)?.context("the object was called off")?;
        Ok(Self { loaded })
    }

    fn hand(&self, script: ScriptName) -> anyhow::Result<ScriptedHand> {
        let plan = self.loaded.plan.clone()?;
        Ok(ScriptedHand::following(script, HandSetup::default(), plan))
    }

    fn follower(&self, margin_m: f64) -> anyhow::Result<Follower<'_>> {
        Ok(Follower {
            stage: self,
            grasp: Grasp::try_new(Isometry3::identity(), margin_m)?,
            reader: HandReader::new(HandSetup::default()),
            tick: 0,
            seen: Seen::default(),
        })
    }

    /// Device bytes of a script, tick by tick, until `holds` accepts the state of the product's grasp, or
    /// to the end.
    fn script(
        &self,
        script: ScriptName,
        holds: impl Fn(Option<StateName>) -> bool,
    ) -> anyhow::Result<Vec<Vec<Arrival>>> {
        let mut hand = self.hand(script)?;
        let mut follower = self.follower(Grasp::RELEASE_MARGIN_M)?;
        let mut played = Vec::new();
        for _ in 0..1000 {
            let sent = hand.next(&follower.seen, &self.loaded.object);
            if sent.over {
                return Ok(played);
            }
            let state = follower.follow(&sent.arrivals);
            played.push(sent.arrivals);
            if holds(state) {
                return Ok(played);
            }
        }
        anyhow::bail!("the script does not come to the state")
    }

    /// Number of changes of the grasp while a hand rests, with noise, that has just come into a state.
    ///
    /// Units: `margin_m` m.
    ///
    /// # Errors
    /// The script does not reach the state.
    pub fn changes(
        &self,
        margin_m: f64,
        state: StateName,
        ticks: u64,
        seed: u64,
    ) -> anyhow::Result<u64> {
        let approach = self.script(ScriptName::Squeeze, |at| at == Some(state))?;
        let mut follower = self.follower(margin_m)?;
        let mut before = None;
        approach.iter().for_each(|arrivals| before = follower.follow(arrivals));
        let last = approach.last().context("the script is empty")?;
        let mut noise = Noise::new(seed);
        let mut changes = 0;
        for _ in 0..ticks {
            let now = follower.follow(&noise.on(last));
            changes += u64::from(now != before);
            before = now;
        }
        Ok(changes)
    }

    /// Time from the beginning of the opening of the hand until the object is not deformed any more, s;
    /// `None` if a grasp with this margin has released it before.
    ///
    /// # Errors
    /// The script does not come so far.
    pub fn release_s(&self, margin_m: f64) -> anyhow::Result<Option<f64>> {
        let played = self.script(ScriptName::Release, |_| false)?;
        let held = self.script(ScriptName::Release, |at| at == Some(StateName::Deforming))?.len();
        // The hand presses, holds still, and opens: it opens when it moves again.
        let still = |tick: &usize| played[*tick] == played[*tick - 1];
        let rests = |from: &usize| (*from..*from + STILL_TICKS).all(|tick| still(&tick));
        let rests = (held..played.len() - STILL_TICKS).find(rests);
        let rests = rests.context("the hand never holds still")?;
        let opens = (rests..played.len()).find(|tick| !still(tick));
        let opens = opens.context("the hand never opens")?;
        let mut follower = self.follower(margin_m)?;
        for (tick, arrivals) in played.iter().enumerate() {
            let holds = follower.follow(arrivals) == Some(StateName::Deforming);
            if tick >= opens && !holds {
                return Ok((tick > opens).then(|| (tick - opens + 1) as f64 / RATE_HZ));
            }
        }
        anyhow::bail!("the hand with a margin of {margin_m} m never lets go")
    }
}

impl Follower<'_> {
    fn follow(&mut self, arrivals: &[Arrival]) -> Option<StateName> {
        let now_s = self.tick as f64 / RATE_HZ;
        self.tick += 1;
        self.reader.feed(arrivals, now_s);
        let hand = self.reader.hand(now_s)?;
        let object = &self.stage.loaded.object;
        let colliders = HandColliders::new(&self.reader.setup().dimensions, &hand);
        let world_from_object = self.grasp.world_from_object(&hand.world_from_palm);
        let margin = self.grasp.release_margin();
        let fingers =
            sense(object.tree(), object.normals(), &colliders, &world_from_object, margin);
        self.seen.inside = std::array::from_fn(|i| fingers[i].tip_hits[0].is_some());
        let step = self.grasp.step(&StepInput {
            world_from_palm: hand.world_from_palm,
            world_from_segment: hand.fingers.map(|f| f.segments.map(|s| s.world_from_segment)),
            fingers,
            command: None,
        });
        self.seen.state = Some(step.state);
        self.seen.world_from_object = step.world_from_object;
        Some(step.state)
    }
}
