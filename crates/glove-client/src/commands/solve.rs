//! `glove-client solve`: one request with a mesh, prescribed displacements and forces.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::bail;
use clap::Args;
use serde::Serialize;
use softgrasp_core::fem::Element;
use softgrasp_core::mesh::{Folds, TetMesh};
use softgrasp_core::mesh_io::MeshFile;
use softgrasp_core::solve::memory::Bytes;
use softgrasp_protocol::solve_report::{SCHEMA, SolveSummary};
use softgrasp_protocol::{
    Answer, Ask, Body, Deformation, Displacements, DofValue, ElementChoice, FieldValues, Material,
    MethodName, NodeChoice, Pace, PathChoice, Quantity, Question, Want, Warning, WarningCode,
};

use super::access_arguments::AccessArguments;
use super::elasticity_arguments::ElasticityArguments;
use super::field_arguments::FieldArguments;
use super::gradient_arguments::GradientArguments;
use super::load_arguments::{LoadArguments, check_server, on_nodes};
use super::numbers::{count, poisson, positive};
use super::output::{print, write_json};
use super::region_arguments::RegionArguments;
use super::solve_cases::{CaseFiles, CaseMesh, CaseResult, read_values};
use super::solve_words::{describe, describe_discretisation};
use crate::ask::calculix_deck::CalculixDeck;
use crate::ask::connection::{Host, ServerChoice};
use crate::ask::discretisation::DiscretisationEstimate;
use crate::ask::displacement_table::{DISPLACEMENT_COLUMNS, FORCE_COLUMNS, TableError};
use crate::ask::model_upload::{materials, mesh_data};
use crate::ask::solve_settings::Elasticity;
use crate::commands::output::Progress;
use crate::object::file_writing::write_file;
use crate::object::mesh_file::read_mesh_file;
use crate::object::region_choice::regions_of;

/// Solve one request on a mesh file: prescribed displacements in, all displacements out.
#[derive(Args)]
pub struct SolveCommand {
    /// Mesh file; the format is recognised by its content.
    #[arg(long, value_name = "F")]
    mesh: PathBuf,
    /// Prescribed displacements: node,ux,uy,uz; nodes from 0 in the order of the file, an empty cell
    /// leaves that direction free. Given several times, with as many --out: one matrix and one factor
    /// for all of them; they prescribe the same directions of the same nodes.
    #[arg(long, value_name = "K.csv", required = true)]
    known: Vec<PathBuf>,
    /// External forces: node,fx,fy,fz.
    #[arg(long, value_name = "F.csv")]
    forces: Option<PathBuf>,
    #[command(flatten)]
    loads: LoadArguments,
    /// Where to solve: HOST:PORT, or embedded.
    #[arg(long, default_value = "embedded", value_name = "ADDR|embedded")]
    server: ServerChoice,
    #[command(flatten)]
    access: AccessArguments,
    /// Threads of the embedded server [default: one per processor].
    #[arg(long, value_name = "N", value_parser = count, allow_hyphen_values = true)]
    threads: Option<usize>,
    /// Memory for the embedded server: bytes, or 8GiB, 512MiB [default: 8GiB]. What needs more is
    /// refused before it is made; auto takes single precision where only that fits.
    #[arg(long, value_name = "BYTES", allow_hyphen_values = true)]
    memory_limit: Option<Bytes>,
    /// gauss-jordan-plain, gauss-jordan, dense-inverse, dense-cholesky, sparse-cholesky, front,
    /// front-mixed, pcg, multigrid, condensed or auto.
    #[arg(long, default_value = "auto", value_name = "NAME|auto")]
    method: MethodName,
    /// Finite element; auto takes t4 below a Poisson's ratio of 0.45, from where on it locks, else
    /// t10 where deadline and memory allow, else t4-anp.
    #[arg(long, default_value = "t4", value_name = "t4|t4-anp|t10|auto")]
    element: ElementChoice,
    /// Young's modulus, Pa (in the mesh's unit of length).
    #[arg(long, default_value_t = 1.0e5, value_name = "PA", value_parser = positive, allow_hyphen_values = true)]
    young: f64,
    /// Poisson's ratio.
    #[arg(long, default_value_t = 0.3, value_name = "NU", value_parser = poisson, allow_hyphen_values = true)]
    poisson: f64,
    #[command(flatten)]
    regions: RegionArguments,
    /// Largest relative error of the solution wanted: auto takes the fastest method within it.
    #[arg(long, value_name = "REL", value_parser = positive, allow_hyphen_values = true)]
    max_error: Option<f64>,
    /// Time wanted, ms: auto takes the most exact method that is predicted to be in time.
    #[arg(long, value_name = "MS", value_parser = positive, allow_hyphen_values = true)]
    deadline: Option<f64>,
    #[command(flatten)]
    elasticity: ElasticityArguments,
    /// Solve once more with the other element and report the difference: an estimate of the
    /// mesh's own error.
    #[arg(long)]
    estimate_discretisation: bool,
    /// File for the displacements: .csv or .vtu.
    /// One for each --known, in their order.
    #[arg(long, value_name = "U.csv|U.vtu", value_parser = parse_out, required = true)]
    out: Vec<PathBuf>,
    #[command(flatten)]
    fields: FieldArguments,
    /// File for the forces that hold the body: node,fx,fy,fz of every node with a known
    /// displacement, N; one for each --known, or none.
    #[arg(long, value_name = "R.csv")]
    reactions: Vec<PathBuf>,
    #[command(flatten)]
    gradient: GradientArguments,
    /// Leave out what only informs: condition, estimated error, rotation and strain.
    #[arg(long, conflicts_with = "estimate_discretisation")]
    no_estimate: bool,
    /// File for the same question as an input deck of CalculiX (and Abaqus): t4 and t10, linear or
    /// neo-hookean. Nodes count from 1 in it.
    #[arg(long, value_name = "F.inp")]
    export_deck: Option<PathBuf>,
    /// File for a JSON report.
    #[arg(long, value_name = "F.json")]
    report: Option<PathBuf>,
}

