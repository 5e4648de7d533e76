//! The arguments that let weight and pressure act on an object.

use std::path::PathBuf;
use std::str::FromStr;

use anyhow::{Context, bail};
use clap::Args;
use nalgebra::Vector3;
use softgrasp_core::fem::{Element, QuadraticMesh, SpreadLoads as SpreadOver};
use softgrasp_core::mesh::{Surface, TetMesh};
use softgrasp_protocol::{DofValue, SpreadLoads, SurfacePressure, Welcome};

use super::numbers::{positive, vector};

/// Weight and pressure.
#[derive(Args, Clone, Default)]
pub(super) struct LoadArguments {
    /// Acceleration that draws the object, m/s²: 0,0,-9.81. Its weight needs --density.
    #[arg(
        long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true,
        requires = "density"
    )]
    gravity: Option<Vector3<f64>>,
    /// Density, kg/m³ (in the mesh's unit of length).
    #[arg(
        long, value_name = "KG/M3", value_parser = positive, allow_hyphen_values = true,
        requires = "gravity"
    )]
    density: Option<f64>,
    /// Even pressure on a part of the boundary, Pa, inwards at rest. The part: all; AXIS=PLACE, AXIS<PLACE
    /// or AXIS>PLACE (z=max, x<0.01) for the triangles whose corners all lie there; or a table of
    /// triangles, F.csv with the columns a,b,c (nodes from 0). Several add up.
    #[arg(long = "pressure", value_name = "PA:PART", allow_hyphen_values = true)]
    pressures: Vec<Pressure>,
}

/// A pressure and where it acts.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pressure {
    pressure: f64,
    part: Part,
}

/// A part of the boundary.
#[derive(Clone, Debug, PartialEq)]
enum Part {
    All,
    /// Triangles whose corners all lie at, below or above a place on an axis.
    Along {
        axis: usize,
        side: Side,
        place: Place,
    },
    /// Triangles of a table.
    Table(PathBuf),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    At,
    Below,
    Above,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    Lowest,
    Highest,
    At(f64),
}

/// A node lies at a place if it is so near, relative to the mesh's size.
const NEAR_REL: f64 = 1e-6;

impl FromStr for Pressure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (pressure, part) = text.split_once(':').ok_or("it must be PA:PART, as 250:z=max")?;
        let number = pressure.trim().parse::<f64>().ok().filter(|pressure| pressure.is_finite());
        let pressure = number.ok_or_else(|| format!("'{pressure}' is not a pressure in Pa"))?;
        Ok(Self { pressure, part: part.trim().parse()? })
    }
}

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "all" {
            return Ok(Self::All);
        }
        if text.ends_with(".csv") {
            return Ok(Self::Table(PathBuf::from(text)));
        }
        let expected =
            || format!("'{text}' is no part; expected all, z=max, x<0.01 or a table F.csv");
        let at = text.find(['=', '<', '>']).ok_or_else(expected)?;
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == text[..at].trim());
        let side = match text.as_bytes()[at] {
            b'=' => Side::At,
            b'<' => Side::Below,
            _ => Side::Above,
        };
        let place = match text[at + 1..].trim() {
            "min" => Place::Lowest,
            "max" => Place::Highest,
            number => Place::At(number.parse().map_err(|_| expected())?),
        };
        Ok(Self::Along { axis: axis.ok_or_else(expected)?, side, place })
    }
}

