//! What is asked, and what is told about a frame.

/// A request.
#[derive(serde::Deserialize)]
#[serde(tag = "ask", rename_all = "kebab-case")]
pub enum Request {
    /// Version of the peer.
    About,
    /// All frames of a scene.
    Play(Box<Scene>),
}

/// A scene; lengths in m, forces in N.
#[derive(serde::Deserialize)]
pub struct Scene {
    /// Mass of the ball, kg, and its radius.
    pub mass: f64,
    pub radius: f64,
    /// Nodes, tetrahedra and their material; `None` for a rigid ball.
    pub soft: Option<Soft>,
    pub friction: f64,
    /// Where the springs of both tips hold them when each frame begins, and when the last ends.
    pub tips: Vec<[[f64; 3]; 2]>,
    pub tip: Tip,
    pub settings: Settings,
}

/// A fingertip and its spring.
#[derive(serde::Deserialize)]
pub struct Tip {
    pub radius: f64,
    pub mass: f64,
    pub stiffness: f64,
    pub damping: f64,
}

/// A soft ball.
#[derive(serde::Deserialize)]
pub struct Soft {
    pub points: Vec<[f64; 3]>,
    pub tets: Vec<[u32; 4]>,
    /// Mass of each node, kg.
    pub masses: Vec<f64>,
    pub young: f64,
    pub poisson: f64,
    /// `fem` or `constraints`.
    pub solver: String,
    pub damping_ratio: f64,
    pub skin: f64,
}

/// Settings of a step; what is `None` stays as it comes.
#[derive(serde::Deserialize)]
pub struct Settings {
    /// Steps in a frame of a sixtieth of a second.
    pub substeps: u32,
    pub solver_iterations: Option<usize>,
    pub pgs_iterations: Option<usize>,
    pub stabilization_iterations: Option<usize>,
    pub length_unit: Option<f64>,
    pub contact_frequency: Option<f64>,
    pub contact_damping_ratio: Option<f64>,
    /// Degrees of freedom up to which the matrix of a soft body is factored.
    pub factored_dofs: Option<usize>,
    /// Steps of conjugate gradients beyond that, and where they may end.
    pub linear_iterations: Option<usize>,
    pub linear_tolerance: Option<f64>,
}

/// What is told about a frame.
#[derive(serde::Serialize)]
pub struct Told {
    /// Time on the clock, and of all processors together.
    pub ms: f64,
    pub cpu_ms: f64,
    pub height: f64,
    pub tips: [[f64; 3]; 2],
    /// Places of the nodes of a soft ball.
    pub points: Vec<[f64; 3]>,
}
