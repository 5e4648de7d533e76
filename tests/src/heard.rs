//! Part of a reply that must have the same bits in every run: all except times and memory.

use softgrasp_protocol::{
    Answer, Displacements, ModelHash, NodeChoice, RejectCode, Reply, SolveReport,
};

/// Reply without the parts that may differ between runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Heard {
    /// `Welcome` of the server.
    Welcome,
    /// Numbers of an answer, as bits.
    Answer(AnswerBits),
    /// Reply to `HaveModel`; its content depends on earlier clients.
    ModelState,
    /// Reply to an upload.
    ModelReady {
        /// Hash that names the model.
        model: ModelHash,
        /// Number of degrees of freedom that are not fixed.
        unknown_dofs: u64,
        /// Number of degrees of freedom that are fixed.
        fixed_dofs: u64,
    },
    /// Code and text of a refusal.
    Rejected(RejectCode, String),
    /// `Alive` of the server.
    Alive,
    /// Number of the `Ping`.
    Pong(u64),
}

/// Numbers of an answer, as bits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AnswerBits {
    method: String,
    unknown_dofs: u64,
    known_dofs: u64,
    nodes: NodeChoice,
    displacements: Vec<u64>,
    reactions: Vec<(u32, u64)>,
    residual: u64,
    rotation: u64,
    strain: u64,
}

impl AnswerBits {
    /// Bits of an answer.
    pub fn of(answer: &Answer) -> Self {
        let SolveReport { method, unknown_dofs, known_dofs, .. } = &answer.report;
        // With `condensed` both are found beside the frames, and are told where they are there.
        let of_this = |value: f64| if method == "condensed" { 0 } else { value.to_bits() };
        Self {
            method: method.clone(),
            unknown_dofs: *unknown_dofs,
            known_dofs: *known_dofs,
            nodes: answer.nodes.clone(),
            displacements: displacement_bits(&answer.displacements),
            reactions: answer.reactions.iter().map(|r| (r.dof, r.value.to_bits())).collect(),
            residual: answer.report.residual_rel.to_bits(),
            rotation: of_this(answer.report.max_rotation_deg),
            strain: of_this(answer.report.max_strain),
        }
    }
}

/// Hash of all bits of the displacements: FNV-1a over them in order.
pub fn displacement_hash(displacements: &Displacements) -> u64 {
    displacement_bits(displacements)
        .iter()
        .flat_map(|bits| bits.to_le_bytes())
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
}

fn displacement_bits(displacements: &Displacements) -> Vec<u64> {
    match displacements {
        Displacements::F64(values) => values.iter().flatten().map(|u| u.to_bits()).collect(),
        Displacements::F32Quantised { scale, values } => {
            let values = values.iter().flatten().map(|u| u64::from(u.to_bits()));
            std::iter::once(scale.to_bits()).chain(values).collect()
        }
    }
}

impl Heard {
    /// Part of a reply that must not differ.
    pub fn of(reply: &Reply) -> Self {
        match reply {
            Reply::Welcome(_) => Self::Welcome,
            Reply::Answer(answer) => Self::Answer(AnswerBits::of(answer)),
            Reply::ContactAnswer(answered) => Self::Answer(AnswerBits::of(&answered.answer)),
            Reply::ModelState { .. } => Self::ModelState,
            Reply::ModelReady(ready) => Self::ModelReady {
                model: ready.model,
                unknown_dofs: ready.unknown_dofs,
                fixed_dofs: ready.fixed_dofs,
            },
            Reply::Rejected(rejected) => Self::Rejected(rejected.code, rejected.text.clone()),
            Reply::Alive => Self::Alive,
            Reply::Pong { nonce } => Self::Pong(*nonce),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hash_sees_the_last_bit_and_the_order() {
        let hash = |rows: Vec<[f64; 3]>| displacement_hash(&Displacements::F64(rows));
        let rows = vec![[1.0, 2.0, 3.0], [0.0, -1.0, 0.5]];
        assert_eq!(hash(rows.clone()), hash(rows.clone()));
        assert_ne!(hash(rows.clone()), hash(vec![rows[1], rows[0]]));
        assert_ne!(hash(rows.clone()), hash(vec![[1.0_f64.next_up(), 2.0, 3.0], rows[1]]));
        assert_ne!(hash(vec![[0.0; 3]]), hash(vec![[-0.0, 0.0, 0.0]]));
    }
}
