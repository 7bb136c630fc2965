//! An indenter in its pose, brought to where it first touches the skin, and how it touches there.

use super::body::{Body, SimulationError, rotation};
use super::drive::{Approach, Drive, FORCE_TRAVEL_MAX_MM};
use super::missed;
use crate::geometry::fingertip::FingertipShape;
use crate::indenter::IndenterError;
use crate::mesh::grading::{Coming, Contact};
use papilla_fem::contact::{ContactRule, ContactSurface};
use papilla_fem::mesh::Mesh;
use papilla_fem::solve::MovingIndenter;
use papilla_sdf::{Placement, SignedDistance, first_touch_travel};
use papilla_vector::norm;

/// Part of a face's width that may be in the indenter before a node touches: a ball as wide
/// as four faces has a sixteenth, a knife comes to a half.
const UNSEEN_MAX: f64 = 0.4;
/// Least width of an indenter with nodal contact, in distances of nodes: rows of them slip off a
/// narrower one.
const NODAL_WIDTH_MIN: f64 = 2.5;
/// Depth that a lattice is graded for where a force says how deep the indenter goes, mm.
const GRADED_DEPTH_MM: f64 = 1.5;

impl Approach {
    /// Where the indenter first touches the undeformed finger and how deep it goes; `None` if it
    /// passes it.
    #[must_use]
    pub fn contact_with(&self, finger: &FingertipShape, drive: &Drive) -> Option<Contact> {
        let (mut depths_mm, mut slides_mm) = (Vec::new(), Vec::new());
        match drive {
            Drive::Depths(depths) => depths_mm.clone_from(depths),
            Drive::Forces(_) => depths_mm.push(GRADED_DEPTH_MM),
            Drive::Shares(_) => {}
            Drive::Path(points) => {
                depths_mm.extend(points.iter().map(|p| p.depth_mm).filter(|d| *d > 0.0));
                depths_mm.sort_by(f64::total_cmp);
                depths_mm.dedup();
                slides_mm.extend(
                    points.iter().map(|p| p.shift_mm).filter(|s| s.iter().any(|v| *v != 0.0)),
                );
            }
        }
        let coming = Coming {
            shape: &self.shape,
            rotation: rotation(self.pose),
            top_mm: self.top_mm,
            offset_mm: self.offset_mm,
            depths_mm,
            slides_mm,
        };
        Contact::new(finger, &coming)
    }
}

impl Body {
    /// The indenter at first touch, on its way.
    ///
    /// # Errors
    /// [`SimulationError::Indenter`] if it never touches.
    pub fn indenter(
        &self,
        approach: &Approach,
        drive: &Drive,
    ) -> Result<MovingIndenter, SimulationError> {
        let rotation = self.rotation(approach.pose);
        let axis = |k: usize| [rotation[0][k], rotation[1][k], rotation[2][k]];
        let (x, y, normal) = (axis(0), axis(1), axis(2));
        let contact = self.contact_rule(approach);
        let start = match &self.first_touch {
            Some(contact) => contact.start,
            None => self.start(approach, contact)?,
        };
        self.sees(approach.shape.as_ref(), &start)?;
        let offset = |depth: f64, shift: [f64; 2]| -> [f64; 3] {
            std::array::from_fn(|i| depth * normal[i] + shift[0] * x[i] + shift[1] * y[i])
        };
        let straight = |travel: f64| vec![(1.0, normal.map(|v| v * travel))];
        let path = match drive {
            Drive::Depths(depths) => straight(depths.last().copied().unwrap_or(0.0)),
            Drive::Forces(_) => straight(FORCE_TRAVEL_MAX_MM),
            Drive::Shares(_) => straight(0.0),
            Drive::Path(points) => {
                let end = points.last().map_or(1.0, |p| p.time_s);
                points.iter().map(|p| (p.time_s / end, offset(p.depth_mm, p.shift_mm))).collect()
            }
        };
        Ok(MovingIndenter { shape: approach.shape.clone(), start, path, contact })
    }

    /// The indenter where it first touches a point of the mesh that can touch.
    fn start(
        &self,
        approach: &Approach,
        contact: ContactRule,
    ) -> Result<Placement, SimulationError> {
        let rotation = self.rotation(approach.pose);
        let axis = |k: usize| [rotation[0][k], rotation[1][k], rotation[2][k]];
        let (x, y, normal) = (axis(0), axis(1), axis(2));
        let along = |p: &[f64; 3]| p[0] * normal[0] + p[1] * normal[1] + p[2] * normal[2];
        let first = first_touch(&self.problem.mesh, &self.contact, along);
        let [a, b] = approach.offset_mm;
        let mut start = Placement {
            rotation,
            origin_mm: std::array::from_fn(|i| {
                first[i] - approach.top_mm * normal[i] + a * x[i] + b * y[i]
            }),
        };
        let points = self.contact_points_mm(contact);
        let travel = first_touch_travel(approach.shape.as_ref(), &start, normal, &points).map_err(
            |error| {
                let narrow = self.spacings(approach) < NODAL_WIDTH_MIN;
                let apart_mm = self.spacing_mm().filter(|_| narrow);
                missed::why(approach.shape.as_ref(), (&start, normal), &points, apart_mm, error)
            },
        )?;
        // A plate's face is there already, to rounding.
        if travel.abs() > 1e-12 * points.iter().map(|p| norm(*p)).fold(0.0, f64::max) {
            for i in 0..3 {
                start.origin_mm[i] += travel * normal[i];
            }
        }
        Ok(start)
    }

