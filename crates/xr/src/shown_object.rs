//! The objects as pages draw them, together as one: the part that stays the same from picture to picture.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};
use softgrasp_grasp::object::RestShape;
use softgrasp_window::view::frame::{ObjectView, ViewFrame};
use softgrasp_window::view::object_skin::{Look, ObjectSkin, Part};

use crate::picture::ObjectMesh;
use crate::textures::Textures;
use crate::to_page::{ObjectPart, object_message};

/// Skins of the objects on the table, and the message that brings them to a page.
pub struct ShownObjects {
    all: Vec<ShownObject>,
    /// Message that a page needs once.
    pub mesh: Arc<ObjectMesh>,
}

/// Skin of one object.
struct ShownObject {
    number: usize,
    rest: Arc<RestShape>,
    rest_shapes: u64,
    skin: ObjectSkin,
    /// Records of its parts, with their textures and their own triangles.
    records: Vec<ObjectPart>,
}

impl ShownObjects {
    /// Makes the skins of the objects of a frame; takes some tenths of a second each. One of several has
    /// its own look. The object that was touched last comes first: pages colour the first body.
    pub fn new(version: u32, look: Look, frame: &ViewFrame, textures: &Textures) -> Self {
        let shown = |object: &ObjectView| {
            let look = object.own.as_ref().map_or(look, |own| own.look);
            let skin = ObjectSkin::new(look, &object.rest);
            ShownObject {
                number: object.number,
                rest: Arc::clone(&object.rest),
                rest_shapes: object.rest_shapes,
                records: skin.parts().iter().map(|part| record(part, textures)).collect(),
                skin,
            }
        };
        let all: Vec<_> = frame.objects().map(shown).collect();
        let mesh = mesh_of(version, &all);
        Self { all, mesh }
    }

    /// Whether the object of a number comes first.
    pub fn begin_with(&self, number: usize) -> bool {
        self.all.first().is_some_and(|object| object.number == number)
    }

    /// Lets the object of a number come first from now on.
    pub fn put_first(&mut self, version: u32, number: usize) {
        self.all.sort_by_key(|object| (object.number != number, object.number));
        self.mesh = mesh_of(version, &self.all);
    }

    /// Whether the objects of a frame are these, perhaps with other rest shapes.
    pub fn are(&mut self, frame: &ViewFrame) -> bool {
        let is_there = |shown: &mut ShownObject| {
            let object = frame.objects().find(|object| object.number == shown.number);
            object.is_some_and(|object| shown.is(object))
        };
        self.all.len() == frame.objects().count() && self.all.iter_mut().all(is_there)
    }

    /// Pose in the world of the frame in which the vertices are given: that of the object, or the world
    /// where there are several.
    pub fn world_from_vertices(&self, frame: &ViewFrame) -> Isometry3<f64> {
        match self.all.len() {
            1 => frame.object.world_from_object,
            _ => Isometry3::identity(),
        }
    }

    /// Moves the skins to the shapes of a frame: positions and normals of all vertices, object after
    /// object and part after part.
    ///
    /// Units: m. Frame: [`ShownObjects::world_from_vertices`].
    pub fn follow(
        &mut self,
        frame: &ViewFrame,
        places: &mut Vec<[f32; 3]>,
        normals: &mut Vec<[f32; 3]>,
    ) {
        places.clear();
        normals.clear();
        let is_one = self.all.len() == 1;
        for shown in &mut self.all {
            let number = shown.number;
            let Some(object) = frame.objects().find(|object| object.number == number) else {
                continue;
            };
            shown.skin.follow(&object.shape());
            let pose = object.world_from_object.cast::<f32>();
            let place = |at: &[f32; 3]| -> [f32; 3] { (pose * Point3::from(*at)).into() };
            let turned = |normal: &[f32; 3]| -> [f32; 3] { (pose * Vector3::from(*normal)).into() };
            for part in shown.skin.parts() {
                if is_one {
                    places.extend_from_slice(&part.positions);
                    normals.extend_from_slice(&part.normals);
                } else {
                    places.extend(part.positions.iter().map(place));
                    normals.extend(part.normals.iter().map(turned));
                }
            }
        }
    }

    /// Shares of a range at the vertices of the first body, 0 to 255; those of other parts and objects
    /// are 0.
    pub fn shares(&self, of_nodes: &[f64], vertices: usize) -> Vec<u8> {
        let Some(first) = self.all.first().filter(|_| !of_nodes.is_empty()) else {
            return Vec::new();
        };
        let mut of_body = Vec::new();
        first.skin.body_values(of_nodes, &mut of_body);
        let byte = |share: &f32| (share.clamp(0.0, 1.0) * 255.0).round() as u8;
        let mut shares: Vec<u8> = of_body.iter().map(byte).collect();
        shares.resize(vertices, 0);
        shares
    }
}

impl ShownObject {
    /// Whether the object of a frame is this one, perhaps with another rest shape.
    fn is(&mut self, object: &ObjectView) -> bool {
        let same = self.rest_shapes == object.rest_shapes
            || self.rest.surface().triangles == object.rest.surface().triangles;
        if same {
            self.rest_shapes = object.rest_shapes;
        }
        same
    }
}

