//! Messages to a page: the bytes of objects, hands and pictures, little-endian (`docs/xr.md`).

use softgrasp_window::view::hand_skin::BONE_COUNT;

use crate::picture::Picture;

/// Version of the messages; the page says so if it knows another.
pub const FORMAT: u32 = 2;
/// First byte of an object's message.
pub const OBJECT: u8 = 1;
/// First byte of a hand's message.
pub const HAND: u8 = 2;
/// First byte of a picture's message.
pub const PICTURE: u8 = 3;
/// Flag of a picture: it has a hand.
pub const WITH_HAND: u8 = 1;
/// Flag of a picture: it has colours.
pub const COLOURED: u8 = 2;
/// Flag of a picture: it has all vertices.
pub const WHOLE: u8 = 4;
/// Flag of a picture: it has a second hand.
pub const WITH_SECOND_HAND: u8 = 8;
/// Number that stands for no record of joints.
pub const NO_RECORD: u32 = u32::MAX;

/// Part of an object that is drawn with one material.
pub struct ObjectPart {
    /// Number of its first triangle.
    pub first_triangle: u32,
    /// Number of triangles.
    pub triangles: u32,
    /// Base colour: linear red, green, blue.
    pub colour: [f32; 3],
    /// Roughness from 0 (mirror) to 1.
    pub roughness: f32,
    /// Metallic share from 0 (no metal) to 1.
    pub metallic: f32,
    /// Strength and roughness of a clear layer on the surface.
    pub clearcoat: (f32, f32),
    /// Share of the light that comes through from behind.
    pub subsurface: f32,
    /// Number of the colour texture; 0 for none.
    pub texture: u32,
    /// Number of the relief texture; 0 for none.
    pub relief: u32,
    /// Whether the back of a triangle can be seen.
    pub two_sided: bool,
}

/// One vertex of a hand's skin.
pub struct HandVertex {
    /// Position in the pose that the skin was made in, m, in the palm's frame.
    pub place: [f32; 3],
    /// Outward unit normal in the same pose.
    pub normal: [f32; 3],
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// Weights of the bones; their sum is 1.
    pub weights: [f32; 4],
    /// Numbers of the bones, the heaviest first.
    pub bones: [u8; 4],
}

/// Message that is being written.
#[derive(Default)]
struct Bytes(Vec<u8>);

impl Bytes {
    fn kind(kind: u8) -> Self {
        Self(vec![kind, 0, 0, 0])
    }

