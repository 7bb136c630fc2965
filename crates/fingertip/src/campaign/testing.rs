//! Campaigns that tests of this crate and of others share.

use super::{CampaignSpec, Candidate, DepthRange, PoseRanges};
use crate::geometry::fingertip::FingertipShape;
use crate::mesh::fingertip::{Density, Order};
use crate::scene::effects::usual;
use crate::scene::{Friction, TissueTable};
use papilla_sdf::{IndenterSpec, Plate, Sphere};
use std::path::PathBuf;

/// Seven indentations by a plate, two depths each.
#[must_use]
pub fn spec() -> CampaignSpec {
    CampaignSpec {
        name: "test".into(),
        seed: 3,
        presses: 7,
        depths_mm: vec![0.25, 0.5],
        depths: None,
        test_fraction: Some(0.3),
        test_one_in: None,
        density: Density::Coarse,
        order: Order::Linear,
        finger: None,
        finger_sha256: None,
        shape: FingertipShape::default(),
        effects: usual(),
        materials: TissueTable::default(),
        friction: Friction::default(),
        indenter: Some(IndenterSpec::default()),
        indenters: Vec::new(),
        pose: PoseRanges { pitch_deg: [0.0, 45.0], roll_deg: [-30.0, 30.0], yaw_deg: [0.0, 0.0] },
        offset_mm: [[0.0; 2]; 2],
        slide: None,
        folder: PathBuf::new(),
    }
}

/// An indenter of a campaign that has several.
fn candidate(name: &str, share: u32, indenter: IndenterSpec) -> Candidate {
    let name = name.into();
    Candidate { name, share, indenter, pose: None, offset_mm: None, depths: None }
}

/// Three indenters, one with a turn, an offset and depths of its own.
#[must_use]
pub fn several() -> CampaignSpec {
    let ball = Candidate {
        pose: Some(PoseRanges { pitch_deg: [10.0, 20.0], roll_deg: [0.0; 2], yaw_deg: [5.0; 2] }),
        offset_mm: Some([[-2.0, 2.0], [1.0, 1.0]]),
        depths: Some(DepthRange { deepest_mm: [1.0, 1.5], states: 3 }),
        ..candidate("ball", 2, IndenterSpec::Sphere(Sphere::default()))
    };
    let plate = candidate("plate", 1, IndenterSpec::default());
    let small = Plate { size_mm: [6.0, 6.0], edge_radius_mm: 0.5 };
    let small = candidate("small plate", 1, IndenterSpec::Plate(small));
    CampaignSpec { presses: 64, indenter: None, indenters: vec![plate, ball, small], ..spec() }
}
