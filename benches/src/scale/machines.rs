//! A model of the worker on several machines, from what one processor of this one measured.
//!
//! Nothing here was measured on several machines.

use super::row::{Answered, GIB, Row};
use super::way::{WAYS, Way};
use crate::table::{Cell, Table};

/// Machine and network of the model.
struct Machine {
    cores: f64,
    /// Cores that its memory's rate is worth: steps and set-up wait for memory.
    worth: f64,
    /// Memory, bytes.
    memory: f64,
    /// Rate of the network, bytes/s.
    network: f64,
    /// Time of one message, s.
    message_s: f64,
}

/// A usual one: 16 cores, 100 GB/s of which one core takes 12, 64 GiB, 25 Gbit/s.
const MACHINE: Machine =
    Machine { cores: 16.0, worth: 8.0, memory: 64.0 * GIB, network: 3.1e9, message_s: 50e-6 };
/// Levels of a hierarchy whose neighbours talk, and messages on each in one step.
const LEVELS: f64 = 6.0;
const MESSAGES: f64 = 4.0;
/// Values that go over a border node in one step on all levels, bytes: three numbers each time.
const BORDER_BYTES: f64 = 24.0 * MESSAGES;
/// Sizes and numbers of machines of the table.
const NODES: [f64; 2] = [1e6, 1e7];
const MACHINES: [f64; 3] = [1.0, 4.0, 16.0];

/// What the model begins with, measured here.
struct Measured {
    /// Nodes of the largest body that one rank answered.
    nodes: f64,
    /// Time of one processor for each node, s.
    s_a_node: f64,
    /// Memory for each node on several ranks, bytes.
    bytes_a_node: f64,
    steps: f64,
}

impl Measured {
    fn of(rows: &[Row]) -> Option<Self> {
        let largest = |ways: &[Way]| {
            let of_ways = rows.iter().filter(|row| ways.contains(&row.way));
            let answered = of_ways.filter_map(|row| Some((row.nodes as f64, row.answered()?)));
            answered
                .max_by(|a, b| a.0.total_cmp(&b.0).then(a.1.peak_bytes.total_cmp(&b.1.peak_bytes)))
        };
        let several: Vec<Way> =
            WAYS.into_iter().filter(|way| matches!(way, Way::Ranks(ranks) if *ranks > 1)).collect();
        let (nodes, one): (f64, &Answered) = largest(&[Way::Ranks(1)])?;
        let (of_several, all) = largest(&several)?;
        Some(Self {
            nodes,
            s_a_node: one.wall_s / nodes,
            bytes_a_node: all.peak_bytes / of_several,
            steps: f64::from(one.report.refinement_steps),
        })
    }

    /// Memory of each machine, bytes, and wall time, s.
    fn predict(&self, nodes: f64, machines: f64) -> (f64, f64) {
        let memory = nodes * self.bytes_a_node / machines;
        let computing = nodes * self.s_a_node / (machines * MACHINE.worth);
        if machines <= 1.0 {
            return (memory, computing);
        }
        let border = 6.0 * (nodes / machines).powf(2.0 / 3.0);
        let talking =
            LEVELS * MESSAGES * MACHINE.message_s + border * BORDER_BYTES / MACHINE.network;
        (memory, computing + self.steps * talking)
    }
}

/// Table of the model, and the words that say what it is; `None` where no worker was measured.
pub(super) fn model(rows: &[Row]) -> Option<(String, Table)> {
    let measured = Measured::of(rows)?;
    let title = "Model, not measured: the worker on several machines";
    let mut table = Table::new("scale-machines", title, &COLUMNS);
    for nodes in NODES {
        for machines in MACHINES {
            let (memory, wall_s) = measured.predict(nodes, machines);
            let fits = memory <= MACHINE.memory;
            table.push([
                Cell::Count(nodes as u64),
                Cell::Count(machines as u64),
                (memory / GIB).into(),
                if fits { "fits" } else { "does not fit" }.into(),
                Some(wall_s).filter(|_| fits).into(),
            ]);
        }
    }
    Some((measured.words(), table))
}

impl Measured {
    fn words(&self) -> String {
        let Machine { cores, worth, memory, .. } = MACHINE;
        format!(
            "A model: no second machine was there. It takes a machine of {cores} cores whose memory's \
             rate is worth {worth} of them (100 GB/s, of which one core takes 12), {:.0} GiB, and a network \
             of 25 Gbit/s with 50 µs for a message. From this run it takes the time of one rank, {:.0} µs \
             for each node at {} nodes, the memory of several ranks, {:.1} kB for each node, and {} steps. \
             Work goes on in proportion to cores; in each step every part sends {MESSAGES} messages on each \
             of {LEVELS} levels and the values of its border, 6 (V/machines)^(2/3) nodes. What one rank's \
             time has in it that no further machine makes shorter (reading the question, parts for the \
             others, the answer) is divided here all the same. Take a factor of two either way.",
            memory / GIB,
            1e6 * self.s_a_node,
            self.nodes,
            1e-3 * self.bytes_a_node,
            self.steps
        )
    }
}

const COLUMNS: [&str; 5] = ["nodes", "machines", "memory_of_each_gib", "in_64_gib", "wall_s"];

#[cfg(test)]
mod tests {
    use softgrasp_protocol::SolveReport;

    use super::*;
    use crate::scale::row::Outcome;

    fn row(ranks: usize, nodes: usize, wall_s: f64, peak_bytes: f64) -> Row {
        let report = SolveReport { refinement_steps: 20, ..SolveReport::default() };
        let answered = Answered { wall_s, peak_bytes, report, imbalance: 0.0, off_front: None };
        Row { nodes, way: Way::Ranks(ranks), outcome: Outcome::Answered(Box::new(answered)) }
    }

    #[test]
    fn the_model_begins_with_the_largest_rows() {
        let rows = [row(1, 1000, 1.0, 1e6), row(1, 100_000, 10.0, 1e9), row(4, 100_000, 4.0, 1e9)];
        let (words, table) = model(&rows).unwrap();
        assert!(words.contains("100 µs for each node at 100000 nodes"), "{words}");
        assert!(words.contains("10.0 kB for each node, and 20 steps"), "{words}");
        // 1e6 nodes on one machine: 1e6 · 1e-4 s / 8, and 1e10 bytes.
        assert_eq!(table.rows[0][4], Cell::Number(1e6 * (10.0 / 100_000.0) / 8.0));
        assert_eq!(table.rows[0][3], "fits".into());
        // 1e7 nodes: 93 GiB do not fit into one.
        assert_eq!(table.rows[3][3..], ["does not fit".into(), Cell::Blank]);
        assert_eq!(table.rows[5][3], "fits".into());
    }

    #[test]
    fn without_several_ranks_there_is_no_model() {
        assert!(model(&[row(1, 1000, 1.0, 1e6)]).is_none());
    }
}
