//! The solver of a finger: contact at vertices, and on pixels if the hello asks for it.

use std::sync::Arc;

use papilla_contact::{
    Contact, ContactError, ContactModel, Displacement, NetForce, Person, PixelContact, Scene,
    Settings, Solver,
};
use papilla_proto::{ErrorCode, Hello, Problem};
use papilla_session_state::{Reader, StateError, Writer};

use super::{Skin, announced, method::Chosen, unusable, warm_start};

/// Contact of one finger by the method of its hello.
pub(crate) struct FingerSolver {
    solver: Solver,
    pixels: Option<PixelContact>,
    has_friction: bool,
    /// If the hello asks for it.
    displacement: Option<Displacement>,
}

impl FingerSolver {
    pub(crate) fn new(
        hello: &Hello,
        skin: Skin<'_>,
        model: &Arc<ContactModel>,
        chosen: &Chosen,
        person: Person,
    ) -> Result<Self, Problem> {
        let stiffness = hello.stiffness == Some(true);
        let has_friction = announced::has_friction(hello);
        let method = chosen.at_vertices();
        let settings = Settings { method, person, stiffness, friction: has_friction };
        let solver = Solver::new(Arc::clone(model), settings);
        // Pixels are chosen only where there is skin for them.
        let pixels = chosen
            .pixel_spacing()
            .zip(skin.pixels)
            .map(|(spacing, skin)| PixelContact::new(Arc::clone(skin), model, spacing));
        let solver = solver.map_err(|error| of_contact(&error))?;
        let displacement = hello.displacement == Some(true);
        let displacement = displacement.then(|| Displacement::new(&solver));
        Ok(Self { solver, pixels, has_friction, displacement })
    }

    /// Finds what presses; returns how far things travelled to meet a net force, mm.
    pub(crate) fn solve(
        &mut self,
        scene: Scene<'_>,
        net: Option<NetForce>,
        out: &mut Contact,
    ) -> Result<f64, ContactError> {
        let Self { solver, pixels, .. } = self;
        match (pixels, scene, net) {
            (Some(pixels), Scene::Objects(objects), Some(net)) => {
                solver.solve_for_force_on_pixels(objects, net, pixels, out)
            }
            (Some(pixels), Scene::Objects(objects), None) => {
                solver.solve_on_pixels(objects, pixels, out).map(|()| 0.0)
            }
            (_, scene, Some(net)) => solver.solve_for_force(scene, net, out),
            (_, scene, None) => solver.solve(scene, out).map(|()| 0.0),
        }
    }

    /// Fills in how far each vertex of the skin has moved in the last frame, mm, if the hello asks.
    pub(crate) fn displace(&mut self, out: &Contact, moved_mm: &mut [[f32; 3]]) {
        let Self { solver, pixels, displacement, .. } = self;
        if let Some(displacement) = displacement {
            displacement.fill(solver, pixels.as_ref(), out, moved_mm);
        }
    }

    /// The pixels, if the hello asks for them.
    pub(crate) fn pixels(&self) -> Option<&PixelContact> {
        self.pixels.as_ref()
    }

    /// Writes what the next frame starts from.
    pub(crate) fn save(&self, state: &mut Writer) {
        let memory = self.solver.memory();
        warm_start::write(&memory, state);
        if self.has_friction {
            warm_start::write_anchors(&memory.anchors, state);
        }
        if let Some(pixels) = &self.pixels {
            warm_start::write_pixels(&pixels.memory(), state);
        }
    }

    /// Goes on from what a solver of the same hello has saved.
    pub(crate) fn restore(&mut self, state: &mut Reader<'_>) -> Result<(), StateError> {
        let mut memory = warm_start::read(state)?;
        if self.has_friction {
            memory.anchors = warm_start::read_anchors(state)?;
        }
        let mut fits = self.solver.recall(&memory);
        if let Some(pixels) = &mut self.pixels {
            fits &= pixels.recall(&warm_start::read_pixels(state)?);
        }
        if fits { Ok(()) } else { Err(StateError::Value("a warm start")) }
    }
}

/// What a client is told of what stopped a solve.
pub(crate) fn of_contact(error: &ContactError) -> Problem {
    let field = match error {
        ContactError::Value { member, .. } => (*member).to_owned(),
        ContactError::Rotation { object, .. } => format!("objects[{object}].quaternion"),
        ContactError::Gaps { .. } => "payload".to_owned(),
        ContactError::Depth { vertex, .. } => format!("depth_mm[{vertex}]"),
        ContactError::Moved { vertex, .. } => format!("velocity_mm_per_s[{vertex}]"),
        ContactError::Force { .. } => "force_n".to_owned(),
        ContactError::Friction(_) => "method".to_owned(),
        ContactError::Diverged => {
            return Problem::new(ErrorCode::BadContact, error.to_string());
        }
    };
    unusable(field, error.to_string())
}
