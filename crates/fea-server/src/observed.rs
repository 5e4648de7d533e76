//! What a server keeps and how much waits, exported with the metrics of OpenTelemetry.

use std::sync::{Arc, Weak};

use softgrasp_telemetry::{Observed, observe};

use crate::places::Places;
use crate::resources::Resources;
use crate::server_handle::ServerHandle;

/// Reads one value of a server.
type Read = fn(&Resources, &Places) -> f64;

/// Exports values of a server for as long as it runs; does nothing where no collector was named.
pub(crate) fn observe_server(server: &ServerHandle) {
    let values: [(&str, &str, &str, Read); 6] = [
        ("softgrasp.server.sessions", "{session}", "Sessions that are there.", |_, places| {
            places.taken() as f64
        }),
        (
            "softgrasp.server.requests.queued",
            "{request}",
            "Requests that wait or are worked on.",
            |resources, _| resources.workers.queued() as f64,
        ),
        ("softgrasp.server.models", "{model}", "Models that are kept.", |resources, _| {
            resources.models.count_and_bytes().0 as f64
        }),
        (
            "softgrasp.server.models.memory",
            "By",
            "Memory of the models and what is made for them.",
            |resources, _| resources.models.count_and_bytes().1 as f64,
        ),
        (
            "softgrasp.server.reserved.memory",
            "By",
            "Memory reserved for requests under way.",
            |resources, _| (resources.budget.limit() - resources.budget.left_for_kept()) as f64,
        ),
        ("softgrasp.server.memory.limit", "By", "Memory for both together.", |resources, _| {
            resources.budget.limit() as f64
        }),
    ];
    let observed = values.map(|(name, unit, description, read)| {
        let resources: Weak<Resources> = Arc::downgrade(&server.resources);
        let places = server.places.clone();
        let read = move || resources.upgrade().map(|resources| read(&resources, &places));
        Observed { name, unit, description, read: Box::new(read) }
    });
    observe(observed.into());
}
