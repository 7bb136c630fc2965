//! One state: each way's drive, and the error of its SED.

use super::{State, Way};
use papilla_actuators::{Inverse, Pin};
use papilla_dataset::{IndentationEntry, Shard};
use papilla_engine::Session;
use papilla_model_export::ExportError;
use papilla_model_export::dataset::Dataset;
use papilla_model_export::metrics::SampleMetrics;
use papilla_processor::thread_s;
use papilla_proto::effects::{Actuator, ActuatorInput, Drive, Layout, Place};
use papilla_proto::{HEADER_LEN, Hello, MAP_LEN, MAP_SIDE_PX, Problem};
use papilla_session_effects::{Effects, Finger};

/// Steps towards the best gain: SED is nearly its square, so few are enough.
const GAIN_STEPS: usize = 4;
/// Corrections of the last row.
const CORRECTIONS: usize = 10;

/// The session's effect by its formula, with a gain of 1: the means of SED over the pins.
pub(super) struct Formula {
    effects: Effects,
    bytes: bytes::BytesMut,
    pressure_pa: Vec<f32>,
}

impl Formula {
    pub(super) fn new(finger: Finger<'_>, pins: &[Pin]) -> Result<Self, Problem> {
        let actuator = |pin: &Pin| {
            let [row, column] =
                [pin.pixel as usize / MAP_SIDE_PX, pin.pixel as usize % MAP_SIDE_PX];
            Actuator {
                at: Place::Px([column as f32 + 0.5, row as f32 + 0.5]),
                radius_mm: Some(pin.reach_mm),
                gain: None,
                threshold: None,
            }
        };
        let layout = Layout {
            actuators: pins.iter().map(actuator).collect(),
            input: ActuatorInput::Sed,
            drive: Drive::Formula,
            radius_mm: None,
            gain: Some(1.0),
            threshold: 0.0,
            max: f32::MAX,
        };
        let hello = Hello {
            effects: vec!["actuators".to_owned()],
            map: Some(false),
            actuators: Some(layout),
            ..Hello::default()
        };
        let missing = || Problem::new(papilla_proto::ErrorCode::Internal, "no effect");
        let effects = Effects::of(&hello, finger)?.ok_or_else(missing)?;
        let bytes = bytes::BytesMut::with_capacity(effects.size_hint());
        Ok(Self { effects, bytes, pressure_pa: vec![0.0; MAP_LEN] })
    }

    /// The means, and how long they took, us.
    fn means(&mut self, sed: &[f32]) -> Option<(Vec<f32>, f64)> {
        self.bytes.clear();
        self.bytes.resize(HEADER_LEN, 0);
        let start_s = thread_s();
        self.effects.write(&self.pressure_pa, sed, 0, &mut self.bytes).ok()?;
        let us = 1e6 * (thread_s() - start_s);
        let numbers = self.bytes[HEADER_LEN..].as_chunks::<4>().0;
        Some((numbers.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect(), us))
    }
}

/// What states are measured with.
pub(super) struct Work<'a> {
    pub(super) dataset: &'a Dataset,
    pub(super) formula: Formula,
    pub(super) inverse: Inverse,
    pub(super) served: Box<dyn Session>,
    pub(super) judge: Box<dyn Session>,
    pub(super) judge_name: String,
    pub(super) max_pa: f32,
    pub(super) press_pa: Vec<f32>,
    /// What the session answers for the press.
    pub(super) wanted: Vec<f32>,
    pub(super) pins_pa: Vec<f32>,
    pub(super) answered: Vec<f32>,
    /// By way; empty where a row has no time of its own.
    pub(super) times_us: [Vec<f64>; Way::ALL.len()],
    pub(super) network_us: Vec<f64>,
    pub(super) judged: Vec<f64>,
}

