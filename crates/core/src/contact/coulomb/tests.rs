//! Contact problems with known answers, and random ones against sweeps alone.

use nalgebra::{DMatrix, Vector3};
use proptest::prelude::*;

use super::between_points::BetweenPoints;
use super::cone::at;
use super::sweeps::PointProblem;
use super::sweeps::Sweeps;
use super::*;

/// A rigid block of four corners on a plane: forces act on mass and inertia.
///
/// Units: kg, m, s.
struct Block {
    mass: f64,
    inertia: Vector3<f64>,
    /// Corners from the centre of mass; the normal is z, written first in the rows.
    corners: [Vector3<f64>; 4],
}

impl Block {
    fn new() -> Self {
        let (mass, half) = (0.3, Vector3::new(0.03, 0.02, 0.01));
        let square = half.component_mul(&half) * (mass / 3.0);
        let inertia = Vector3::new(square.y + square.z, square.x + square.z, square.x + square.y);
        let corner = |x: f64, y: f64| Vector3::new(x * half.x, y * half.y, -half.z);
        let corners = [corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0), corner(1.0, -1.0)];
        Self { mass, inertia, corners }
    }

    /// One step of the block with a velocity, under gravity, on a plane of some friction.
    fn problem(&self, gravity: Vector3<f64>, h: f64, friction: f64) -> ContactProblem {
        let normal_first = |v: Vector3<f64>| [v.z, v.x, v.y];
        let w = DMatrix::from_fn(12, 12, |r, c| {
            let axis = |k: usize| [Vector3::z(), Vector3::x(), Vector3::y()][k % 3];
            let (i, j) = (self.corners[r / 3], self.corners[c / 3]);
            let turned = j.cross(&axis(c)).component_div(&self.inertia).cross(&i);
            h * h * axis(r).dot(&(axis(c) / self.mass + turned))
        });
        let fall = normal_first(h * h * gravity);
        let b = (0..12).map(|row| fall[row % 3]).collect();
        // A body that is rigid has no compliance of its own; what is shared is not touched by this.
        let soft = DMatrix::identity(12, 12) * (1e-6 * w.trace() / 12.0);
        ContactProblem::try_new(w + soft, b, vec![FrictionCone { friction }; 4]).unwrap()
    }
}

fn tilted(degrees: f64) -> Vector3<f64> {
    let angle = degrees.to_radians();
    9.81 * Vector3::new(angle.sin(), 0.0, -angle.cos())
}

#[test]
fn block_on_a_tilted_plane_sticks_below_the_angle_of_friction_and_slides_above() {
    let (block, h) = (Block::new(), 0.01);
    let friction: f64 = 0.4;
    let angle = friction.atan().to_degrees();
    for (degrees, slides) in [(angle - 0.01, false), (angle + 0.01, true), (angle + 5.0, true)] {
        let problem = block.problem(tilted(degrees), h, friction);
        let found = Solution::of(&problem, &[], SolveBudget::default());
        assert!(found.is_converged, "{degrees} degrees: residual {:e} N", found.residual);
        let weight = block.mass * 9.81;
        let (normal, along) =
            (0..4).fold((0.0, 0.0), |(n, t), i| (n + found.force(i).x, t - found.force(i).y));
        let (sin, cos) = degrees.to_radians().sin_cos();
        assert!((normal - weight * cos).abs() < 1e-6 * weight, "{normal}");
        let expected = if slides { friction * weight * cos } else { weight * sin };
        assert!((along - expected).abs() < 1e-5 * weight, "{degrees} degrees: {along}, {expected}");
        let slip = (0..4).map(|i| at(&found.motion, i).yz().norm()).fold(0.0, f64::max);
        let free = h * h * 9.81 * (sin - friction * cos);
        match slides {
            true => assert!((slip - free).abs() < 1e-3 * free, "{slip:e} instead of {free:e}"),
            false => assert!(slip < 1e-9, "{slip:e}"),
        }
    }
}

#[test]
fn points_that_are_nowhere_near_get_no_force_at_all() {
    let problem = ContactProblem::try_new(
        DMatrix::identity(6, 6),
        vec![0.1, 3.0, -4.0, 1e-9, 0.0, 1.0],
        vec![FrictionCone { friction: 1.0 }; 2],
    )
    .unwrap();
    let found = Solution::of(&problem, &[], SolveBudget::default());
    assert_eq!(found.lambda, [0.0; 6]);
    assert!(found.is_converged && found.newton_steps == 0);
}

