//! Numbers with their tolerances, as the file has them.

use papilla_proto::{MAP_LEN, MAP_SIDE_PX, Window};
use serde_json::{Value, json};

/// What a step is to find. Pairs are value and absolute tolerance.
pub(super) struct Due {
    pub(super) map_values: Vec<f64>,
    pub(super) tolerance: Vec<f64>,
    pub(super) relative: f64,
    pub(super) map: bool,
    pub(super) window: Option<Window>,
    pub(super) summary: Vec<[f64; 2]>,
    /// The map of firing rates.
    pub(super) rates: Option<Box<Due>>,
    pub(super) points: Vec<[f64; 2]>,
    pub(super) point_rates: Vec<[f64; 2]>,
    pub(super) actuators: Vec<[f64; 2]>,
    pub(super) force_n: f64,
}

/// `value` to so many significant digits, so that the last bits do not change the file.
fn rounded(value: f64, digits: i32) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return 0.0;
    }
    let text = format!("{value:.*e}", usize::try_from(digits - 1).unwrap_or(0));
    text.parse().unwrap_or(value)
}

fn pair([value, tolerance]: [f64; 2]) -> Value {
    json!([rounded(value, 7), rounded(tolerance, 2)])
}

impl Due {
    /// A map, its tolerance relative to its greatest value.
    pub(super) fn of_map(map: &[f64], relative: f64) -> Self {
        let top = map.iter().copied().fold(0.0, f64::max);
        Self {
            map_values: map.to_vec(),
            tolerance: vec![relative * top; MAP_LEN],
            relative,
            map: true,
            window: None,
            summary: Vec::new(),
            rates: None,
            points: Vec::new(),
            point_rates: Vec::new(),
            actuators: Vec::new(),
            force_n: 0.0,
        }
    }

    /// Writes the numbers that `expect` asks for, in whatever state they are.
    pub(super) fn fill(&self, expect: &mut Value) {
        if let (Some(rates), Some(expect)) = (&self.rates, expect.get_mut("rates")) {
            rates.fill(expect);
        }
        let Some(expect) = expect.as_object_mut() else { return };
        let mut set = |name: &str, value: Value| {
            if let Some(old) = expect.get_mut(name) {
                *old = value;
            }
        };
        let sum: f64 = self.map_values.iter().sum();
        let top = (0..MAP_LEN)
            .fold(0, |best, i| if self.map_values[i] > self.map_values[best] { i } else { best });
        set("sum", pair([sum, self.relative * sum]));
        set("max", pair([self.map_values[top], self.tolerance[top]]));
        set("force_n", pair([self.force_n, 1e-4 * self.force_n]));
        set("summary", self.summary.iter().copied().map(pair).collect());
        set("points", self.points.iter().copied().map(pair).collect());
        set("point_rates", self.point_rates.iter().copied().map(pair).collect());
        set("actuators", self.actuators.iter().copied().map(pair).collect());
        if let Some(Window { x, y, width, height }) = self.window {
            set("window", json!([x, y, width, height]));
        }
        for pixel in expect.get_mut("pixels").and_then(Value::as_array_mut).into_iter().flatten() {
            let at = |i: usize| pixel[i].as_u64().and_then(|n| usize::try_from(n).ok());
            let (Some(row), Some(column)) = (at(0), at(1)) else { continue };
            let index = (row * MAP_SIDE_PX + column).min(MAP_LEN - 1);
            let value = rounded(self.map_values[index], 7);
            *pixel = json!([row, column, value, rounded(self.tolerance[index], 2)]);
        }
    }
}
