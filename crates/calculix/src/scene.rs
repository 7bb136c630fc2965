//! From a scene to a deck.

use super::{
    Deck, ElementTypes, ExportError, Indentation, MaterialCard, RigidIndenter, RigidShape,
    StepControl, refuse_inexpressible,
};
use papilla_fingertip::scene::{Scene, TissueError};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_fingertip::simulation::drive::Drive;
use papilla_fingertip::tissue::Tissue;
use papilla_sdf::{IndenterSpec, RoundedPlate};

/// A scene set up for our solver, and what a deck of it needs.
pub struct SceneDeck {
    /// The scene as our solver takes it.
    pub setup: Simulation,
    /// What CalculiX takes the tissues for.
    pub cards: [Option<MaterialCard>; Tissue::ALL.len()],
    /// What presses.
    pub indenter: RigidIndenter,
    /// Load fractions of the stored states.
    pub outputs: Vec<f64>,
}

/// Why there is no deck of a scene.
#[derive(Debug, thiserror::Error)]
pub enum SceneDeckError {
    /// The scene cannot be set up.
    #[error(transparent)]
    Press(#[from] SimulationError),
    /// CalculiX cannot express it.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// A material is out of range.
    #[error(transparent)]
    Material(#[from] TissueError),
}

impl SceneDeck {
    /// Sets up a scene. Ogden's law goes into a deck as it is: CalculiX has no
    /// continuation outside the calibrated stretches.
    ///
    /// # Errors
    /// [`SceneDeckError`] names what cannot be built or expressed.
    pub fn new(scene: &Scene) -> Result<Self, SceneDeckError> {
        refuse_inexpressible(scene)?;
        let shape = RigidShape::of(&scene.indenter)?;
        let setup = Simulation::new(scene)?;
        let outputs = match &setup.drive {
            Drive::Depths(depths) => {
                let last = depths.last().copied().unwrap_or(1.0);
                depths.iter().map(|d| d / last).collect()
            }
            Drive::Path(points) => {
                let last = points.last().map_or(1.0, |p| p.time_s);
                points.iter().map(|p| p.time_s / last).collect()
            }
            Drive::Forces(_) => return Err(ExportError::Force.into()),
            Drive::Shares(_) => return Err(ExportError::Pressure.into()),
        };
        let mut cards = [const { None }; Tissue::ALL.len()];
        for tissue in Tissue::ALL {
            let spec = scene.materials.of(setup.plan.tissues[tissue.index()]);
            let card = MaterialCard::of(spec, &setup.plan)
                .map_err(|source| TissueError::Material { tissue: tissue.name(), source })?;
            cards[tissue.index()] = Some(card);
        }
        let moving = setup.body.indenter(&setup.approach, &setup.drive)?;
        let indenter = RigidIndenter { shape, start: moving.start, path: moving.path };
        let problem = &setup.body.problem;
        let nodes = problem.mesh.surfaces[&setup.body.contact].nodes();
        indenter.refuse_ends(nodes.iter().map(|&n| problem.mesh.nodes[n as usize]))?;
        Ok(Self { setup, cards, indenter, outputs })
    }

    /// The deck.
    #[must_use]
    pub fn deck<'a>(&'a self, title: &'a str, types: ElementTypes) -> Deck<'a> {
        let problem = &self.setup.body.problem;
        Deck {
            title,
            mesh: &problem.mesh,
            materials: &self.cards,
            fixed: &problem.fixed,
            prescribed_mm: &[],
            press: Some(Indentation {
                contact: &self.setup.body.contact,
                indenter: self.indenter.clone(),
                stiffness_mpa_per_mm: None,
            }),
            types,
            step: StepControl { outputs: self.outputs.clone(), ..StepControl::default() },
        }
    }
}

impl RigidShape {
    /// The shape of a scene's indenter.
    ///
    /// # Errors
    /// [`ExportError::Indenter`] names a shape that is none of these.
    pub fn of(spec: &IndenterSpec) -> Result<Self, ExportError> {
        match spec {
            IndenterSpec::Plate(plate) => {
                let RoundedPlate { half_mm, edge_radius_mm } = plate.into();
                Ok(Self::Plate { half_mm, edge_radius_mm })
            }
            IndenterSpec::Sphere(sphere) => Ok(Self::Sphere { radius_mm: sphere.radius_mm }),
            IndenterSpec::Cylinder(c) => Ok(Self::Cylinder {
                radius_mm: c.radius_mm,
                half_length_mm: 0.5 * c.length_mm - c.end_radius_mm,
            }),
            other => Err(ExportError::Indenter { shape: other.name() }),
        }
    }
}
