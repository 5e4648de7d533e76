//! A client of forty lines: keeps a block of rubber at a server and pulls one of its faces, frame by
//! frame, with what the wire says of every answer.
//!
//!     fea-server --listen 127.0.0.1:7878
//!     cargo run --release -p softgrasp-protocol --example talk_to_a_server 127.0.0.1:7878

#![allow(clippy::print_stdout, reason = "it shows what it heard")]

use std::error::Error;
use std::net::TcpStream;

use softgrasp_protocol::blocking::Connection;
use softgrasp_protocol::{
    Ask, DofValue, ElementName, Hello, Limits, Material, MeshData, Question, Reply, Request,
    UploadModel,
};

/// A connection on which one request at a time is asked.
struct Session {
    connection: Connection<TcpStream>,
    request_id: u64,
}

impl Session {
    fn ask(&mut self, request: &Request) -> Result<Reply, Box<dyn Error>> {
        self.request_id += 1;
        let mut bytes = Vec::new();
        request.encode_into(self.request_id, &Limits::default(), &mut bytes)?;
        self.connection.write_bytes(&bytes)?;
        let frame = self.connection.read_frame()?.ok_or("the server has closed the connection")?;
        match Reply::decode(&frame, &Limits::default())? {
            Reply::Rejected(rejected) => {
                Err(format!("refused ({}): {}", rejected.code, rejected.text).into())
            }
            reply => Ok(reply),
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let address = std::env::args().nth(1).ok_or("say where the server is: HOST:PORT")?;
    let stream = TcpStream::connect(&address)?;
    stream.set_nodelay(true)?;
    let mut session =
        Session { connection: Connection::new(stream, Limits::default()), request_id: 0 };
    if let Reply::Welcome(welcome) = session.ask(&Request::Hello(Hello::new("an example", None)))? {
        println!("{} {}, wire {}", welcome.server, welcome.version, welcome.wire);
    }

    let (mesh, left, right) = block();
    let model = UploadModel {
        mesh,
        materials: vec![Material { young: 1.0e5, poisson: 0.3 }],
        element: ElementName::T4,
        fixed: left.iter().flat_map(|node| (0..3).map(move |axis| 3 * node + axis)).collect(),
    };
    let Reply::ModelReady(ready) = session.ask(&Request::UploadModel(model))? else {
        return Err("no answer to an upload".into());
    };
    println!("{} unknown degrees of freedom as {}", ready.unknown_dofs, ready.model);

    for step in 1..=5 {
        let pull = 1e-3 * f64::from(step);
        let known = right.iter().map(|node| DofValue { dof: 3 * node, value: pull }).collect();
        let mut question = Question { known, ..Question::default() };
        question.want.reactions = true;
        let Reply::Answer(answer) = session.ask(&Ask::new(ready.model, question).into())? else {
            return Err("no answer to a frame".into());
        };
        let pulled = |dof: u32| dof.is_multiple_of(3) && right.contains(&(dof / 3));
        let force: f64 = answer.reactions.iter().filter(|r| pulled(r.dof)).map(|r| r.value).sum();
        let report = &answer.report;
        println!(
            "{:.0} mm take {force:.3} N; by {}, residual {:.0e}, proven error {}",
            1e3 * pull,
            report.method,
            report.residual_rel,
            report.error_bound_rel.map_or("none yet".to_owned(), |bound| format!("{bound:.0e}")),
        );
    }
    Ok(())
}

/// A block of 4 × 2 × 2 cm in cubes of 1 cm with six tetrahedra each; nodes of its left and right face.
fn block() -> (MeshData, Vec<u32>, Vec<u32>) {
    let (nx, ny, nz) = (4, 2, 2);
    let node = |[i, j, k]: [u32; 3]| i + (nx + 1) * (j + (ny + 1) * k);
    let (mut mesh, mut left, mut right) = (MeshData::default(), Vec::new(), Vec::new());
    for k in 0..=nz {
        for j in 0..=ny {
            for i in 0..=nx {
                mesh.vertices.push([i, j, k].map(|index| 0.01 * f64::from(index)));
                if i == 0 {
                    left.push(node([i, j, k]));
                } else if i == nx {
                    right.push(node([i, j, k]));
                }
            }
        }
    }
    for cell in (0..nx * ny * nz).map(|c| [c % nx, c / nx % ny, c / (nx * ny)]) {
        // From corner to opposite corner along the three axes in every order.
        for axes in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let mut place = cell;
            let mut tet = [node(cell); 4];
            for (corner, axis) in (1..).zip(axes) {
                place[axis] += 1;
                tet[corner] = node(place);
            }
            mesh.tets.push(tet);
        }
    }
    (mesh, left, right)
}
