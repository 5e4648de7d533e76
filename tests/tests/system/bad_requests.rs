//! Invalid requests: refused with the right code and a text that names the fault, and the session goes
//! on. the session goes on.

use fea_server::{RunningServer, ServerConfig};
use glove_client::ask::connection::ServerConnection;
use softgrasp_protocol::RejectCode::{
    BadRequest, MemoryLimit, RigidMotionFree, TooLarge, UnknownMethod, UnknownModel,
};
use softgrasp_protocol::{
    DofValue, Material, MethodName, ModelHash, NodeChoice, RejectCode, Reply, Request,
};
use softgrasp_tests::heard::AnswerBits;
use softgrasp_tests::questions::{MATERIAL, Once, cube, frame, once, question, upload};

use crate::start::{answer, client, config, refusal, server};

/// Session that alternates invalid requests and a valid one.
struct Bench {
    // Stops when dropped.
    _server: RunningServer,
    connection: ServerConnection,
    good: AnswerBits,
}

fn good() -> Request {
    Request::from(once(&cube(27), "sparse-cholesky"))
}

impl Bench {
    fn new(server: RunningServer) -> Self {
        let mut connection = client(&server);
        let good = AnswerBits::of(&answer(&mut connection, &good()));
        Self { _server: server, connection, good }
    }

    /// Checks that the request is refused with `code` and a text that contains all of `says`, and that
    /// the valid request then gets the same bits as before.
    fn refuses(&mut self, request: &Request, code: RejectCode, says: &[&str]) {
        let (found, text) = refusal(&mut self.connection, request);
        assert_eq!(found, code, "{text}");
        for part in says {
            assert!(text.contains(part), "'{part}' is missing in: {text}");
        }
        assert!(!text.contains('\n'), "one line: {text}");
        let again = AnswerBits::of(&answer(&mut self.connection, &good()));
        assert_eq!(again, self.good, "after: {text}");
    }

    /// Checks the refusal of the valid request with its own mesh after a change.
    fn refuses_changed(&mut self, change: impl Fn(&mut Once), code: RejectCode, says: &[&str]) {
        let mut request = once(&cube(27), "sparse-cholesky");
        change(&mut request);
        self.refuses(&Request::from(request), code, says);
    }
}

#[test]
fn meshes_that_cannot_be_modelled_are_refused_by_element_or_node() {
    let mut bench = Bench::new(server(1));
    bench.refuses_changed(
        |r| r.mesh.tets[3][2] = 27,
        BadRequest,
        &["tetrahedron 3", "node 27", "27 nodes"],
    );
    bench.refuses_changed(
        |r| r.mesh.tets[0][0] = u32::MAX,
        BadRequest,
        &["tetrahedron 0", "4294967295"],
    );
    bench.refuses_changed(|r| r.mesh.vertices[5][1] = f64::NAN, BadRequest, &["node 5", "finite"]);
    bench.refuses_changed(
        |r| r.mesh.vertices[6][0] = f64::INFINITY,
        BadRequest,
        &["node 6", "finite"],
    );
    bench.refuses_changed(
        |r| r.mesh.tets[2][3] = r.mesh.tets[2][0],
        BadRequest,
        &["tetrahedron 2", "volume 0"],
    );
    bench.refuses_changed(|r| r.mesh.tets.clear(), BadRequest, &["no tetrahedra"]);
    bench.refuses_changed(
        |r| (r.mesh.vertices.clear(), r.mesh.tets.clear(), r.question.known.clear()).0,
        BadRequest,
        &["no tetrahedra"],
    );
    bench.refuses_changed(
        |r| r.mesh.vertices.iter_mut().flatten().for_each(|c| *c *= 1e200),
        BadRequest,
        &["tetrahedron 0", "volume"],
    );
}

#[test]
fn materials_and_methods_that_do_not_exist_are_refused() {
    let mut bench = Bench::new(server(1));
    bench.refuses_changed(|r| r.materials.clear(), BadRequest, &["no material"]);
    bench.refuses_changed(|r| r.materials[0].poisson = 0.5, BadRequest, &["0.5", "0.49"]);
    bench.refuses_changed(|r| r.materials[0].poisson = -1.0, BadRequest, &["Poisson", "-1"]);
    bench.refuses_changed(|r| r.materials[0].poisson = f64::NAN, BadRequest, &["Poisson", "NaN"]);
    bench.refuses_changed(|r| r.materials[0].young = 0.0, BadRequest, &["Young", "above 0"]);
    bench.refuses_changed(
        |r| r.materials[0].young = f64::INFINITY,
        BadRequest,
        &["Young", "finite"],
    );
    bench.refuses_changed(
        |r| {
            r.materials.push(MATERIAL);
            r.mesh.regions = (0..r.mesh.tets.len() as u32).map(|t| t.min(2)).collect();
        },
        BadRequest,
        &["2 materials", "3 region labels", "one for each"],
    );
    bench.refuses_changed(|r| r.materials.push(MATERIAL), BadRequest, &["2 materials", "0 region"]);
    bench.refuses_changed(
        |r| r.question.method = MethodName::try_new("cramers-rule").unwrap(),
        UnknownMethod,
        &["cramers-rule", "sparse-cholesky", "gauss-jordan"],
    );
}