/// Message with the parts of all objects, in their order.
fn mesh_of(version: u32, all: &[ShownObject]) -> Arc<ObjectMesh> {
    let (mut records, mut uvs, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    let parts = all.iter().flat_map(|object| object.skin.parts().iter().zip(&object.records));
    for (part, record) in parts {
        let first = u32::try_from(uvs.len()).unwrap_or(u32::MAX);
        let first_triangle = u32::try_from(triangles.len()).unwrap_or(u32::MAX);
        records.push(ObjectPart { first_triangle, ..*record });
        uvs.extend_from_slice(&part.uvs);
        triangles.extend(part.triangles.iter().map(|t| t.map(|vertex| vertex + first)));
    }
    let message = object_message(version, &records, &uvs, &triangles);
    Arc::new(ObjectMesh { version, message })
}

/// Record of a part; its textures are kept from now on.
fn record(part: &Part, textures: &Textures) -> ObjectPart {
    let material = &part.material;
    let number = |texture: &Option<_>| texture.as_ref().map_or(0, |t| textures.add(t));
    ObjectPart {
        first_triangle: 0,
        triangles: u32::try_from(part.triangles.len()).unwrap_or(u32::MAX),
        colour: material.colour,
        roughness: material.roughness,
        metallic: material.metallic,
        clearcoat: material.clearcoat,
        subsurface: material.subsurface,
        texture: number(&material.texture),
        relief: number(&material.relief),
        two_sided: material.two_sided,
    }
}

#[cfg(test)]
mod tests {
    use softgrasp_core::fem::Material;
    use softgrasp_core::mesh::{BuiltIn, generate};
    use softgrasp_window::view::frame::{GraspView, HandActs, OwnLook, ServerView};

    use super::*;

    /// A tick with cubes at rest, each so far to the right, m.
    fn frame_with(places_m: &[f64]) -> ViewFrame {
        let rest = RestShape::try_new(generate(BuiltIn::Cube, 27).unwrap()).unwrap();
        let (rest, material) = (Arc::new(rest), Material::try_new(2.0e4, 0.4).unwrap());
        let objects = places_m.iter().enumerate().map(|(number, x)| ObjectView {
            number,
            own: Some(OwnLook { name: "cube".into(), look: Look::Cube, material }),
            rest: Arc::clone(&rest),
            rest_shapes: 1,
            kept: 0,
            displacement: vec![[0.0; 3]; rest.mesh().node_count()],
            whole: true,
            world_from_object: Isometry3::translation(*x, 0.0, 0.0),
            table_y: None,
        });
        let mut objects: Vec<ObjectView> = objects.collect();
        ViewFrame {
            tick: 0,
            at_s: 0.0,
            object: objects.remove(0),
            others: objects,
            hand: None,
            second_hand: None,
            grasp: GraspView::default(),
            server: ServerView::default(),
            acts: HandActs::default(),
            news: Vec::new(),
            timings: Vec::new(),
        }
    }

    #[test]
    fn several_objects_are_one_mesh_in_the_world_and_one_alone_is_in_its_own_frame() {
        let textures = Textures::default();
        let (mut places, mut normals) = (Vec::new(), Vec::new());
        let mut extent_of = |places_m: &[f64]| {
            let frame = frame_with(places_m);
            let mut shown = ShownObjects::new(1, Look::Cube, &frame, &textures);
            assert!(shown.are(&frame));
            shown.follow(&frame, &mut places, &mut normals);
            assert_eq!(places.len(), normals.len());
            let x = places.iter().map(|place| place[0]);
            let (low, high) = (x.clone().fold(f32::MAX, f32::min), x.fold(f32::MIN, f32::max));
            (places.len(), low, high, shown.world_from_vertices(&frame).translation.x)
        };
        let (count, low, high, at) = extent_of(&[0.3]);
        assert!(low < 0.0 && high < 0.1 && at == 0.3, "{low} to {high} at {at}");
        let (of_both, both_low, both_high, at) = extent_of(&[0.0, 0.3]);
        assert_eq!((of_both, at), (2 * count, 0.0));
        assert!((both_low - low).abs() < 1e-6 && (both_high - high - 0.3).abs() < 1e-6);
    }

    #[test]
    fn object_that_is_touched_comes_first_and_is_the_one_that_is_coloured() {
        let textures = Textures::default();
        let mut frame = frame_with(&[0.0, 0.3]);
        let mut shown = ShownObjects::new(1, Look::Cube, &frame, &textures);
        assert!(shown.begin_with(0));
        std::mem::swap(&mut frame.object, &mut frame.others[0]);
        assert!(shown.are(&frame) && !shown.begin_with(1));
        shown.put_first(2, 1);
        assert!(shown.begin_with(1) && shown.mesh.version == 2);
        let (mut places, mut normals) = (Vec::new(), Vec::new());
        shown.follow(&frame, &mut places, &mut normals);
        assert!(places[0][0] > 0.2, "{:?}", places[0]);
        let shares = shown.shares(&vec![1.0; frame.object.displacement.len()], places.len());
        assert_eq!((shares.len(), shares[0]), (places.len(), 255));
        assert_eq!(shares.last(), Some(&0));
        assert!(!shown.are(&frame_with(&[0.0])));
    }
}
