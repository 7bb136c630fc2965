//! A session as the documentation describes it: what its effects make of the engine's maps.

use papilla_proto::{
    Hello, MAP_LEN, RuntimeEffect, SampleType, Window,
    effects::{ActuatorInput, Moduli, OutOfRange, Relaxation},
};

use super::{
    Tier,
    due::Due,
    finger::{Surface, summary},
};

/// Relative tolerance of a map, of its greatest value: other processors, other kernels.
const MAP_TOLERANCE: f64 = 2e-4;

/// The same of firing rates.
const RATE_TOLERANCE: f64 = 2e-3;
/// Of SED at points.
const POINT_TOLERANCE: f64 = MAP_TOLERANCE;

/// The state of a session.
pub(super) struct Session {
    hello: Hello,
    pub(super) tier: String,
    effects: Vec<RuntimeEffect>,
    /// Time (s) and pressure of every frame so far.
    sent: Vec<(f64, Vec<f32>)>,
    /// Time (s) and stress (kPa) of the frame before.
    stress: Option<(f64, Vec<f64>)>,
}

/// A rendered frame.
pub(super) struct Answer {
    sed: Vec<f64>,
    rate_hz: Option<Vec<f64>>,
    /// Tolerance of every pixel of the map of SED.
    tolerance: Vec<f64>,
}

/// Name and default tier of the finger that `clients/conformance/run --fingers` serves.
const OTHER_FINGER: [&str; 2] = ["other", "half-space"];

/// The default of the finger that a hello names.
fn own_tier(hello: &Hello) -> Option<String> {
    let [finger, tier] = OTHER_FINGER;
    let first = hello.fingers.as_deref()?.first()?;
    (first.name.as_deref() == Some(finger)).then(|| tier.to_owned())
}

impl Session {
    pub(super) fn new(hello: Hello) -> Result<Self, String> {
        let tier = (hello.tier.clone().or_else(|| own_tier(&hello)))
            .ok_or("every hello of the script names its tier, but for those of the other finger")?;
        let effects = hello.effects.iter().filter_map(|name| name.parse().ok()).collect();
        Ok(Self { hello, tier, effects, sent: Vec::new(), stress: None })
    }

    /// Whether answers tell how wrong they are likely to be.
    pub(super) fn tells_error(&self) -> bool {
        self.hello.error_estimate == Some(true)
    }

    fn has(&self, effect: RuntimeEffect) -> bool {
        self.effects.contains(&effect)
    }

    pub(super) fn render(
        &mut self,
        tier: &mut Tier,
        sent_pa: &[f32],
        time_us: u64,
    ) -> Result<Answer, String> {
        let now_s = time_us as f64 * 1e-6;
        self.sent.push((now_s, sent_pa.to_vec()));
        let effective_pa = if self.has(RuntimeEffect::Relaxation) {
            crept(&self.hello.relaxation.clone().unwrap_or_default(), &self.sent)?
        } else {
            sent_pa.to_vec()
        };
        let seen_pa = self.seen(tier, effective_pa);
        let sed = tier.render(&seen_pa)?;
        let tolerance = self.tolerance(tier, &seen_pa, &sed)?;
        let sed: Vec<f64> = sed.into_iter().map(f64::from).collect();
        if !self.has(RuntimeEffect::Afferents) {
            return Ok(Answer { sed, rate_hz: None, tolerance });
        }
        let of = self.hello.afferents.unwrap_or_default();
        let [e_ref, theta, k_s, k_d] =
            [of.e_ref_kpa, of.theta_kpa, of.k_s_hz_per_kpa, of.k_d_hz_s_per_kpa].map(f64::from);
        // kPa from J/m3 = Pa.
        let stress: Vec<f64> = sed.iter().map(|w| (2.0 * e_ref * 1e-3 * w).sqrt()).collect();
        let rate = |i: usize| {
            let slope = match &self.stress {
                Some((before_s, before)) if now_s > *before_s => {
                    (stress[i] - before[i]) / (now_s - before_s)
                }
                _ => 0.0,
            };
            k_s * (stress[i] - theta).max(0.0) + k_d * slope.max(0.0)
        };
        let rate_hz: Vec<f64> = (0..MAP_LEN).map(rate).collect();
        self.stress = Some((now_s, stress));
        Ok(Answer { sed, rate_hz: Some(rate_hz), tolerance })
    }