    /// Where on the skin contact is to be found: at Gauss points if the indenter is too narrow for
    /// nodes; at nodes if it is not, or so narrow that faces would lose it too.
    fn contact_rule(&self, approach: &Approach) -> ContactRule {
        if self.graded {
            return approach.contact.unwrap_or(ContactRule::GaussOrder3);
        }
        let spacings = self.spacings(approach);
        approach.contact.unwrap_or(match (1.0..NODAL_WIDTH_MIN).contains(&spacings) {
            true => ContactRule::Gauss,
            false => ContactRule::Nodal,
        })
    }

    /// Whether contact that is nodal could be at Gauss points.
    pub(super) fn can_take_gauss_points(&self, approach: &Approach) -> bool {
        let spacings = self.spacings(approach);
        approach.contact.is_none() && spacings >= NODAL_WIDTH_MIN && spacings.is_finite()
    }

    /// Whether contact at Gauss points could be at those of order 3:
    /// quadratic faces have them already.
    pub(super) fn can_take_order_3(&self, approach: &Approach) -> bool {
        let more = |c: &ContactSurface| {
            c.points(ContactRule::GaussOrder3).len() > c.points(ContactRule::Gauss).len()
        };
        self.contact_rule(approach) == ContactRule::Gauss
            && self.problem.contact.as_ref().is_some_and(more)
    }

    /// Width of an indenter over the distance of the skin's nodes.
    fn spacings(&self, approach: &Approach) -> f64 {
        self.spacing_mm().map_or(f64::INFINITY, |mm| approach.shape.narrowest_mm() / mm)
    }

    /// Distance of the skin's nodes, mm; none without a skin that may touch.
    fn spacing_mm(&self) -> Option<f64> {
        self.problem.contact.as_ref().map(ContactSurface::spacing_mm)
    }

    /// Width of an indenter and distance of nodes, mm, if contact is at nodes though the indenter is
    /// narrower than they are apart.
    pub(crate) fn too_narrow_mm(&self, approach: &Approach) -> Option<[f64; 2]> {
        let narrow = self.spacings(approach) < 1.0;
        let is_nodal = self.contact_rule(approach) == ContactRule::Nodal;
        let spacing_mm = self.spacing_mm().filter(|_| narrow && is_nodal && !self.plane)?;
        Some([approach.shape.narrowest_mm(), spacing_mm])
    }

    /// Undeformed points of the skin that can touch, mm.
    fn contact_points_mm(&self, rule: ContactRule) -> Vec<[f64; 3]> {
        let at = &self.problem.mesh.nodes;
        match &self.problem.contact {
            Some(c) if rule.is_gauss() => {
                c.points(rule).iter().map(|(support, _)| support.of(|n| at[n])).collect()
            }
            _ => self.problem.mesh.surfaces[&self.contact]
                .nodes()
                .iter()
                .map(|&n| at[n as usize])
                .collect(),
        }
    }

    /// Refuses an indenter of which, at first touch of a node, a face's middle or an edge's is
    /// already deep inside: contact is at nodes and would never see what fits between.
    fn sees(&self, shape: &dyn SignedDistance, start: &Placement) -> Result<(), IndenterError> {
        let mesh = &self.problem.mesh;
        let surface = &mesh.surfaces[&self.contact];
        let corners = surface.kind.corners();
        let at = |n: u32| mesh.nodes[n as usize];
        let mut worst = (0.0, 1.0);
        let mut look = |p: [f64; 3], width: f64| {
            let inside = -start.clearance_mm(shape, p);
            if inside / width > worst.0 / worst.1 {
                worst = (inside, width);
            }
        };
        for face in surface.faces() {
            let mut longest = 0.0f64;
            for k in 0..corners {
                let (a, b) = (at(face[k]), at(face[(k + 1) % corners]));
                let length = norm(std::array::from_fn(|i| a[i] - b[i]));
                look(std::array::from_fn(|i| 0.5 * (a[i] + b[i])), length);
                longest = longest.max(length);
            }
            let corner = |i: usize| face[..corners].iter().map(move |&n| at(n)[i]);
            look(std::array::from_fn(|i| corner(i).sum::<f64>() / corners as f64), longest);
        }
        let (by_mm, face_mm) = worst;
        if by_mm > UNSEEN_MAX * face_mm {
            return Err(IndenterError::FinerThanMesh { by_mm, face_mm });
        }
        Ok(())
    }
}

/// Skin point with the smallest `along`; where several tie (a flat plate on a
/// symmetric finger), their mean, so that a mirrored pose touches at the mirror
/// image.
fn first_touch(mesh: &Mesh, contact: &str, along: impl Fn(&[f64; 3]) -> f64) -> [f64; 3] {
    let nodes = mesh.surfaces[contact].nodes();
    let points: Vec<_> = nodes.iter().map(|&n| mesh.nodes[n as usize]).collect();
    let least = points.iter().map(&along).fold(f64::INFINITY, f64::min);
    let scale = points.iter().map(|p| norm(*p)).fold(0.0, f64::max);
    let touching: Vec<_> = points.iter().filter(|p| along(p) <= least + 1e-12 * scale).collect();
    let count = touching.len() as f64;
    std::array::from_fn(|i| touching.iter().map(|p| p[i]).sum::<f64>() / count)
}
