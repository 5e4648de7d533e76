//! Questions that are too large for a server go to its cluster, and what happens when that is lost. The
//! cluster here is a server of this process with an engine that answers by a factor.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail like tests")]

use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use fea_server::cluster::{Cluster, ClusterEndpoint};
use fea_server::engine::{Answered, Case, Engine, Equations, Outcome, Task};
use fea_server::{RunningServer, ServerConfig, Tokens, start};
use softgrasp_core::mesh::{BuiltIn, generate};
use softgrasp_core::model::Model;
use softgrasp_core::solve::{Loads, Method};
use softgrasp_protocol::blocking::Connection;
use softgrasp_protocol::{
    Answer, Ask, Body, DofValue, ElementChoice, ElementName, Hello, Limits, Material, MeshData,
    MethodName, ModelHash, Question, RejectCode, Rejected, Reply, Request, SolveReport,
    UploadModel, Want,
};

/// Answers everything by a factor, and counts.
#[derive(Debug, Default)]
struct Together {
    asked: AtomicUsize,
}

impl Engine for Together {
    fn takes_all(&self) -> bool {
        true
    }

    fn answer(&self, task: Task) -> Answered<'_> {
        self.asked.fetch_add(1, Ordering::Relaxed);
        Box::pin(async move {
            let equations = Equations::of(&task)?;
            Ok(solved(&equations).answer(&task, &equations))
        })
    }
}

fn solved(equations: &Equations) -> Outcome {
    let Equations { mesh, element, materials, known, .. } = equations;
    let model = Model::try_new(mesh.clone(), *element, materials, Vec::new(), &mut |_| {}).unwrap();
    let factored = model.factor(&known.dofs, Method::Front, &mut |_| {}).unwrap();
    let case = |q_known: &[f64]| {
        let loads = Loads { q_known, forces: &equations.forces, residual_rel: 0.0 };
        let solution = factored.solve(model.stiffness(), loads, &mut |_| {}).unwrap();
        Case { displacement: solution.displacement, reaction: solution.reaction }
    };
    let method = "cluster-factor".to_owned();
    Outcome {
        first: case(&known.q_known),
        further: equations.cases.iter().map(|known| case(&known.q_known)).collect(),
        report: SolveReport { method, ..SolveReport::default() },
    }
}

fn cluster_at(listen: SocketAddr, engine: &Arc<Together>) -> RunningServer {
    let engine: Arc<dyn Engine> = Arc::clone(engine) as _;
    let tokens = Some(Tokens::of("a word between servers"));
    let config =
        ServerConfig { listen, threads: 1, engine: Some(engine), tokens, ..Default::default() };
    start(config).unwrap()
}

/// A server with so much memory and a cluster.
fn head(cluster: SocketAddr, memory_limit: u64) -> RunningServer {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("token");
    std::fs::write(&file, "a word between servers\n").unwrap();
    let endpoint = ClusterEndpoint::read(&cluster.to_string(), Some(&file), None).unwrap();
    let engine: Arc<dyn Engine> = Arc::new(Cluster::new(endpoint).with_patience(PATIENCE));
    let listen = SocketAddr::from(([127, 0, 0, 1], 0));
    let engine = Some(engine);
    start(ServerConfig { listen, threads: 1, memory_limit, engine, ..Default::default() }).unwrap()
}

struct Client {
    connection: Connection<TcpStream>,
    id: u64,
}

impl Client {
    fn of(server: &RunningServer) -> Self {
        let socket = TcpStream::connect(server.address()).unwrap();
        socket.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        Self { connection: Connection::new(socket, Limits::default()), id: 0 }
    }

    fn ask(&mut self, request: &Request) -> Reply {
        self.id += 1;
        let mut bytes = Vec::new();
        request.encode_into(self.id, &Limits::default(), &mut bytes).unwrap();
        self.connection.write_bytes(&bytes).unwrap();
        let frame = self.connection.read_frame().unwrap().unwrap();
        assert_eq!(frame.request_id(), self.id);
        Reply::decode(&frame, &Limits::default()).unwrap()
    }

    fn answer(&mut self, ask: Ask) -> Answer {
        match self.ask(&Request::Ask(Box::new(ask))) {
            Reply::Answer(answer) => *answer,
            other => panic!("{:?}", other.kind()),
        }
    }

    fn refusal(&mut self, ask: Ask) -> Rejected {
        match self.ask(&Request::Ask(Box::new(ask))) {
            Reply::Rejected(rejected) => rejected,
            other => panic!("{:?}", other.kind()),
        }
    }
}

fn mesh() -> MeshData {
    let mesh = generate(BuiltIn::Cube, 1000).unwrap();
    let vertices = mesh.vertices().iter().map(|p| p.coords.into()).collect();
    MeshData { vertices, tets: mesh.tets().to_vec(), ..MeshData::default() }
}

const MATERIALS: [Material; 1] = [Material { young: 1e4, poisson: 0.3 }];

fn question(method: &str) -> Question {
    let held =
        [0, 9, 90].into_iter().flat_map(|node| (0..3).map(move |axis| (3 * node + axis, 0.0)));
    let known = held.chain([(3 * 999, 1e-3)]).map(|(dof, value)| DofValue { dof, value });
    let method = MethodName::try_new(method).unwrap();
    let want = Want { reactions: true, ..Want::default() };
    Question { known: known.collect(), method, want, ..Question::default() }
}

