//! Answers of Softgrasp: by its program, by its server over a socket, by its core.

use std::fmt::Write as _;
use std::path::Path;

use clap::Parser;
use fea_server::{RunningServer, ServerConfig};
use glove_client::ask::connection::ServerConnection;
use glove_client::commands::solve::SolveCommand;
use softgrasp_core::fem::{Element, Material};
use softgrasp_core::model::Model;
use softgrasp_core::solve::{Loads, Method};
use softgrasp_protocol::{
    Ask, Body, DofValue, ElementChoice, MethodName, NodeChoice, Reply, Request, Want,
};
use softgrasp_tests::questions::mesh_data;

use crate::deck::System;
use crate::object::Object;
use crate::question::Question;

/// Way to an answer, each with another method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// `glove-client solve --method auto`, with files.
    Program,
    /// Request to a server, with reactions; `condensed` for linear elements.
    Socket,
    /// `Model` and the sparse factor of the core, mid-edge nodes included.
    Core,
}

/// Answer of Softgrasp.
pub struct Found {
    /// Displacement of each node, m; of the corners, or of the whole system.
    pub displacement: Vec<[f64; 3]>,
    /// Force at every known degree of freedom, N, in the question's order; empty if the way has none.
    pub reaction: Vec<f64>,
}

/// Server that questions are sent to.
pub struct Asked {
    server: RunningServer,
}

#[derive(Parser)]
struct SolveArguments {
    #[command(flatten)]
    solve: SolveCommand,
}

impl Asked {
    /// Starts a server on a free loopback port.
    pub fn new() -> Self {
        let listen = std::net::SocketAddr::from(([127, 0, 0, 1], 0));
        let config = ServerConfig { listen, threads: 2, ..ServerConfig::default() };
        Self { server: fea_server::start(config).unwrap() }
    }

    /// Answer in the question's way.
    pub fn answer(
        &self,
        object: &Object,
        system: &System,
        question: &Question,
        folder: &Path,
    ) -> Found {
        match question.way {
            Way::Program => by_program(object, system, question, folder),
            Way::Socket => self.by_socket(object, system, question),
            Way::Core => by_core(object, system, question),
        }
    }

    /// Connection to the server.
    pub fn connection(&self) -> ServerConnection {
        ServerConnection::connect(self.server.address().to_string()).unwrap()
    }

    fn by_socket(&self, object: &Object, system: &System, question: &Question) -> Found {
        let mut connection = self.connection();
        let value = |&(dof, value): &(u32, f64)| DofValue { dof, value };
        let (element, method) = match system.element {
            Element::Tet4 => (ElementChoice::T4, "condensed"),
            _ => (ElementChoice::T10, "front"),
        };
        let (young, poisson) = (question.young, question.poisson);
        let body = Body {
            mesh: mesh_data(&object.mesh),
            materials: object.materials(young, poisson),
            element,
        };
        let asked = softgrasp_protocol::Question {
            known: question.known.iter().map(value).collect(),
            forces: question.forces.iter().map(value).collect(),
            method: MethodName::try_new(method).unwrap(),
            want: Want { nodes: NodeChoice::All, reactions: true, ..Want::default() },
            ..softgrasp_protocol::Question::default()
        };
        let reply = connection.ask(&Request::from(Ask::new(body, asked)));
        let Ok(Reply::Answer(answer)) = reply else { panic!("{}: {reply:?}", object.name) };
        assert!(answer.reactions.iter().map(|r| r.dof).eq(question.known.iter().map(|k| k.0)));
        assert_eq!(answer.report.method, method);
        Found {
            reaction: answer.reactions.iter().map(|r| r.value).collect(),
            displacement: answer.displacements.into_f64(),
        }
    }
}