    fn whole(&mut self, number: u32) {
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    fn count(&mut self, number: usize) {
        self.whole(u32::try_from(number).unwrap_or(u32::MAX));
    }

    fn floats(&mut self, numbers: &[f32]) {
        numbers.iter().for_each(|number| self.0.extend_from_slice(&number.to_le_bytes()));
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) {
        triangles.iter().flatten().for_each(|vertex| self.whole(*vertex));
    }
}

/// Message with the part of an object that does not change.
pub fn object_message(
    version: u32,
    parts: &[ObjectPart],
    uvs: &[[f32; 2]],
    triangles: &[[u32; 3]],
) -> Vec<u8> {
    let mut bytes = Bytes::kind(OBJECT);
    bytes.whole(version);
    [uvs.len(), triangles.len(), parts.len()].into_iter().for_each(|n| bytes.count(n));
    for part in parts {
        bytes.whole(part.first_triangle);
        bytes.whole(part.triangles);
        bytes.floats(&part.colour);
        let (coat, coat_roughness) = part.clearcoat;
        bytes.floats(&[part.roughness, part.metallic, coat, coat_roughness, part.subsurface]);
        bytes.whole(part.texture);
        bytes.whole(part.relief);
        bytes.whole(u32::from(part.two_sided));
    }
    bytes.floats(uvs.as_flattened());
    bytes.triangles(triangles);
    bytes.0
}

/// Message with the part of a hand that does not change.
pub fn hand_message(
    version: u32,
    texture: u32,
    vertices: &[HandVertex],
    triangles: &[[u32; 3]],
) -> Vec<u8> {
    let mut bytes = Bytes::kind(HAND);
    bytes.whole(version);
    [vertices.len(), triangles.len(), BONE_COUNT].into_iter().for_each(|n| bytes.count(n));
    bytes.whole(texture);
    vertices.iter().for_each(|vertex| bytes.floats(&vertex.place));
    vertices.iter().for_each(|vertex| bytes.floats(&vertex.normal));
    vertices.iter().for_each(|vertex| bytes.floats(&vertex.uv));
    vertices.iter().for_each(|vertex| bytes.floats(&vertex.weights));
    vertices.iter().for_each(|vertex| bytes.0.extend_from_slice(&vertex.bones));
    bytes.triangles(triangles);
    bytes.0
}

/// Message of a picture for a page that has drawn `before`, if any: only the vertices that differ.
pub fn picture_message(
    picture: &Picture,
    before: Option<&Picture>,
    number: u32,
    stamp_ms: f64,
) -> Vec<u8> {
    let before = before.filter(|before| picture.goes_on_from(before));
    let runs = changed_runs(picture, before);
    let changed: usize = runs.iter().map(|(_, length)| length).sum();
    let mut flags = 0;
    let mut flag = |is: bool, flag: u8| flags |= if is { flag } else { 0 };
    let [first, second] = &picture.hands;
    flag(first.is_some(), WITH_HAND);
    flag(second.is_some(), WITH_SECOND_HAND);
    flag(!picture.shares.is_empty(), COLOURED);
    flag(before.is_none(), WHOLE);
    let capsules = u16::try_from(picture.capsules.len()).unwrap_or(0);
    let mut bytes = Bytes(vec![PICTURE, flags]);
    bytes.0.extend_from_slice(&capsules.to_le_bytes());
    bytes.whole(number);
    bytes.whole(picture.object.version);
    bytes.whole(first.as_ref().map_or(0, |(mesh, _)| mesh.version));
    bytes.0.extend_from_slice(&picture.tick.to_le_bytes());
    bytes.0.extend_from_slice(&stamp_ms.to_le_bytes());
    bytes.whole(picture.record.unwrap_or(NO_RECORD));
    bytes.floats(&[picture.ground_y]);
    bytes.floats(&picture.world_from_object);
    let space = &picture.space;
    bytes.floats(&space.origin);
    bytes.floats(&[space.step, space.error]);
    bytes.count(runs.len());
    bytes.count(changed);
    if let Some((_, bones)) = first {
        bytes.floats(bones.as_flattened());
    }
    if let Some((mesh, bones)) = second {
        bytes.whole(mesh.version);
        bytes.floats(bones.as_flattened());
    }
    bytes.floats(picture.capsules.as_flattened());
    for (first, length) in &runs {
        bytes.count(*first);
        bytes.count(*length);
    }
    let ranges = || runs.iter().map(|(first, length)| *first..first + length);
    for range in ranges() {
        let numbers = picture.numbers[range].as_flattened();
        numbers.iter().for_each(|n| bytes.0.extend_from_slice(&n.to_le_bytes()));
    }
    for range in ranges() {
        let numbers = picture.normals[range].as_flattened();
        numbers.iter().for_each(|n| bytes.0.extend_from_slice(&n.to_le_bytes()));
    }
    if !picture.shares.is_empty() {
        ranges().for_each(|range| bytes.0.extend_from_slice(&picture.shares[range]));
    }
    bytes.0
}

/// Runs of vertices that differ from those of the picture before: first vertex and number.
fn changed_runs(picture: &Picture, before: Option<&Picture>) -> Vec<(usize, usize)> {
    let count = picture.numbers.len();
    let Some(before) = before else {
        return if count == 0 { Vec::new() } else { vec![(0, count)] };
    };
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for vertex in 0..count {
        let is_same = picture.numbers[vertex] == before.numbers[vertex]
            && picture.normals[vertex] == before.normals[vertex]
            && picture.shares.get(vertex) == before.shares.get(vertex);
        if is_same {
            continue;
        }
        match runs.last_mut() {
            Some((first, length)) if *first + *length == vertex => *length += 1,
            _ => runs.push((vertex, 1)),
        }
    }
    runs
}

#[cfg(test)]
#[path = "to_page_tests.rs"]
mod tests;
