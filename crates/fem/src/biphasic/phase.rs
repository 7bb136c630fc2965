//! The fluid of a body: where it is, its unknowns, its forces and its share of the tangent.

use super::element::{CORNERS_MAX, Flowing, Interpolation, NODES_MAX};
use super::{Permeability, PermeabilityError};
use crate::element::{BlockGeometry, ElementKind, Inverted, Materials, Region};
use crate::linear::{
    Coupling, DofMap, SaddleSystem, SymbolicError, SymbolicSystem, SymmetricMatrix,
};
use crate::mesh::Mesh;

/// What is to be known of a body's fluid.
#[derive(Clone, Debug, Default)]
pub struct FluidSpec {
    /// Permeability by [`Region::index`]; `None` for tissue without fluid.
    pub permeability: Vec<Option<Permeability>>,
    /// Name of the surface through which fluid leaves freely, touched or not; every other is
    /// sealed.
    pub drained: Option<String>,
}

/// Why a body cannot be biphasic.
#[derive(Debug, thiserror::Error)]
pub enum FluidError {
    /// A permeability out of range.
    #[error("region {}: {source}", region.0)]
    Permeability {
        /// Region.
        region: Region,
        /// What is wrong.
        source: PermeabilityError,
    },
    /// Fluid that cannot move to a surface where it has to.
    #[error(
        "region {} has permeability 0 and a drained surface: its pressure would have to be 0 there and \
         could not fall anywhere else; give it a permeability or seal the surface", region.0
    )]
    ShutBehindDrain {
        /// Region.
        region: Region,
    },
    /// Elements that cannot carry displacement and pressure.
    #[error(
        "{kind:?} elements lock or oscillate when they are full of fluid: take quadratic ones (Hex27, Tet10, \
         Quad9)"
    )]
    Linear {
        /// Their kind.
        kind: ElementKind,
    },
    /// Cells of different size side by side.
    #[error("pressure is not continuous where cells are halved: take a mesh without hanging nodes")]
    Hanging,
    /// A drained surface on tissue without fluid.
    #[error(
        "no element at the drained surface '{0}' has a permeability: nothing can leave there; give the tissue \
         below it one or seal the surface"
    )]
    DryDrain(String),
    /// No region has a permeability.
    #[error("no element has a permeability: there is no fluid")]
    NoFluid,
    /// A surface is missing.
    #[error("the mesh has no surface named '{0}' to be drained")]
    Missing(String),
    /// The system has no structure.
    #[error(transparent)]
    Structure(#[from] SymbolicError),
}

/// Displacement and pressure at the end of a step, and where it began.
#[derive(Clone, Copy, Debug)]
pub struct Flow<'a> {
    /// Pressure, MPa, one a pressure unknown.
    pub pressure_mpa: &'a [f64],
    /// Displacement of the nodes at the start of the step, mm.
    pub start_mm: &'a [[f64; 3]],
    /// The step before; `None` for backward Euler.
    pub older: Option<Older<'a>>,
}

/// The step before a step.
#[derive(Clone, Copy, Debug)]
pub struct Older<'a> {
    /// Displacement of the nodes at its start, mm.
    pub start_mm: &'a [[f64; 3]],
    /// Length of the present step over its length.
    pub ratio: f64,
}

/// The fluid of a body.
pub struct FluidPhase {
    permeability: Vec<Option<Permeability>>,
    /// By block; `None` where none of it has fluid.
    interpolation: Vec<Option<Interpolation>>,
    /// Elements with fluid: block and element, in the order of `couplings`.
    elements: Vec<[u32; 2]>,
    /// Unknown of each node; [`DofMap::FIXED`] where pressure is 0 or there is none.
    unknown: Vec<u32>,
    count: usize,
    /// Displacement and pressure together.
    pub system: SaddleSystem,
}

