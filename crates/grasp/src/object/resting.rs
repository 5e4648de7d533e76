//! How an object comes to lie on a table: it topples over its lowest points until its centre of mass is
//! above them.

use nalgebra::{Point3, UnitQuaternion, Vector2, Vector3};
use softgrasp_core::mesh::{MeshError, TetMesh};

/// Points that are no higher than this above the lowest one, over the object's size, touch the table.
const TOUCHES_OF_SIZE: f64 = 1e-7;
/// A centre of mass that is so little outside of what supports it, over the object's size, is above it.
const ABOVE_OF_SIZE: f64 = 1e-9;
/// Most turns over one edge or point. A ball of ten thousand facets rolls over some hundreds.
const TURNS_MAX: usize = 20_000;
/// A body that a tilt by this angle topples does not stand, rad: what is soft yields by as much under its own
/// weight.
const UNSTEADY: f64 = 0.2;
/// It lies better only where its centre of mass comes down by this much, over the object's size: a ball of
/// facets rolls from one to the next and gains nothing.
const LOWER_OF_SIZE: f64 = 0.02;
/// Least part of this that is worth a turn.
const LOWER_LEAST: f64 = 1e-3;

/// A mesh turned so that it lies on a table, with the middle of its box where it was, and that rotation.
///
/// A mesh that lies already is not turned.
///
/// Units: m. Frame: the table's normal is +y.
///
/// # Errors
/// [`MeshError`], not seen for a turned mesh.
pub fn lying(mesh: &TetMesh) -> Result<(TetMesh, UnitQuaternion<f64>), MeshError> {
    let points = mesh.vertices();
    let turn = resting_turn(points, &centre_of_mass(mesh));
    if turn == UnitQuaternion::identity() {
        return mesh.with_vertices(points.to_vec()).map(|mesh| (mesh, turn));
    }
    let turned: Vec<Point3<f64>> = points.iter().map(|point| turn * point).collect();
    let shift = middle(points) - middle(&turned);
    Ok((mesh.with_vertices(turned.iter().map(|point| point + shift).collect())?, turn))
}

/// Rotation that a rigid body of these points makes when it is put on a table as it is and let go, slowly:
/// about the nearest edge or corner of what it stands on, until the next point touches, and so on; and
/// further where a small tilt topples it to where its centre of mass is lower.
///
/// Units: m. Frame: the table's normal is +y. `centre` is the centre of mass.
pub fn resting_turn(points: &[Point3<f64>], centre: &Point3<f64>) -> UnitQuaternion<f64> {
    let mut around: Vec<Vector3<f64>> = points.iter().map(|point| point - centre).collect();
    let size = around.iter().map(Vector3::norm).fold(0.0, f64::max);
    let rests = settle(&mut around, size);
    match toppled(&around, size) {
        Some(topples) => topples * rests,
        None => rests,
    }
}

/// Lets points fall until their centre of mass, the origin, is above what they stand on.
fn settle(around: &mut [Vector3<f64>], size: f64) -> UnitQuaternion<f64> {
    let mut turn = UnitQuaternion::identity();
    for _ in 0..TURNS_MAX {
        let Some(fall) = Fall::of(around, size) else { break };
        turn = fall.play(around, size) * turn;
        turn.renormalize();
    }
    turn
}

/// The turn by which a body that stands unsteadily comes to lie lower, over one edge after the other, each
/// time over the one that leads lowest; `None` where it gains little.
fn toppled(around: &[Vector3<f64>], size: f64) -> Option<UnitQuaternion<f64>> {
    let height = |around: &[Vector3<f64>]| -lowest(around);
    let begun = height(around);
    let (mut now, mut turn) = (around.to_vec(), UnitQuaternion::identity());
    loop {
        let tries = Fall::of_unsteady(&now, size).into_iter().map(|fall| {
            let mut next = now.clone();
            let over = fall.play(&mut next, size);
            let further = settle(&mut next, size);
            (next, further * over)
        });
        let best = tries.min_by(|a, b| height(&a.0).total_cmp(&height(&b.0)));
        let Some((next, step)) =
            best.filter(|best| height(&best.0) < height(&now) - LOWER_LEAST * LOWER_OF_SIZE * size)
        else {
            break;
        };
        (now, turn) = (next, step * turn);
        turn.renormalize();
    }
    (begun - height(&now) > LOWER_OF_SIZE * size).then_some(turn)
}

/// Height of the lowest point.
fn lowest(around: &[Vector3<f64>]) -> f64 {
    around.iter().map(|point| point.y).fold(f64::INFINITY, f64::min)
}

/// A body that is not above its support: it falls about a pivot.
struct Fall {
    pivot: Vector3<f64>,
    /// Horizontal direction from the pivot to below the centre of mass.
    direction: Vector3<f64>,
}