#[derive(Serialize)]
struct Report {
    schema: u32,
    command: &'static str,
    mesh: MeshSummary,
    server: String,
    #[serde(flatten)]
    solve: SolveSummary,
    /// Difference between linear and ten-node elements, relative to the answer, or null.
    discretisation_estimate_rel: Option<f64>,
    /// How the estimate was made, or why there is none.
    discretisation_why: String,
    /// The quantity whose derivatives were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    quantity: Option<f64>,
    /// Stored energy of the body, J, if fields were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    strain_energy: Option<f64>,
    /// Estimated error of the stress in the energy norm, relative, if it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    stress_error_rel: Option<f64>,
    out: String,
    /// Files of the displacements of all cases, if there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    outs: Vec<String>,
}

#[derive(Serialize)]
struct MeshSummary {
    file: String,
    format: String,
    nodes: usize,
    tets: usize,
    flipped: usize,
    degenerate_dropped: usize,
    repeated_dropped: usize,
    orphans: usize,
}

impl Report {
    /// Adds the totals that the fields of the first case tell of the whole body.
    fn add_fields(&mut self, fields: Option<&FieldValues>) {
        self.strain_energy = fields.map(|fields| fields.energy);
        self.stress_error_rel =
            fields.map(|fields| fields.error_rel).filter(|error| error.is_finite());
    }
}

fn parse_out(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension().and_then(|e| e.to_str()) {
        Some("csv" | "vtu") => Ok(path),
        _ => Err("the name must end in .csv or .vtu".to_owned()),
    }
}

