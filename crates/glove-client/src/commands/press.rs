//! `glove-client press`: rigid bodies pressed against a soft object, with friction and weight.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use nalgebra::Point3;
use softgrasp_core::fem::{QuadraticMesh, SpreadLoads};
use softgrasp_core::mesh::{Surface, TetMesh};
use softgrasp_protocol::solve_report::SCHEMA;
use softgrasp_protocol::{
    ContactAsk, Deformation, ElementName, Material, PathChoice, Reply, Request, Welcome,
};

use super::access_arguments::AccessArguments;
use super::elasticity_arguments::ElasticityArguments;
use super::field_arguments::{FieldArguments, is_vtu};
use super::interruption;
use super::numbers::{count, poisson, positive, speed, vector};
use super::output::Progress;
use super::output::{print, write_json};
use super::region_arguments::RegionArguments;
use crate::ask::connection::{Host, LinkError, ServerChoice, ServerConnection, unexpected};
use crate::ask::contact_frame::isometry_of;
use crate::ask::displacement_table::write_displacements;
use crate::ask::model_upload::{ModelUpload, materials};
use crate::ask::solve_settings::Elasticity;
use crate::object::element_nodes::with_nodes_of;
use crate::object::field_writing::{NodeVectors, encode_fields};
use crate::object::file_writing::write_file;
use crate::object::object_file::{ObjectFile, read_object_file};
use crate::object::region_choice::regions_of;
use crate::object::scene::NODES_DEFAULT;
use crate::object::series::Series;
use crate::press::bodies_file::{PressBodies, read_bodies};
use crate::press::course::{Course, Step};
use crate::press::report::{PressReport, StepReport, steps};
use crate::press::world_fields::in_world;

/// Press rigid bodies against a soft object that nothing else holds, with friction and weight.
#[derive(Args)]
pub struct PressCommand {
    /// Mesh file of the object, in metres, or a surface (STL, OBJ, PLY, OFF, glTF), which is filled
    /// with about 1000 nodes; the format is recognised by its content.
    #[arg(long, value_name = "F")]
    mesh: PathBuf,
    /// Rigid bodies and their ways: [[body]] with name, shape = "sphere", "capsule", "plane", "box"
    /// or "mesh", its sizes in metres, poses = [[t, x, y, z, qw, qx, qy, qz], …]; end = T.
    #[arg(long, value_name = "B.toml")]
    bodies: PathBuf,
    /// Young's modulus, Pa.
    #[arg(long, default_value_t = 2.0e4, value_name = "PA", value_parser = positive, allow_hyphen_values = true)]
    young: f64,
    /// Poisson's ratio.
    #[arg(long, default_value_t = 0.4, value_name = "NU", value_parser = poisson, allow_hyphen_values = true)]
    poisson: f64,
    #[command(flatten)]
    regions: RegionArguments,
    /// Density, kg/m³.
    #[arg(long, default_value_t = 1000.0, value_name = "KG/M3", value_parser = positive, allow_hyphen_values = true)]
    density: f64,
    /// Coefficient of friction of bodies that name none in their file.
    #[arg(long, default_value_t = 0.5, value_name = "MU", value_parser = speed, allow_hyphen_values = true)]
    friction: f64,
    /// Acceleration of free fall, m/s²; 0,0,0 for none.
    #[arg(long, default_value = "0,0,-9.81", value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    gravity: nalgebra::Vector3<f64>,
    /// Time in which the shape forgets a force, s (Kelvin and Voigt); 0 for none.
    #[arg(long, default_value_t = 0.0, value_name = "T", value_parser = speed, allow_hyphen_values = true)]
    viscosity: f64,
    /// Longest step, s.
    #[arg(long, default_value_t = 0.01, value_name = "S", value_parser = positive, allow_hyphen_values = true)]
    step: f64,
    /// Time after which a step ends at the best that was found, ms; the report says which steps did
    /// [default: as long as it takes].
    #[arg(long, value_name = "MS", value_parser = positive, allow_hyphen_values = true)]
    deadline: Option<f64>,
    #[command(flatten)]
    elasticity: ElasticityArguments,
    /// Finite element. t10 has nodes in the middles of all edges, those of the file or halfway between
    /// corners, and is pressed at all of them.
    #[arg(long, default_value = "t4", value_name = "t4|t4-anp|t10", value_parser = element)]
    element: ElementName,
    /// Where to solve: HOST:PORT, or embedded.
    #[arg(long, default_value = "embedded", value_name = "ADDR|embedded")]
    server: ServerChoice,
    #[command(flatten)]
    access: AccessArguments,
    /// Threads of the embedded server [default: one per processor].
    #[arg(long, value_name = "N", value_parser = count, allow_hyphen_values = true)]
    threads: Option<usize>,
    /// File for the displacements of all nodes at the end, from rest to their place in the world.
    #[arg(long, value_name = "U.vtu|U.csv")]
    out: Option<PathBuf>,
    /// Folder for the object at every step, as VTU files and a PVD file that ParaView plays.
    #[arg(long, value_name = "DIR")]
    series: Option<PathBuf>,
    #[command(flatten)]
    fields: FieldArguments,
    /// File for a JSON report of every step.
    #[arg(long, value_name = "R.json")]
    report: Option<PathBuf>,
}

