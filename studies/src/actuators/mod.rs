//! Drives of an array of pins, found by formula and by inversion, against the presses that they are
//! to show.

mod report;
mod state;

pub use report::markdown;

use papilla_actuators::{Array, HalfSpace, Inverse, Pin};
use papilla_dataset::Split;
use papilla_engine::{EngineError, Model, Session};
use papilla_model_export::dataset::Dataset;
use papilla_model_export::metrics::quantile;
use papilla_model_export::picture::{Picture, sheet};
use papilla_model_export::{ExportError, evaluate};
use papilla_output::canvas::Canvas;
use papilla_proto::MAP_LEN;
use papilla_proto::atlas::Patch;
use papilla_session_effects::{Finger, Shared};
use serde::Serialize;
use state::{Formula, Work};

/// Why an array is not measured.
#[derive(Debug, thiserror::Error)]
pub enum ActuatorsError {
    /// Of the dataset, a network, or a picture.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// An array cannot be.
    #[error("pins {pitch_mm} mm apart: {reason}")]
    Pins {
        /// Distance of the pins, mm.
        pitch_mm: f32,
        /// What is wrong with it.
        reason: String,
    },
}

/// A way to a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Way {
    /// The formula, with the gain that is the median of the best ones of all states.
    Formula,
    /// The formula, with the best gain of each state.
    FormulaBest,
    /// Least squares on magnitudes of strain.
    Magnitudes,
    /// Gauss-Newton on SED, begun from there.
    Fitted,
    /// The same, corrected once by the network.
    Corrected,
    /// Corrected ten times.
    Settled,
}

impl Way {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Formula,
        Self::FormulaBest,
        Self::Magnitudes,
        Self::Fitted,
        Self::Corrected,
        Self::Settled,
    ];

    /// Name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Formula => "`formula`, one gain for all states",
            Self::FormulaBest => "`formula`, the best gain of each state",
            Self::Magnitudes => "magnitudes, linear",
            Self::Fitted => "`fitted`: SED, Gauss-Newton",
            Self::Corrected => "`corrected`: and once by the network",
            Self::Settled => "corrected ten times",
        }
    }
}

/// Figures of a way; pairs are median and 95th percentile.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The way.
    pub way: Way,
    /// Relative L2 of SED.
    pub relative_l2: [f64; 2],
    /// The same of its means over the pins.
    pub means: [f64; 2],
    /// Relative error of the greatest SED.
    pub peak: [f64; 2],
    /// Processor time of a frame without the network, us; none where it is another row's.
    pub us: Option<[f64; 2]>,
}

/// An array on a dataset.
#[derive(Clone, Debug, Serialize)]
pub struct Table {
    /// Campaign.
    pub set: String,
    /// States that were taken.
    pub states: usize,
    /// Distance of the pins, mm; their reach is half of it.
    pub pitch_mm: f32,
    /// Number of pins.
    pub pins: usize,
    /// Relative L2 of what the judge makes of the press itself.
    pub judge: [f64; 2],
    /// Processor time of the network that corrects, us.
    pub network_us: [f64; 2],
    /// Its ways.
    pub rows: Vec<Row>,
}

/// The networks that take part.
#[derive(Clone, Copy)]
pub struct Networks<'a> {
    /// What the session answers with, and corrects by.
    pub served: &'a dyn Model,
    /// What tells the SED of a drive.
    pub judge: &'a dyn Model,
}

/// Pins on a flat grid along and across the finger, projected onto the pad from below.
#[must_use]
pub fn grid(dataset: &Dataset, pitch_mm: f32, max_pa: f32) -> Vec<Pin> {
    let places = &dataset.ground.position_mm;
    let pad = |i: &usize| dataset.ground.mask[*i] && places[*i][2] < 0.0;
    let pad: Vec<usize> = (0..MAP_LEN).filter(pad).collect();
    let reach = |axis: usize| {
        let all = pad.iter().map(|&i| (places[i][axis] / pitch_mm).round() as i32);
        all.clone().min().unwrap_or(0)..=all.max().unwrap_or(-1)
    };
    let mut pins = Vec::new();
    for x in reach(0) {
        for y in reach(1) {
            let at = [x as f32 * pitch_mm, y as f32 * pitch_mm];
            let off = |i: &usize| (places[*i][0] - at[0]).hypot(places[*i][1] - at[1]);
            let nearest = pad.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
            // No pixel is farther from its neighbour on the pad.
            if let Some(&i) = nearest.filter(|i| off(i) < 0.15) {
                pins.push(Pin { pixel: i as u32, reach_mm: 0.5 * pitch_mm, max_pa });
            }
        }
    }
    pins
}

/// What a state was taken for: the truth, and what each way came to.
struct State {
    heading: String,
    truth: Vec<f32>,
    means: Vec<f32>,
    best_gain: f32,
    /// Of SED, of its peak and of its means over the pins, by way; none where SED is zero.
    errors: [Option<[f64; 3]>; Way::ALL.len()],
    corrected_pa: Vec<f32>,
}

