//! Compares the evaluation by rows with tract's of the same graph, before it is used.

use super::{Found, MapModel};
use crate::{EngineError, MAP_LEN, MAP_SIDE_PX, Model, ModelInfo, trial_map};
use std::sync::Arc;

/// Greatest difference between the answers that counts as rounding, relative to the greatest value.
///
/// The trial maps go far beyond the pressures of any training, where sums that nearly cancel round most:
/// of the shipped networks `small` differs most, by 1.02e-5. From the pressures of finite elements both
/// agree to 1e-5 (the cards' `onnxruntime_difference_max`). A network that is read wrongly differs by
/// parts of a hundred.
pub(super) const DIFFERENCE_MAX: f32 = 3e-5;

/// How a model is to be run.
pub(crate) enum Preferred {
    Plain(Arc<dyn Model>),
    /// By rows. The plain graph is not kept.
    ByRows(Box<ModelInfo>, Found),
}

impl Preferred {
    /// The model. A model that is run by rows is laid out in memory of the calling thread.
    pub(crate) fn into_model(self) -> Arc<dyn Model> {
        match self {
            Self::Plain(model) => model,
            Self::ByRows(info, found) => Arc::new(MapModel::new(*info, found.runner())),
        }
    }
}

/// Chooses the evaluation by rows if its answers are those of the plain graph, else the plain
/// graph.
///
/// # Errors
/// A session cannot be made.
pub(crate) fn prefer(
    plain: Arc<dyn Model>,
    networks: Option<Found>,
) -> Result<Preferred, EngineError> {
    let Some(networks) = networks else {
        if plain.info().network["kind"] == "map_net" {
            let model = &plain.info().name;
            tracing::warn!(model, "not the graph of a network on maps; tract runs it as it stands");
        }
        return Ok(Preferred::Plain(plain));
    };
    let by_rows = MapModel::new(plain.info().clone(), networks.runner());
    let name = &plain.info().name;
    let mut due = vec![0.0; MAP_LEN];
    let mut found = vec![0.0; MAP_LEN];
    let (mut plainly, mut session) = (plain.session()?, by_rows.session()?);
    for pressure_pa in trials(plain.info().pressure_max_pa) {
        let difference = plainly
            .infer(&pressure_pa, &mut due)
            .and_then(|()| session.infer(&pressure_pa, &mut found))
            .map(|()| difference(&found, &due));
        match difference {
            Ok(difference) if difference <= DIFFERENCE_MAX => {}
            Ok(difference) => {
                tracing::warn!(
                    model = name,
                    difference,
                    "evaluated by rows it answers otherwise; tract runs the graph as it stands"
                );
                return Ok(Preferred::Plain(plain));
            }
            Err(error) => {
                tracing::warn!(model = name, %error, "tract runs the graph as it stands");
                return Ok(Preferred::Plain(plain));
            }
        }
    }
    tracing::debug!(model = name, "evaluated by rows");
    Ok(Preferred::ByRows(Box::new(plain.info().clone()), networks))
}

/// The greatest difference, relative to the greatest value of `due`.
pub(super) fn difference(found: &[f32], due: &[f32]) -> f32 {
    let greatest = due.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
    let apart = found.iter().zip(due).map(|(a, b)| (a - b).abs());
    apart.fold(0.0, f32::max) / greatest
}

/// The trial maps: a round contact, pressure all over the map, two contacts, and single pixels at
/// the map's corners and in its middle.
pub(super) fn trials(max_pa: f32) -> [Vec<f32>; 4] {
    let round = trial_map(max_pa);
    let whole = (0..MAP_LEN).map(|i| 0.1 * max_pa * (0.2 + (i % 7) as f32)).collect();
    let mut two = vec![0.0; MAP_LEN];
    for (to, from) in [(30, 0), (150, 7)] {
        for row in 0..30 {
            for column in 0..30 {
                let place = (to + row) * MAP_SIDE_PX + to + from + column;
                two[place] = 0.01 * max_pa * (1 + (row * column) % 13) as f32;
            }
        }
    }
    let mut pixels = vec![0.0; MAP_LEN];
    let last = MAP_SIDE_PX - 1;
    for (row, column) in [(0, 0), (0, last), (last, 0), (last, last), (113, 110)] {
        pixels[row * MAP_SIDE_PX + column] = max_pa;
    }
    [round, whole, two, pixels]
}