fn element(text: &str) -> Result<ElementName, String> {
    match text {
        "t4" => Ok(ElementName::T4),
        "t4-anp" => Ok(ElementName::T4Anp),
        "t10" => Ok(ElementName::T10),
        _ => Err("there are t4, t4-anp and t10".to_owned()),
    }
}

/// Refuses rounded bodies and a deadline that a server does not know, before it is asked.
///
/// # Errors
/// One line that names the server, and a body or the deadline.
fn check_server(
    bodies: &PressBodies,
    deadline: Option<f64>,
    server: &Welcome,
) -> anyhow::Result<()> {
    if deadline.is_some() && !server.knows("contact-deadline") {
        bail!(
            "{} is an older server and keeps no deadline of a step; leave out --deadline",
            server.program()
        );
    }
    if let Some(name) = bodies.rounded().filter(|_| !server.knows("rounded-bodies")) {
        bail!(
            "{} is an older server and knows no bodies with rounded edges; leave out the radius of {name}",
            server.program()
        );
    }
    Ok(())
}

impl PressCommand {
    /// Reads the files, plays the press, and writes the results.
    ///
    /// # Errors
    /// One line each: what happened, where, and what to do.
    pub fn run(&self) -> anyhow::Result<()> {
        let progress = Progress::start("reading");
        let elasticity = self.elasticity.of_request()?;
        let bodies = read_bodies(&self.bodies)?;
        let (given, region_names) = self.read_object()?;
        let own_nodes = given.node_count();
        let mesh = with_nodes_of(given, self.element)?;
        let surface = Surface::with_mid_edge_nodes(&mesh);
        let is_known = |path: &PathBuf| {
            matches!(path.extension().and_then(|e| e.to_str()), Some("vtu" | "csv"))
        };
        if self.out.as_ref().is_some_and(|path| !is_known(path)) {
            bail!("--out must end in .vtu or .csv");
        }
        progress.now("starting");
        let host = match self.access.to(&self.server)? {
            Some(endpoint) => Host::at(endpoint),
            None => Host::open(&self.server, self.threads)?,
        };
        let mut connection = host.connect()?;
        check_server(&bodies, self.deadline, connection.welcome())?;
        progress.now(&format!("{} nodes:", mesh.node_count()));
        progress.watch(host.stage());
        let material = Material { young: self.young, poisson: self.poisson };
        let regions = regions_of(&mesh, &region_names, &self.regions.regions)?;
        let materials = materials(&mesh, &regions, material);
        let upload = ModelUpload::of_mesh(&mesh, 1, materials, self.element);
        give_model(&mut connection, &upload)?;
        let course = Course {
            mesh: &mesh,
            surface: &surface,
            model: upload.hash,
            bodies: &bodies,
            friction: self.friction,
            ask: self.ask(elasticity),
            whole: self.series.is_some(),
            fields: self.fields.of_contact(&mesh, self.has_fields_file())?,
        };
        let mut played = Played {
            names: bodies.bodies.iter().map(|body| body.name.clone()).collect(),
            end: bodies.end,
            object: (&mesh, own_nodes),
            steps: Vec::new(),
            series: self.series.as_deref().map(Series::create).transpose()?,
            last: None,
        };
        // A signal ends the press after the step that is being made, with the report.
        interruption::hear();
        let ended = course.play(&mut connection, |step| {
            progress.now(&format!("{:.3} of {:.3} s", step.time, bodies.end));
            played.add(step)
        });
        drop(progress);
        self.write(played, ended, (&mesh, elasticity), &bodies)
    }

