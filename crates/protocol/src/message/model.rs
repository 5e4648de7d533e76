//! Models that the server keeps: upload, name, hint of what will be touched.

use std::fmt;
use std::str::FromStr;

use wincode::{SchemaRead, SchemaWrite};

use super::masks::{Masks, MasksPart};
use super::mesh::{Material, MeshData, MeshPart, read_mesh, write_mesh};
use super::names::ElementName;
use super::report::StageMs;
use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::trace::{TraceContext, TracePart};
use crate::{DecodeError, EncodeError, Frame, Limits};

/// Content hash that names a model; opaque here, shown as 64 hexadecimal digits.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
pub struct ModelHash(pub [u8; 32]);

/// A text that is not 64 hexadecimal digits.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} is not a model's name (64 hexadecimal digits)")]
pub struct ModelHashError {
    /// The text that is no model hash.
    pub text: String,
}

/// Request to keep a model: mesh, material and the degrees of freedom that are known in every question.
#[derive(Clone, Debug, PartialEq)]
pub struct UploadModel {
    /// Nodes and elements of the mesh.
    pub mesh: MeshData,
    /// One material for the whole body, or one for each region.
    pub materials: Vec<Material>,
    /// Kind of element.
    pub element: ElementName,
    /// Degrees of freedom `3 · node + axis` whose displacement is zero unless a question gives it a
    /// value.
    pub fixed: Vec<u32>,
}

/// Answer to `UploadModel`: the uploaded model can be used.
#[derive(Clone, Debug, PartialEq, SchemaRead, SchemaWrite)]
pub struct ModelReady {
    /// Hash that names the model from now on.
    pub model: ModelHash,
    /// Number of degrees of freedom to be solved for, those of unused nodes left out.
    pub unknown_dofs: u64,
    /// Number of degrees of freedom that are fixed.
    pub fixed_dofs: u64,
    /// Whether the server kept this model already.
    pub reused: bool,
    /// Wall times of the upload by stage, ms.
    pub stage_ms: StageMs,
}

impl ModelHash {
    /// Name of a model: BLAKE3 of everything that decides its answers.
    ///
    /// Both sides compute it, so a client can ask for a model by name after a crash, or on another
    /// server. Any change of what a model means must change its first section.
    pub fn of(upload: &UploadModel) -> Self {
        let mut hasher = blake3::Hasher::new();
        let mut section = |name: &str, count: usize, bytes: &[u8]| {
            hasher.update(name.as_bytes());
            hasher.update(&(count as u64).to_le_bytes());
            hasher.update(bytes);
        };
        section(MODEL_FORMAT, 0, upload.element.as_str().as_bytes());
        let vertices: Vec<u8> =
            upload.mesh.vertices.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        section("vertices", upload.mesh.vertices.len(), &vertices);
        let tets: Vec<u8> =
            upload.mesh.tets.iter().flatten().flat_map(|n| n.to_le_bytes()).collect();
        section("tets", upload.mesh.tets.len(), &tets);
        let regions: Vec<u8> = upload.mesh.regions.iter().flat_map(|r| r.to_le_bytes()).collect();
        section("regions", upload.mesh.regions.len(), &regions);
        let materials: Vec<u8> = upload
            .materials
            .iter()
            .flat_map(|m| [m.young, m.poisson])
            .flat_map(f64::to_le_bytes)
            .collect();
        section("materials", upload.materials.len(), &materials);
        let mut fixed = upload.fixed.clone();
        fixed.sort_unstable();
        fixed.dedup();
        let bytes: Vec<u8> = fixed.iter().flat_map(|d| d.to_le_bytes()).collect();
        section("fixed", fixed.len(), &bytes);
        // Left out where there are none, so that the names of other models stay what they were.
        if !upload.mesh.mid_edge.is_empty() {
            let nodes = upload.mesh.mid_edge.iter().flatten();
            let bytes: Vec<u8> = nodes.flat_map(|n| n.to_le_bytes()).collect();
            section("mid-edge", upload.mesh.mid_edge.len(), &bytes);
        }
        Self(*hasher.finalize().as_bytes())
    }
}

/// First bytes of every hashed model; they change when the same upload would give other answers.
const MODEL_FORMAT: &str = "softgrasp model 1";

/// Hint which nodes or masks will be touched soon, so that the server can compute their columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Prefetch {
    /// Name of the kept model.
    pub model: ModelHash,
    /// Nodes that will probably be touched, by their numbers in the mesh.
    pub nodes: Vec<u32>,
    /// Masks that will probably be held.
    pub masks: Masks,
}