impl Fall {
    /// `None` for a body that rests. `around` are its points, seen from the centre of mass.
    fn of(around: &[Vector3<f64>], size: f64) -> Option<Self> {
        let (hull, lowest) = (support(around, size), lowest(around));
        let nearest = nearest_of_hull(&hull)?;
        let distance = nearest.norm();
        let pivot = Vector3::new(nearest.x, lowest, nearest.y);
        if distance > ABOVE_OF_SIZE * size {
            let direction = Vector3::new(-nearest.x, 0.0, -nearest.y) / distance;
            return Some(Self { pivot, direction });
        }
        // It stands on a tip or on an edge, in balance: a breath of air tips it over.
        match hull.as_slice() {
            [_] => Some(Self { pivot, direction: Vector3::x() }),
            [a, b] => {
                let along = (b - a).normalize();
                Some(Self { pivot, direction: Vector3::new(along.y, 0.0, -along.x) })
            }
            _ => None,
        }
    }

    /// Falls of a body at rest over the edges of its support that a small tilt takes it over.
    fn of_unsteady(around: &[Vector3<f64>], size: f64) -> Vec<Self> {
        let (hull, lowest) = (support(around, size), lowest(around));
        let fall = |edge: [Vector2<f64>; 2]| {
            let nearest = nearest_of_edge(edge);
            let along = (edge[1] - edge[0]).try_normalize(0.0)?;
            // The hull runs around its inside on the left.
            let direction = Vector3::new(along.y, 0.0, -along.x);
            let pivot = Vector3::new(nearest.x, lowest, nearest.y);
            (nearest.norm() < UNSTEADY.tan() * -lowest).then_some(Self { pivot, direction })
        };
        edges(&hull).filter_map(fall).collect()
    }

    /// Turns the body until the next point touches the table.
    fn play(&self, around: &mut [Vector3<f64>], size: f64) -> UnitQuaternion<f64> {
        let turn = self.turn(around, size);
        around.iter_mut().for_each(|point| *point = turn * *point);
        turn
    }

    /// The turn about the pivot until the next point touches the table.
    fn turn(&self, around: &[Vector3<f64>], size: f64) -> UnitQuaternion<f64> {
        let angle = around.iter().filter_map(|point| {
            let from_pivot = point - self.pivot;
            let (along, height) = (from_pivot.dot(&self.direction), from_pivot.y);
            // What touches already and lies behind the pivot rises.
            let counts = height > TOUCHES_OF_SIZE * size;
            counts.then(|| height.atan2(along))
        });
        let angle = angle.fold(std::f64::consts::PI, f64::min);
        let axis = nalgebra::Unit::new_normalize(Vector3::y().cross(&self.direction));
        UnitQuaternion::from_axis_angle(&axis, angle)
    }
}

/// Corners of what points stand on, around it.
fn support(around: &[Vector3<f64>], size: f64) -> Vec<Vector2<f64>> {
    let lowest = lowest(around);
    let touching = around.iter().filter(|point| point.y - lowest <= TOUCHES_OF_SIZE * size);
    convex_hull(touching.map(|point| Vector2::new(point.x, point.z)).collect())
}

/// The corners of the convex hull, around it; one or two for points that are one point or on a line.
fn convex_hull(mut points: Vec<Vector2<f64>>) -> Vec<Vector2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let chain = |points: &mut dyn Iterator<Item = Vector2<f64>>| {
        let mut chain: Vec<Vector2<f64>> = Vec::new();
        for point in points {
            while let [.., a, b] = chain.as_slice()
                && (b - a).perp(&(point - b)) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull
}

/// The point of a convex hull that is nearest to the origin; `None` where the origin is inside.
fn nearest_of_hull(hull: &[Vector2<f64>]) -> Option<Vector2<f64>> {
    if hull.len() > 2 && edges(hull).all(|[a, b]| (b - a).perp(&-a) > 0.0) {
        return None;
    }
    let nearest = edges(hull).map(nearest_of_edge);
    nearest.min_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))
}

/// Edges of a convex hull, around it.
fn edges(hull: &[Vector2<f64>]) -> impl Iterator<Item = [Vector2<f64>; 2]> {
    (0..hull.len()).map(|i| [hull[i], hull[(i + 1) % hull.len()]])
}

