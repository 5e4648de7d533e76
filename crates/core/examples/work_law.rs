//! How many operations and numbers a factor of `K11` takes on meshes of several shapes and sizes,
//! counted by `FrontAnalysis`, beside the law that estimates them from the number of nodes.
//!
//! `work_law [NODES…]`, default 500 2000 8000; counts are exact, so any machine will do.
#![allow(clippy::print_stdout, reason = "a table on standard output is what it is for")]

use softgrasp_core::fem::Material;
use softgrasp_core::mesh::{BuiltIn, generate};
use softgrasp_core::model::{Element, Model};
use softgrasp_core::solve::{FrontAnalysis, Partition};

fn main() {
    let sizes: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let sizes = if sizes.is_empty() { vec![500, 2000, 8000] } else { sizes };
    println!(
        "shape       element   nodes  tets  blocks/node  flops/N^2  entries/N^4/3  peak/entries"
    );
    for shape in [BuiltIn::Cube, BuiltIn::Sphere, BuiltIn::Strawberry, BuiltIn::Toothpaste] {
        for &size in &sizes {
            // Ten-node systems are eight times as large.
            let all = Element::ALL.into_iter();
            for element in all.filter(|e| *e == Element::Tet4 || size <= 8000) {
                let mesh = generate(shape, size).expect("a size in range");
                let material = Material::try_new(1.0, 0.3).expect("in range");
                let tets = mesh.tets().len();
                let corners = mesh.node_count();
                let model = Model::try_new(mesh, element, &[material], vec![], &mut |_| {})
                    .expect("a model");
                let used: Vec<bool> =
                    (0..model.system_node_count()).map(|n| model.is_used(n)).collect();
                let known: Vec<u32> = (0..15).collect();
                let partition = Partition::try_new(&used, &known).expect("nodes are there");
                let analysis = FrontAnalysis::new(model.stiffness(), &partition);
                let nodes = model.system_node_count() as f64;
                let stored = (analysis.factor_bytes::<f64>() / 8) as f64;
                println!(
                    "{shape:?} {element:?} {corners:6} {nodes:6} {tets:6} {:6.1} {:8.1} {:8.1} {:6.2}",
                    model.stiffness().pattern().block_count() as f64 / nodes,
                    analysis.flops() / nodes.powi(2),
                    stored / nodes.powf(4.0 / 3.0),
                    (analysis.peak_bytes::<f64>() / 8) as f64 / stored,
                );
            }
        }
    }
}