#[test]
fn what_makes_no_problem_is_refused_by_name() {
    let cones = vec![FrictionCone { friction: 0.5 }];
    let new = |w: DMatrix<f64>, b: Vec<f64>| ContactProblem::try_new(w, b, cones.clone()).err();
    assert!(matches!(new(DMatrix::identity(2, 2), vec![0.0; 3]), Some(ProblemError::Sizes { .. })));
    assert!(matches!(new(DMatrix::zeros(3, 3), vec![0.0; 3]), Some(ProblemError::Rigid { .. })));
    let nan = new(DMatrix::identity(3, 3), vec![f64::NAN; 3]);
    assert!(matches!(nan, Some(ProblemError::NotFinite)));
}

/// A splitting that runs away ends at forces that are no numbers: their residual was 0, and they were taken for
/// the solution.
#[test]
fn forces_that_are_no_numbers_do_not_count_as_a_solution() {
    let cones = vec![FrictionCone { friction: 0.5 }; 2];
    let b = vec![-1.0, 0.0, 0.0, -1.0, 0.0, 0.0];
    let problem = ContactProblem::try_new(DMatrix::identity(6, 6), b, cones).unwrap();
    let solved = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    assert_eq!(problem.residual_of(&solved, &problem.motion(&solved)), 0.0);
    for wrong in [f64::NAN, f64::INFINITY] {
        let lambda = [1.0, 0.0, 0.0, wrong, wrong, 0.0];
        let residual = problem.residual_of(&lambda, &problem.motion(&lambda));
        assert_eq!(residual, f64::INFINITY);
    }
}

/// A random compliance as bodies have it: everything is coupled, near things more.
fn compliance(n: usize, seed: &[f64]) -> DMatrix<f64> {
    let place = |i: usize| {
        Vector3::new(seed[3 * i], seed[3 * i + 1], 0.3 * seed[3 * i + 2]) + Vector3::repeat(1e-3)
    };
    DMatrix::from_fn(3 * n, 3 * n, |r, c| {
        let apart = place(r / 3) - place(c / 3);
        let distance = (apart.norm_squared() + 0.01).sqrt();
        let direction = apart / distance;
        let same = if r % 3 == c % 3 { 1.4 } else { 0.0 };
        // Kelvin's solution for a point force, smoothed.
        (same + 0.6 * direction[r % 3] * direction[c % 3]) / distance
    })
}

/// A fingertip on a fine surface: three points within a thousandth of each place, so that the compliance
/// is nearly the same for all of them, pressed and sheared by a sphere that touches the middle most.
fn fingertip(
    places: &[(f64, f64)],
    press: f64,
    shear: (f64, f64),
    friction: f64,
) -> ContactProblem {
    let mut seed = Vec::new();
    for (x, y) in places {
        for k in 0..3 {
            let turn = f64::from(k) * 2.1;
            seed.extend([x + 1e-3 * turn.cos(), y + 1e-3 * turn.sin(), 0.0]);
        }
    }
    let n = seed.len() / 3;
    let w = compliance(n, &seed);
    let b = (0..n).flat_map(|i| {
        let away = seed[3 * i].hypot(seed[3 * i + 1]);
        [away * away - press, shear.0, shear.1]
    });
    ContactProblem::try_new(w, b.collect(), vec![FrictionCone { friction }; n]).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn three_points_at_every_place_of_a_fingertip_are_solved_too(
        places in prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 4..14),
        press in 0.2..1.5f64,
        shear in (-0.8..0.8f64, -0.8..0.8f64),
        friction in 0.2..0.9f64,
    ) {
        let problem = fingertip(&places, press, shear, friction);
        let budget = SolveBudget { residual_rel: 1e-8, attempts_max: 20, ..SolveBudget::default() };
        let found = Solution::of(&problem, &[], budget);
        prop_assert!(found.is_converged, "residual {:e} of {:e} N", found.residual, found.force_max());
    }

    /// Where places crowd, the compliance has hardly an inverse: in one of thirteen of these Newton's method and the
    /// splitting came back to the same forces again and again.
    #[test]
    fn a_fingertip_whose_places_crowd_is_solved_and_not_gone_round_in_circles(
        places in prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 4..14),
        press in 0.2..1.5f64,
        shear in prop::option::of((-0.8..0.8f64, -0.8..0.8f64)),
        friction in 0.2..1.5f64,
    ) {
        let (first, half) = (places[0], places.len() / 2);
        let near = |(i, place): (usize, &(f64, f64))| match i {
            i if i > 0 && i < half => (first.0 + 0.1 * place.0, first.1 + 0.1 * place.1),
            _ => *place,
        };
        let places: Vec<(f64, f64)> = places.iter().enumerate().map(near).collect();
        let problem = fingertip(&places, press, shear.unwrap_or_default(), friction);
        let budget = SolveBudget { residual_rel: 1e-8, attempts_max: 20, ..SolveBudget::default() };
        let found = Solution::of(&problem, &[], budget);
        prop_assert!(found.is_converged, "residual {:e} of {:e} N", found.residual, found.force_max());
    }

    #[test]
    fn random_problems_are_solved_and_sweeps_alone_find_the_same_motion(
        n in 1usize..16,
        seed in prop::collection::vec(-1.0..1.0f64, 72),
        pushed in prop::collection::vec(-1.0..0.5f64, 72),
        friction in 0.0..0.9f64,
    ) {
        let w = compliance(n, &seed);
        let cones = vec![FrictionCone { friction }; n];
        let problem = ContactProblem::try_new(w, pushed[..3 * n].to_vec(), cones).unwrap();
        let found = Solution::of(&problem, &[], SolveBudget::default());
        prop_assert!(found.is_converged, "residual {:e} of {:e} N", found.residual, found.force_max());
        prop_assert!((0..n).all(|i| found.motion[3 * i] > -1e-9));
        // The oracle: sweeps and nothing else.
        let sweeps = Sweeps::new(&problem);
        let (mut lambda, mut motion) = (vec![0.0; 3 * n], problem.motion(&[]));
        for _ in 0..2_000 {
            sweeps.sweep(&mut lambda, &mut motion);
        }
        motion = problem.motion(&lambda);
        let residual = problem.residual_of(&lambda, &motion);
        prop_assume!(residual < 1e-9 * found.force_max().max(1e-3));
        let off = motion.iter().zip(&found.motion).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        prop_assert!(off < 1e-5, "{off:e}");
    }
}

