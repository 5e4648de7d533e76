//! A soft object between two rigid plates as an input of CalculiX: penalty contact, node to face.

use std::fmt::Write as _;

use softgrasp_core::mesh::{Surface, TetMesh, mirrored, mirrored_middles};

/// Press between two plates, which begin at the object's lowest and highest node.
///
/// Units: m, Pa.
pub struct Press<'a> {
    pub mesh: &'a TetMesh,
    pub young: f64,
    pub poisson: f64,
    /// Coefficient of friction of both plates. With 0 the object is free to slide, and three degrees of
    /// freedom without forces are held.
    pub friction: f64,
    /// Positions of the upper plate, one after the other, m: along x, and down.
    pub way: &'a [[f64; 2]],
    /// Stiffness of the penalty, Pa/m.
    pub penalty: f64,
}

/// Number of increments for each piece of the motion.
pub const INCREMENTS: usize = 10;

/// Ratio of the stiffness against sliding of a sticking point to that of the penalty.
pub const STICK_OF_PENALTY: f64 = 0.1;

impl Press<'_> {
    /// Heights of the plates at first, m: that of the lowest node and that of the highest.
    pub fn heights(&self) -> [f64; 2] {
        let (low, high) = self.mesh.bounds();
        [low.z, high.z]
    }

    /// Input deck. Nodes count from 1; behind the object's are those of the lower plate, then those of
    /// the upper one.
    pub fn deck(&self) -> String {
        let mut text = self.cells();
        text.push_str(&self.contact_cards());
        for [along, down] in self.way {
            write!(
                text,
                "*STEP, INC=10000\n*STATIC\n{first},1.,1e-8,{first}\n\
                 *CONTROLS, PARAMETERS=FIELD\n1e-7,1e-7\n*BOUNDARY\nFLOOR,1,3,0.\n\
                 LID,1,1,{along}\nLID,2,2,0.\nLID,3,3,{}\n",
                -down,
                first = 1.0 / INCREMENTS as f64,
            )
            .unwrap();
            if self.friction == 0.0 {
                text.push_str(&self.guides());
            }
            text.push_str(
                "*NODE PRINT, NSET=BODY, FREQUENCY=100000\nU\n\
                 *NODE PRINT, NSET=LID, TOTALS=ONLY, FREQUENCY=100000\nRF\n\
                 *NODE PRINT, NSET=FLOOR, TOTALS=ONLY, FREQUENCY=100000\nRF\n*END STEP\n",
            );
        }
        text
    }

    /// Nodes and elements of the object, and of two blocks as plates.
    fn cells(&self) -> String {
        let mut text = String::from("*NODE, NSET=BODY\n");
        let mut node = 0;
        let mut add = |text: &mut String, p: [f64; 3]| {
            node += 1;
            writeln!(text, "{node},{:.12e},{:.12e},{:.12e}", p[0], p[1], p[2]).unwrap();
        };
        self.mesh.vertices().iter().for_each(|p| add(&mut text, [p.x, p.y, p.z]));
        let [low, high] = self.heights();
        let size = self.mesh.size();
        let (begin, _) = self.mesh.bounds();
        for (name, bottom) in [("FLOOR", low - size), ("LID", high)] {
            writeln!(text, "*NODE, NSET={name}").unwrap();
            for corner in 0..8 {
                let far = |is_far: bool| if is_far { 2.0 * size } else { -size };
                let place = [
                    begin.x + far([1, 2].contains(&(corner % 4))),
                    begin.y + far([2, 3].contains(&(corner % 4))),
                    bottom + if corner < 4 { 0.0 } else { size },
                ];
                add(&mut text, place);
            }
        }
        let kind = if self.mesh.mid_edge_nodes().is_empty() { "C3D4" } else { "C3D10" };
        writeln!(text, "*ELEMENT, TYPE={kind}, ELSET=SOFT").unwrap();
        for (at, corners) in self.mesh.tets().iter().enumerate() {
            // CalculiX counts the volume with the other sign.
            let middles = self.mesh.mid_edge_nodes().get(at).copied().map(mirrored_middles);
            let nodes = mirrored(*corners).into_iter().chain(middles.into_iter().flatten());
            let nodes: Vec<String> = nodes.map(|node| (node + 1).to_string()).collect();
            writeln!(text, "{},{}", at + 1, nodes.join(",")).unwrap();
        }
        text.push_str("*ELEMENT, TYPE=C3D8, ELSET=HARD\n");
        let (nodes, tets) = (self.mesh.node_count(), self.mesh.tets().len());
        for plate in 0..2 {
            let corners: Vec<String> =
                (1..=8).map(|corner| (nodes + 8 * plate + corner).to_string()).collect();
            writeln!(text, "{},{}", tets + plate + 1, corners.join(",")).unwrap();
        }
        text
    }

    fn contact_cards(&self) -> String {
        let Self { young, poisson, friction, penalty, .. } = self;
        let mut text = format!(
            "*MATERIAL, NAME=SOFT\n*ELASTIC\n{young},{poisson}\n\
             *SOLID SECTION, ELSET=SOFT, MATERIAL=SOFT\n\
             *MATERIAL, NAME=HARD\n*ELASTIC\n{},0.3\n\
             *SOLID SECTION, ELSET=HARD, MATERIAL=HARD\n",
            1e5 * young
        );
        let (low, high) = self.mesh.bounds();
        let middle = 0.5 * (low.z + high.z);
        let surface = Surface::with_mid_edge_nodes(self.mesh).nodes;
        for (name, is_upper) in [("LOWER", false), ("UPPER", true)] {
            writeln!(text, "*SURFACE, NAME={name}, TYPE=NODE").unwrap();
            let vertices = self.mesh.vertices();
            let of_side =
                surface.iter().filter(|n| (vertices[**n as usize].z > middle) == is_upper);
            of_side.for_each(|node| writeln!(text, "{}", node + 1).unwrap());
        }
        let tets = self.mesh.tets().len();
        // A spring that pulls hardly at all where the gap is open.
        let pull = 1e-9 * young;
        write!(
            text,
            "*SURFACE, NAME=FLOORTOP\n{},S2\n*SURFACE, NAME=LIDBOTTOM\n{},S1\n\
             *SURFACE INTERACTION, NAME=TOUCH\n\
             *SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{penalty:e},{pull:e}\n",
            tets + 1,
            tets + 2
        )
        .unwrap();
        if *friction > 0.0 {
            writeln!(text, "*FRICTION\n{friction},{:e}", STICK_OF_PENALTY * penalty).unwrap();
        }
        for pair in ["LOWER,FLOORTOP", "UPPER,LIDBOTTOM"] {
            writeln!(text, "*CONTACT PAIR, INTERACTION=TOUCH, TYPE=NODE TO SURFACE\n{pair}")
                .unwrap();
        }
        text
    }

    /// Cards that keep the object from sliding, and from rotating about the vertical.
    fn guides(&self) -> String {
        let (low, high) = self.mesh.bounds();
        let middle = nalgebra::center(&low, &high);
        let nodes = || (1..).zip(self.mesh.vertices());
        let least = |of: &dyn Fn(&nalgebra::Point3<f64>) -> f64| -> usize {
            nodes().min_by(|a, b| of(a.1).total_cmp(&of(b.1))).map_or(1, |(node, _)| node)
        };
        let inside = least(&|p| (p - middle).norm());
        let outside = least(&|p| -p.x);
        format!("{inside},1,2,0.\n{outside},2,2,0.\n")
    }
}