    /// What the network sees: no pressure beyond its range, unless it was asked to extrapolate.
    fn seen(&self, tier: &Tier, mut effective_pa: Vec<f32>) -> Vec<f32> {
        let most_pa = tier.pressure_max_pa;
        let leaves = effective_pa.iter().any(|&p| p > 1.01 * most_pa);
        if leaves && self.hello.out_of_range.unwrap_or(OutOfRange::Clamp) == OutOfRange::Clamp {
            effective_pa.iter_mut().for_each(|p| *p = p.min(most_pa));
        }
        effective_pa
    }

    /// What rounding samples on the way in and out may do to every pixel.
    fn tolerance(
        &self,
        tier: &mut Tier,
        effective_pa: &[f32],
        sed: &[f32],
    ) -> Result<Vec<f64>, String> {
        let top = sed.iter().copied().fold(0.0, f32::max);
        let sent = self.hello.sample_type;
        let error_pa = |p: f32| match sent {
            SampleType::F32 => 0.0,
            SampleType::F16 => p / 2048.0,
            SampleType::U16 | SampleType::U8 => 0.5 * tier.pressure_max_pa / sent.unit_max(),
        };
        let more_pa: Vec<f32> =
            effective_pa.iter().map(|&p| if p > 0.0 { p + error_pa(p) } else { 0.0 }).collect();
        let more = if sent == SampleType::F32 { sed.to_vec() } else { tier.render(&more_pa)? };
        let answered = self.hello.answer_sample_type.unwrap_or(sent);
        let unit = top / answered.unit_max();
        let pixel = |(&w, &more): (&f32, &f32)| {
            let rounding = f64::from(answered.error_max(w, unit));
            MAP_TOLERANCE * f64::from(top) + 2.0 * f64::from((more - w).abs()) + rounding
        };
        Ok(sed.iter().zip(&more).map(pixel).collect())
    }

    pub(super) fn due(
        &self,
        answer: &Answer,
        sent_pa: &[f32],
        (skin, interface): (&Surface, &Surface),
    ) -> Result<Due, String> {
        let contact_pa = self.hello.contact_pa.unwrap_or(0.0);
        let whole = &answer.sed;
        let mut map = whole.clone();
        let mut window = Window::WHOLE;
        if self.has(RuntimeEffect::ContactWindow) {
            let margin_px = self.hello.contact_window.unwrap_or_default().margin_px;
            window = contact_window(sent_pa, contact_pa, margin_px);
            let kept: Vec<usize> = window.rows().flatten().collect();
            (0..MAP_LEN).filter(|i| kept.binary_search(i).is_err()).for_each(|i| map[i] = 0.0);
        }
        let most = |map: &[f64]| map.iter().copied().fold(0.0, f64::max);
        let near = |value: f64, size: f64| [value, size.abs().max(1e-9)];
        let mut due = Due { window: Some(window), ..Due::of_map(&map, MAP_TOLERANCE) };
        due.tolerance = answer.tolerance.clone();
        due.map = self.hello.map.unwrap_or(true);
        // Half a unit of the smallest samples counts beside other kernels.
        let rounding = match self.hello.answer_sample_type.unwrap_or(self.hello.sample_type) {
            SampleType::F32 | SampleType::F16 => 0.0,
            scaled @ (SampleType::U16 | SampleType::U8) => 0.51 / f64::from(scaled.unit_max()),
        };
        let of_rates = |map: &[f64]| RATE_TOLERANCE.max(rounding) * most(map);
        if let Some(rate_hz) = &answer.rate_hz {
            let tolerance = vec![of_rates(rate_hz); MAP_LEN];
            due.rates = Some(Box::new(Due { tolerance, ..Due::of_map(rate_hz, RATE_TOLERANCE) }));
        }
        if self.has(RuntimeEffect::Summary) {
            let values = summary(
                (skin, interface),
                (sent_pa, &answer.sed),
                answer.rate_hz.as_deref(),
                f64::from(contact_pa),
            );
            // Places to a fiftieth of a pixel: SED itself is good to MAP_TOLERANCE.
            let places = [3, 4, 6, 7, 9, 10];
            let one = |(i, &v): (usize, &f64)| {
                if places.contains(&i) { [v, 0.02] } else { [v, 1e-3 * v.abs().max(1.0)] }
            };
            due.summary = values.iter().enumerate().map(one).collect();
        }
        for place in self.hello.points.iter().flatten() {
            due.points.push(near(interface.at(*place, whole), POINT_TOLERANCE * most(whole)));
            if let Some(rate_hz) = &answer.rate_hz {
                let found = interface.at(*place, rate_hz);
                due.point_rates.push(near(found, RATE_TOLERANCE * most(rate_hz)));
            }
        }
        if let Some(layout) = &self.hello.actuators {
            for one in &layout.actuators {
                let input = match layout.input {
                    ActuatorInput::Sed => whole,
                    ActuatorInput::Sa1Rate => answer.rate_hz.as_ref().unwrap_or(whole),
                };
                due.actuators.push([interface.intensity(layout, one, input), 2e-3]);
            }
        }
        Ok(due)
    }
}