fn once(method: &str) -> Ask {
    let (materials, element) = (MATERIALS.to_vec(), ElementChoice::Auto);
    Ask::new(Body { mesh: mesh(), materials, element }, question(method))
}

fn displacements(answer: Answer) -> Vec<[f64; 3]> {
    answer.displacements.into_f64()
}

const PATIENCE: Duration = Duration::from_secs(2);
const SMALL: u64 = 3 << 20;
const LARGE: u64 = 1 << 30;

fn loopback() -> SocketAddr {
    ([127, 0, 0, 1], 0).into()
}

#[test]
fn what_does_not_fit_is_answered_by_the_cluster_with_the_reason() {
    let engine = Arc::new(Together::default());
    let cluster = cluster_at(loopback(), &engine);
    let (small, large) = (head(cluster.address(), SMALL), head(cluster.address(), LARGE));
    let here = Client::of(&large).answer(once("auto"));
    assert_eq!(here.report.method, "front");
    assert_eq!(engine.asked.load(Ordering::Relaxed), 0);
    let there = Client::of(&small).answer(once("auto"));
    assert_eq!(there.report.method, "cluster-factor");
    let why = &there.report.chosen_because;
    assert!(why.contains("no method fits into this server's memory"), "{why}");
    let named = Client::of(&large).answer(once("cluster-cg"));
    assert!(named.report.chosen_because.contains("asked for"), "{:?}", named.report);
    assert_eq!(named.reactions, there.reactions);
    assert_eq!(displacements(named), displacements(there.clone()));
    assert_eq!(displacements(here), displacements(there));
    assert_eq!(engine.asked.load(Ordering::Relaxed), 2);
    // What was asked for by name stays here.
    assert_eq!(Client::of(&small).refusal(once("front")).code, RejectCode::MemoryLimit);
}

#[test]
fn models_that_do_not_fit_are_kept_by_the_cluster_and_uploaded_to_it_again() {
    let engine = Arc::new(Together::default());
    let cluster = cluster_at(loopback(), &engine);
    let address = cluster.address();
    let server = head(address, SMALL);
    let fixed: Vec<u32> = [0, 9, 90].into_iter().flat_map(|node| 3 * node..3 * node + 3).collect();
    let (materials, element) = (MATERIALS.to_vec(), ElementName::T4);
    let model = UploadModel { mesh: mesh(), materials, element, fixed };
    let hash = ModelHash::of(&model);
    let mut client = Client::of(&server);
    for is_reused in [false, true] {
        match client.ask(&Request::UploadModel(model.clone())) {
            Reply::ModelReady(ready) => {
                assert_eq!((ready.model, ready.reused), (hash, is_reused));
                assert_eq!((ready.fixed_dofs, ready.unknown_dofs), (9, 2991));
            }
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(client.ask(&Request::HaveModel(hash)), Reply::ModelState { known: true });
    let mut about = question("auto");
    about.known.retain(|known| known.dof == 3 * 999);
    let mut ask = Ask::new(hash, about);
    ask.cases = vec![vec![2e-3]];
    let first = client.answer(ask.clone());
    assert_eq!(first.cases.len(), 1);
    assert_eq!(
        displacements(first.clone()),
        displacements(Client::of(&server).answer(once("auto")))
    );
    // One that begins anew knows no model; the client notices nothing.
    cluster.stop();
    let _again = cluster_at(address, &engine);
    let second = client.answer(ask);
    assert_eq!(displacements(second), displacements(first));
}

#[test]
fn methods_of_a_cluster_are_refused_where_there_is_none() {
    let config = ServerConfig { listen: loopback(), threads: 1, ..Default::default() };
    let alone = start(config).unwrap();
    let mut client = Client::of(&alone);
    let refused = client.refusal(once("cluster-cg"));
    assert_eq!(refused.code, RejectCode::UnknownMethod);
    assert!(refused.text.contains("--cluster"), "{}", refused.text);
    let welcome = |client: &mut Client| match client.ask(&Request::Hello(Hello::new("test", None)))
    {
        Reply::Welcome(welcome) => welcome.knows("cluster"),
        other => panic!("{other:?}"),
    };
    assert!(!welcome(&mut client));
    let nobody = TcpListener::bind(loopback()).unwrap().local_addr().unwrap();
    assert!(welcome(&mut Client::of(&head(nobody, LARGE))));
}

#[test]
fn a_cluster_that_goes_each_time_is_lost_and_says_when_to_ask_again() {
    // Takes connections, and closes each of them.
    let listener = TcpListener::bind(loopback()).unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || listener.incoming().take(1000).for_each(drop));
    let server = head(address, SMALL);
    let refused = Client::of(&server).refusal(once("auto"));
    assert_eq!(refused.code, RejectCode::ClusterLost);
    assert!(refused.retry_after_ms > 0 && refused.text.contains("lost"), "{refused:?}");
}

#[test]
fn what_a_cluster_cannot_is_refused_in_words() {
    let engine = Arc::new(Together::default());
    let cluster = cluster_at(loopback(), &engine);
    let server = head(cluster.address(), LARGE);
    let mut ask = once("cluster-cg");
    ask.question.deadline_ms = Some(-1.0);
    assert_eq!(Client::of(&server).refusal(ask).code, RejectCode::BadRequest);
    let mut ask = once("cluster-cg");
    ask.question.known.truncate(4);
    assert_eq!(Client::of(&server).refusal(ask).code, RejectCode::RigidMotionFree);
}