    /// Writes the results of a press; where it ended before its time, those of the steps before.
    ///
    /// # Errors
    /// What ended the press, with its time, and files that cannot be written.
    fn write(
        &self,
        played: Played<'_>,
        ended: anyhow::Result<()>,
        (mesh, elasticity): (&TetMesh, Elasticity),
        bodies: &PressBodies,
    ) -> anyhow::Result<()> {
        let ended = ended.map_err(|error| played.when(error));
        if let Some(series) = played.series {
            series.finish()?;
        }
        if let (Some(path), Some(last), Ok(())) = (&self.out, &played.last, &ended) {
            write_file(path, &encode(path, played.object, last)?)?;
        }
        let has_steps = !played.steps.is_empty();
        let why = ended.as_ref().err().map(|error| format!("{error:#}"));
        let report = self.summary(mesh, played.steps, elasticity, why)?;
        if let Some(path) = self.report.as_ref().filter(|_| has_steps) {
            write_json(path, &report)?;
        }
        ended?;
        print(&report.told(bodies))
    }

    /// The mesh with the names of its regions, or what fills the surface; a surface and what was done to it are
    /// told.
    fn read_object(&self) -> anyhow::Result<(TetMesh, Vec<String>)> {
        match read_object_file(&self.mesh, NODES_DEFAULT)? {
            ObjectFile::Mesh(file) => Ok((file.mesh, file.findings.region_labels)),
            ObjectFile::Surface(surface) => {
                let doubt = surface.doubtful_unit().map(|doubt| {
                    format!("{doubt}: `glove-client fill {} --scale S` first", self.mesh.display())
                });
                for line in
                    [surface.told(&self.mesh)].into_iter().chain(surface.faults()).chain(doubt)
                {
                    eprintln!("glove-client: {line}");
                }
                Ok((surface.filled.mesh, Vec::new()))
            }
        }
    }

    /// Whether a file is written that can contain fields.
    fn has_fields_file(&self) -> bool {
        self.series.is_some() || self.out.as_ref().is_some_and(|path| is_vtu(path))
    }

    fn ask(&self, elasticity: Elasticity) -> ContactAsk {
        ContactAsk {
            seconds: self.step,
            gravity: self.gravity.into(),
            density: self.density,
            viscosity: self.viscosity,
            deformation: Some(elasticity.deformation),
            law: elasticity.law,
            yield_stress: elasticity.yield_stress,
            // The first step of a session finds nothing to go on with.
            path: PathChoice::Continue,
            deadline_ms: self.deadline,
            ..ContactAsk::default()
        }
    }

