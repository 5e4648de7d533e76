//! Loads of frame questions that are kept with a model: what each of them does to the held shape.

use std::sync::Arc;

use nalgebra::Vector3;
use softgrasp_core::fem::SpreadLoadError;
use softgrasp_core::model::{Model, ModelError};
use softgrasp_core::solve::condensed::{
    Base, Columns, Contact, ContactColumns, ContactSet, LoadColumn, LoadedSet, UnitLoad,
};

use super::recent::Recent;
use crate::lock::Lock;

/// One load of unit amount, by what it is made of.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum UnitKey {
    /// One newton on a node along x, y or z.
    Node { node: u32, axis: usize },
    /// Weight under an acceleration of 1 m/s² along x, y or z; densities in kg/m³.
    Weight { densities: Vec<f64>, axis: usize },
    /// Pressures in Pa on triangles of the boundary.
    Pressures(Vec<(f64, Vec<[u32; 3]>)>),
    /// Forces in N by degree of freedom, ascending.
    Forces(Vec<(u32, f64)>),
}

/// Loads of one frame question: unit loads, and how much of each acts.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct FrameLoads {
    pub units: Vec<UnitKey>,
    pub amounts: Vec<f64>,
}

impl FrameLoads {
    /// Adds so much of a unit load.
    pub fn add(&mut self, unit: UnitKey, amount: f64) {
        self.units.push(unit);
        self.amounts.push(amount);
    }
}

/// Columns and contact sets of the loads that were asked about last.
#[derive(Default)]
pub(super) struct KeptLoads {
    columns: Lock<Recent<KeptColumn>>,
    sets: Lock<Recent<KeptLoaded>>,
}

struct KeptColumn {
    key: UnitKey,
    column: Arc<LoadColumn>,
}

struct KeptLoaded {
    units: Vec<UnitKey>,
    loaded: Arc<LoadedSet>,
}

/// Largest number of loads kept for each model: weight along three axes and some pressures.
const COLUMNS_MAX: usize = 16;
/// Largest number of contact sets with loads kept for each model.
const SETS_MAX: usize = 8;

impl KeptLoads {
    /// The contact set with the loads, if it is kept.
    pub fn set_for(&self, set: &Arc<ContactSet>, units: &[UnitKey]) -> Option<Arc<LoadedSet>> {
        let is_it = |kept: &KeptLoaded| Arc::ptr_eq(kept.loaded.set(), set) && kept.units == units;
        self.sets.with(|sets| sets.find(is_it).map(|kept| Arc::clone(&kept.loaded)))
    }

    /// Makes the contact set with the loads and keeps it: a solve for each load that is new, three for
    /// each node.
    ///
    /// # Errors
    /// [`ModelError`] for a load that does not fit the model.
    pub fn make_set(
        &self,
        (model, base, columns): (&Model, &Base, &Columns),
        set: &Arc<ContactSet>,
        units: &[UnitKey],
    ) -> Result<Arc<LoadedSet>, ModelError> {
        let of_nodes = of_nodes(base, columns, units)?;
        let load = |key: &UnitKey| match *key {
            UnitKey::Node { node, axis } => {
                let contact = Contact::Node(node);
                let found = of_nodes.iter().find(|columns| columns.contact == contact);
                let columns = Arc::clone(found.expect("columns of every node were asked for"));
                Ok(UnitLoad::Node { columns, axis })
            }
            _ => self.column(model, base, key).map(UnitLoad::Forces),
        };
        let loads = units.iter().map(load).collect::<Result<Vec<UnitLoad>, ModelError>>()?;
        let loaded = Arc::new(LoadedSet::new(base, Arc::clone(set), loads));
        self.sets.with(|sets| {
            sets.retain(|kept| !Arc::ptr_eq(kept.loaded.set(), set) || kept.units != units);
            sets.push(KeptLoaded { units: units.to_vec(), loaded: Arc::clone(&loaded) });
            sets.shorten(SETS_MAX);
        });
        Ok(loaded)
    }

    fn column(
        &self,
        model: &Model,
        base: &Base,
        key: &UnitKey,
    ) -> Result<Arc<LoadColumn>, ModelError> {
        let is_it = |kept: &KeptColumn| kept.key == *key;
        let kept = self.columns.with(|all| all.find(is_it).map(|kept| Arc::clone(&kept.column)));
        if let Some(kept) = kept {
            return Ok(kept);
        }
        let column = Arc::new(LoadColumn::try_new(base, &unit_forces(model, key)?)?);
        self.columns.with(|all| {
            // Two frames at once may have made the same column.
            all.retain(|kept| kept.key != *key);
            all.push(KeptColumn { key: key.clone(), column: Arc::clone(&column) });
            all.shorten(COLUMNS_MAX);
        });
        Ok(column)
    }

    /// Bytes of all that is kept.
    pub fn bytes(&self) -> usize {
        let columns: usize =
            self.columns.with(|all| all.iter().map(|kept| kept.column.bytes()).sum());
        columns + self.sets.with(|sets| sets.iter().map(|kept| kept.loaded.bytes()).sum::<usize>())
    }

    /// Drops the contact sets, which can be made again.
    pub fn drop_sets(&self) {
        self.sets.with(Recent::clear);
    }

    /// Drops the columns, which can be made again.
    pub fn drop_columns(&self) {
        self.columns.with(Recent::clear);
    }
}

/// Columns of the nodes that forces act on, each once.
fn of_nodes(
    base: &Base,
    columns: &Columns,
    units: &[UnitKey],
) -> Result<Vec<Arc<ContactColumns>>, ModelError> {
    let mut nodes: Vec<u32> = units
        .iter()
        .filter_map(|key| match key {
            UnitKey::Node { node, .. } => Some(*node),
            _ => None,
        })
        .collect();
    nodes.dedup();
    let contacts: Vec<Contact> = nodes.into_iter().map(Contact::Node).collect();
    Ok(columns.of_contacts(base, &contacts)?)
}

/// Forces of one unit of a load, 3N, N.
fn unit_forces(model: &Model, key: &UnitKey) -> Result<Vec<f64>, SpreadLoadError> {
    let body = model.spread_loads();
    let mut forces = vec![0.0; 3 * model.system_node_count()];
    match key {
        UnitKey::Node { node, axis } => forces[3 * *node as usize + axis] = 1.0,
        UnitKey::Weight { densities, axis } => {
            let mut along = Vector3::zeros();
            along[*axis] = 1.0;
            return body.weight(densities, along);
        }
        UnitKey::Pressures(all) => {
            for (pressure, triangles) in all {
                let pressed = body.pressure(triangles, *pressure)?;
                forces.iter_mut().zip(pressed).for_each(|(sum, f)| *sum += f);
            }
        }
        UnitKey::Forces(of_dofs) => {
            of_dofs.iter().for_each(|&(dof, force)| forces[dof as usize] = force);
        }
    }
    Ok(forces)
}