impl SolveCommand {
    /// Reads the files, asks the server, and writes the results.
    ///
    /// # Errors
    /// One line each: what happened, where, and what to do.
    pub fn run(&self) -> anyhow::Result<()> {
        let progress = Progress::start("reading the mesh");
        let file = self.mesh_file()?;
        let materials = self.materials(&file)?;
        let question = self.question(&file.mesh)?;
        let elasticity = self.elasticity.of_request()?;
        self.check_cases(&elasticity)?;
        let cases = self.cases().further(&file.mesh, &question.known)?;
        if let Some(path) = &self.export_deck {
            write_file(
                path,
                self.deck(&file.mesh, &materials, &question, &elasticity)?.as_bytes(),
            )?;
        }
        progress.now("starting");
        let host = self.open_host()?;
        let mut connection = host.connect()?;
        check_server((&file.mesh, &question.spread), connection.welcome())?;
        self.gradient.check_server(connection.welcome())?;
        let nodes = file.mesh.node_count();
        progress.now(&match &self.server {
            ServerChoice::Embedded => format!("{nodes} nodes:"),
            ServerChoice::At(address) => format!("solving for {nodes} nodes at {address}"),
        });
        progress.watch(host.stage());
        let body = Body { mesh: mesh_data(&file.mesh), materials, element: self.element };
        let again = self.again(&body, &question);
        let start = Instant::now();
        let ask = Ask {
            large: elasticity.ask(PathChoice::FromRest, Pace::Repeatable),
            cases,
            without_estimate: self.no_estimate,
            ..Ask::new(body, question)
        };
        let mut answer = connection.answer(ask)?;
        let round_trip_ms = start.elapsed().as_secs_f64() * 1e3;
        progress.now("writing");
        let folds = Folds::from_mesh(&file.mesh);
        let folds = folds.map(|folds| Warning::new(WarningCode::MESH, folds.to_string()));
        let summary = SolveSummary::new(answer.report.clone(), answer.large, round_trip_ms)
            .with_first_warning(folds)
            .with_bytes(connection.bytes_of_exchange());
        let displacements =
            std::mem::replace(&mut answer.displacements, Displacements::F64(vec![]));
        let displacements = displacements.into_f64();
        self.write_cases(&file, &displacements, &answer)?;
        self.gradient.write(&file, &answer)?;
        let mut discretisation = DiscretisationEstimate::not_asked();
        if let Some((body, question)) = &again {
            progress.now("solving again");
            let again = (body, question);
            discretisation =
                DiscretisationEstimate::of(&mut connection, again, &answer, &displacements);
        }
        if let Some(path) = &self.report {
            let mut report = self.report(&file, &host, summary.clone(), discretisation.clone());
            report.add_fields(answer.fields.first());
            report.quantity = answer.gradient.as_ref().map(|gradient| gradient.value);
            write_json(path, &report)?;
        }
        drop(progress);
        for warning in &summary.report.warnings {
            eprintln!("glove-client: warning: {warning}");
        }
        let mut told = describe(&file, &summary, &self.out);
        if self.estimate_discretisation {
            told.push_str(&describe_discretisation(&discretisation));
        }
        print(&told)
    }

    /// What a further solve asks of the same body, for its displacements alone.
    fn again(&self, body: &Body, question: &Question) -> Option<(Body, Question)> {
        let question = || Question { quantity: Quantity::default(), ..question.clone() };
        self.estimate_discretisation.then(|| (body.clone(), question()))
    }

    /// The mesh file, with its mid-edge nodes where the element may be one that has some.
    fn mesh_file(&self) -> anyhow::Result<MeshFile> {
        let mut file = read_mesh_file(&self.mesh)?;
        if matches!(self.element, ElementChoice::T4 | ElementChoice::T4Anp) {
            file.mesh = file.mesh.without_mid_edge_nodes();
        }
        file.findings.orphans = file.mesh.used_nodes().iter().filter(|used| !**used).count();
        Ok(file)
    }

    /// Materials of the mesh's regions, as they travel.
    fn materials(&self, file: &MeshFile) -> anyhow::Result<Vec<Material>> {
        let body = Material { young: self.young, poisson: self.poisson };
        let names = &file.findings.region_labels;
        let regions = regions_of(&file.mesh, names, &self.regions.regions)?;
        Ok(materials(&file.mesh, &regions, body))
    }

    /// Host with the embedded server, or the one at an address.
    fn open_host(&self) -> anyhow::Result<Host> {
        if self.memory_limit.is_some() && self.server != ServerChoice::Embedded {
            bail!(
                "--memory-limit is for the embedded server; {} has its own, set where it is started",
                self.server
            );
        }
        let limit = self.memory_limit.map(|Bytes(bytes)| bytes);
        Ok(match self.access.to(&self.server)? {
            Some(endpoint) => Host::at(endpoint),
            None => Host::open_within(&self.server, self.threads, limit)?,
        })
    }

    /// Writes the files of all cases; the reactions of the further ones are in the order of the first's.
    fn write_cases(
        &self,
        file: &MeshFile,
        displacements: &[[f64; 3]],
        answer: &Answer,
    ) -> anyhow::Result<()> {
        let mesh = CaseMesh { mesh: &file.mesh, labels: &file.findings.region_labels };
        let fields = answer.fields.first();
        if fields.is_none() && self.fields.are_wanted(&file.mesh, &self.out)? {
            eprintln!("glove-client: the server is an older one and answers no fields");
        }
        let reactions = answer.reactions.as_slice();
        self.cases().write(0, mesh, CaseResult { displacements, reactions, fields })?;
        for (k, case) in answer.cases.iter().enumerate() {
            let pairs = answer.reactions.iter().zip(&case.reactions);
            let reactions: Vec<DofValue> =
                pairs.map(|(known, &value)| DofValue { dof: known.dof, value }).collect();
            let result = CaseResult {
                displacements: &case.displacements,
                reactions: &reactions,
                fields: answer.fields.get(k + 1),
            };
            self.cases().write(k + 1, mesh, result)?;
        }
        Ok(())
    }