impl Work<'_> {
    /// Takes a state of the dataset.
    pub(super) fn state(
        &mut self,
        indentation: &IndentationEntry,
        shard: &Shard,
        index: usize,
    ) -> Result<State, ExportError> {
        let mut truth = vec![0.0; MAP_LEN];
        self.dataset.draw_sed(indentation, shard, index, &mut truth)?;
        self.dataset.draw_pressure(indentation, shard, index, &mut self.press_pa)?;
        let failed = |source| ExportError::Engine { path: "the network".into(), source };
        self.judge.infer(&self.press_pa, &mut self.answered).map_err(failed)?;
        let on_press = SampleMetrics::measure(&self.answered, &truth, &self.dataset.ground);
        self.judged.extend(on_press.map(|metrics| metrics.relative_l2));
        let start_s = thread_s();
        self.served.infer(&self.press_pa, &mut self.wanted).map_err(failed)?;
        self.network_us.push(1e6 * (thread_s() - start_s));

        let (means, us) = self.formula.means(&self.wanted).unwrap_or_default();
        self.times_us[Way::Formula as usize].push(us);
        let best_gain = self.best_gain(&means, &truth)?;
        let best_pa = self.formula_pa(&means, best_gain);
        let mut errors = [None; Way::ALL.len()];
        errors[Way::FormulaBest as usize] = self.error(&best_pa, &truth)?;
        let wanted = std::mem::take(&mut self.wanted);
        let start_s = thread_s();
        let drive_pa = self.inverse.fit(&wanted, 0).to_vec();
        self.times_us[Way::Magnitudes as usize].push(1e6 * (thread_s() - start_s));
        errors[Way::Magnitudes as usize] = self.error(&drive_pa, &truth)?;
        let start_s = thread_s();
        let mut drive_pa = self.inverse.fit(&wanted, Inverse::STEPS).to_vec();
        let fit_us = 1e6 * (thread_s() - start_s);
        self.times_us[Way::Fitted as usize].push(fit_us);
        errors[Way::Fitted as usize] = self.error(&drive_pa, &truth)?;
        let mut corrected_pa = Vec::new();
        for correction in 0..CORRECTIONS {
            self.inverse.array().pressure(&drive_pa, &mut self.pins_pa);
            self.served.infer(&self.pins_pa, &mut self.answered).map_err(failed)?;
            let start_s = thread_s();
            drive_pa = self.inverse.correct(&wanted, &self.answered, Inverse::STEPS).to_vec();
            if correction == 0 {
                self.times_us[Way::Corrected as usize].push(fit_us + 1e6 * (thread_s() - start_s));
                errors[Way::Corrected as usize] = self.error(&drive_pa, &truth)?;
                corrected_pa.clone_from(&drive_pa);
            }
        }
        errors[Way::Settled as usize] = self.error(&drive_pa, &truth)?;
        self.wanted = wanted;
        let heading = format!(
            "{}, press {} ({}), {:.2} mm deep; SED of pins by {}",
            self.dataset.name(),
            indentation.id,
            indentation.indenter,
            shard.depth_mm[index],
            self.judge_name,
        );
        Ok(State { heading, truth, means, best_gain, errors, corrected_pa })
    }

    /// The drive by the formula.
    pub(super) fn formula_pa(&self, means: &[f32], gain: f32) -> Vec<f32> {
        means.iter().map(|mean| (gain * mean).clamp(0.0, self.max_pa)).collect()
    }

    /// What the judge makes of a drive; left in `answered`.
    pub(super) fn judge(&mut self, drive_pa: &[f32]) -> Result<(), ExportError> {
        self.inverse.array().pressure(drive_pa, &mut self.pins_pa);
        let failed = |source| ExportError::Engine { path: "the judge".into(), source };
        self.judge.infer(&self.pins_pa, &mut self.answered).map_err(failed)
    }

    /// Of a drive's SED: relative L2, error of the peak, and relative L2 of its means over the pins.
    pub(super) fn error(
        &mut self,
        drive_pa: &[f32],
        truth: &[f32],
    ) -> Result<Option<[f64; 3]>, ExportError> {
        self.judge(drive_pa)?;
        let metrics = SampleMetrics::measure(&self.answered, truth, &self.dataset.ground);
        let [found, due] = [&self.answered[..], truth].map(|sed| self.formula.means(sed));
        let (Some((found, _)), Some((due, _)), Some(metrics)) = (found, due, metrics) else {
            return Ok(None);
        };
        let square = |a: &f32| f64::from(*a).powi(2);
        let off: f64 = found.iter().zip(&due).map(|(a, b)| square(&(a - b))).sum();
        let means = (off / due.iter().map(square).sum::<f64>()).sqrt();
        Ok(Some([metrics.relative_l2, metrics.peak_error, means]))
    }

    /// The gain whose drive comes closest to the truth, in hindsight: of SED that grows with its
    /// square, and again.
    fn best_gain(&mut self, means: &[f32], truth: &[f32]) -> Result<f32, ExportError> {
        let greatest = |map: &[f32]| map.iter().fold(0.0_f32, |max, value| max.max(*value));
        let mut gain = greatest(&self.press_pa) / greatest(means).max(f32::MIN_POSITIVE);
        for _ in 0..GAIN_STEPS {
            let drive_pa = self.formula_pa(means, gain);
            self.judge(&drive_pa)?;
            let (mut both, mut own) = (0.0_f64, 0.0_f64);
            for (i, (sed, truth)) in self.answered.iter().zip(truth).enumerate() {
                if self.dataset.ground.mask[i] {
                    both += f64::from(*sed) * f64::from(*truth);
                    own += f64::from(*sed).powi(2);
                }
            }
            if both > 0.0 {
                gain *= (both / own).sqrt() as f32;
            }
        }
        Ok(gain)
    }
}