/// The point of an edge that is nearest to the origin.
fn nearest_of_edge([a, b]: [Vector2<f64>; 2]) -> Vector2<f64> {
    let along = b - a;
    let share = (-a.dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    a + share * along
}

/// Centre of mass of a body of one density.
///
/// Units: m. Frame: that of the mesh.
pub fn centre_of_mass(mesh: &TetMesh) -> Point3<f64> {
    let (mut sum, mut volume) = (Vector3::zeros(), 0.0);
    for (tet, nodes) in mesh.tets().iter().enumerate() {
        let part = mesh.signed_volume(tet);
        let corners: Vector3<f64> = nodes.iter().map(|&n| mesh.vertices()[n as usize].coords).sum();
        sum += part * 0.25 * corners;
        volume += part;
    }
    Point3::from(sum / volume)
}

fn middle(points: &[Point3<f64>]) -> Point3<f64> {
    let (mut low, mut high) = (points[0], points[0]);
    for point in points {
        (low, high) = (low.inf(point), high.sup(point));
    }
    nalgebra::center(&low, &high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, generate};

    fn is_at_rest(points: &[Point3<f64>], centre: &Point3<f64>) -> bool {
        let around: Vec<Vector3<f64>> = points.iter().map(|point| point - centre).collect();
        let size = around.iter().map(Vector3::norm).fold(0.0, f64::max);
        // What a turn leaves of the plane is larger than what counts as touching while it turns.
        let lowest = around.iter().map(|point| point.y).fold(f64::INFINITY, f64::min);
        let support: Vec<Vector2<f64>> = around
            .iter()
            .filter(|point| point.y - lowest < 1e-6 * size)
            .map(|point| Vector2::new(point.x, point.z))
            .collect();
        nearest_of_hull(&convex_hull(support)).is_none_or(|nearest| nearest.norm() < 1e-6 * size)
    }

    #[test]
    fn box_that_lies_stays_and_one_that_stands_on_a_corner_falls_on_a_face() {
        let edges = Vector3::new(0.03, 0.01, 0.02);
        let corners = (0..8).map(|i| {
            let sign = |bit: i32| f64::from(2 * (i >> bit & 1) - 1);
            Point3::new(sign(0) * edges.x, sign(1) * edges.y, sign(2) * edges.z)
        });
        let corners: Vec<Point3<f64>> = corners.collect();
        assert_eq!(resting_turn(&corners, &Point3::origin()), UnitQuaternion::identity());
        for seed in 0..40 {
            let t = f64::from(seed);
            let turn = UnitQuaternion::from_euler_angles(0.7 * t, 1.3 * t, 0.4 * t);
            let turned: Vec<_> = corners.iter().map(|corner| turn * corner).collect();
            let rest = resting_turn(&turned, &Point3::origin());
            let lowest = turned.iter().map(|point| (rest * point).y).fold(f64::INFINITY, f64::min);
            let on_a_face = [edges.x, edges.y, edges.z].iter().any(|e| (e + lowest).abs() < 1e-9);
            assert!(on_a_face, "turn {seed}: lowest point at {lowest}");
        }
    }

    /// A body that stood on three points of its back fell over as soon as it was soft, and the hand found it
    /// elsewhere than where it had been planned for.
    #[test]
    fn bent_rod_that_stands_on_a_facet_of_its_back_lies_on_its_side() {
        // A bow in the plane of x and y, open upwards, with a small flat at its lowest place.
        let ring = |along: f64| {
            let middle = Vector3::new(0.1 * along.sin(), -0.1 * along.cos(), 0.0);
            let out = Vector3::new(along.sin(), -along.cos(), 0.0);
            (0..24).map(move |k| {
                let around = std::f64::consts::TAU * (f64::from(k) + 0.5) / 24.0;
                Point3::from(middle + 0.015 * (around.cos() * out + around.sin() * Vector3::z()))
            })
        };
        let rings = (-12..=12).map(|k| 1.1 * (f64::from(k) + 0.5) / 12.5);
        let points: Vec<Point3<f64>> = rings.flat_map(ring).collect();
        let sum: Vector3<f64> = points.iter().map(|point| point.coords).sum();
        let centre = Point3::from(sum / points.len() as f64);
        let turn = resting_turn(&points, &centre);
        let turned: Vec<_> = points.iter().map(|point| turn * (point - centre)).collect();
        let high = turned.iter().map(|point| point.y).fold(f64::NEG_INFINITY, f64::max);
        let height = high - lowest(&turned);
        assert!(height < 0.032, "it rises {height} m above the table, a rod of 0.03 m");
        let mut again = turned.clone();
        assert!(settle(&mut again, 0.1).angle() < 1e-6, "it lies");
    }

    #[test]
    fn every_built_in_object_lies_and_its_box_keeps_its_place() {
        for shape in [BuiltIn::Cube, BuiltIn::Sphere, BuiltIn::Strawberry, BuiltIn::Toothpaste] {
            let mesh = generate(shape, 400).unwrap();
            let (lies, _) = lying(&mesh).unwrap();
            assert!(is_at_rest(lies.vertices(), &centre_of_mass(&lies)), "{shape}");
            assert!((middle(lies.vertices()) - middle(mesh.vertices())).norm() < 1e-12, "{shape}");
            let (again, turn) = lying(&lies).unwrap();
            assert!(turn.angle() < 1e-6, "{shape} turns again by {}", turn.angle());
            assert_eq!(again.tets(), mesh.tets());
        }
    }
}
