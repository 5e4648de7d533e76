//! One tick of the force: local model, coupling, safeguard and passivity, without clock and device.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::energy::EnergyLedger;
use crate::limits::DeviceLimits;
use crate::local_model::{LocalForces, LocalModel};
use crate::safeguard::{Release, Safeguard};
use crate::small_system::SmallSystem;

/// Ports of a device: the fingers, thumb first. An arm on the desk has one, the first.
pub const PORTS: usize = 5;

/// What a tick knows of the world.
///
/// Units: s, m. Frame: world.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moment<'a> {
    /// Time of the tick on the clock of the force, s.
    pub now_s: f64,
    /// Time at which the step of the newest answer ended, on the same clock; `None` before the first.
    pub answer_s: Option<f64>,
    /// Newest poses of the bodies, with the time at which the hand was there; empty before the first.
    pub world_from_bodies: &'a [Isometry3<f64>],
    /// Time at which the hand was there, s.
    pub hand_s: f64,
    /// Place of the device, where it has one of its own.
    pub device: Option<Vector3<f64>>,
    /// Fault of device or server.
    pub fault: Option<Release>,
}

/// Forces of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rendered {
    /// Force on the hand at each port, N, world.
    pub forces: [Vector3<f64>; PORTS],
    /// Place of each port, m, world; zero where nothing touches.
    pub places: [Vector3<f64>; PORTS],
    /// Energy that the hand has given at each port so far, damping included, J.
    pub energies: [f64; PORTS],
    /// Share of the forces that acts: 1 after the rise.
    pub share: f64,
    /// Residual of the law of contact, N.
    pub residual: f64,
}

/// An answer that is older releases the force, s.
pub const ANSWER_AGE_MAX: f64 = 0.25;
/// A hand that was not seen for longer releases the force, s.
pub const HAND_AGE_MAX: f64 = 0.25;
/// A step from tick to tick that is longer releases the force, s.
pub const TICK_MAX: f64 = 0.05;
/// Residual of the law, over the largest force, above which nothing is rendered.
const RESIDUAL_MAX: f64 = 0.05;

/// A contact that a force is held at.
#[derive(Clone, Copy, Debug)]
struct Anchor {
    port: usize,
    body: usize,
    place_in_body: Point3<f64>,
    place: Point3<f64>,
    /// Share of the port's force.
    share: f64,
}

/// The state of the force from tick to tick.
#[derive(Clone, Debug)]
pub struct Rendering {
    limits: DeviceLimits,
    model: LocalModel,
    ledgers: [EnergyLedger; PORTS],
    guard: Safeguard,
    /// Contacts of the last tick.
    anchors: Vec<Anchor>,
    /// Place of the device in the last tick, and where it was when the newest poses came.
    device: Option<Vector3<f64>>,
    device_at_hand: Option<Vector3<f64>>,
    hand_s: f64,
    last_s: Option<f64>,
    force_max: f64,
    softened: f64,
}

impl Rendering {
    /// Without an answer, so without force.
    pub fn new(limits: DeviceLimits) -> Self {
        Self {
            limits,
            model: LocalModel::new(SmallSystem::empty(), f64::INFINITY),
            ledgers: std::array::from_fn(|_| EnergyLedger::new(limits)),
            guard: Safeguard::new(limits.force_max),
            anchors: Vec::new(),
            device: None,
            device_at_hand: None,
            hand_s: f64::NEG_INFINITY,
            last_s: None,
            force_max: 0.0,
            softened: 0.0,
        }
    }

    /// Takes a newer answer: from now on the local model is about it.
    pub fn take(&mut self, system: SmallSystem) {
        self.model = LocalModel::new(system, self.limits.stiffness_max());
        self.softened = self.softened.max(self.model.softened());
    }

