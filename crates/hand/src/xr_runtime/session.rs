//! A session of OpenXR without graphics: what is asked of the runtime, call by call.

use std::array;
use std::path::Path;

use openxr::{
    ApplicationInfo, Entry, Event, EventDataBuffer, ExtensionSet, FormFactor, Hand,
    HandJointLocation, HandTracker, Headless, Instance, Posef, ReferenceSpaceType, Session,
    SessionState, Space, Version, ViewConfigurationType, headless,
};
use softgrasp_grasp::hand::Handedness;

use super::error::{RuntimeError, XrResult};
use super::located::{LocatedJoint, record_of};
use super::wanted::WantedHands;
use crate::joints::JointsRecord;

/// Names of the loader's library; the second one comes with the packages for developers only.
#[cfg(not(any(target_os = "windows", target_os = "macos")))]
const LOADERS: [&str; 2] = ["libopenxr_loader.so.1", "libopenxr_loader.so"];
#[cfg(target_os = "macos")]
const LOADERS: [&str; 1] = ["libopenxr_loader.dylib"];
#[cfg(target_os = "windows")]
const LOADERS: [&str; 1] = ["openxr_loader.dll"];

/// Extension that tells the runtime's time.
#[cfg(not(windows))]
const CLOCK: &str = "XR_KHR_convert_timespec_time";
#[cfg(windows)]
const CLOCK: &str = "XR_KHR_win32_convert_performance_counter_time";

/// The library through which a runtime is found.
pub(super) struct Loader(Entry);

impl Loader {
    /// Opens the library.
    ///
    /// # Errors
    /// [`RuntimeError::NoLoader`].
    pub(super) fn open() -> Result<Self, RuntimeError> {
        Self::open_one_of(&LOADERS)
    }

    fn open_one_of(names: &[&str]) -> Result<Self, RuntimeError> {
        let mut why = String::new();
        for name in names {
            // SAFETY: a library of this name is the loader of the Khronos Group or stands in for it.
            match unsafe { Entry::load_from(Path::new(name), &()) } {
                Ok(entry) => return Ok(Self(entry)),
                // The first name is the usual one.
                Err(error) if why.is_empty() => why = softgrasp_os::one_line(&error),
                Err(_) => {}
            }
        }
        Err(RuntimeError::NoLoader { why })
    }

    /// Extensions that are needed, if the runtime has them all.
    fn extensions(&self) -> Result<ExtensionSet, RuntimeError> {
        let there = self.0.enumerate_extensions();
        let there = there.map_err(|result| RuntimeError::NoRuntime { result: told(result) })?;
        #[cfg(not(windows))]
        let has_clock = there.khr_convert_timespec_time;
        #[cfg(windows)]
        let has_clock = there.khr_win32_convert_performance_counter_time;
        let needed = [
            (there.mnd_headless, "XR_MND_headless"),
            (there.ext_hand_tracking, "XR_EXT_hand_tracking"),
            (has_clock, CLOCK),
        ];
        if let Some((_, name)) = needed.into_iter().find(|(is_there, _)| !is_there) {
            return Err(RuntimeError::NoExtension { name });
        }
        let mut wanted = ExtensionSet::default();
        wanted.mnd_headless = true;
        wanted.ext_hand_tracking = true;
        #[cfg(not(windows))]
        {
            wanted.khr_convert_timespec_time = true;
        }
        #[cfg(windows)]
        {
            wanted.khr_win32_convert_performance_counter_time = true;
        }
        Ok(wanted)
    }
}

/// A session with the trackers of the hands that are wanted.
///
/// Frame: the space LOCAL, with Y up, which every runtime has; it begins where the headset is, and −Z is where
/// the person looked then.
pub(super) struct HandSession {
    // What was made last goes first.
    trackers: Vec<(Handedness, HandTracker)>,
    space: Space,
    session: Session<Headless>,
    instance: Instance,
    runtime: String,
    is_begun: bool,
    frame: u64,
}

impl HandSession {
    /// Opens a session.
    ///
    /// # Errors
    /// [`RuntimeError`]: no runtime, one that lacks something, or a call that failed.
    pub(super) fn open(loader: &Loader, wanted: WantedHands) -> Result<Self, RuntimeError> {
        let extensions = loader.extensions()?;
        let about = ApplicationInfo {
            application_name: "Softgrasp",
            application_version: 0,
            engine_name: "Softgrasp",
            engine_version: 0,
            api_version: Version::new(1, 0, 0),
        };
        let instance = loader.0.create_instance(&about, &extensions, &[], &());
        let instance =
            instance.map_err(|result| RuntimeError::NoRuntime { result: told(result) })?;
        let runtime = instance.properties().map_or_else(|_| String::new(), |p| p.runtime_name);
        let failed = |call| {
            let runtime = runtime.clone();
            move |result| RuntimeError::Call { runtime, call, result: told(result) }
        };
        let system = instance.system(FormFactor::HEAD_MOUNTED_DISPLAY).map_err(|result| {
            RuntimeError::NoHeadset { runtime: runtime.clone(), result: told(result) }
        })?;
        let tracks = instance.supports_hand_tracking(system);
        if !tracks.map_err(failed("xrGetSystemProperties"))? {
            return Err(RuntimeError::NoHandTracking { runtime });
        }
        // SAFETY: a session without graphics is given no handle of anybody.
        let session =
            unsafe { instance.create_session::<Headless>(system, &headless::SessionCreateInfo {}) };
        let (session, _, _) = session.map_err(failed("xrCreateSession"))?;
        let space = session.create_reference_space(ReferenceSpaceType::LOCAL, Posef::IDENTITY);
        let space = space.map_err(failed("xrCreateReferenceSpace"))?;
        let mut trackers = Vec::new();
        for side in wanted.sides() {
            let hand = match side {
                Handedness::Left => Hand::LEFT,
                Handedness::Right => Hand::RIGHT,
            };
            let tracker = session.create_hand_tracker(hand);
            trackers.push((*side, tracker.map_err(failed("xrCreateHandTrackerEXT"))?));
        }
        let (is_begun, frame) = (false, 0);
        Ok(Self { trackers, space, session, instance, runtime, is_begun, frame })
    }

