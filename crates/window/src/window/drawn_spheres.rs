//! The spheres of the sphere tree as they are drawn.

use kiss3d::prelude::{Color, SceneNode3d};
use nalgebra::Isometry3;
use softgrasp_grasp::shape::Sphere;

use super::drawn_mesh::DrawnMesh;
use super::units::drawn_pose;

/// Transparent spheres in two colours.
pub struct DrawnSpheres {
    group: SceneNode3d,
    passed: Heap,
    entered: Heap,
}

/// What a search does with a sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visit {
    /// The search passes the sphere by.
    Passed,
    /// The search looks into the sphere.
    Entered,
}

const PASSED: Color = Color::new(0.16, 0.36, 0.80, 0.26);
const ENTERED: Color = Color::new(0.95, 0.45, 0.10, 0.30);

impl DrawnSpheres {
    /// A drawing without any sphere.
    pub fn new(scene: &mut SceneNode3d) -> Self {
        let group = scene.add_group();
        Self { group, passed: Heap::new(PASSED), entered: Heap::new(ENTERED) }
    }

    /// Shows these spheres; returns whether something new is drawn that has no material yet.
    ///
    /// Units: m. Frame: the object's.
    pub fn show(
        &mut self,
        world_from_object: &Isometry3<f64>,
        spheres: &[(Sphere, Visit)],
    ) -> bool {
        self.group.set_visible(!spheres.is_empty());
        if spheres.is_empty() {
            return false;
        }
        self.group.set_pose(drawn_pose(world_from_object));
        let mut of = |wanted: Visit, heap: &mut Heap| {
            let chosen = spheres.iter().filter(|(_, visit)| *visit == wanted);
            heap.show(&mut self.group, &chosen.map(|(sphere, _)| *sphere).collect::<Vec<_>>())
        };
        // Both are to be shown, whatever the first has to say.
        of(Visit::Passed, &mut self.passed) | of(Visit::Entered, &mut self.entered)
    }
}

/// Spheres of one colour in one mesh: where the processor draws, many draws are slow, and the
/// renderer's own way to draw one body many times keeps memory for each picture.
struct Heap {
    colour: Color,
    drawn: Option<DrawnMesh>,
    /// Number of spheres that the mesh has room for; those that are not needed have no size.
    room: usize,
    ball: Ball,
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
}

impl Heap {
    fn new(colour: Color) -> Self {
        let ball = Ball::new(16, 10);
        Self { colour, drawn: None, room: 0, ball, positions: Vec::new(), normals: Vec::new() }
    }

    /// Shows these spheres; returns whether the mesh is a new one.
    fn show(&mut self, group: &mut SceneNode3d, spheres: &[Sphere]) -> bool {
        let is_new = spheres.len() > self.room;
        if is_new {
            self.room = spheres.len().next_power_of_two();
        }
        self.positions.clear();
        for sphere in spheres {
            let (c, r) = (sphere.centre.map(|v| v as f32), sphere.radius as f32);
            let place = |n: &[f32; 3]| [c.x + r * n[0], c.y + r * n[1], c.z + r * n[2]];
            self.positions.extend(self.ball.normals.iter().map(place));
        }
        let count = self.room * self.ball.normals.len();
        self.positions.resize(count, [0.0; 3]);
        if is_new {
            self.normals = self.ball.normals.repeat(self.room);
            if let Some(before) = self.drawn.take() {
                before.remove();
            }
            let triangles = self.ball.repeated(self.room);
            let uvs = vec![[0.0; 2]; count];
            let mut drawn = DrawnMesh::new(group, &triangles, &self.positions, &self.normals, &uvs);
            drawn.node().set_color(self.colour);
            drawn.node().set_roughness(0.6).set_casts_shadows(false);
            self.drawn = Some(drawn);
        } else if let Some(drawn) = &mut self.drawn {
            drawn.set(&self.positions, &self.normals);
        }
        if let Some(drawn) = &mut self.drawn {
            drawn.node().set_visible(!spheres.is_empty());
        }
        is_new
    }
}

/// A sphere of radius 1 around the origin: its vertices are their own normals.
struct Ball {
    normals: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Ball {
    /// Shapes: (`rings` + 1) × (`around` + 1) vertices.
    fn new(around: u32, rings: u32) -> Self {
        let (mut normals, mut triangles) = (Vec::new(), Vec::new());
        for ring in 0..=rings {
            let down = std::f32::consts::PI * ring as f32 / rings as f32;
            for step in 0..=around {
                let turn = std::f32::consts::TAU * step as f32 / around as f32;
                normals.push([down.sin() * turn.cos(), down.cos(), down.sin() * turn.sin()]);
            }
        }
        for (ring, step) in (0..rings).flat_map(|ring| (0..around).map(move |step| (ring, step))) {
            let a = ring * (around + 1) + step;
            let b = a + around + 1;
            triangles.extend([[a, a + 1, b], [b, a + 1, b + 1]]);
        }
        Self { normals, triangles }
    }

    /// The triangles of so many balls, one after the other.
    fn repeated(&self, count: usize) -> Vec<[u32; 3]> {
        let vertices = self.normals.len() as u32;
        let of_ball = |ball: usize| {
            let first = ball as u32 * vertices;
            self.triangles.iter().map(move |triangle| triangle.map(|vertex| first + vertex))
        };
        (0..count).flat_map(of_ball).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_of_a_ball_look_outwards_and_close_it() {
        let ball = Ball::new(16, 10);
        let mut volume = 0.0;
        for triangle in ball.repeated(2) {
            let [a, b, c] = triangle.map(|vertex| {
                nalgebra::Vector3::from(ball.normals[vertex as usize % ball.normals.len()])
            });
            volume += a.dot(&b.cross(&c)) / 6.0;
        }
        let whole = 2.0 * 4.0 / 3.0 * std::f32::consts::PI;
        assert!(volume > 0.9 * whole && volume < whole, "{volume} of {whole}");
    }
}