/// Called with an element's number, its nodes and what flows in it.
type Visit<'a> = &'a mut dyn FnMut(usize, &[u32], &Flowing<'_>) -> Result<(), Inverted>;

impl FluidPhase {
    /// The fluid of a body whose displacements have `system`.
    ///
    /// # Errors
    /// See [`FluidError`].
    pub fn new(mesh: &Mesh, system: &SymbolicSystem, spec: FluidSpec) -> Result<Self, FluidError> {
        let FluidSpec { permeability, drained } = spec;
        for (r, k) in permeability.iter().enumerate() {
            if let Some(Err(source)) = k.map(|k| k.validate()) {
                return Err(FluidError::Permeability { region: Region(r as u8), source });
            }
        }
        if !mesh.hanging.is_empty() {
            return Err(FluidError::Hanging);
        }
        let of = |region: Region| permeability.get(region.index()).copied().flatten();
        let mut interpolation = Vec::new();
        let mut elements = Vec::new();
        for (b, block) in mesh.blocks.iter().enumerate() {
            let wet: Vec<_> = (0..block.len()).filter(|&e| of(block.region[e]).is_some()).collect();
            let by_kind =
                || Interpolation::new(block.kind).ok_or(FluidError::Linear { kind: block.kind });
            interpolation.push(if wet.is_empty() { None } else { Some(by_kind()?) });
            elements.extend(wet.iter().map(|&e| [b as u32, e as u32]));
        }
        if elements.is_empty() {
            return Err(FluidError::NoFluid);
        }
        let outlet = outlet(mesh, drained.as_deref())?;
        let (mut unknown, mut count) = (vec![DofMap::FIXED; mesh.nodes.len()], 0);
        let mut has_pressure = vec![false; mesh.nodes.len()];
        for &[b, e] in &elements {
            let block = &mesh.blocks[b as usize];
            let region = block.region[e as usize];
            let shut = of(region).is_some_and(|k| k.at_rest_mm4_per_n_s == 0.0);
            let corners = interpolation[b as usize].as_ref().map_or(0, |i| i.corners);
            for &n in &block.element(e as usize)[..corners] {
                if shut && outlet[n as usize] {
                    return Err(FluidError::ShutBehindDrain { region });
                }
                has_pressure[n as usize] = true;
            }
        }
        if let (Some(name), false) =
            (drained, (0..outlet.len()).any(|n| outlet[n] && has_pressure[n]))
        {
            return Err(FluidError::DryDrain(name));
        }
        for n in (0..unknown.len()).filter(|&n| has_pressure[n] && !outlet[n]) {
            unknown[n] = count;
            count += 1;
        }
        let coupling = |&[b, e]: &[u32; 2]| {
            let nodes = mesh.blocks[b as usize].element(e as usize);
            let corners = interpolation[b as usize].as_ref().map_or(0, |i| i.corners);
            let dofs = nodes.iter().flat_map(|&n| (0..3).map(move |i| 3 * n as usize + i));
            Coupling {
                displacement: dofs.map(|d| system.dofs.of_dof[d]).collect(),
                pressure: nodes[..corners].iter().map(|&n| unknown[n as usize]).collect(),
            }
        };
        let couplings: Vec<_> = elements.iter().map(coupling).collect();
        let count = count as usize;
        let system = SaddleSystem::new(system, &couplings, count)?;
        Ok(Self { permeability, interpolation, elements, unknown, count, system })
    }

    /// Number of pressure unknowns.
    #[must_use]
    pub const fn unknowns(&self) -> usize {
        self.count
    }

    /// Pressure at every node of `mesh`, MPa, by the pressure unknowns; 0 where there is no fluid or
    /// it leaves.
    #[must_use]
    pub fn at_nodes_mpa(&self, mesh: &Mesh, pressure_mpa: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; mesh.nodes.len()];
        for &[b, e] in &self.elements {
            let nodes = mesh.blocks[b as usize].element(e as usize);
            let Some(interpolation) = &self.interpolation[b as usize] else { continue };
            let corners = self.corners(interpolation, nodes, pressure_mpa);
            for (&n, factors) in nodes.iter().zip(&interpolation.at_nodes) {
                out[n as usize] = factors.iter().zip(&corners).map(|(f, p)| f * p).sum();
            }
        }
        out
    }

    /// Pressure of an element's corners, MPa.
    fn corners(
        &self,
        interpolation: &Interpolation,
        nodes: &[u32],
        pressure_mpa: &[f64],
    ) -> [f64; CORNERS_MAX] {
        let mut pressure = [0.0; CORNERS_MAX];
        for (p, &n) in pressure.iter_mut().zip(&nodes[..interpolation.corners]) {
            let unknown = self.unknown[n as usize] as usize;
            *p = pressure_mpa.get(unknown).copied().unwrap_or(0.0);
        }
        pressure
    }

    /// Visits the elements with fluid: their number, nodes and flow.
    fn visit(
        &self,
        body: Solid<'_>,
        u: &[[f64; 3]],
        flow: Flow<'_>,
        dt_s: f64,
        visit: Visit<'_>,
    ) -> Result<(), (usize, usize, Inverted)> {
        let [mut end, mut start, mut older] = [[[0.0; 3]; NODES_MAX]; 3];
        for (at, &[b, e]) in self.elements.iter().enumerate() {
            let (b, e) = (b as usize, e as usize);
            let block = &body.mesh.blocks[b];
            let (nodes, region) = (block.element(e), block.region[e]);
            let (Some(interpolation), Some(permeability)) =
                (&self.interpolation[b], self.permeability[region.index()])
            else {
                continue;
            };
            for (a, &n) in nodes.iter().enumerate() {
                (end[a], start[a]) = (u[n as usize], flow.start_mm[n as usize]);
                older[a] = flow.older.map_or([0.0; 3], |o| o.start_mm[n as usize]);
            }
            let pressure = self.corners(interpolation, nodes, flow.pressure_mpa);
            let flowing = Flowing {
                geometry: body.geometry[b].element(e),
                interpolation,
                permeability,
                finite: body.materials[region].is_finite_strain(),
                u: &end[..nodes.len()],
                start: &start[..nodes.len()],
                older: flow.older.map(|o| (&older[..nodes.len()], o.ratio)),
                pressure,
                dt_s,
            };
            visit(at, nodes, &flowing).map_err(|i| (b, e, i))?;
        }
        Ok(())
    }

    /// Adds the pressure's forces (N, three a node) and, if given, its geometric stiffness;
    /// overwrites `surplus_mm3` with what the unknowns' volumes are off by.
    pub(crate) fn add(
        &self,
        body: Solid<'_>,
        u: &[[f64; 3]],
        flow: Flow<'_>,
        dt_s: f64,
        out: FluidForces<'_>,
    ) -> Result<(), (usize, usize, Inverted)> {
        let FluidForces { force_n, surplus_mm3, mut tangent } = out;
        surplus_mm3.clear();
        surplus_mm3.resize(self.count, 0.0);
        let mut dense = Vec::new();
        self.visit(body, u, flow, dt_s, &mut |at, nodes, flowing| {
            let mut force = [[0.0; 3]; NODES_MAX];
            let mut surplus = [0.0; CORNERS_MAX];
            let corners = flowing.interpolation.corners;
            let geometric = tangent.is_some() && flowing.finite;
            dense.clear();
            dense.resize(if geometric { 9 * nodes.len() * nodes.len() } else { 0 }, 0.0);
            flowing.points(&mut |point| {
                point.add_force(&mut force[..nodes.len()]);
                point.add_surplus(&flowing.pressure, &mut surplus[..corners]);
                if geometric {
                    point.add_geometric(&mut dense);
                }
            })?;
            for (&n, f) in nodes.iter().zip(&force) {
                for i in 0..3 {
                    force_n[3 * n as usize + i] += f[i];
                }
            }
            for (&n, s) in nodes[..corners].iter().zip(surplus) {
                if let Some(sum) = surplus_mm3.get_mut(self.unknown[n as usize] as usize) {
                    *sum += s;
                }
            }
            if let (Some((system, t)), true) = (tangent.as_mut(), geometric) {
                let [b, e] = self.elements[at];
                system.add_element(t, b as usize, e as usize, &mut dense);
            }
            Ok(())
        })
    }

    /// Puts the tangent of displacement and pressure together; `own` is the displacements'.
    pub(crate) fn assemble(
        &self,
        body: Solid<'_>,
        u: &[[f64; 3]],
        flow: Flow<'_>,
        dt_s: f64,
        own: (&SymbolicSystem, &SymmetricMatrix),
        matrix: &mut SymmetricMatrix,
    ) -> Result<(), (usize, usize, Inverted)> {
        self.system.set_displacements(own.0, own.1, matrix);
        let (mut coupled, mut between) = (Vec::new(), Vec::new());
        self.visit(body, u, flow, dt_s, &mut |at, nodes, flowing| {
            let corners = flowing.interpolation.corners;
            coupled.clear();
            coupled.resize(corners * 3 * nodes.len(), 0.0);
            between.clear();
            between.resize(corners * corners, 0.0);
            flowing.points(&mut |p| p.add_coupling(corners, &mut coupled, &mut between))?;
            self.system.add(matrix, at, &coupled, &between);
            Ok(())
        })
    }

    /// Work, mJ, that the mean of two pressures does on what volumes change by in a step: what
    /// fluid loses by friction as it flows.
    pub(crate) fn lost_mj(
        &self,
        body: Solid<'_>,
        u: &[[f64; 3]],
        flow: Flow<'_>,
        before_mpa: &[f64],
    ) -> f64 {
        let mean: Vec<f64> =
            before_mpa.iter().zip(flow.pressure_mpa).map(|(a, b)| 0.5 * (a + b)).collect();
        let flow = Flow { pressure_mpa: &mean, older: None, ..flow };
        let mut lost = 0.0;
        let visited = self.visit(body, u, flow, 0.0, &mut |_, _, flowing| {
            flowing.points(&mut |p| lost -= p.weight * p.pressure * p.growth)
        });
        // An equilibrium has no inverted element; NaN would show one.
        visited.map_or(f64::NAN, |()| lost)
    }
}

/// The solid that the fluid is in.
#[derive(Clone, Copy)]
pub(crate) struct Solid<'a> {
    pub mesh: &'a Mesh,
    pub geometry: &'a [BlockGeometry],
    pub materials: &'a Materials,
}

/// Where the fluid's forces go.
pub(crate) struct FluidForces<'a> {
    pub force_n: &'a mut [f64],
    pub surplus_mm3: &'a mut Vec<f64>,
    pub tangent: Option<(&'a SymbolicSystem, &'a mut SymmetricMatrix)>,
}

/// Nodes at which fluid leaves.
fn outlet(mesh: &Mesh, drained: Option<&str>) -> Result<Vec<bool>, FluidError> {
    let mut outlet = vec![false; mesh.nodes.len()];
    let Some(name) = drained else { return Ok(outlet) };
    let missing = || FluidError::Missing(name.into());
    let surface = mesh.surfaces.get(name).ok_or_else(missing)?;
    surface.nodes().iter().for_each(|&n| outlet[n as usize] = true);
    Ok(outlet)
}