#[test]
fn a_point_without_friction_presses_only() {
    let mut w = nalgebra::Matrix3::identity();
    w[(0, 1)] = 0.3;
    w[(1, 0)] = 0.3;
    let force = PointProblem::new(w, 0.0).solve(Vector3::new(-0.5, 0.2, 0.0));
    assert_eq!(force, Vector3::new(0.5, 0.0, 0.0));
}

/// Points between corners: each within a triangle of three, on an edge or at a corner, its normal turned.
fn between(corners: usize, seed: &[f64]) -> Vec<PointPlace> {
    let numbers = |i: usize| &seed[4 * i..4 * i + 4];
    let place = |i: usize| {
        let [a, b, turn, kind] = numbers(i) else { unreachable!("four numbers a point") };
        let first = i % corners;
        let others = [(first + 1) % corners, (first + 2) % corners];
        let weights = match (3.0 * kind.abs()) as usize {
            0 => [1.0, 0.0, 0.0],
            1 => [0.5 + 0.4 * a, 0.5 - 0.4 * a, 0.0],
            _ => [0.4 + 0.2 * a, 0.3 + 0.2 * b, 0.3 - 0.2 * a - 0.2 * b],
        };
        let axis = nalgebra::Vector3::new(*a, *b, 0.3);
        let frame = nalgebra::Rotation3::from_scaled_axis(*turn * axis).into_inner();
        PointPlace {
            corners: [first, others[0], others[1]].map(|c| c as u32),
            weights,
            frame,
            slide: None,
        }
    };
    (0..seed.len() / 4).map(place).collect()
}