fn by_core(object: &Object, system: &System, question: &Question) -> Found {
    let materials = object.materials(question.young, question.poisson);
    let materials: Vec<Material> =
        materials.iter().map(|m| Material::try_new(m.young, m.poisson).unwrap()).collect();
    let (mesh, element) = (object.mesh.clone(), system.element);
    let model = Model::try_new(mesh, element, &materials, vec![], &mut |_| {}).unwrap();
    let known = model.known(question.known.clone()).unwrap();
    let factored = model.factor(&known.dofs, Method::SparseCholesky, &mut |_| {}).unwrap();
    let mut forces = vec![0.0; 3 * model.system_node_count()];
    question.forces.iter().for_each(|&(dof, value)| forces[dof as usize] = value);
    let loads = Loads { q_known: &known.q_known, forces: &forces, residual_rel: 0.0 };
    let solution = factored.solve(model.stiffness(), loads, &mut |_| {}).unwrap();
    let (displacement, rest) = solution.displacement.as_chunks();
    assert!(rest.is_empty());
    Found { displacement: displacement.to_vec(), reaction: solution.reaction }
}

/// Answer of the program, by tables of the command contract.
fn by_program(object: &Object, system: &System, question: &Question, folder: &Path) -> Found {
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let (known, forces, out) = (path("K.csv"), path("F.csv"), path("U.csv"));
    std::fs::write(&known, rows("node,ux,uy,uz", &question.known)).unwrap();
    let (young, poisson) = (question.young.to_string(), question.poisson.to_string());
    let element = if system.element == Element::Tet4 { "t4" } else { "t10" };
    let mut arguments = vec!["solve", "--mesh", object.file.to_str().unwrap()];
    arguments.extend(["--known", &known, "--young", &young, "--poisson", &poisson]);
    arguments.extend(["--element", element, "--server", "embedded", "--out", &out]);
    let stone = object.materials(question.young, question.poisson).pop().unwrap();
    let stone = format!("stone:{}:{}", stone.young, stone.poisson);
    if object.has_stone {
        arguments.extend(["--material-region", &stone]);
    }
    if !question.forces.is_empty() {
        std::fs::write(&forces, rows("node,fx,fy,fz", &question.forces)).unwrap();
        arguments.extend(["--forces", &forces]);
    }
    let reactions = path("R.csv");
    if question.is_large {
        arguments.extend(["--deformation", "large", "--material", "neo-hookean"]);
        arguments.extend(["--reactions", &reactions]);
    }
    SolveArguments::parse_from(arguments).solve.run().unwrap();
    let displacement = read_table(&out).into_iter().map(|(_, u)| u).collect();
    let reaction = match question.is_large {
        true => reactions_at(&read_table(&reactions), &question.known),
        false => Vec::new(),
    };
    Found { displacement, reaction }
}

/// Rows of a table: node and three numbers.
fn read_table(file: &str) -> Vec<(u32, [f64; 3])> {
    let text = std::fs::read_to_string(file).unwrap();
    let row = |line: &str| {
        let mut cells = line.split(',');
        let node = cells.next().unwrap().parse().unwrap();
        let values: Vec<f64> = cells.map(|cell| cell.parse().unwrap()).collect();
        (node, <[f64; 3]>::try_from(values).unwrap())
    };
    text.lines().skip(1).map(row).collect()
}

/// Forces at the known degrees of freedom, in their order.
fn reactions_at(table: &[(u32, [f64; 3])], known: &[(u32, f64)]) -> Vec<f64> {
    let at = |dof: u32| {
        let row = table.binary_search_by_key(&(dof / 3), |row| row.0).unwrap();
        table[row].1[dof as usize % 3]
    };
    known.iter().map(|(dof, _)| at(*dof)).collect()
}

/// Table with a row for each node; directions that are not named stay empty.
fn rows(header: &str, values: &[(u32, f64)]) -> String {
    let mut text = format!("{header}\n");
    for of_node in values.chunk_by(|a, b| a.0 / 3 == b.0 / 3) {
        write!(text, "{}", of_node[0].0 / 3).unwrap();
        for axis in 0..3 {
            match of_node.iter().find(|(dof, _)| dof % 3 == axis) {
                Some((_, value)) => write!(text, ",{value:e}").unwrap(),
                None => text.push(','),
            }
        }
        text.push('\n');
    }
    text
}
