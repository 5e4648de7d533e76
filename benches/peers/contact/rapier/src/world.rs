//! The world of a scene: table, tips on springs, ball.

use std::error::Error;
use std::time::Instant;

use rapier3d_f64::na::Unit;
use rapier3d_f64::prelude::*;

use crate::scene::{Scene, Soft, Told};

/// A ball, as the world knows it.
enum Ball {
    Rigid(RigidBodyHandle),
    Soft { handle: SoftBodyHandle, masses: Vec<f64> },
}

/// A world in which a scene is played.
pub struct Lift {
    world: PhysicsWorld,
    ball: Ball,
    /// Bodies that go where the springs hold the tips, and the tips.
    anchors: [RigidBodyHandle; 2],
    tips: [RigidBodyHandle; 2],
}

impl Lift {
    /// A scene at its beginning.
    pub fn new(scene: &Scene) -> Result<Self, Box<dyn Error>> {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::new(0.0, 0.0, -9.81);
        let settings = &scene.settings;
        let parameters = &mut world.integration_parameters;
        parameters.dt = 1.0 / 60.0 / f64::from(settings.substeps);
        set(&mut parameters.num_solver_iterations, settings.solver_iterations);
        set(&mut parameters.num_internal_pgs_iterations, settings.pgs_iterations);
        set(
            &mut parameters.num_internal_stabilization_iterations,
            settings.stabilization_iterations,
        );
        set(&mut parameters.length_unit, settings.length_unit);
        let fem = &mut parameters.soft_bodies.fem;
        set(&mut fem.max_dense_dofs, settings.factored_dofs);
        set(&mut fem.max_linear_iterations, settings.linear_iterations);
        set(&mut fem.linear_tolerance, settings.linear_tolerance);
        for softness in [&mut parameters.contact_softness, &mut parameters.static_contact_softness]
        {
            set(&mut softness.natural_frequency, settings.contact_frequency);
            set(&mut softness.damping_ratio, settings.contact_damping_ratio);
        }
        let table = world.bodies.insert(RigidBodyBuilder::fixed());
        let plane =
            ColliderBuilder::halfspace(Unit::new_unchecked(Vector::Z)).friction(scene.friction);
        world.colliders.insert_with_parent(plane, table, &mut world.bodies);
        let mut tip = |side: usize| {
            let place = Vector::from(scene.tips[0][side]);
            let anchor = RigidBodyBuilder::kinematic_position_based().translation(place);
            let anchor = world.bodies.insert(anchor);
            let tip = RigidBodyBuilder::dynamic()
                .translation(place)
                .lock_rotations()
                .gravity_scale(0.0)
                .can_sleep(false);
            let tip = world.bodies.insert(tip);
            let ball = ColliderBuilder::ball(scene.tip.radius)
                .mass(scene.tip.mass)
                .friction(scene.friction);
            world.colliders.insert_with_parent(ball, tip, &mut world.bodies);
            let mut spring =
                GenericJointBuilder::new(JointAxesMask::empty()).contacts_enabled(false);
            for axis in [JointAxis::LinX, JointAxis::LinY, JointAxis::LinZ] {
                spring = spring.motor_model(axis, MotorModel::ForceBased).motor_position(
                    axis,
                    0.0,
                    scene.tip.stiffness,
                    scene.tip.damping,
                );
            }
            world.impulse_joints.insert(anchor, tip, spring.build(), true);
            (anchor, tip)
        };
        let [left, right] = [tip(0), tip(1)];
        let ball = match &scene.soft {
            None => Self::rigid(&mut world, scene),
            Some(soft) => Self::soft(&mut world, scene, soft)?,
        };
        Ok(Self { world, ball, anchors: [left.0, right.0], tips: [left.1, right.1] })
    }