/// B: weight times frame for each corner, rows, and point, columns.
fn spread(corners: usize, points: &[PointPlace]) -> DMatrix<f64> {
    let mut b = DMatrix::zeros(3 * corners, 3 * points.len());
    for (i, point) in points.iter().enumerate() {
        for (corner, weight) in point.weighted() {
            let mut block = b.fixed_view_mut::<3, 3>(3 * corner, 3 * i);
            block += weight * point.frame;
        }
    }
    b
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn operator_between_corners_is_that_of_its_matrices(
        corners in 3usize..9,
        seed in prop::collection::vec(-1.0..1.0f64, 27),
        points in prop::collection::vec(-1.0..1.0f64, 4 * 11),
    ) {
        let (k, points) = (compliance(corners, &seed), between(corners, &points));
        let b = spread(corners, &points);
        let w = Delassus::try_new(k.clone(), points.clone()).unwrap();
        let dense = b.transpose() * &k * &b;
        prop_assert!((w.to_matrix() - &dense).norm() < 1e-12 * dense.norm());
        for i in 0..points.len() {
            prop_assert!((w.own(i) - dense.fixed_view::<3, 3>(3 * i, 3 * i)).norm() < 1e-12 * dense.norm());
        }
        // A stiffness of every point couples the corners.
        let answers: Vec<_> = (0..points.len()).map(|i| w.own(i) * (1.0 + i as f64)).collect();
        let mut h = DMatrix::zeros(3 * points.len(), 3 * points.len());
        for (i, answer) in answers.iter().enumerate() {
            h.fixed_view_mut::<3, 3>(3 * i, 3 * i).copy_from(answer);
        }
        let coupled = DMatrix::identity(3 * corners, 3 * corners) + &k * &b * h * b.transpose();
        prop_assert!((w.coupled(&answers) - &coupled).norm() < 1e-12 * coupled.norm());
        // Of some points alone it is the part of the whole.
        let some = [1, 4, 5, 9];
        let part = w.of_points(&some).to_matrix();
        for (r, &i) in some.iter().enumerate() {
            for (c, &j) in some.iter().enumerate() {
                let off = part.fixed_view::<3, 3>(3 * r, 3 * c) - dense.fixed_view::<3, 3>(3 * i, 3 * j);
                prop_assert!(off.norm() < 1e-12 * dense.norm());
            }
        }
    }

    #[test]
    fn more_points_than_corners_move_as_in_the_problem_of_their_matrix(
        corners in 3usize..7,
        seed in prop::collection::vec(-1.0..1.0f64, 21),
        points in prop::collection::vec(-1.0..1.0f64, 4 * 14),
        pushed in prop::collection::vec(-1.0..0.5f64, 3 * 14),
        friction in 0.0..0.9f64,
    ) {
        let mut points = between(corners, &points);
        // Normals that hardly differ, as those of a patch.
        points.iter_mut().for_each(|point| point.frame = nalgebra::Matrix3::identity());
        let cones = vec![FrictionCone { friction }; points.len()];
        let w = Delassus::try_new(compliance(corners, &seed), points).unwrap();
        let dense = ContactProblem::try_new(w.to_matrix(), pushed.clone(), cones.clone()).unwrap();
        let problem = {
            let laws = cones.into_iter().map(PointLaw::from).collect();
            ContactProblem::between_corners(w, pushed, laws).unwrap()
        };
        let budget = SolveBudget { residual_rel: 1e-8, ..SolveBudget::default() };
        let (ours, theirs) = (Solution::of(&problem, &[], budget), Solution::of(&dense, &[], budget));
        prop_assert!(ours.is_converged, "residual {:e} of {:e} N", ours.residual, ours.force_max());
        prop_assume!(theirs.is_converged);
        // Forces that shear every point can have more than one answer; without friction motions have one.
        let off = ours.motion.iter().zip(&theirs.motion).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        prop_assert!(friction > 0.3 || off < 1e-4, "{off:e}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// The oracle: the spring's compliance taken out of W beforehand.
    #[test]
    fn spring_among_the_points_is_that_of_the_problem_without_it_on_a_stiffer_body(
        corners in 3usize..9,
        seed in prop::collection::vec(-1.0..1.0f64, 27),
        pushed in prop::collection::vec(-1.0..0.5f64, 27),
        rise in -0.5..0.5f64,
        logarithm in -2.0..2.0f64,
        friction in 0.0..0.6f64,
    ) {
        let (k, stiffness) = (compliance(corners, &seed), 10.0f64.powf(logarithm));
        let mut points: Vec<PointPlace> = (0..corners as u32).map(PointPlace::corner).collect();
        points.push(PointPlace { weights: [-1.0, 0.4, 0.6], ..PointPlace::corner(0) });
        points[corners].corners = [0, 1, 2];
        let w = Delassus::try_new(k.clone(), points).unwrap();
        let (whole, n) = (w.to_matrix(), 3 * corners);
        let mut b = pushed[..n].to_vec();
        let per_motion = stiffness / (1.0 + stiffness * whole[(n, n)]);
        let stiffer = DMatrix::from_fn(n, n, |r, c| whole[(r, c)] - whole[(r, n)] * per_motion * whole[(n, c)]);
        let pushed: Vec<f64> = (0..n).map(|r| b[r] - whole[(r, n)] * per_motion * rise).collect();
        b.extend([rise, 0.0, 0.0]);
        let contact = FrictionCone { friction };
        let mut laws = vec![PointLaw::Contact(contact); corners];
        laws.push(PointLaw::Spring { stiffness: Vector3::new(stiffness, 0.0, 0.0) });
        let problem = ContactProblem::between_corners(w, b, laws).unwrap();
        let oracle = ContactProblem::try_new(stiffer, pushed, vec![contact; corners]).unwrap();
        let budget = SolveBudget { residual_rel: 1e-9, ..SolveBudget::default() };
        let (ours, theirs) = (Solution::of(&problem, &[], budget), Solution::of(&oracle, &[], budget));
        prop_assert!(ours.is_converged, "residual {:e} of {:e} N", ours.residual, ours.force_max());
        prop_assume!(theirs.is_converged);
        let spring = at(&ours.lambda, corners);
        let off = (spring.x + stiffness * ours.motion[n]).abs();
        prop_assert!(off < 1e-6 * (1.0 + spring.x.abs()), "{off:e}");
        prop_assert_eq!(spring.yz().norm(), 0.0);
        let pairs = ours.motion[..n].iter().zip(&theirs.motion);
        let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        prop_assert!(friction > 0.3 || off < 1e-4, "{off:e}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// The oracle: the operator between corners, of points and springs together.
    #[test]
    fn problem_between_points_alone_moves_them_as_that_of_corners_and_springs(
        corners in 8usize..14,
        seed in prop::collection::vec(-1.0..1.0f64, 42),
        points in prop::collection::vec(-1.0..1.0f64, 4 * 5),
        springs in prop::collection::vec((0usize..5, prop::array::uniform5(-1.0..1.0f64)), 0..9),
        pushed in prop::collection::vec(-1.0..0.5f64, 3 * 14),
        lambda in prop::collection::vec(-1.0..1.0f64, 3 * 14),
    ) {
        let contacts = between(corners, &points);
        let (mut places, mut laws) = (Vec::new(), Vec::new());
        for (i, place) in contacts.iter().enumerate() {
            // Springs stand among the points: their order says nothing.
            for (_, [rise, fall, share, logarithm, along]) in springs.iter().filter(|s| s.0 == i) {
                let weights = [-rise - fall, *rise, *fall];
                let slide = Some(Slide { weights: place.weights, share: [0.3 * share, 0.2 * share] });
                places.push(PointPlace { weights, slide, ..*place });
                let normal = 10.0f64.powf(2.0 * logarithm);
                let stiffness = Vector3::new(normal, along * normal, -share * normal);
                laws.push(PointLaw::Spring { stiffness });
            }
            places.push(*place);
            laws.push(FrictionCone { friction: 0.4 }.into());
        }
        let n = places.len();
        let w = Delassus::try_new(compliance(corners, &seed), places).unwrap();
        let problem = ContactProblem::between_corners(w, pushed[..3 * n].to_vec(), laws.clone());
        // A spring of no compliance at all is refused, as a point is.
        prop_assume!(problem.is_ok());
        let problem = problem.unwrap();
        let between = BetweenPoints::new(&problem).expect("more corners than points");
        let of_points = between.of_points(&lambda[..3 * n]);
        prop_assert_eq!(of_points.len(), 3 * contacts.len());
        let all = between.with_springs(&of_points);
        prop_assert_eq!(between.of_points(&all), of_points.clone());
        let (whole, alone) = (problem.motion(&all), between.problem().motion(&of_points));
        let largest = whole.iter().chain(&all).fold(1.0, |most: f64, x| most.max(x.abs()));
        let mut alone = alone.chunks_exact(3);
        for (i, law) in laws.iter().enumerate() {
            let (force, motion) = (at(&all, i), at(&whole, i));
            let off = match law {
                PointLaw::Contact(_) => motion - Vector3::from_column_slice(alone.next().unwrap()),
                PointLaw::Spring { stiffness } => (force + stiffness * motion.x) / (1.0 + stiffness.norm()),
            };
            prop_assert!(off.norm() < 1e-11 * largest, "point {i}: {:e} of {largest:e}", off.norm());
        }
    }
}

#[test]
fn points_at_corners_that_are_not_there_are_refused() {
    let points = vec![PointPlace::corner(2)];
    let refused = Delassus::try_new(DMatrix::identity(6, 6), points).err();
    assert!(matches!(refused, Some(ProblemError::Sizes { .. })), "{refused:?}");
}