    fn summary(
        &self,
        mesh: &TetMesh,
        steps: Vec<StepReport>,
        elasticity: Elasticity,
        ended_early: Option<String>,
    ) -> anyhow::Result<PressReport> {
        let is_large = elasticity.deformation != Deformation::Linear;
        let most = |number: fn(&StepReport) -> f64| steps.iter().map(number).fold(0.0, f64::max);
        let quadratic = match mesh.mid_edge_nodes().is_empty() {
            true => None,
            false => Some(QuadraticMesh::try_new(mesh)?),
        };
        let volume: f64 = SpreadLoads::new(mesh, quadratic.as_ref()).nodal_volumes().iter().sum();
        Ok(PressReport {
            schema: SCHEMA,
            command: "press",
            mesh: self.mesh.display().to_string(),
            nodes: mesh.node_count(),
            tets: mesh.tets().len(),
            young: self.young,
            poisson: self.poisson,
            density: self.density,
            mass: self.density * volume,
            gravity: self.gravity.into(),
            friction: self.friction,
            viscosity: self.viscosity,
            element: self.element.as_str().to_owned(),
            deformation: elasticity.deformation.as_str(),
            material: is_large.then(|| elasticity.law.to_string()),
            yield_pa: elasticity.yield_stress,
            ended_early,
            steps_large: steps.iter().filter(|step| step.deformation == "large").count(),
            residual_rel_max: most(|step| step.residual_rel),
            steps_not_converged: steps.iter().filter(|step| !step.converged).count(),
            steps_late: steps.iter().filter(|step| step.late).count(),
            penetration_max: most(|step| step.penetration_max),
            contact_residual_rel_max: most(|step| step.contact_residual_rel),
            steps,
        })
    }
}

/// Steps of a press that have been made.
struct Played<'a> {
    /// Names of the bodies.
    names: Vec<String>,
    /// Time at which the press is to end, s.
    end: f64,
    /// Mesh, and how many of its nodes its file has.
    object: (&'a TetMesh, usize),
    steps: Vec<StepReport>,
    series: Option<Series>,
    last: Option<Step>,
}

impl Played<'_> {
    /// Keeps a step, and writes its file.
    fn add(&mut self, step: Step) -> anyhow::Result<()> {
        self.steps.push(StepReport::new(&step, &self.names));
        if let Some(series) = &mut self.series {
            let path = series.add(step.time);
            write_file(&path, &encode(&path, self.object, &step)?)?;
        }
        let is_before_the_end = step.time < self.end;
        self.last = Some(step);
        if is_before_the_end && interruption::asked() {
            bail!("a signal has ended it");
        }
        Ok(())
    }

    /// What ended the press, with its time.
    fn when(&self, error: anyhow::Error) -> anyhow::Error {
        match &self.last {
            None => error,
            Some(last) => error.context(format!(
                "the press ends after {}, at {:.3} of {:.3} s",
                steps(self.steps.len()),
                last.time,
                self.end
            )),
        }
    }
}

/// Uploads the model of the object.
fn give_model(connection: &mut ServerConnection, upload: &ModelUpload) -> Result<(), LinkError> {
    match connection.ask(&Request::UploadModel((*upload.message).clone()))? {
        Reply::ModelReady(_) => Ok(()),
        other => Err(unexpected("UploadModel", &other)),
    }
}

/// Displacement of every node from rest to its position in the world after a step, m.
fn world_displacement(mesh: &TetMesh, step: &Step) -> Vec<[f64; 3]> {
    let world_from_object = isometry_of(&step.answer.state.pose);
    let moved = |(rest, u): (&Point3<f64>, &[f64; 3])| {
        let place = world_from_object * Point3::new(rest.x + u[0], rest.y + u[1], rest.z + u[2]);
        [place.x - rest.x, place.y - rest.y, place.z - rest.z]
    };
    mesh.vertices().iter().zip(&step.displacement).map(moved).collect()
}

/// File of a step: a table of the nodes that the mesh file has, or a mesh with all nodes.
fn encode(
    path: &Path,
    (mesh, own_nodes): (&TetMesh, usize),
    step: &Step,
) -> anyhow::Result<Vec<u8>> {
    let whole = world_displacement(mesh, step);
    if !is_vtu(path) {
        return Ok(write_displacements(&whole[..own_nodes]).into_bytes());
    }
    let vectors = [
        NodeVectors { name: "displacement", unit: "m", values: &whole },
        NodeVectors { name: "elastic_displacement", unit: "m", values: &step.displacement },
    ];
    let turn = isometry_of(&step.answer.state.pose).rotation;
    let fields = step.answer.answer.fields.first().cloned();
    let fields = fields.map(|fields| in_world(fields, &turn));
    encode_fields(mesh, &[], &vectors, fields.as_ref()).context("cannot form the VTU file")
}