/// The smallest window with a margin that holds every pixel in contact, pixel by pixel.
fn contact_window(map_pa: &[f32], contact_pa: f32, margin_px: u16) -> Window {
    let touched = |i: &usize| map_pa[*i] > contact_pa;
    let side = papilla_proto::MAP_SIDE_PX;
    let span = |places: Vec<usize>| {
        let (first, last) = (places.iter().min()?, places.iter().max()?);
        let start = first.saturating_sub(usize::from(margin_px));
        let end = (last + 1 + usize::from(margin_px)).min(side);
        Some((start as u16, (end - start) as u16))
    };
    let columns = span((0..MAP_LEN).filter(touched).map(|i| i % side).collect());
    let rows = span((0..MAP_LEN).filter(touched).map(|i| i / side).collect());
    match (columns, rows) {
        (Some((x, width)), Some((y, height))) => Window { x, y, width, height },
        _ => Window::EMPTY,
    }
}

/// The pressure that the elastic map is asked about now: the history through the creep compliance
/// of a standard linear solid, `J(t) = (1 - g exp(-x t)) / (1 - g)`, `x = (1 - g) / tau`.
/// The script keeps to one term of a Prony series, for which that is exact; the server has a
/// recursion for any number of them.
fn crept(of: &Relaxation, sent: &[(f64, Vec<f32>)]) -> Result<Vec<f32>, String> {
    let Some([term]) = of.prony.as_deref() else {
        return Err("the script's relaxation has one term of its own".to_owned());
    };
    if of.moduli != Moduli::Instantaneous {
        return Err("the script's moduli are the instantaneous ones".to_owned());
    }
    let (g, x) = (term.g, (1.0 - term.g) / term.tau_s);
    let now_s = sent.last().map_or(0.0, |last| last.0);
    // The mean of J between two ages.
    let mean = |young: f64, old: f64| {
        let decayed = ((-x * young).exp() - (-x * old).exp()) / (x * (old - young));
        (1.0 - g * decayed) / (1.0 - g)
    };
    let mut effective_pa = vec![0.0; MAP_LEN];
    for (number, (time_s, map_pa)) in sent.iter().enumerate() {
        let before = number.checked_sub(1).map(|before| &sent[before]);
        let share = match before {
            Some((before_s, _)) if time_s > before_s => mean(now_s - time_s, now_s - before_s),
            _ => (1.0 - g * (-x * (now_s - time_s)).exp()) / (1.0 - g),
        };
        for (i, effective) in effective_pa.iter_mut().enumerate() {
            let rise = f64::from(map_pa[i]) - before.map_or(0.0, |b| f64::from(b.1[i]));
            *effective += share * rise;
        }
    }
    // What is left of a pressure below 0.1 Pa is nothing (docs/concepts/physics.md).
    Ok(effective_pa.into_iter().map(|p| if p < 0.1 { 0.0 } else { p as f32 }).collect())
}
