//! Chen, Shuai & Zhu's section under a flat plate, in plane strain.
//!
//! Planar elements on both sides: CalculiX makes bricks of its own, but ties
//! their layers to each other, so that its unknowns are as many as ours. A slab of
//! bricks in the deck would have three times as many.

use super::indentation::{CPU_SHARE, Pressing, Tolerance};
use super::ours::Cards;
use super::{Check, Context};
use papilla_calculix::{
    ElementTypes, MaterialCard, QuadraticHex, RigidIndenter, RigidShape, StepControl,
};
use papilla_fem::contact::ContactRule;
use papilla_fem::element::ElementKind;
use papilla_fingertip::geometry::section::SectionShape;
use papilla_fingertip::mesh::fingertip::{Density, Parts};
use papilla_fingertip::mesh::section::{Extent, build};
use papilla_fingertip::scene::TissueTable;
use papilla_fingertip::scene::effects::{Law, Plan};
use papilla_fingertip::tissue::Tissue;
use papilla_sdf::{Placement, RoundedPlate};
use papilla_validation::verify::CaseError;
use std::sync::Arc;

const DEPTH_MM: f64 = 1.0;
/// Half sides of the plate, mm; its edges do not touch.
const PLATE: RoundedPlate = RoundedPlate { half_mm: [10.0, 10.0, 2.0], edge_radius_mm: 0.0 };
const TOLERANCE: Tolerance = Tolerance { force: 5e-3, displacement: 5e-3, sed: 2e-2, limit: None };

pub(super) fn run(context: &Context<'_>) -> Result<Vec<Check>, CaseError> {
    let mut rows = Vec::new();
    for (law, quadratic, name, job) in [
        (Law::NeoHookean, QuadraticHex::C3d20r, "neo-Hookean, Quad9, CPE8R", "section-neo"),
        (Law::Ogden, QuadraticHex::C3d20r, "Ogden, Quad9, CPE8R", "section-ogden"),
        (Law::Linear, QuadraticHex::C3d20, "linear, Quad9, CPE8", "section-linear"),
    ] {
        rows.extend(pressing(law, quadratic, name, job)?.rows(context));
    }
    Ok(rows)
}

fn pressing<'a>(
    law: Law,
    quadratic: QuadraticHex,
    name: &'a str,
    job: &'a str,
) -> Result<Pressing<'a>, CaseError> {
    let shape = SectionShape::default();
    let section =
        build(&shape, Parts::default(), Density::Medium, ElementKind::Quad9, Extent::Half)?;
    let fixed = section.fixed();
    // Its own +z presses towards +y, from the pad's lowest point.
    let start = Placement {
        rotation: [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
        origin_mm: [0.0, -0.5 * shape.height_mm - PLATE.half_mm[2], 0.0],
    };
    let RoundedPlate { half_mm, edge_radius_mm } = PLATE;
    Ok(Pressing {
        job,
        name,
        mesh: section.mesh,
        cards: cards(law)?,
        fixed,
        contact: "skin",
        indenter: RigidIndenter {
            shape: RigidShape::Plate { half_mm, edge_radius_mm },
            start,
            path: vec![(1.0, [0.0, DEPTH_MM, 0.0])],
        },
        shape: Arc::new(PLATE),
        rule: ContactRule::Nodal,
        types: ElementTypes { quadratic, ..ElementTypes::default() },
        interface: [Tissue::Dermis, Tissue::Epidermis],
        steps: 1,
        first: StepControl::default().first,
        tolerance: TOLERANCE,
        cpu_share: CPU_SHARE,
    })
}

/// The design's tissues.
fn cards(law: Law) -> Result<Cards, CaseError> {
    let (table, plan) = (TissueTable::default(), Plan { law, ..Plan::usual() });
    let mut cards = [const { None }; Tissue::ALL.len()];
    for tissue in Tissue::ALL {
        cards[tissue.index()] = Some(MaterialCard::of(table.of(tissue), &plan)?);
    }
    Ok(cards)
}
