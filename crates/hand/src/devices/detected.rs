//! Finds out which form of record a device sends, by trying all that it may be.

/// One parser, or several of which the first that reads records well is kept.
///
/// A device that answers questions says what it sends; one that does not must be listened to.
#[derive(Clone, Debug)]
pub struct Detected<Parser> {
    candidates: Vec<Candidate<Parser>>,
}

#[derive(Clone, Debug)]
struct Candidate<Parser> {
    parser: Parser,
    /// Good records that this parser has read in a row.
    records: u32,
}

/// Good records in a row after which a parser is kept.
const NEEDED: u32 = 3;

impl<Parser> Detected<Parser> {
    /// Keeps this parser from the beginning: the form of the records is known.
    pub fn known(parser: Parser) -> Self {
        Self::one_of([parser])
    }

    /// Keeps one of these parsers, as soon as it reads records well; where several do, the first.
    pub fn one_of(parsers: impl IntoIterator<Item = Parser>) -> Self {
        let candidate = |parser| Candidate { parser, records: 0 };
        Self { candidates: parsers.into_iter().map(candidate).collect() }
    }

    /// Whether the form of the records is known.
    pub fn is_known(&self) -> bool {
        self.candidates.len() <= 1
    }

    /// Feeds all parsers; the events of the one that is kept, none while none is.
    ///
    /// `read` feeds one parser and returns its events; `is_record` tells records from faults.
    pub fn feed<Event>(
        &mut self,
        read: impl Fn(&mut Parser) -> Vec<Event>,
        is_record: impl Fn(&Event) -> bool,
    ) -> Vec<Event> {
        if let [only] = &mut self.candidates[..] {
            return read(&mut only.parser);
        }
        let mut found = None;
        for (at, candidate) in self.candidates.iter_mut().enumerate() {
            let events = read(&mut candidate.parser);
            for event in &events {
                candidate.records = if is_record(event) { candidate.records + 1 } else { 0 };
            }
            if candidate.records >= NEEDED && found.is_none() {
                found = Some((at, events));
            }
        }
        let Some((at, events)) = found else { return Vec::new() };
        self.candidates.swap(0, at);
        self.candidates.truncate(1);
        events
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::cyberglove::{
        GloveEvent, GloveParser, GloveRecord, RawSensors, RecordKind, RecordOptions, SensorCount,
        encode_record,
    };

    fn stream(count: SensorCount, records: u8) -> Vec<u8> {
        let record = |value| GloveRecord {
            kind: RecordKind::Polled,
            sensors: RawSensors::from_fn(count, |_| value),
            timestamp: None,
            status: None,
        };
        (1..=records).flat_map(|value| encode_record(&record(value))).collect()
    }

    fn read(parser: &mut GloveParser, bytes: &[u8]) -> Vec<GloveEvent> {
        let mut events = Vec::new();
        parser.feed_all(bytes, |event| events.push(event));
        events
    }

    #[test]
    fn glove_with_18_or_22_sensors_is_told_by_its_records_and_damage_only_delays_that() {
        let both = [SensorCount::TwentyTwo, SensorCount::Eighteen];
        for count in both {
            let parsers = both.map(|count| GloveParser::new(count, RecordOptions::default()));
            let mut detected = Detected::one_of(parsers);
            let is_record = |event: &GloveEvent| matches!(event, GloveEvent::Record(_));
            let mut bytes = stream(count, 2);
            bytes.extend([71, 5, 0]);
            bytes.extend(stream(count, 5));
            let mut records = 0;
            for chunk in bytes.chunks(7) {
                let events = detected.feed(|parser| read(parser, chunk), is_record);
                for event in events {
                    let GloveEvent::Record(record) = event else { continue };
                    assert_eq!(record.sensors.count(), count);
                    records += 1;
                }
            }
            assert!(detected.is_known() && records == 3, "{count:?}: {records}");
        }
    }
}
