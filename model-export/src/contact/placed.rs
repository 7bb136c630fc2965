//! Where the indenter of a simulation in a dataset stands, in the finger's frame.

use crate::ExportError;
use crate::dataset::Dataset;
use papilla_contact::Object;
use papilla_dataset::{IndentationEntry, Shard};
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::scene::Pose;
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_proto::atlas::Patch;
use papilla_proto::sdf::{IndenterSpec, Placement, SignedDistance, TouchError, first_touch_travel};
use std::sync::Arc;

/// An indenter on its way into the finger.
pub(crate) struct Placed {
    shape: Arc<dyn SignedDistance>,
    first_touch: Placement,
    direction: [f64; 3],
}

impl Placed {
    /// As the dataset's simulations place it: on graded meshes by the skin itself, on the even
    /// lattice by its nodes. `None` if it passes the finger.
    pub(crate) fn at_first_touch(
        dataset: &Dataset,
        indentation: &IndentationEntry,
        shard: &Shard,
    ) -> Result<Option<Self>, ExportError> {
        let path = dataset.shard_path(indentation);
        let bad = |reason: String| ExportError::DatasetFile { path: path.clone(), reason };
        let Some(spec) = dataset.indenter(indentation) else {
            return Err(bad("the manifest does not say what pressed".into()));
        };
        let papilla_dataset::Pose { pitch_deg, roll_deg, yaw_deg } = indentation.pose;
        let pose = Pose { pitch_deg, roll_deg, yaw_deg };
        let straight = Approach::straight(spec, pose).map_err(|error| bad(error.to_string()))?;
        let approach = Approach { offset_mm: indentation.offset_mm, ..straight };
        if shard.cells.is_some() {
            return Ok(Self::on_skin(approach, dataset.shape()?));
        }
        let touch = on_vertices(dataset, spec, &approach);
        let shape = approach.shape;
        Ok(touch.map(|(first_touch, direction)| Self { shape, first_touch, direction }))
    }

    /// Where it first touches the skin of a finger of this shape. `None` if it passes the finger.
    pub(super) fn on_skin(approach: Approach, finger: &FingertipShape) -> Option<Self> {
        let touch = approach.contact_with(finger, &Drive::Depths(vec![]))?;
        let (first_touch, direction) = (touch.start, touch.direction);
        Some(Self { shape: approach.shape, first_touch, direction })
    }

    /// Its way in, a unit vector.
    pub(crate) fn direction(&self) -> [f64; 3] {
        self.direction
    }

    /// It at a depth from there, slid along its own x and y.
    pub(crate) fn at(&self, depth_mm: f64, slide_mm: [f64; 2]) -> Object {
        let mut placement = self.first_touch;
        for i in 0..3 {
            let [x, y, _] = placement.rotation[i];
            placement.origin_mm[i] +=
                depth_mm * self.direction[i] + slide_mm[0] * x + slide_mm[1] * y;
        }
        Object::rigid(Arc::clone(&self.shape), placement)
    }
}

/// Where it first touches one of the atlas' vertices, and its way.
fn on_vertices(
    dataset: &Dataset,
    spec: &IndenterSpec,
    approach: &Approach,
) -> Option<(Placement, [f64; 3])> {
    let Approach { shape, pose, offset_mm: [a, b], .. } = approach;
    let mut placement = Placement::turned(pose.pitch_deg, pose.roll_deg, pose.yaw_deg, [0.0; 3]);
    let axis = |k: usize| [0, 1, 2].map(|i| placement.rotation[i][k]);
    let (x, y, normal) = (axis(0), axis(1), axis(2));
    let skin = &dataset.atlas().patch(Patch::Skin).positions_mm;
    let points: Vec<[f64; 3]> = skin.iter().map(|p| p.map(f64::from)).collect();
    let along = |p: &[f64; 3]| (0..3).map(|i| p[i] * normal[i]).sum::<f64>();
    let least = points.iter().map(along).fold(f64::INFINITY, f64::min);
    let touching: Vec<_> = points.iter().filter(|p| along(p) <= least + 1e-5).collect();
    let top_mm = spec.top_mm();
    placement.origin_mm = std::array::from_fn(|i| {
        let first = touching.iter().map(|p| p[i]).sum::<f64>() / touching.len() as f64;
        first - top_mm * normal[i] + a * x[i] + b * y[i]
    });
    let travel_mm = match first_touch_travel(shape.as_ref(), &placement, normal, &points) {
        Ok(travel_mm) => travel_mm,
        // Inside by the rounding of positions to f32: there already.
        Err(TouchError::StartsInside { by_mm }) if by_mm < 1e-4 => 0.0,
        Err(_) => return None,
    };
    placement.origin_mm = std::array::from_fn(|i| placement.origin_mm[i] + travel_mm * normal[i]);
    Some((placement, normal))
}