/// Measures an array on the held-out states of a dataset, every `every`th, and draws the state of
/// median error.
///
/// # Errors
/// [`ActuatorsError`] of the dataset, a network, or the array.
pub fn measure(
    dataset: &Dataset,
    networks: Networks<'_>,
    pitch_mm: f32,
    every: usize,
) -> Result<(Table, Canvas), ActuatorsError> {
    let Networks { served, judge } = networks;
    for model in [served, judge] {
        evaluate::require_atlas(dataset.name(), dataset.atlas().hash(), model.info())?;
    }
    let pins = grid(dataset, pitch_mm, served.info().pressure_max_pa);
    let [skin, interface] = [Patch::Skin, Patch::Interface].map(|patch| dataset.maps.raster(patch));
    let refused = |reason: String| ActuatorsError::Pins { pitch_mm, reason };
    let array = Array::new(dataset.atlas(), [skin, interface], &pins, HalfSpace::SHIPPED)
        .map_err(|error| refused(error.to_string()))?;
    let shared = Shared::default();
    let finger = Finger { atlas: dataset.atlas(), skin, interface, shared: &shared };
    let formula = Formula::new(finger, &pins).map_err(|problem| refused(problem.message))?;
    let mut work = Work {
        dataset,
        formula,
        inverse: Inverse::new(array),
        served: started(served)?,
        judge: started(judge)?,
        judge_name: judge.info().name.clone(),
        max_pa: served.info().pressure_max_pa,
        press_pa: vec![0.0; MAP_LEN],
        wanted: vec![0.0; MAP_LEN],
        pins_pa: vec![0.0; MAP_LEN],
        answered: vec![0.0; MAP_LEN],
        times_us: Default::default(),
        network_us: Vec::new(),
        judged: Vec::new(),
    };
    let mut states = Vec::new();
    let mut count = 0;
    for indentation in dataset.indentations(Split::Test)? {
        let shard = dataset.shard(indentation)?;
        for index in 0..indentation.samples {
            count += 1;
            if (count - 1) % every.max(1) == 0 {
                states.push(work.state(indentation, &shard, index)?);
            }
        }
    }
    let gains: Vec<f64> = states.iter().map(|s| f64::from(s.best_gain)).collect();
    let gain = quantile(&gains, 0.5).unwrap_or(0.0) as f32;
    for state in &mut states {
        let drive_pa = work.formula_pa(&state.means, gain);
        state.errors[Way::Formula as usize] = work.error(&drive_pa, &state.truth)?;
    }
    let picture = drawn(&mut work, &states, gain)?;
    Ok((table(&work, &states, pitch_mm, pins.len()), picture))
}

fn started(model: &dyn Model) -> Result<Box<dyn Session>, ExportError> {
    let path = model.info().name.clone().into();
    model.session().map_err(|source: EngineError| ExportError::Engine { path, source })
}

fn pair(values: &[f64]) -> [f64; 2] {
    [0.5, 0.95].map(|q| quantile(values, q).unwrap_or(f64::NAN))
}

fn table(work: &Work<'_>, states: &[State], pitch_mm: f32, pins: usize) -> Table {
    let row = |way: Way| {
        let found = |part: usize| {
            let all = states.iter().filter_map(|state| state.errors[way as usize]);
            pair(&all.map(|error| error[part]).collect::<Vec<_>>())
        };
        Row {
            way,
            relative_l2: found(0),
            means: found(2),
            peak: found(1),
            us: (!work.times_us[way as usize].is_empty())
                .then(|| pair(&work.times_us[way as usize])),
        }
    };
    Table {
        set: work.dataset.name().to_owned(),
        states: states.len(),
        pitch_mm,
        pins,
        judge: pair(&work.judged),
        network_us: pair(&work.network_us),
        rows: Way::ALL.map(row).into(),
    }
}

/// The state whose corrected drive has the median error: the press, what the drives give, the pins.
fn drawn(work: &mut Work<'_>, states: &[State], gain: f32) -> Result<Canvas, ExportError> {
    let l2 = |state: &&State, way: Way| state.errors[way as usize].map_or(f64::NAN, |[l2, ..]| l2);
    let mut order: Vec<&State> = states.iter().collect();
    order.sort_by(|a, b| l2(a, Way::Corrected).total_cmp(&l2(b, Way::Corrected)));
    let Some(state) = order.get(order.len() / 2) else {
        return Ok(Canvas::new(1, 1));
    };
    let by_formula = work.formula_pa(&state.means, gain);
    work.judge(&by_formula)?;
    let formula_sed = work.answered.clone();
    work.judge(&state.corrected_pa)?;
    let [skin, inside] =
        [Patch::Skin, Patch::Interface].map(|patch| work.dataset.maps.raster(patch).mask());
    let max = |map: &[f32]| map.iter().fold(0.0_f32, |max, v| max.max(*v));
    let sed_max = max(&state.truth).max(max(&formula_sed)).max(max(&work.answered));
    let percent = |way| format!("{:.0} % off", 100.0 * l2(state, way));
    let pins_kpa: Vec<f32> = work.pins_pa.iter().map(|pa| pa / 1e3).collect();
    let sed = |title, values: &[f32]| Picture {
        title,
        values: values.to_vec(),
        mask: inside,
        max: sed_max,
        unit: "J/m3",
    };
    let panels = [
        sed("SED of the press, finite elements".to_owned(), &state.truth),
        sed(format!("by formula, {}", percent(Way::Formula)), &formula_sed),
        sed(format!("corrected, {}", percent(Way::Corrected)), &work.answered),
        Picture {
            title: "pins, corrected".to_owned(),
            max: max(&pins_kpa),
            values: pins_kpa,
            mask: skin,
            unit: "kPa",
        },
    ];
    Ok(sheet(&state.heading, panels))
}
