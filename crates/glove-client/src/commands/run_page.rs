//! Page of a run: opened before the run, shown every tick that is due, closed after it.

use std::net::IpAddr;
use std::sync::mpsc::{Receiver, Sender};

use anyhow::Context;
use fea_server::{Encryption, EncryptionError};
use softgrasp_hand::hand_request::HandChoice;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::joints::JointsFeed;
use softgrasp_hand::notice::Notice;
use softgrasp_window::view::control::Control;
#[cfg(feature = "window")]
use softgrasp_window::view::frame::ViewFrame;
use softgrasp_window::view::object_skin::Look;
use softgrasp_window::view::outlet::Outlet;
use softgrasp_xr::{Page, PageOptions, ShownRun};

use super::page_arguments::PageArguments;
use super::run_arguments::RunArguments;
use super::run_plan::RunPlan;
use super::run_setup::load_beside;
use crate::pace::Due;
use crate::run::observer::{Foresight, Observer};
use crate::run::session::Session;
use crate::run::tick_outcome::TickOutcome;

/// Page that is being served.
pub(super) struct RunPage {
    page: Page,
    out: Option<Outlet>,
    observer: Observer,
    foresight: Foresight,
}

/// Channels between page and ticks.
pub(super) struct PageTalk {
    /// Channel for wishes to the ticks.
    pub(super) controls: Sender<Control>,
    /// Channel of sentences for the person.
    pub(super) notices: Receiver<Notice>,
    /// Whether a window shows the run too.
    pub(super) has_window: bool,
}

impl RunPage {
    /// Serves the page, if it was asked for, and prints its address.
    ///
    /// # Errors
    /// A port that is in use, or a certificate that cannot be used.
    pub(super) fn open(arguments: &RunArguments, plan: &RunPlan) -> anyhow::Result<Option<Self>> {
        let Some(address) = arguments.page.xr else { return Ok(None) };
        let page = &arguments.page;
        let encryption =
            encryption_of(page, address.ip()).context("the page cannot be encrypted")?;
        let encryption = encryption.map(|encryption| encryption.acceptor());
        let is_encrypted = encryption.is_some();
        let takes_hands = plan.takes_headset();
        let page = Page::open(PageOptions { address, encryption, takes_hands })?;
        eprintln!("glove-client: the page is at {}", page.address());
        if !is_encrypted && !address.ip().is_loopback() {
            eprintln!(
                "glove-client: it is not encrypted: a headset shows it flat and tracks no hand; \
                 --xr-tls encrypts it"
            );
        }
        let (observer, foresight) = (Observer::default(), Foresight::default());
        Ok(Some(Self { page, out: None, observer, foresight }))
    }

    /// Feed of the joints of a headset's hand.
    pub(super) fn joints(&self) -> JointsFeed {
        self.page.joints()
    }

    /// Shows a run from now on. To be called before the calling thread has real-time priority.
    ///
    /// # Errors
    /// Error of the operating system if it starts no thread.
    pub(super) fn begin(
        &mut self,
        arguments: &RunArguments,
        plan: &RunPlan,
        talk: PageTalk,
    ) -> anyhow::Result<()> {
        let PageTalk { controls, notices, has_window } = talk;
        let hand = plan.choice();
        let request = plan.first.request(&HandSetup::default());
        let run = ShownRun {
            look: Look::of(&plan.first.object.to_string()),
            material: plan.elastic_material()?,
            shading: arguments.shown.shading,
            is_directed: matches!(hand, HandChoice::Scripted(_) | HandChoice::Mouse),
            begins_anew: !has_window && arguments.begins_anew(plan),
            has_window,
            controls,
            notices,
            load: (!has_window).then(|| load_beside(request)),
        };
        let out = self.page.begin(run).context("cannot start a thread for the page")?;
        self.out = Some(out);
        Ok(())
    }

    /// Offers a tick to the page.
    pub(super) fn add(&mut self, due: Due, now_s: f64, outcome: &TickOutcome, session: &Session) {
        self.observer.note(due, outcome);
        let Some(out) = self.out.as_mut().filter(|out| out.is_due()) else { return };
        let mut frame = self.observer.frame(due, now_s, outcome, session.grasp_loop());
        frame.acts = self.foresight.acts(session.hand(), session.grasp_loop());
        out.publish(Box::new(frame));
    }

    /// Offers a frame that was made for the window.
    #[cfg(feature = "window")]
    pub(super) fn show(&mut self, frame: &ViewFrame) {
        if let Some(out) = self.out.as_mut().filter(|out| out.is_due()) {
            out.publish(Box::new(frame.clone()));
        }
    }
}

impl Drop for RunPage {
    /// Prints the times from tracked hands to pictures.
    fn drop(&mut self) {
        if let Some(took) = self.page.hand_to_picture() {
            eprintln!(
                "glove-client: headset: {} pictures of newer hands, {} ms from hand to picture (half of \
                 them), {} ms (99 %)",
                took.pictures, took.p50_ms, took.p99_ms
            );
        }
    }
}

/// What the page is encrypted with: the pair of files, one that is made now, or nothing.
fn encryption_of(page: &PageArguments, ip: IpAddr) -> Result<Option<Encryption>, EncryptionError> {
    match (&page.xr_cert, &page.xr_key, page.xr_tls) {
        (Some(certificate), Some(key), _) => Encryption::read(certificate, key).map(Some),
        (_, _, true) => {
            let names = ["localhost", "127.0.0.1", &ip.to_string()];
            Encryption::self_made(&names.map(str::to_owned)).map(Some)
        }
        _ => Ok(None),
    }
}
