//! A server that is killed and started again at the same address: time until the client has an answer.

use std::time::{Duration, Instant};

use glove_client::ask::link::Link;
use glove_client::ask::model_upload::ModelUpload;
use glove_client::pace::tick_budget::Priority;
use softgrasp_core::mesh::BuiltIn;
use softgrasp_protocol::{ModelHash, NodeChoice};

use super::bars::{Amounts, bar, server};
use crate::programs::Programs;
use crate::random::Random;
use crate::report::{Report, ReportError};
use crate::sample::Spread;
use crate::scene::Pressed;
use crate::table::Table;

/// Time after which a link without an answer is taken to be lost.
const PATIENCE: Duration = Duration::from_secs(60);
/// Time between two requests.
const TICK: Duration = Duration::from_millis(4);

/// Measures restarts.
///
/// # Errors
/// [`ReportError`].
pub(super) fn measure(
    programs: &Programs,
    amounts: Amounts,
    bars: &mut Table,
    report: &mut Report,
) -> Result<(), ReportError> {
    let mut running = server(programs, "127.0.0.1:0")?;
    let address = running.address.clone();
    let scene = Pressed::try_new(BuiltIn::Cube, 1000)?;
    let message = scene.upload();
    let model =
        ModelUpload { rest_shape: 0, hash: ModelHash::of(&message), message: message.into() };
    let link = Link::start(address.as_str(), Priority::Ordinary)
        .map_err(|source| ReportError::Process { what: "the link".to_owned(), source })?;
    link.set_model(model);
    let mut random = Random(4);
    let (mut connected_ms, mut answered_ms) = (Vec::new(), Vec::new());
    let mut tick = 0;
    for _ in 0..amounts.restarts {
        let surface = NodeChoice::Nodes(scene.surface.nodes.clone());
        let question = scene.question("auto", 0.5, surface);
        let mut ask = || {
            tick += 1;
            link.ask(tick, 0, question.clone(), None);
            std::thread::sleep(TICK);
            let (_, ended) = link.take();
            ended.iter().any(|end| end.reached.is_ok())
        };
        let before = Instant::now();
        while !ask() && before.elapsed() < PATIENCE {}
        drop(running);
        // Away for up to a second, the hand goes on.
        let away = Instant::now();
        let lasts = Duration::from_millis(random.below(1000) as u64);
        while away.elapsed() < lasts {
            ask();
        }
        running = server(programs, &address)?;
        let back = Instant::now();
        let mut connected = None;
        while !ask() && back.elapsed() < PATIENCE {
            if connected.is_none() && link.is_connected() {
                connected = Some(back.elapsed());
            }
        }
        answered_ms.push(1e3 * back.elapsed().as_secs_f64());
        connected_ms.push(1e3 * connected.unwrap_or(back.elapsed()).as_secs_f64());
    }
    drop(link);
    let (connected, answered) = (Spread::of(connected_ms), Spread::of(answered_ms));
    report.text(format!(
        "Restarts: the server is killed and started again {} times at the same address while a hand asks \
         every {} ms. From the moment it listens to the connection {:.0} ms (median; {:.0} at most), to the \
         first answer {:.0} ms ({:.0} at most), the upload of the model of 1000 nodes and its \
         preparation included.",
        amounts.restarts,
        TICK.as_millis(),
        connected.median,
        connected.max,
        answered.median,
        answered.max,
    ));
    let is_quick = amounts.restarts < 10;
    bar(bars, report, is_quick, ("connected again after a restart", connected.max, 250.0, "ms"));
    Ok(())
}