    /// The forces from this tick to the next.
    pub fn tick(&mut self, moment: &Moment<'_>) -> Rendered {
        if moment.hand_s > self.hand_s {
            (self.hand_s, self.device_at_hand) = (moment.hand_s, moment.device);
        }
        let shift = match (moment.device, self.device_at_hand) {
            (Some(now), Some(then)) => now - then,
            _ => Vector3::zeros(),
        };
        self.observe(moment, &shift);
        let (places, is_placed) = self.places(moment, &shift);
        let found = self.model.forces_at(&places);
        let mut rendered = self.by_port(&found, &places);
        let fault = self.fault(moment, is_placed, &found);
        rendered.share = self.guard.guard(moment.now_s, fault, &mut rendered.forces);
        self.hold(&mut rendered, &found);
        self.anchor(&places);
        self.last_s = Some(moment.now_s);
        self.device = moment.device;
        rendered
    }

    /// Books what the hand has done since the last tick.
    fn observe(&mut self, moment: &Moment<'_>, shift: &Vector3<f64>) {
        let Some(last_s) = self.last_s else { return };
        let seconds = moment.now_s - last_s;
        if let (Some(now), Some(before)) = (moment.device, self.device) {
            // The device is the port, whatever the hand of the run does.
            self.ledgers[0].observe(&(now - before), seconds);
            return;
        }
        let mut ways = [Vector3::zeros(); PORTS];
        for anchor in &self.anchors {
            let Some(pose) = moment.world_from_bodies.get(anchor.body) else { continue };
            let way = pose * anchor.place_in_body + shift - anchor.place;
            ways[anchor.port] += anchor.share * way;
        }
        for (ledger, way) in self.ledgers.iter_mut().zip(&ways) {
            ledger.observe(way, seconds);
        }
    }

    /// Places of the contacts now, and whether the bodies of all are known.
    fn places(&self, moment: &Moment<'_>, shift: &Vector3<f64>) -> (Vec<Point3<f64>>, bool) {
        let mut is_placed = true;
        let of_contact = |contact: &crate::SmallContact| {
            let pose = moment.world_from_bodies.get(contact.body as usize);
            match (pose, contact.port) {
                (Some(pose), Some(_)) => contact.place_at(pose) + shift,
                (Some(pose), None) => contact.place_at(pose),
                (None, _) => {
                    is_placed = false;
                    contact.place
                }
            }
        };
        let places = self.model.system().contacts().iter().map(of_contact).collect();
        (places, is_placed)
    }

    /// Forces on the hand at the ports, and where they act.
    fn by_port(&self, found: &LocalForces, places: &[Point3<f64>]) -> Rendered {
        let mut rendered = Rendered { residual: found.residual, ..Rendered::default() };
        let mut weights = [0.0; PORTS];
        let contacts = self.model.system().contacts().iter().zip(places).zip(&found.forces);
        for ((contact, place), force) in contacts {
            let Some(port) = contact.port.filter(|port| *port < PORTS) else { continue };
            rendered.forces[port] -= force;
            let weight = force.norm();
            rendered.places[port] += weight * place.coords;
            weights[port] += weight;
        }
        for (place, weight) in rendered.places.iter_mut().zip(weights) {
            *place = if weight > 0.0 { *place / weight } else { Vector3::zeros() };
        }
        rendered
    }

    /// Why no force may act.
    fn fault(&self, moment: &Moment<'_>, is_placed: bool, found: &LocalForces) -> Option<Release> {
        let is_late = self.last_s.is_some_and(|last| moment.now_s - last > TICK_MAX);
        // An object that lies still on its table is not asked about.
        let is_felt = self.model.system().contacts().iter().any(|c| c.port.is_some());
        let is_old = moment.answer_s.is_none_or(|then| moment.now_s - then > ANSWER_AGE_MAX);
        let is_unseen = !is_placed || moment.now_s - moment.hand_s > HAND_AGE_MAX;
        let largest = found.forces.iter().map(Vector3::norm).fold(0.0, f64::max);
        // Written so that a NaN is a fault too.
        let is_solved = found.residual <= RESIDUAL_MAX * largest || found.is_converged;
        match () {
            () if moment.fault.is_some() => moment.fault,
            () if is_late => Some(Release::TickLost),
            () if is_felt && is_old => Some(Release::StaleAnswer),
            () if is_felt && is_unseen => Some(Release::StaleHand),
            () if !is_solved => Some(Release::Unsolved),
            () => None,
        }
    }