    fn rigid(world: &mut PhysicsWorld, scene: &Scene) -> Ball {
        let body = RigidBodyBuilder::dynamic()
            .translation(Vector::new(0.0, 0.0, scene.radius))
            .can_sleep(false);
        let body = world.bodies.insert(body);
        let ball = ColliderBuilder::ball(scene.radius).mass(scene.mass).friction(scene.friction);
        world.colliders.insert_with_parent(ball, body, &mut world.bodies);
        Ball::Rigid(body)
    }

    fn soft(world: &mut PhysicsWorld, scene: &Scene, soft: &Soft) -> Result<Ball, Box<dyn Error>> {
        let points: Vec<Vector> = soft.points.iter().map(|&p| Vector::from(p)).collect();
        let solver = match soft.solver.as_str() {
            "fem" => SoftBodySolver::Fem,
            "constraints" => SoftBodySolver::Constraints,
            other => return Err(format!("no solver is called {other}").into()),
        };
        let material = SoftBodyMaterial {
            young_modulus: soft.young,
            poisson_ratio: soft.poisson,
            elastic_damping_ratio: soft.damping_ratio,
            ..Default::default()
        };
        let cells = soft.tets.iter().map(|&tet| oriented(tet, &points)).collect();
        let builder = SoftBodyBuilder::new(points)
            .cells(cells)
            .cell_model(SoftBodyCellModel::Corotational)
            .material(material)
            .solver(solver)
            .masses(soft.masses.clone())
            .particle_radius(soft.skin)
            .surface_collider(ColliderBuilder::ball(soft.skin).friction(scene.friction))
            .can_sleep(false);
        let handle = world.insert_soft_body(builder);
        Ok(Ball::Soft { handle, masses: soft.masses.clone() })
    }

    /// Plays the frame of a number.
    pub fn frame(&mut self, scene: &Scene, number: usize) -> Told {
        let substeps = scene.settings.substeps;
        let (mut seconds, mut cpu_ms) = (0.0, 0.0);
        for step in 1..=substeps {
            let share = f64::from(step) / f64::from(substeps);
            for side in 0..2 {
                let [from, to] = [number, number + 1].map(|k| Vector::from(scene.tips[k][side]));
                let place = from + (to - from) * share;
                self.world.bodies[self.anchors[side]].set_next_kinematic_translation(place);
            }
            let spent = cpu_time_ms();
            let start = Instant::now();
            self.world.step();
            seconds += start.elapsed().as_secs_f64();
            cpu_ms += cpu_time_ms() - spent;
        }
        let (height, points) = self.ball();
        let tips = self.tips.map(|tip| self.world.bodies[tip].translation().into());
        Told { ms: seconds * 1e3, cpu_ms, height, tips, points }
    }

    /// Height of the centre of mass, and the nodes.
    fn ball(&self) -> (f64, Vec<[f64; 3]>) {
        match &self.ball {
            Ball::Rigid(body) => (self.world.bodies[*body].translation().z, Vec::new()),
            Ball::Soft { handle, masses } => {
                let soft = &self.world.soft_bodies[*handle];
                let points: Vec<Vector> = soft.particle_positions().collect();
                let moment: f64 = points.iter().zip(masses).map(|(p, mass)| mass * p.z).sum();
                let height = moment / masses.iter().sum::<f64>();
                (height, points.into_iter().map(Into::into).collect())
            }
        }
    }
}

/// What the threads of this process have computed so far, on Linux; elsewhere 0.
fn cpu_time_ms() -> f64 {
    let Ok(threads) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    let texts =
        threads.flatten().flat_map(|one| std::fs::read_to_string(one.path().join("schedstat")));
    let nanoseconds = texts.filter_map(|text| text.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.sum::<f64>() * 1e-6
}

fn set<T: Copy>(place: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *place = value;
    }
}

/// Rapier wants the fourth corner on the other side of the first three.
fn oriented(tet: [u32; 4], points: &[Vector]) -> [u32; 4] {
    let [a, b, c, d] = tet.map(|v| points[v as usize]);
    match (b - a).cross(c - a).dot(d - a) < 0.0 {
        true => [tet[1], tet[0], tet[2], tet[3]],
        false => tet,
    }
}
