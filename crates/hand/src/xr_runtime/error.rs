//! Why an OpenXR runtime brings no hands.

use std::fmt;

/// Result of a call of OpenXR, as the runtime gave it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct XrResult {
    /// Number of the result (`XrResult` of the specification); negative for an error.
    pub code: i32,
    /// Name of the result.
    pub name: String,
}

impl fmt::Display for XrResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.name, self.code)
    }
}

/// Why hands cannot be had from an OpenXR runtime, or no longer.
#[derive(Debug, thiserror::Error)]
pub enum RuntimeError {
    /// The program was built without the feature `openxr`.
    #[error("this build asks no OpenXR runtime; build glove-client with its feature `openxr`")]
    NotBuilt,
    /// There is no such hand.
    #[error("openxr brings both hands, openxr:left or openxr:right one: there is no {name:?}")]
    NoSuchHand {
        /// Name that was given.
        name: String,
    },
    /// The loader of OpenXR, a shared library, is not on this machine.
    #[error(
        "there is no OpenXR loader; install it (Debian: libopenxr-loader1) and a runtime such as Monado: \
         {why}"
    )]
    NoLoader {
        /// What the system says about the library.
        why: String,
    },
    /// The loader finds no runtime, or that runtime does not run.
    #[error(
        "no OpenXR runtime answers, {result}: start one, or name the file of one by XR_RUNTIME_JSON"
    )]
    NoRuntime {
        /// Result of the call.
        result: XrResult,
    },
    /// The runtime lacks an extension that is needed.
    #[error("the OpenXR runtime has no {name}: it brings no hands to a program without a picture")]
    NoExtension {
        /// Name of the extension.
        name: &'static str,
    },
    /// The runtime has no headset.
    #[error("the OpenXR runtime {runtime} has no headset, {result}")]
    NoHeadset {
        /// Name of the runtime.
        runtime: String,
        /// Result of the call.
        result: XrResult,
    },
    /// The headset tracks no hands.
    #[error("the headset of the OpenXR runtime {runtime} tracks no hands")]
    NoHandTracking {
        /// Name of the runtime.
        runtime: String,
    },
    /// A call failed.
    #[error("the OpenXR runtime {runtime} fails: {call} gives {result}")]
    Call {
        /// Name of the runtime.
        runtime: String,
        /// Name of the call.
        call: &'static str,
        /// Result of the call.
        result: XrResult,
    },
    /// The runtime has ended the session, or says that it is about to.
    #[error("the OpenXR runtime {runtime} has ended the session")]
    Ended {
        /// Name of the runtime.
        runtime: String,
    },
    /// The runtime did not answer in time.
    #[error("the OpenXR runtime has not answered for {seconds} s")]
    NoAnswer {
        /// Time that was waited, s.
        seconds: u64,
    },
    /// The system starts no thread for the hands.
    #[error("no thread to ask the OpenXR runtime")]
    Thread {
        /// Error of the operating system.
        source: std::io::Error,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_refusal_of_a_runtime_has_its_number() {
        let result = || XrResult { code: -51, name: "ERROR_RUNTIME_UNAVAILABLE".to_owned() };
        let runtime = || "Monado".to_owned();
        let refusals = [
            RuntimeError::NoRuntime { result: result() },
            RuntimeError::NoHeadset { runtime: runtime(), result: result() },
            RuntimeError::Call { runtime: runtime(), call: "xrCreateSession", result: result() },
        ];
        for refusal in refusals {
            let said = refusal.to_string();
            assert!(said.contains("ERROR_RUNTIME_UNAVAILABLE (-51)"), "{said}");
        }
    }
}