    /// Lets the passivity of each port decide how much of its force acts.
    fn hold(&mut self, rendered: &mut Rendered, found: &LocalForces) {
        let mut stored = [0.0; PORTS];
        for (contact, energy) in self.model.system().contacts().iter().zip(&found.stored) {
            if let Some(port) = contact.port.filter(|port| *port < PORTS) {
                stored[port] += energy;
            }
        }
        for (port, ledger) in self.ledgers.iter_mut().enumerate() {
            rendered.forces[port] = ledger.allow(rendered.forces[port], stored[port]);
            rendered.energies[port] = ledger.balance();
            self.force_max = self.force_max.max(rendered.forces[port].norm());
        }
    }

    /// Notes where the forces are held.
    fn anchor(&mut self, places: &[Point3<f64>]) {
        let contacts = self.model.system().contacts();
        let count = |port: usize| contacts.iter().filter(|c| c.port == Some(port)).count() as f64;
        let anchor = |(contact, place): (&crate::SmallContact, &Point3<f64>)| {
            let port = contact.port.filter(|port| *port < PORTS)?;
            Some(Anchor {
                port,
                body: contact.body as usize,
                place_in_body: contact.place_in_body,
                place: *place,
                share: 1.0 / count(port),
            })
        };
        self.anchors = contacts.iter().zip(places).filter_map(anchor).collect();
    }

    /// Energy of each port.
    pub fn ledgers(&self) -> &[EnergyLedger; PORTS] {
        &self.ledgers
    }

    /// Ceiling, rise and releases.
    pub fn guard(&self) -> &Safeguard {
        &self.guard
    }

    /// Largest force that was rendered at a port, N.
    pub fn force_max(&self) -> f64 {
        self.force_max
    }

    /// Largest share of a port's stiffness that the virtual coupling has taken.
    pub fn softened(&self) -> f64 {
        self.softened
    }

    /// Limits of the device.
    pub fn limits(&self) -> &DeviceLimits {
        &self.limits
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::small_system::SmallContact;

    fn pressing(port: Option<usize>) -> SmallSystem {
        let contact = SmallContact {
            body: 0,
            port,
            place_in_body: Point3::origin(),
            place: Point3::origin(),
            normal: -Vector3::z(),
            force: Vector3::new(0.0, 0.0, -0.1),
            friction: 0.5,
        };
        SmallSystem::try_new(vec![contact], DMatrix::identity(3, 3) / 200.0).unwrap()
    }

    /// Releases in a second in which answer and hand grow old.
    fn releases(port: Option<usize>, answers: bool, hands: bool) -> Vec<Release> {
        let mut rendering = Rendering::new(DeviceLimits::brakes());
        rendering.take(pressing(port));
        for tick in 0..1000 {
            let now_s = f64::from(tick) * 1e-3;
            rendering.tick(&Moment {
                now_s,
                answer_s: Some(if answers { now_s } else { 0.0 }),
                world_from_bodies: &[Isometry3::identity()],
                hand_s: if hands { now_s } else { 0.0 },
                device: None,
                fault: None,
            });
        }
        rendering.guard().releases().iter().map(|(_, why)| *why).collect()
    }

    #[test]
    fn old_answers_and_old_hands_release_what_a_port_feels() {
        assert_eq!(releases(Some(0), true, true), []);
        assert_eq!(releases(Some(0), false, true), [Release::StaleAnswer]);
        assert_eq!(releases(Some(0), true, false), [Release::StaleHand]);
        assert_eq!(releases(None, false, false), [], "nobody feels the table");
    }

    #[test]
    fn a_tick_that_comes_far_too_late_releases() {
        let mut rendering = Rendering::new(DeviceLimits::brakes());
        for now_s in [0.0, 0.001, 0.2, 0.201] {
            rendering.tick(&Moment { now_s, ..Moment::default() });
        }
        let releases = rendering.guard().releases();
        assert_eq!(releases, [(0.2, Release::TickLost)]);
    }
}