#[test]
fn known_displacements_and_forces_that_make_no_sense_are_refused_by_node() {
    let mut bench = Bench::new(server(1));
    let push = |dof, value| move |r: &mut Once| r.question.known.push(DofValue { dof, value });
    bench.refuses_changed(push(81, 0.0), BadRequest, &["node 27", "27 nodes"]);
    bench.refuses_changed(push(u32::MAX, 0.0), BadRequest, &["node 1431655765"]);
    bench.refuses_changed(push(40, f64::NAN), BadRequest, &["node 13", "axis y", "finite"]);
    bench.refuses_changed(
        |r| {
            let DofValue { dof, value } = r.question.known[4];
            r.question.known.push(DofValue { dof, value: value + 0.01 });
        },
        BadRequest,
        &["node", "axis", "two displacements"],
    );
    bench.refuses_changed(
        |r| {
            r.mesh.vertices.push([1.0, 1.0, 1.0]);
            r.question.known.push(DofValue { dof: 83, value: 0.0 });
        },
        BadRequest,
        &["node 27", "no tetrahedron uses it"],
    );
    let force = |dof, value| move |r: &mut Once| r.question.forces.push(DofValue { dof, value });
    bench.refuses_changed(force(39, f64::NAN), BadRequest, &["force", "node 13", "finite"]);
    bench.refuses_changed(force(39, f64::INFINITY), BadRequest, &["force", "node 13", "finite"]);
    bench.refuses_changed(force(81, 1.0), BadRequest, &["forces", "node 27", "27 nodes"]);
    bench.refuses_changed(
        |r| r.question.forces.push(DofValue { dof: r.question.known[0].dof, value: 1.0 }),
        BadRequest,
        &["force", "node", "known"],
    );
    bench.refuses_changed(
        |r| r.question.want.nodes = NodeChoice::Nodes(vec![0, 27]),
        BadRequest,
        &["wanted nodes", "node 27", "27 nodes"],
    );
}

#[test]
fn bodies_left_free_to_move_are_refused_with_their_motion() {
    let mut bench = Bench::new(server(1));
    let hold = |nodes: &'static [u32]| {
        move |r: &mut Once| {
            let dofs = nodes.iter().flat_map(|n| 3 * n..3 * n + 3);
            r.question.known = dofs.map(|dof| DofValue { dof, value: 0.0 }).collect();
        }
    };
    for method in softgrasp_tests::questions::METHODS {
        let with = |change: Box<dyn Fn(&mut Once)>| {
            move |r: &mut Once| {
                r.question.method = MethodName::try_new(method).unwrap();
                change(r);
            }
        };
        let three = "at least three nodes";
        bench.refuses_changed(with(Box::new(hold(&[]))), RigidMotionFree, &["0 known", three]);
        bench.refuses_changed(with(Box::new(hold(&[4]))), RigidMotionFree, &["turn about", three]);
        bench.refuses_changed(
            with(Box::new(hold(&[0, 1]))),
            RigidMotionFree,
            &["6 known", "turn about the axis", three],
        );
    }
    bench.refuses_changed(
        |r| {
            let other: Vec<[f64; 3]> =
                r.mesh.vertices.iter().map(|v| [v[0] + 1.0, v[1], v[2]]).collect();
            let tets: Vec<[u32; 4]> = r.mesh.tets.iter().map(|t| t.map(|n| n + 27)).collect();
            r.mesh.vertices.extend(other);
            r.mesh.tets.extend(tets);
        },
        RigidMotionFree,
        &["body 1", "first is node 27", "0 known"],
    );
}

#[test]
fn inverted_elements_are_accepted_and_give_the_same_answer() {
    let server = server(1);
    let mut connection = client(&server);
    let upright = once(&cube(64), "sparse-cholesky");
    let mut inverted = upright.clone();
    for tet in inverted.mesh.tets.iter_mut().step_by(3) {
        tet.swap(0, 1);
    }
    let mut ask =
        |request: Once| answer(&mut connection, &Request::from(request)).displacements.into_f64();
    let (expected, found) = (ask(upright), ask(inverted));
    let largest = expected.iter().flatten().fold(0.0, |most: f64, u| most.max(u.abs()));
    assert!(largest > 0.0);
    for (e, f) in expected.iter().flatten().zip(found.iter().flatten()) {
        assert!((e - f).abs() <= 1e-12 * largest);
    }
}

