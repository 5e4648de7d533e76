//! Sentences about devices on the terminal during a run: each when it is first known, and once.

use std::collections::BTreeSet;
use std::sync::mpsc::{Sender, channel};
use std::thread::JoinHandle;

use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// Sentences that were printed; a thread of its own prints, so that no tick waits for a terminal.
pub(super) struct DeviceSentences {
    said: BTreeSet<String>,
    to_say: Option<Sender<String>>,
    thread: Option<JoinHandle<()>>,
}

/// Largest number of different sentences on the terminal; the report has all of them.
const SAID_MAX: usize = 200;

impl DeviceSentences {
    /// Prints sentences by `say`. To be called before the calling thread has real-time priority.
    ///
    /// # Errors
    /// Error of the operating system if it starts no thread.
    pub(super) fn start(say: impl Fn(&str) + Send + 'static) -> std::io::Result<Self> {
        let (to_say, sentences) = channel::<String>();
        let thread = std::thread::Builder::new().name("sentences".to_owned());
        let thread = thread.spawn(move || sentences.iter().for_each(|text| say(&text)))?;
        Ok(Self { said: BTreeSet::new(), to_say: Some(to_say), thread: Some(thread) })
    }

    /// Takes the sentences of a tick.
    pub(super) fn hear(&mut self, outcome: &TickOutcome) {
        for event in &outcome.events {
            let LoopEvent::Device(notice) = event else { continue };
            if self.said.len() >= SAID_MAX || !self.said.insert(notice.text.clone()) {
                continue;
            }
            if let Some(to_say) = &self.to_say {
                // A terminal that is gone hears nothing.
                let _ = to_say.send(notice.text.clone());
            }
        }
    }
}

impl Drop for DeviceSentences {
    /// Waits until all is printed, so that it precedes the summary of the run.
    fn drop(&mut self) {
        drop(self.to_say.take());
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the thread that says sentences ended abnormally");
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use softgrasp_hand::notice::Notice;

    use super::*;

    #[test]
    fn sentence_on_a_device_is_said_while_the_run_goes_on_and_not_said_again() {
        let said = Arc::new(Mutex::new(Vec::new()));
        let (told, heard) = channel();
        let hears = Arc::clone(&said);
        let mut sentences = DeviceSentences::start(move |text| {
            hears.lock().unwrap().push(text.to_owned());
            told.send(()).unwrap();
        })
        .unwrap();
        let event = |text: &str| LoopEvent::Device(Notice::refused(text));
        let tick = |events: Vec<LoopEvent>| TickOutcome { events, ..TickOutcome::default() };
        let server = LoopEvent::Server("connected".to_owned());
        sentences.hear(&tick(vec![server, event("the joints are those of a giant")]));
        heard.recv_timeout(std::time::Duration::from_secs(60)).expect("it waits for the end");
        sentences.hear(&tick(vec![event("the joints are those of a giant")]));
        sentences.hear(&tick(vec![event("the glove is silent")]));
        drop(sentences);
        let all = ["the joints are those of a giant", "the glove is silent"];
        assert_eq!(*said.lock().unwrap(), all);
    }
}
