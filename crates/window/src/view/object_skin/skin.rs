//! The skin of a loaded object: all that is drawn of it, kept in step with its computed shape.

use nalgebra::Point3;
use softgrasp_grasp::object::RestShape;

use super::body::{Body, SpreadBody};
use super::calyx::Calyx;
use super::cap::Cap;
use super::look::Look;
use super::paint::{FruitPaint, TubePaint, ball, foam};
use super::part::{Part, SurfaceMaterial};
use super::seeds::Seeds;
use super::tube_profile::TubeProfile;
use super::unwrap::Unwrap;

/// What is drawn of an object: its body, and the parts that ride on it.
///
/// Made once per loaded object. A kept shape has the same nodes, so it keeps its skin, and the
/// print on it is stretched as the object is. Units: m. Frame: the object's.
pub struct ObjectSkin {
    body: Body,
    riders: Riders,
    parts: Vec<Part>,
}

/// What rides on the body; its parts come after the body in this order.
enum Riders {
    None,
    /// Seeds, leaves, stalk.
    Fruit {
        seeds: Seeds,
        calyx: Box<Calyx>,
    },
    Cap(Cap),
}

impl ObjectSkin {
    /// The skin of an object at rest. It paints pictures, which takes some tenths of a second.
    pub fn new(look: Look, rest: &RestShape) -> Self {
        let mut body = Body::new(rest, look.crease_angle());
        let dressed = dress(look, rest, &mut body);
        let count = body.vertex_count();
        let body_part = Part {
            name: "body",
            triangles: body.triangles.clone(),
            positions: vec![[0.0; 3]; count],
            normals: vec![[0.0; 3]; count],
            uvs: dressed.spread.uvs.iter().map(|uv| uv.map(|c| c as f32)).collect(),
            material: dressed.material,
        };
        let riders = dressed.riders;
        let mut parts = vec![body_part];
        match &riders {
            Riders::None => {}
            Riders::Fruit { seeds, calyx } => {
                parts.extend([seeds.part(), calyx.leaves(), calyx.stalk()]);
            }
            Riders::Cap(cap) => parts.push(cap.part()),
        }
        let mut skin = Self { body, riders, parts };
        skin.follow(rest.mesh().vertices());
        skin
    }

    /// What to draw: the body first, then what rides on it.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// Moves all parts to a deformed shape, or to a shape that was kept.
    ///
    /// The drawn surface passes through every vertex of the computed one.
    /// Shapes: `shape` holds all vertices of the mesh. Units: m. Frame: the object's.
    pub fn follow(&mut self, shape: &[Point3<f64>]) {
        self.body.follow(shape);
        let [body_part, others @ ..] = self.parts.as_mut_slice() else { return };
        self.body.write(&mut body_part.positions, &mut body_part.normals);
        match (&self.riders, others) {
            (Riders::Fruit { seeds, calyx }, [drawn_seeds, leaves, stalk]) => {
                seeds.write(&self.body, drawn_seeds);
                calyx.write_leaves(&self.body, leaves);
                calyx.write_stalk(&self.body, stalk);
            }
            (Riders::Cap(cap), [drawn_cap]) => cap.write(shape, drawn_cap),
            _ => {}
        }
    }

    /// Values at the body's drawn vertices of a quantity known at the nodes.
    ///
    /// Linear within each computed triangle. Shapes: `node_values` one per node of the mesh; `out`
    /// one per vertex of the body.
    pub fn body_values(&self, node_values: &[f64], out: &mut Vec<f32>) {
        self.body.values(node_values, out);
    }

    /// The edges of the computed surface, in pieces: pairs of vertices of the body.
    pub fn wireframe(&self) -> &[[u32; 2]] {
        &self.body.wireframe
    }
}

/// How an object is dressed: paint, and what rides on it.
struct Dressed {
    spread: SpreadBody,
    material: SurfaceMaterial,
    riders: Riders,
}

fn dress(look: Look, rest: &RestShape, body: &mut Body) -> Dressed {
    match look {
        Look::Strawberry => dress_fruit(rest, body),
        Look::Toothpaste => dress_tube(rest, body),
        Look::Cube => {
            let (low, high) = rest.mesh().bounds();
            let spread = body.spread(&Unwrap::Faces { low, high });
            let mut material = SurfaceMaterial::plain([1.0; 3], 0.85);
            material.subsurface = 0.15;
            material.texture = Some(foam());
            Dressed { spread, material, riders: Riders::None }
        }
        Look::Sphere => {
            let centre = rest.centre();
            let spread = body.spread(&Unwrap::Discs { centre });
            let baked = spread.with(&body.triangles).bake(2048, 1024, |p| ball(&centre, p));
            let mut material = SurfaceMaterial::plain([1.0; 3], 0.48);
            material.clearcoat = (0.25, 0.3);
            material.subsurface = 0.1;
            material.texture = Some(baked.colours);
            Dressed { spread, material, riders: Riders::None }
        }
        Look::Imported => {
            let spread = body.spread(&Unwrap::Nothing);
            let mut material = SurfaceMaterial::plain(CLAY, 0.72);
            material.subsurface = 0.15;
            Dressed { spread, material, riders: Riders::None }
        }
    }
}

fn dress_fruit(rest: &RestShape, body: &mut Body) -> Dressed {
    let (low, high) = rest.mesh().bounds();
    let scale = (high.y - low.y) / FRUIT_HEIGHT;
    let vertices = rest.mesh().vertices();
    let spread = body.spread(&Unwrap::Discs { centre: rest.centre() });
    let seeds = Seeds::new(body, &spread, vertices, scale);
    let paint = FruitPaint::new(seeds.places(body), low.y, high.y, scale);
    let baked = spread.with(&body.triangles).bake(2048, 1024, |p| paint.at(p));
    let mut material = SurfaceMaterial::plain([1.0; 3], 0.42);
    material.clearcoat = (0.9, 0.14);
    material.subsurface = 0.35;
    material.texture = Some(baked.colours);
    material.relief = Some(baked.relief);
    let calyx = Box::new(Calyx::new(body, vertices, scale));
    Dressed { spread, material, riders: Riders::Fruit { seeds, calyx } }
}

fn dress_tube(rest: &RestShape, body: &mut Body) -> Dressed {
    let vertices = rest.mesh().vertices();
    let nodes = &rest.surface().nodes;
    let points: Vec<Point3<f64>> = nodes.iter().map(|n| vertices[*n as usize]).collect();
    let profile = TubeProfile::new(&points);
    let spread = body.spread(&Unwrap::Sides(profile.clone()));
    let cap = Cap::new(vertices, nodes, &profile);
    let paint = TubePaint::new(profile);
    let baked = spread.with(&body.triangles).bake(2048, 1024, |p| paint.at(p));
    let mut material = SurfaceMaterial::plain([1.0; 3], 0.36);
    material.clearcoat = (0.5, 0.12);
    material.texture = Some(baked.colours);
    material.relief = Some(baked.relief);
    Dressed { spread, material, riders: cap.map_or(Riders::None, Riders::Cap) }
}

/// Height of the strawberry that seeds and leaves were measured for, m.
const FRUIT_HEIGHT: f64 = 0.065;
/// Linear colour of clay.
const CLAY: [f32; 3] = [0.10, 0.34, 0.38];