    fn question(&self, mesh: &TetMesh) -> anyhow::Result<Question> {
        let node_count = mesh.node_count();
        let Some(first) = self.known.first() else { bail!("--known is missing") };
        let known = read_values(first, DISPLACEMENT_COLUMNS, node_count)?;
        if known.is_empty() {
            bail!(TableError::Empty { name: first.display().to_string() });
        }
        let forces = match &self.forces {
            Some(path) => read_values(path, FORCE_COLUMNS, node_count)?,
            None => Vec::new(),
        };
        Ok(Question {
            known,
            forces,
            method: self.method.clone(),
            want: Want {
                nodes: NodeChoice::All,
                reactions: !self.reactions.is_empty(),
                fields: self.fields.of_answer(mesh, &self.out)?,
                ..Want::default()
            },
            max_error: self.max_error,
            deadline_ms: self.deadline,
            spread: self.loads.of_mesh(mesh)?,
            quantity: self.gradient.quantity(node_count)?,
            ..Question::default()
        })
    }

    /// Whether there are several cases of linear elasticity, or the estimates are left out.
    fn is_several(&self) -> bool {
        self.known.len() > 1 || self.no_estimate
    }

    /// Refuses options that do not go together.
    fn check_cases(&self, elasticity: &Elasticity) -> anyhow::Result<()> {
        self.cases().check()?;
        self.gradient.check(self.known.len())?;
        if self.is_several() && elasticity.deformation != Deformation::Linear {
            bail!(
                "several --known and --no-estimate are for linear answers; leave out --deformation"
            );
        }
        if self.estimate_discretisation && elasticity.deformation != Deformation::Linear {
            bail!("--estimate-discretisation compares linear answers; leave out --deformation");
        }
        if self.known.len() > 1 && (self.estimate_discretisation || self.export_deck.is_some()) {
            bail!("--estimate-discretisation and --export-deck are for one --known");
        }
        Ok(())
    }

    fn cases(&self) -> CaseFiles<'_> {
        CaseFiles { known: &self.known, out: &self.out, reactions: &self.reactions }
    }

    /// The request as an input deck of CalculiX.
    fn deck(
        &self,
        mesh: &TetMesh,
        materials: &[Material],
        question: &Question,
        elasticity: &Elasticity,
    ) -> anyhow::Result<String> {
        let element = match self.element {
            ElementChoice::T4 => Element::Tet4,
            ElementChoice::T4Anp => Element::Tet4Anp,
            ElementChoice::T10 => Element::Tet10,
            ElementChoice::Auto => bail!("--export-deck needs an element: --element t4 or t10"),
        };
        if elasticity.yield_stress.is_some() {
            bail!("--export-deck has no yield stress; leave out --yield or the deck");
        }
        let forces = on_nodes(mesh, element, (&question.forces, &question.spread))?;
        let is_linear = elasticity.deformation == Deformation::Linear;
        let deck = CalculixDeck {
            mesh,
            element,
            materials,
            law: (!is_linear).then_some(elasticity.law),
            known: &question.known,
            forces: &forces,
        };
        Ok(deck.text()?)
    }

    fn report(
        &self,
        file: &MeshFile,
        host: &Host,
        solve: SolveSummary,
        discretisation: DiscretisationEstimate,
    ) -> Report {
        Report {
            schema: SCHEMA,
            command: "solve",
            mesh: MeshSummary {
                file: self.mesh.display().to_string(),
                format: file.format.to_string(),
                nodes: file.mesh.node_count(),
                tets: file.mesh.tets().len(),
                flipped: file.findings.flipped.len(),
                degenerate_dropped: file.findings.degenerate.len(),
                repeated_dropped: file.findings.repeated.len(),
                orphans: file.findings.orphans,
            },
            server: match &self.server {
                ServerChoice::Embedded => "embedded".to_owned(),
                ServerChoice::At(_) => host.endpoint().address.clone(),
            },
            solve,
            discretisation_estimate_rel: discretisation.rel,
            discretisation_why: discretisation.why,
            quantity: None,
            strain_energy: None,
            stress_error_rel: None,
            out: self.out.first().map(|out| out.display().to_string()).unwrap_or_default(),
            outs: match self.out.len() {
                1 => Vec::new(),
                _ => self.out.iter().map(|out| out.display().to_string()).collect(),
            },
        }
    }
}
