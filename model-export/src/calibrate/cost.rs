//! How much time an error estimate adds to a frame.

use papilla_engine::error_law::{Facts, Law};
use papilla_engine::{MAP_LEN, Model};
use papilla_proto::input_statistics::PressedCells;
use papilla_proto::map::PeakAndSum;
use papilla_proto::{Look, peak};
use serde::Serialize;
use std::hint::black_box;
use std::time::Instant;

/// Pairs of runs, in turn; the least of each counts.
pub(super) const RUNS: usize = 400;

/// Times of one map on one thread, us, each the least of many that took turns.
#[derive(Debug, Clone, Serialize)]
pub struct Cost {
    /// The network beside.
    pub network: String,
    /// What a frame took before: the greatest SED.
    pub peak_us: f64,
    /// The same with the sum.
    pub peak_and_sum_us: f64,
    /// The pass over the pressure that tells strange maps and where it presses.
    pub look_us: f64,
    /// Facts, and two laws.
    pub laws_us: f64,
    /// The network.
    pub network_us: f64,
}

impl Cost {
    /// Measures it on a ball's contact.
    ///
    /// # Errors
    /// As [`papilla_engine::Session::infer`].
    pub fn of(
        model: &dyn Model,
        law: &Law,
        trained: PressedCells,
    ) -> Result<Self, papilla_engine::EngineError> {
        let mut session = model.session()?;
        let pressure_pa: Vec<f32> = (0..MAP_LEN)
            .map(|i| {
                let (y, x) = ((i / 224) as f32 - 112.0, (i % 224) as f32 - 112.0);
                2e4 * (1.0 - (x * x + y * y) / 900.0).max(0.0).sqrt()
            })
            .collect();
        let mut sed = vec![0.0; MAP_LEN];
        let mut least = [f64::INFINITY; 5];
        let mut time = |of: usize, work: &mut dyn FnMut()| {
            let start = Instant::now();
            work();
            least[of] = least[of].min(start.elapsed().as_secs_f64() * 1e6);
        };
        let mut failed = None;
        for _ in 0..RUNS {
            time(4, &mut || failed = session.infer(&pressure_pa, &mut sed).err());
            if let Some(error) = failed {
                return Err(error);
            }
            time(0, &mut || _ = black_box(peak(black_box(&sed))));
            time(1, &mut || _ = black_box(PeakAndSum::of(black_box(&sed))));
            let mut look = Look::default();
            time(2, &mut || look = black_box(Look::of(black_box(&pressure_pa))));
            time(3, &mut || {
                for _ in 0..2 {
                    let facts = Facts::of_sed(black_box(&look), 2e4, 1e6, trained);
                    black_box(law.at(&facts));
                }
            });
        }
        let [peak_us, peak_and_sum_us, look_us, laws_us, network_us] = least;
        let network = model.info().name.clone();
        Ok(Self { network, peak_us, peak_and_sum_us, look_us, laws_us, network_us })
    }

    /// What is new in a frame, over the network's time: the sum of SED and the laws. The pass over the
    /// pressure was there before.
    #[must_use]
    pub fn share(&self) -> f64 {
        ((self.peak_and_sum_us - self.peak_us).max(0.0) + self.laws_us) / self.network_us
    }
}
