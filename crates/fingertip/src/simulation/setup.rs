//! From a scene to a body and an indenter.

use super::body::{Body, SimulationError};
use super::drive::{Approach, Drive, DrivePoint, Visit};
use super::laws::solids;
use super::section::SectionSpec;
use crate::indenter::IndenterError;
use crate::mesh::fingertip::Order;
use crate::scene::{Geometry, Layer, Motion, Plan, Pose, Pressure, Scene};
use crate::tissue::Tissue;
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::block::{BlockLattice, build as build_block, even};
use papilla_fem::solve::Options;

/// A scene ready to run: everything that it is solved with.
pub struct Simulation {
    /// What is going to be simulated.
    pub plan: Plan,
    /// The body.
    pub body: Body,
    /// The indenter.
    pub approach: Approach,
    /// What is stored.
    pub drive: Drive,
}

impl Simulation {
    /// Meshes and sets up what a scene describes, the indenter at first touch.
    ///
    /// # Errors
    /// [`SimulationError`] names what cannot be built, and the line of the scene that is
    /// to blame.
    pub fn new(scene: &Scene) -> Result<Self, SimulationError> {
        Self::build(scene).map_err(|e| e.at(scene))
    }

    /// Finds the equilibria of the whole motion; `observer` is called with the solver at each
    /// stored state and its record.
    ///
    /// # Errors
    /// As [`Body::press`].
    pub fn run(&self, observer: Visit<'_>) -> Result<(), SimulationError> {
        let mut solver = self.body.solver(Options::default())?;
        self.body.press(&mut solver, &self.approach, &self.drive, 1, observer)
    }

    fn build(scene: &Scene) -> Result<Self, SimulationError> {
        let plan = scene.plan()?;
        if let Some(pressure) = &scene.pressure {
            return Self::under(scene, plan, pressure);
        }
        let approach = Approach {
            shape: scene.indenter.build(&scene.folder).map_err(IndenterError::from)?,
            top_mm: scene.indenter.top_mm(),
            pose: scene.motion.pose(),
            offset_mm: scene.motion.offset_mm,
            friction: plan.friction,
            contact: scene.contact,
        };
        let drive = drive(&scene.motion);
        let body = body(scene, &plan, &approach, &drive)?.filled(&scene.materials, &plan)?;
        // An indenter that never touches is found now, not after files are written.
        let indenter = body.indenter(&approach, &drive)?;
        if let (Drive::Depths(depths_mm), Some(room_mm)) = (&drive, body.room_mm(&indenter))
            && let Some(&depth_mm) = depths_mm.last()
            && depth_mm >= room_mm
        {
            return Err(IndenterError::BeyondBone { depth_mm, room_mm }.into());
        }
        Ok(Self { plan, body, approach, drive })
    }
}

impl Simulation {
    /// Of a scene that is pressed by a map.
    fn under(scene: &Scene, plan: Plan, pressure: &Pressure) -> Result<Self, SimulationError> {
        let map_pa = pressure.map_pa(&scene.folder)?;
        let Geometry::Fingertip { density, order, shape, .. } = &scene.geometry else {
            // Refused when the scene was read.
            return Err(SimulationError::Empty);
        };
        let materials = solids(&scene.materials, &plan)?;
        let mesh = (*density, *order, plan.parts);
        let body = Body::fingertip_under(shape, materials, mesh, &map_pa)?;
        if !body.under.as_ref().is_some_and(|under| under.presses) {
            let message = "none of its pressure is on the skin: the pixels that have some lie off the \
                           atlas' finger, or between the points of the mesh (docs/reference/atlas.md \
                           shows which pixels are skin)";
            return Err(pressure.cannot(message.into()).into());
        }
        let n = pressure.increments;
        let shares = (1..=n).map(|i| i as f64 / n as f64).collect();
        let approach = Approach::plate(Pose::default());
        Ok(Self { plan, body, approach, drive: Drive::Shares(shares) })
    }
}

fn body(
    scene: &Scene,
    plan: &Plan,
    approach: &Approach,
    drive: &Drive,
) -> Result<Body, SimulationError> {
    let materials = solids(&scene.materials, plan)?;
    match &scene.geometry {
        Geometry::Fingertip { density, order, shape, .. } => {
            let contact = (*order == Order::Graded).then(|| approach.contact_with(shape, drive));
            Body::fingertip(
                shape,
                materials,
                *density,
                *order,
                plan.parts,
                contact.flatten().as_ref(),
            )
        }
        Geometry::Block { size_mm, elements, layers, order } => {
            let lattice = block_lattice(*size_mm, *elements, layers, *order);
            let mesh = build_block(&lattice, |p| p);
            Body::from_mesh(mesh, materials, &["z_max".into()], "z_min")
        }
        Geometry::Section { density, order, extent, shape } => {
            let mesh = SectionSpec { shape, density: *density, order: *order, extent: *extent };
            Body::section(&mesh, materials, plan.parts)
        }
        Geometry::Mesh { file, fixed, contact } => {
            let mesh = papilla_fem::mesh::gmsh::read_file(
                &scene.folder.join(file),
                &Tissue::ALL.map(Tissue::name),
            )?;
            if mesh.is_planar() != plan.plane_strain {
                return Err(SimulationError::Plane {
                    file: file.clone(),
                    planar: mesh.is_planar(),
                });
            }
            let mesh = papilla_fem::mesh::complete::for_contact(mesh, contact);
            Body::from_mesh(mesh, materials, fixed, contact)
        }
    }
}

fn block_lattice(
    size: [f64; 2],
    elements: [usize; 2],
    layers: &[Layer],
    order: Order,
) -> BlockLattice {
    let (step, kind) = match order {
        Order::Linear => (1, ElementKind::Hex8),
        Order::Quadratic | Order::Graded => (2, ElementKind::Hex27),
    };
    let mut z = vec![0.0];
    let mut regions = Vec::new();
    for layer in layers {
        let bottom = z.last().copied().unwrap_or(0.0);
        let inside = even(layer.thickness_mm, layer.elements * step);
        z.extend(inside[1..].iter().map(|t| bottom + t));
        regions.extend(std::iter::repeat_n(layer.tissue.region(), layer.elements));
    }
    let [x, y] = std::array::from_fn(|i| even(size[i], elements[i] * step));
    BlockLattice { axes: [x, y, z], layers: regions, kind }
}

/// States that a motion stores.
fn drive(motion: &Motion) -> Drive {
    let n = motion.increments;
    let steps = |last: f64| (1..=n).map(|i| last * i as f64 / n as f64).collect();
    if let Some(path) = &motion.path {
        let mut points = Vec::new();
        let mut from = DrivePoint::default();
        for p in path {
            let to = DrivePoint { time_s: p.time_s, depth_mm: p.depth_mm, shift_mm: p.shift_mm };
            points.extend((1..n).map(|i| from.towards(&to, i, n)));
            points.push(to);
            from = to;
        }
        return Drive::Path(points);
    }
    match (motion.depth_mm, motion.force_n) {
        (Some(depth), _) => Drive::Depths(steps(depth)),
        (None, force) => Drive::Forces(steps(force.unwrap_or(0.0))),
    }
}
