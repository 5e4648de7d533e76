//! The providers of spans and metrics, one pair in a program.

use std::sync::{Arc, OnceLock};
use std::time::Duration;

use opentelemetry::metrics::{Histogram, Meter, MeterProvider as _};
use opentelemetry::trace::TracerProvider as _;
use opentelemetry::{InstrumentationScope, KeyValue};
use opentelemetry_otlp::{
    ExporterBuildError, MetricExporter, OTEL_EXPORTER_OTLP_ENDPOINT,
    OTEL_EXPORTER_OTLP_METRICS_ENDPOINT, OTEL_EXPORTER_OTLP_TRACES_ENDPOINT, SpanExporter,
    WithHttpConfig as _,
};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::metrics::SdkMeterProvider;
use opentelemetry_sdk::trace::{SdkTracer, SdkTracerProvider};

use super::collector::Collector;
use crate::error::StartError;
use crate::observed::{DURATION_BOUNDS_S, Observed};

/// The providers, which are shut down when this is dropped.
pub(crate) struct Exporting {
    tracers: SdkTracerProvider,
    meters: SdkMeterProvider,
}

/// Tracer and instruments of this program, once its export was started.
pub(super) struct Instruments {
    pub tracer: SdkTracer,
    pub client_s: Histogram<f64>,
    pub server_s: Histogram<f64>,
    meter: Meter,
}

static STARTED: OnceLock<Instruments> = OnceLock::new();

/// Time for the last spans at the end of a program.
const END_MAX: Duration = Duration::from_secs(2);

pub(super) fn instruments() -> Option<&'static Instruments> {
    STARTED.get()
}

pub(crate) fn start(
    program: &'static str,
    version: &'static str,
    _: &'static str,
) -> Result<Exporting, StartError> {
    let settings = |error: ExporterBuildError| StartError::Settings { reason: error.to_string() };
    let collector = Arc::new(Collector::new());
    let resource = resource(program, version);
    let mut tracers = SdkTracerProvider::builder().with_resource(resource.clone());
    let mut meters = SdkMeterProvider::builder().with_resource(resource);
    // Where one signal alone has an address, the other would go to the specification's.
    if is_named(OTEL_EXPORTER_OTLP_TRACES_ENDPOINT) {
        let spans = SpanExporter::builder().with_http().with_shared_http_client(collector.clone());
        tracers = tracers.with_batch_exporter(spans.build().map_err(settings)?);
    }
    if is_named(OTEL_EXPORTER_OTLP_METRICS_ENDPOINT) {
        let metrics = MetricExporter::builder().with_http().with_shared_http_client(collector);
        meters = meters.with_periodic_exporter(metrics.build().map_err(settings)?);
    }
    let (tracers, meters) = (tracers.build(), meters.build());
    let scope = || InstrumentationScope::builder("softgrasp").with_version(version).build();
    let meter = meters.meter_with_scope(scope());
    let durations = |name: &'static str, description: &'static str| {
        meter
            .f64_histogram(name)
            .with_unit("s")
            .with_description(description)
            .with_boundaries(DURATION_BOUNDS_S.to_vec())
            .build()
    };
    let client_s = durations(
        "softgrasp.client.request.duration",
        "Time from the sending of a request to its reply.",
    );
    let server_s = durations(
        "softgrasp.server.request.duration",
        "Time from the last byte of a request until its reply is written.",
    );
    let tracer = tracers.tracer_with_scope(scope());
    // A second start of the same process keeps the first one's tracer, which then sends nothing more.
    let _ = STARTED.set(Instruments { tracer, client_s, server_s, meter });
    Ok(Exporting { tracers, meters })
}

/// Whether the environment names a collector for one signal, by the signal's own variable or for all.
fn is_named(signal: &str) -> bool {
    [signal, OTEL_EXPORTER_OTLP_ENDPOINT]
        .into_iter()
        .any(|name| std::env::var(name).is_ok_and(|address| !address.is_empty()))
}

/// Name of the program, unless the environment has another one; its version; its process.
fn resource(program: &'static str, version: &'static str) -> Resource {
    let named = Resource::builder();
    let is_named = std::env::var("OTEL_SERVICE_NAME").is_ok_and(|name| !name.is_empty())
        || std::env::var("OTEL_RESOURCE_ATTRIBUTES")
            .is_ok_and(|list| list.split(',').any(|one| one.trim().starts_with("service.name=")));
    let named = if is_named { named } else { named.with_service_name(program) };
    let process = i64::from(std::process::id());
    named
        .with_attributes([
            KeyValue::new("service.version", version),
            KeyValue::new("process.pid", process),
        ])
        .build()
}

pub(crate) fn observe(values: Vec<Observed>) {
    let Some(instruments) = instruments() else { return };
    for Observed { name, unit, description, read } in values {
        // The provider keeps it, for as long as it lives.
        let _ = instruments
            .meter
            .f64_observable_gauge(name)
            .with_unit(unit)
            .with_description(description)
            .with_callback(move |observer| {
                if let Some(value) = read() {
                    observer.observe(value, &[]);
                }
            })
            .build();
    }
}

impl Drop for Exporting {
    fn drop(&mut self) {
        // A collector that is gone has been told of.
        let _ = self.tracers.shutdown_with_timeout(END_MAX);
        let _ = self.meters.shutdown_with_timeout(END_MAX);
    }
}