impl LoadArguments {
    /// The loads on a mesh.
    ///
    /// # Errors
    /// One line for a part without a triangle, and for a table that cannot be read.
    pub(super) fn of_mesh(&self, mesh: &TetMesh) -> anyhow::Result<SpreadLoads> {
        let gravity = self.gravity.unwrap_or_default().into();
        let densities = self.density.into_iter().collect();
        let surface = match self.pressures.is_empty() {
            true => Vec::new(),
            false => Surface::from_mesh(mesh).triangles,
        };
        let on_part = |on: &Pressure| {
            let triangles = on.part.triangles(mesh, &surface)?;
            if triangles.is_empty() {
                bail!("--pressure: no triangle of the boundary lies there ({:?})", on.part);
            }
            Ok(SurfacePressure { pressure: on.pressure, triangles })
        };
        let pressures = self.pressures.iter().map(on_part).collect::<anyhow::Result<_>>()?;
        Ok(SpreadLoads { gravity, densities, pressures })
    }
}

impl Part {
    fn triangles(&self, mesh: &TetMesh, surface: &[[u32; 3]]) -> anyhow::Result<Vec<[u32; 3]>> {
        match self {
            Self::All => Ok(surface.to_vec()),
            Self::Table(path) => {
                let name = path.display().to_string();
                let bytes = std::fs::read(path).with_context(|| format!("cannot read {name}"))?;
                triangles_of(&bytes).with_context(|| name)
            }
            Self::Along { axis, side, place } => {
                let (low, high) = mesh.bounds();
                let place = match place {
                    Place::Lowest => low[*axis],
                    Place::Highest => high[*axis],
                    Place::At(place) => *place,
                };
                let near = NEAR_REL * mesh.size();
                let is_there = |node: &u32| {
                    let off = mesh.vertices()[*node as usize][*axis] - place;
                    match side {
                        Side::At => off.abs() <= near,
                        Side::Below => off < near,
                        Side::Above => off > -near,
                    }
                };
                let there = surface.iter().filter(|corners| corners.iter().all(is_there));
                Ok(there.copied().collect())
            }
        }
    }
}

/// Triangles of a table with the columns `a,b,c`.
fn triangles_of(bytes: &[u8]) -> anyhow::Result<Vec<[u32; 3]>> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
    let header = reader.headers()?.iter().collect::<Vec<_>>().join(",");
    if header != "a,b,c" {
        bail!("line 1: the header is '{header}'; expected 'a,b,c'");
    }
    let mut triangles = Vec::new();
    for record in reader.into_records() {
        let record = record?;
        let mut triangle = [0; 3];
        for (node, cell) in triangle.iter_mut().zip(record.iter()) {
            let line = record.position().map_or(0, csv::Position::line);
            *node = cell
                .parse()
                .with_context(|| format!("line {line}: '{cell}' is not a node, 0 or above"))?;
        }
        triangles.push(triangle);
    }
    Ok(triangles)
}

/// Refuses loads and mid-edge nodes that a server does not know, before it is asked.
///
/// # Errors
/// One line that names the server.
pub(super) fn check_server(
    (mesh, spread): (&TetMesh, &SpreadLoads),
    server: &Welcome,
) -> anyhow::Result<()> {
    let older = format!("{} is an older server", server.program());
    if !spread.is_empty() && !server.knows("loads") {
        bail!(
            "{older} and takes no weight and no pressure; leave out --gravity, --density and \
             --pressure, or give them as --forces"
        );
    }
    if !mesh.mid_edge_nodes().is_empty() && !server.knows("mid-edge") {
        bail!(
            "{older} and takes no mid-edge nodes; take --element t4, or a file of four-node \
             tetrahedra, to which it adds straight edges for t10"
        );
    }
    Ok(())
}

