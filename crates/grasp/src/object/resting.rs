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
/// about the nearest edge or corner of what it stands on, until the next point touches, and so on.
///
/// Units: m. Frame: the table's normal is +y. `centre` is the centre of mass.
pub fn resting_turn(points: &[Point3<f64>], centre: &Point3<f64>) -> UnitQuaternion<f64> {
    let mut around: Vec<Vector3<f64>> = points.iter().map(|point| point - centre).collect();
    let size = around.iter().map(Vector3::norm).fold(0.0, f64::max);
    let mut turn = UnitQuaternion::identity();
    for _ in 0..TURNS_MAX {
        let Some(fall) = Fall::of(&around, size) else { break };
        let step = fall.turn(&around, size);
        around.iter_mut().for_each(|point| *point = step * *point);
        turn = step * turn;
        turn.renormalize();
    }
    turn
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
        let lowest = around.iter().map(|point| point.y).fold(f64::INFINITY, f64::min);
        let touches = |point: &&Vector3<f64>| point.y - lowest <= TOUCHES_OF_SIZE * size;
        let support: Vec<Vector2<f64>> =
            around.iter().filter(touches).map(|point| Vector2::new(point.x, point.z)).collect();
        let hull = convex_hull(support);
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
    let edges = || (0..hull.len()).map(|i| (hull[i], hull[(i + 1) % hull.len()]));
    if hull.len() > 2 && edges().all(|(a, b)| (b - a).perp(&-a) > 0.0) {
        return None;
    }
    let on_edge = |(a, b): (Vector2<f64>, Vector2<f64>)| {
        let along = b - a;
        let share = (-a.dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        a + share * along
    };
    edges().map(on_edge).min_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))
}

fn centre_of_mass(mesh: &TetMesh) -> Point3<f64> {
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
