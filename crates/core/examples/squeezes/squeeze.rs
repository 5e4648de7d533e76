//! A random squeeze: patches of the surface pressed in and turned, with and without forces on others.

use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::{Point3, Rotation3, Unit, Vector3};
use softgrasp_core::fem::hyperelastic::{Elements, Law};
use softgrasp_core::fem::{Element, Material};
use softgrasp_core::mesh::{BuiltIn, Surface, TetMesh, generate};
use softgrasp_core::mesh_io::{Companion, parse};
use softgrasp_core::model::{Known, Model};
use softgrasp_core::solve::equilibrium::{Goal, Path};

/// Objects of `shared/meshes`, and generated ones.
pub fn objects() -> Vec<(String, TetMesh)> {
    let shared = std::env::var_os("SOFTGRASP_SHARED").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"),
        PathBuf::from,
    );
    let files = [
        "armadillo_4k.node",
        "banana.vtk",
        "bunny.wrong-extension.vtk",
        "cylinder.medit.mesh",
        "hammer.v41.msh",
        "liver.msh1.msh",
        "shark.binary22.msh",
        "turtle.veg",
    ];
    let mut objects = Vec::new();
    for name in files {
        let folder = shared.join("meshes");
        let Ok(bytes) = std::fs::read(folder.join(name)) else {
            println!("skipped: no {name}");
            continue;
        };
        let mut beside = |companion: &Companion| {
            let path = match companion {
                Companion::Extension(extension) => folder.join(name).with_extension(extension),
                Companion::FileName(file) => folder.join(file),
            };
            std::fs::read(path).ok()
        };
        let file = parse(name, &bytes, &mut beside).expect("a mesh that can be read");
        objects.push((name.to_owned(), file.mesh));
    }
    for (shape, nodes) in [
        (BuiltIn::Strawberry, 400),
        (BuiltIn::Cube, 343),
        (BuiltIn::Sphere, 600),
        (BuiltIn::Toothpaste, 500),
    ] {
        let mesh = generate(shape, nodes).expect("a size in range");
        objects.push((format!("{shape:?}"), mesh));
    }
    objects
}

/// A squeeze and its model.
pub struct Squeeze {
    pub name: String,
    pub model: Model,
    pub elements: Arc<Elements>,
    pub known: Known,
    pub forces: Vec<f64>,
}

/// Young's modulus, Pa.
const YOUNG: f64 = 2.0e4;

impl Squeeze {
    /// The squeeze of a seed.
    pub fn random(objects: &[(String, TetMesh)], seed: u64) -> Self {
        let mut random = Random::new(seed);
        let (name, mesh) = &objects[seed as usize % objects.len()];
        let poisson = [0.3, 0.4, 0.45, 0.49, 0.4999][random.below(5)];
        let element =
            if poisson >= 0.45 && random.below(3) > 0 { Element::Tet4Anp } else { Element::Tet4 };
        let law = [Law::NeoHookean, Law::NeoHookeanLog][random.below(2)];
        let material = Material::try_new(YOUNG, poisson).expect("in range");
        let model = Model::try_new(mesh.clone(), element, &[material], vec![], &mut |_| {})
            .expect("a model");
        let surface = Surface::from_mesh(mesh);
        let (low, high) = mesh.bounds();
        let (centre, size) = (nalgebra::center(&low, &high), mesh.size());
        let mut free = vec![true; mesh.node_count()];
        let mut pairs = Vec::new();
        for _ in 0..2 + random.below(3) {
            let tip = mesh.vertices()[surface.nodes[random.below(surface.nodes.len())] as usize];
            // At least the five nodes next to the tip.
            let mut distances: Vec<f64> =
                surface.nodes.iter().map(|&n| (mesh.vertices()[n as usize] - tip).norm()).collect();
            distances.sort_by(f64::total_cmp);
            let radius = (random.between(0.06, 0.15) * size).max(distances[4]);
            let inward = Unit::new_normalize(centre - tip);
            let press = *inward * (random.between(0.01, 0.09) * size);
            let turn = Rotation3::from_axis_angle(&inward, random.between(-0.5, 0.5));
            for &n in &surface.nodes {
                let place = mesh.vertices()[n as usize];
                if (place - tip).norm() > radius || !free[n as usize] {
                    continue;
                }
                free[n as usize] = false;
                let moved = tip + turn * (place - tip) + press - place;
                pairs.extend((0..3u32).map(|axis| (3 * n + axis, moved[axis as usize])));
            }
        }
        let mut forces = vec![0.0; 3 * model.system_node_count()];
        let is_loaded = random.below(2) == 1;
        if is_loaded {
            let tip = mesh.vertices()[surface.nodes[random.below(surface.nodes.len())] as usize];
            let radius = random.between(0.08, 0.2) * size;
            let total = random.direction() * (random.between(0.0005, 0.006) * YOUNG * size * size);
            let near = |n: &&u32| free[**n as usize] && near(mesh, **n, tip, radius);
            let nodes: Vec<u32> = surface.nodes.iter().filter(near).copied().collect();
            for n in &nodes {
                for axis in 0..3 {
                    forces[3 * *n as usize + axis] = total[axis] / nodes.len() as f64;
                }
            }
        }
        let known = model.known(pairs).expect("nodes of the mesh");
        let elements = Arc::new(model.hyperelastic(law).expect("elements"));
        let loaded = if is_loaded { "forces" } else { "no-forces" };
        let name =
            format!("{name} {} {} {poisson} {law:?} {loaded}", mesh.node_count(), element.name());
        Self { name, model, elements, known, forces }
    }

    /// What is asked for.
    pub fn goal(&self) -> Goal<'_> {
        Goal { q_known: &self.known.q_known, mask_q: &[], forces: &self.forces }
    }

    /// A path at rest.
    pub fn path(&self) -> Path {
        let hold = self.model.hold(&self.known.dofs, vec![], None).expect("held");
        let rest = vec![0.0; 3 * self.model.system_node_count()];
        let is_single = self.elements.poisson_max() < 0.48;
        let elements = Arc::clone(&self.elements);
        Path::new(elements, self.model.stiffness(), Arc::new(hold), rest, is_single)
    }
}

fn near(mesh: &TetMesh, node: u32, tip: Point3<f64>, radius: f64) -> bool {
    (mesh.vertices()[node as usize] - tip).norm() <= radius
}

/// Largest difference over the largest displacement.
pub fn off(a: &[f64], b: &[f64]) -> f64 {
    let largest = |v: &mut dyn Iterator<Item = f64>| v.fold(0.0f64, |m, x| m.max(x.abs()));
    largest(&mut a.iter().zip(b).map(|(a, b)| a - b)) / largest(&mut b.iter().copied())
}

/// Numbers from a seed (xorshift64*).
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Self {
        let mut random = Self((seed + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        (0..8).for_each(|_| _ = random.next());
        random
    }

    fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, count: usize) -> usize {
        ((self.next() * count as f64) as usize).min(count - 1)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn direction(&mut self) -> Vector3<f64> {
        loop {
            let v = Vector3::from_fn(|_, _| self.between(-1.0, 1.0));
            if v.norm() > 0.1 && v.norm() <= 1.0 {
                return v.normalize();
            }
        }
    }
}