    /// Name of the runtime.
    pub(super) fn runtime(&self) -> &str {
        &self.runtime
    }

    /// The hands that are seen now; none before the runtime has begun the session.
    ///
    /// # Errors
    /// [`RuntimeError::Call`] and [`RuntimeError::Ended`]: the runtime is lost, or ends the session.
    pub(super) fn locate(&mut self) -> Result<Vec<JointsRecord>, RuntimeError> {
        self.hear()?;
        if !self.is_begun {
            return Ok(Vec::new());
        }
        let now = self.instance.now().map_err(self.failed("the conversion of the time"))?;
        let time_s = 1e-9 * now.as_nanos() as f64;
        self.frame += 1;
        let mut records = Vec::with_capacity(self.trackers.len());
        for (side, tracker) in &self.trackers {
            let located = self.space.locate_hand_joints(tracker, now);
            let located = located.map_err(self.failed("xrLocateHandJointsEXT"))?;
            let Some(joints) = located else { continue };
            let joints = array::from_fn(|at| located_joint(&joints[at]));
            records.extend(record_of(*side, &joints, self.frame, time_s));
        }
        Ok(records)
    }

    /// Hears what the runtime has to say, and begins and ends the session as it wants.
    fn hear(&mut self) -> Result<(), RuntimeError> {
        let mut buffer = EventDataBuffer::new();
        loop {
            let event = self.instance.poll_event(&mut buffer);
            let state = match event.map_err(self.failed("xrPollEvent"))? {
                None => return Ok(()),
                Some(Event::InstanceLossPending(_)) => SessionState::LOSS_PENDING,
                Some(Event::SessionStateChanged(change)) => change.state(),
                Some(_) => continue,
            };
            match state {
                SessionState::READY => {
                    let begun = self.session.begin(ViewConfigurationType::PRIMARY_STEREO);
                    begun.map_err(self.failed("xrBeginSession"))?;
                    self.is_begun = true;
                }
                SessionState::STOPPING => {
                    self.is_begun = false;
                    self.session.end().map_err(self.failed("xrEndSession"))?;
                }
                SessionState::EXITING | SessionState::LOSS_PENDING => {
                    return Err(RuntimeError::Ended { runtime: self.runtime.clone() });
                }
                _ => {}
            }
        }
    }

    /// The error of a call of this name.
    fn failed(&self, call: &'static str) -> impl FnOnce(openxr::sys::Result) -> RuntimeError {
        move |result| {
            let runtime = self.runtime.clone();
            RuntimeError::Call { runtime, call, result: told(result) }
        }
    }
}

/// A joint as the runtime wrote it.
fn located_joint(joint: &HandJointLocation) -> LocatedJoint {
    let Posef { position, orientation } = joint.pose;
    LocatedJoint {
        flags: joint.location_flags.into_raw(),
        position: [position.x, position.y, position.z].map(f64::from),
        orientation: [orientation.x, orientation.y, orientation.z, orientation.w].map(f64::from),
        radius_m: f64::from(joint.radius),
    }
}

fn told(result: openxr::sys::Result) -> XrResult {
    XrResult { code: result.into_raw(), name: format!("{result:?}") }
}

#[cfg(test)]
mod tests {
    use super::super::located::POSITION_VALID;
    use super::*;

    #[test]
    fn machine_without_a_loader_is_told_what_to_install() {
        let opened = Loader::open_one_of(&["libno_such_loader.so.1"]).map(|_| ());
        let Err(RuntimeError::NoLoader { why }) = opened else { panic!("{opened:?}") };
        assert!(why.contains("libno_such_loader.so.1"), "{why}");
    }

    #[test]
    fn joint_of_a_runtime_keeps_its_numbers() {
        let pose = Posef {
            position: openxr::Vector3f { x: 0.5, y: 1.25, z: -0.75 },
            orientation: openxr::Quaternionf { x: 0.1, y: 0.2, z: 0.3, w: 0.4 },
        };
        let location_flags = openxr::SpaceLocationFlags::POSITION_VALID;
        let joint = HandJointLocation { location_flags, pose, radius: 0.25 };
        let located = located_joint(&joint);
        assert_eq!(located.flags, POSITION_VALID);
        assert_eq!((located.position, located.radius_m), ([0.5, 1.25, -0.75], 0.25));
        assert_eq!(located.orientation.map(|c| c as f32), [0.1, 0.2, 0.3, 0.4]);
    }
}