/// Forces with those of weight and pressure among them, of mid-edge nodes too, for a deck that has forces on
/// nodes only.
///
/// # Errors
/// One line for loads that do not fit the mesh.
pub(super) fn on_nodes(
    mesh: &TetMesh,
    element: Element,
    (forces, spread): (&[DofValue], &SpreadLoads),
) -> anyhow::Result<Vec<DofValue>> {
    let quadratic = match element {
        Element::Tet10 => Some(QuadraticMesh::try_new(mesh)?),
        _ => None,
    };
    let body = SpreadOver::new(mesh, quadratic.as_ref());
    let mut all = forces.to_vec();
    let mut add = |of_load: Vec<f64>| {
        let acting = (0u32..).zip(of_load).filter(|(_, value)| *value != 0.0);
        all.extend(acting.map(|(dof, value)| DofValue { dof, value }));
    };
    if !spread.densities.is_empty() {
        add(body.weight(&spread.densities, Vector3::from(spread.gravity))?);
    }
    for on in &spread.pressures {
        add(body.pressure(&on.triangles, on.pressure)?);
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use softgrasp_core::mesh::{BuiltIn, generate};

    use super::*;

    fn area(mesh: &TetMesh, triangles: &[[u32; 3]]) -> f64 {
        let of = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|node| mesh.vertices()[node as usize]);
            0.5 * (b - a).cross(&(c - a)).norm()
        };
        triangles.iter().map(of).sum()
    }

    #[test]
    fn parts_of_a_cube_have_their_area() {
        let mesh = generate(BuiltIn::Cube, 125).unwrap();
        let (low, high) = mesh.bounds();
        let edge = high.x - low.x;
        let middle = 0.5 * (low.x + high.x);
        for (text, faces) in [
            ("all", 6.0),
            ("z=max", 1.0),
            ("y = min", 1.0),
            (&format!("x<{middle}"), 3.0),
            (&format!("x>{middle}"), 3.0),
        ] {
            let pressure: Pressure = format!("-250: {text}").parse().unwrap();
            let arguments = LoadArguments { pressures: vec![pressure], ..LoadArguments::default() };
            let [on] = &arguments.of_mesh(&mesh).unwrap().pressures[..] else { panic!("{text}") };
            let found = area(&mesh, &on.triangles) / edge.powi(2);
            assert!((found - faces).abs() < 1e-9, "{text}: {found} faces");
            assert_eq!(on.pressure, -250.0);
        }
        let nowhere =
            LoadArguments { pressures: vec!["1:z=7".parse().unwrap()], ..LoadArguments::default() };
        assert!(nowhere.of_mesh(&mesh).unwrap_err().to_string().contains("no triangle"));
    }

    #[test]
    fn what_is_no_pressure_is_said() {
        for (text, said) in [
            ("250", "PA:PART"),
            ("soft:all", "'soft'"),
            ("nan:all", "'nan'"),
            ("1:w=3", "'w=3'"),
            ("1:z~3", "'z~3'"),
            ("1:z=top", "'z=top'"),
        ] {
            let error = text.parse::<Pressure>().unwrap_err();
            assert!(error.contains(said), "{text}: {error}");
        }
        assert_eq!(triangles_of(b"a,b,c\n0,1,2\n 4, 5,6\n").unwrap(), [[0, 1, 2], [4, 5, 6]]);
        for bad in ["a,b\n0,1\n", "a,b,c\n0,1\n", "a,b,c\n0,1,-2\n", "a,b,c\n0,1,x\n"] {
            assert!(triangles_of(bad.as_bytes()).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_deck_gets_the_weight_on_its_nodes() {
        let mesh = generate(BuiltIn::Cube, 27).unwrap();
        let spread = SpreadLoads {
            gravity: [0.0, 0.0, -10.0],
            densities: vec![1000.0],
            pressures: Vec::new(),
        };
        let own = [DofValue { dof: 8, value: -0.5 }];
        let volume: f64 = (0..mesh.tets().len()).map(|tet| mesh.signed_volume(tet).abs()).sum();
        for element in [Element::Tet4, Element::Tet10] {
            let forces = on_nodes(&mesh, element, (&own, &spread)).unwrap();
            let sum: f64 = forces.iter().map(|force| force.value).sum();
            assert!((sum + 0.5 + 1e4 * volume).abs() < 1e-9 * 1e4 * volume, "{sum}");
            assert!(forces.iter().all(|force| force.dof % 3 == 2));
        }
    }
}