#[test]
fn region_labels_of_any_size_take_no_memory_and_pair_with_materials_in_ascending_order() {
    let server = server(1);
    let mut connection = client(&server);
    let mut ask = |request: Once| AnswerBits::of(&answer(&mut connection, &Request::from(request)));
    let stiff = Material { young: 20.0 * MATERIAL.young, ..MATERIAL };
    let with = |labels: [u32; 2], materials: Vec<Material>| {
        let mut request = once(&cube(64), "sparse-cholesky");
        let third = |tet| labels[usize::from(tet % 3 == 0)];
        request.mesh.regions = (0..request.mesh.tets.len()).map(third).collect();
        request.materials = materials;
        request
    };
    let plain = ask(once(&cube(64), "sparse-cholesky"));
    assert_eq!(ask(with([7, u32::MAX], vec![MATERIAL])), plain);
    let two = ask(with([0, 1], vec![MATERIAL, stiff]));
    assert_ne!(two, plain);
    assert_eq!(ask(with([7, u32::MAX], vec![MATERIAL, stiff])), two);
    assert_eq!(ask(with([u32::MAX, 7], vec![stiff, MATERIAL])), two);
}

#[test]
fn requests_above_the_servers_limits_are_refused_by_the_options_name() {
    let small = ServerConfig { max_nodes: 100, memory_limit: 135_000, ..config(1) };
    let mut bench = Bench::new(fea_server::start(small).unwrap());
    let large = Request::from(once(&cube(125), "sparse-cholesky"));
    bench.refuses(&large, TooLarge, &["125", "100", "--max-nodes"]);
    bench.refuses(&Request::UploadModel(upload(&cube(125))), TooLarge, &["--max-nodes"]);
    // 64 nodes, 96 unknowns: 73 728 bytes as a square, half of that as a triangle; mesh and
    // stiffness take up to 86 000.
    for method in ["gauss-jordan", "dense-inverse"] {
        let dense = Request::from(once(&cube(64), method));
        bench.refuses(&dense, MemoryLimit, &[method, "96", "73728", "135000", "--memory-limit"]);
    }
    let dense = Request::from(once(&cube(64), "dense-cholesky"));
    assert_eq!(answer(&mut bench.connection, &dense).report.method, "dense-cholesky");
}

#[test]
fn frames_on_models_that_are_not_there_are_refused_and_an_upload_helps() {
    let mut bench = Bench::new(server(1));
    let mesh = cube(64);
    let request = Request::from(frame(&mesh, 1.0, "auto"));
    let hash = ModelHash::of(&upload(&mesh));
    let name = hash.to_string();
    bench.refuses(&request, UnknownModel, &[&name, "upload it"]);
    for _ in 0..2 {
        let ready = bench.connection.ask(&Request::UploadModel(upload(&mesh))).unwrap();
        assert!(matches!(ready, Reply::ModelReady(ready) if ready.model == hash && !ready.reused));
        answer(&mut bench.connection, &request);
        bench.connection.send(&Request::Drop(hash)).unwrap();
        bench.refuses(&request, UnknownModel, &[&name, "upload it"]);
    }
}

#[test]
fn frames_are_checked_like_whole_requests_and_cost_no_factor_when_they_are_bad() {
    let mut bench = Bench::new(server(1));
    let mesh = cube(64);
    let mut fixed = upload(&mesh);
    fixed.fixed = vec![192];
    bench.refuses(&Request::UploadModel(fixed), BadRequest, &["node 64", "64 nodes"]);
    bench.connection.ask(&Request::UploadModel(upload(&mesh))).unwrap();
    let sound = frame(&mesh, 1.0, "sparse-cholesky");
    let changed = |change: &dyn Fn(&mut softgrasp_protocol::Question)| {
        let mut frame = sound.clone();
        change(&mut frame.question);
        Request::from(frame)
    };
    let free = question(Vec::new(), "sparse-cholesky");
    bench.refuses(&changed(&|q| *q = free.clone()), RigidMotionFree, &["0 known"]);
    let force = |dof, value| changed(&move |q| q.forces.push(DofValue { dof, value }));
    let known = sound.question.known[0].dof;
    bench.refuses(&force(known, 1.0), BadRequest, &["force", "known"]);
    bench.refuses(&force(100, f64::NAN), BadRequest, &["force", "node 33", "finite"]);
    let wanted = NodeChoice::Nodes(vec![64]);
    bench.refuses(&changed(&|q| q.want.nodes = wanted.clone()), BadRequest, &["node 64"]);
    let first = answer(&mut bench.connection, &Request::from(sound.clone()));
    assert!(!first.report.factor_reused, "a bad frame must not be factored first");
    let second = answer(&mut bench.connection, &Request::from(sound));
    assert!(second.report.factor_reused);
    assert_eq!(second.displacements.node_count(), 64);
}