#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct UploadModelPart {
    mesh: MeshPart,
    element: ElementName,
    fixed_count: u32,
}

#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct PrefetchPart {
    model: ModelHash,
    node_count: u32,
    masks: MasksPart,
}

impl UploadModel {
    pub(super) fn write(&self, writer: &mut PayloadWriter<'_>) -> Result<(), EncodeError> {
        writer.part(&UploadModelPart {
            mesh: MeshPart::of(&self.mesh, &self.materials)?,
            element: self.element,
            fixed_count: count_of("fixed degrees of freedom", self.fixed.len())?,
        })?;
        write_mesh(writer, &self.mesh, &self.materials);
        writer.array(&self.fixed);
        Ok(())
    }

    /// Trace that the request in a frame belongs to.
    pub(super) fn trace(frame: &Frame) -> Option<TraceContext> {
        let mut reader = PayloadReader::new(&frame.payload);
        let (_, later): (UploadModelPart, TracePart) = reader.part_and_later().ok()?;
        later.trace
    }

    pub(super) fn read(
        reader: &mut PayloadReader<'_>,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let part: UploadModelPart = reader.part()?;
        part.mesh.check(limits)?;
        let what = "fixed degrees of freedom";
        let fixed_count = check_count(what, part.fixed_count, limits.dof_count_max)?;
        let (mesh, materials) = read_mesh(reader, &part.mesh)?;
        let fixed = reader.array(what, fixed_count)?;
        Ok(Self { mesh, materials, element: part.element, fixed })
    }
}

impl Prefetch {
    pub(super) fn write(&self, writer: &mut PayloadWriter<'_>) -> Result<(), EncodeError> {
        let node_count = count_of("prefetched nodes", self.nodes.len())?;
        let masks = self.masks.part()?;
        writer.part(&PrefetchPart { model: self.model, node_count, masks })?;
        writer.array(&self.nodes);
        self.masks.write_arrays(writer);
        Ok(())
    }

    pub(super) fn read(
        reader: &mut PayloadReader<'_>,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let part: PrefetchPart = reader.part()?;
        let what = "prefetched nodes";
        let count = check_count(what, part.node_count, limits.node_count_max)?;
        part.masks.check(limits)?;
        let nodes = reader.array(what, count)?;
        Ok(Self { model: part.model, nodes, masks: Masks::read_arrays(reader, part.masks)? })
    }
}

impl fmt::Display for ModelHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for ModelHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ModelHash({self})")
    }
}

impl FromStr for ModelHash {
    type Err = ModelHashError;

    fn from_str(text: &str) -> Result<Self, ModelHashError> {
        parse_hash(text).map(Self).ok_or_else(|| ModelHashError { text: text.to_owned() })
    }
}

fn parse_hash(text: &str) -> Option<[u8; 32]> {
    let (pairs, rest) = text.as_bytes().as_chunks::<2>();
    let mut hash = [0; 32];
    if pairs.len() != hash.len() || !rest.is_empty() {
        return None;
    }
    let digit = |c: u8| char::from(c).to_digit(16).and_then(|d| u8::try_from(d).ok());
    for (byte, [high, low]) in hash.iter_mut().zip(pairs) {
        *byte = 16 * digit(*high)? + digit(*low)?;
    }
    Some(hash)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mid_edge_nodes_are_part_of_the_name() {
        let upload = |mid_edge: Vec<[u32; 6]>| UploadModel {
            mesh: MeshData { tets: vec![[0, 1, 2, 3]], mid_edge, ..MeshData::default() },
            materials: vec![],
            element: ElementName::T10,
            fixed: vec![],
        };
        let names = [vec![], vec![[4, 5, 6, 7, 8, 9]], vec![[4, 5, 6, 7, 9, 8]]]
            .map(|mid_edge| ModelHash::of(&upload(mid_edge)));
        assert!(names[0] != names[1] && names[1] != names[2] && names[0] != names[2]);
    }

    #[test]
    fn hash_text_reads_back() {
        let hash = ModelHash(std::array::from_fn(|i| (i * 37 + 5) as u8));
        let text = hash.to_string();
        assert!(text.starts_with("052a4f"));
        assert_eq!(text.parse(), Ok(hash));
        assert_eq!(text.to_uppercase().parse(), Ok(hash));
    }

    #[test]
    fn other_texts_are_not_hashes() {
        for text in ["", &"0".repeat(63), &"0".repeat(65), &"0g".repeat(32), &"+1".repeat(32)] {
            assert_eq!(text.parse::<ModelHash>().unwrap_err().text, text);
        }
    }
}
