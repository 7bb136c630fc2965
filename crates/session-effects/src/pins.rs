//! `actuators` whose drives are fitted together: pins that press on the skin.

use bytes::{BufMut, BytesMut};
use papilla_actuators::{Array, HalfSpace, Inverse, Pin};
use papilla_proto::{
    MAP_LEN, Problem,
    effects::{ActuatorInput, Drive, Layout},
};

use super::{Finger, Geometry, unusable};

/// A display of pins, and the drive of the frame at hand.
#[derive(Debug)]
pub(super) struct Pins {
    inverse: Inverse,
    /// Intensity a Pa, one a pin.
    gain: Vec<f32>,
    max: f32,
    drive_pa: Vec<f32>,
    /// Pressure of the drive and the network's SED of it, where one is asked.
    asked: Option<[Vec<f32>; 2]>,
}

impl Pins {
    /// # Errors
    /// Pins that cannot be, one off the interface, or members that have no meaning for pins.
    pub(super) fn new(
        layout: &Layout,
        finger: Finger<'_>,
        geometry: &Geometry,
    ) -> Result<Self, Problem> {
        let bad = |message: String| unusable("actuators", message);
        if layout.input != ActuatorInput::Sed {
            return Err(bad("'drive' fits SED; 'input' has to be 'sed'".to_owned()));
        }
        let max = layout.max;
        if !(max.is_finite() && max > 0.0) {
            return Err(bad(format!("'max' is {max}; it has to be above 0")));
        }
        let (mut pins, mut gain) = (Vec::new(), Vec::new());
        for (number, actuator) in layout.actuators.iter().enumerate() {
            if actuator.threshold.unwrap_or(layout.threshold) > 0.0 {
                let message = format!("'threshold' of actuator {number}: a fitted drive has none");
                return Err(bad(message));
            }
            let due = |name: &str, value: Option<f32>| {
                value.filter(|value| value.is_finite() && *value > 0.0).ok_or_else(|| {
                    let found = value.map_or("missing".to_owned(), |v| v.to_string());
                    bad(format!("'{name}' of actuator {number} is {found}; above 0 is due"))
                })
            };
            let reach_mm = due("radius_mm", actuator.radius_mm.or(layout.radius_mm))?;
            let own_gain = due("gain", actuator.gain.or(layout.gain))?;
            let name = format!("actuator {number}");
            let (pixel, _) = geometry.locate(actuator.at, "actuators", &name)?;
            pins.push(Pin { pixel, reach_mm, max_pa: max / own_gain });
            gain.push(own_gain);
        }
        let rasters = [finger.skin, finger.interface];
        let array = Array::new(finger.atlas, rasters, &pins, HalfSpace::SHIPPED)
            .map_err(|error| bad(error.to_string()))?;
        let asks = layout.drive == Drive::Corrected;
        Ok(Self {
            inverse: Inverse::new(array),
            drive_pa: vec![0.0; gain.len()],
            gain,
            max,
            asked: asks.then(|| [(); 2].map(|()| vec![0.0; MAP_LEN])),
        })
    }

    pub(super) fn len(&self) -> usize {
        self.gain.len()
    }

    pub(super) fn drive_pa_mut(&mut self) -> &mut [f32] {
        &mut self.drive_pa
    }

    /// Finds the drive for a map of SED.
    pub(super) fn fit<E>(
        &mut self,
        sed_j_per_m3: &[f32],
        infer: impl FnOnce(&[f32], &mut [f32]) -> Result<(), E>,
    ) -> Result<(), E> {
        let found = self.inverse.fit(sed_j_per_m3, Inverse::STEPS);
        self.drive_pa.copy_from_slice(found);
        if let Some([pressure_pa, answered]) = &mut self.asked
            && found.iter().any(|pa| *pa > 0.0)
        {
            self.inverse.array().pressure(&self.drive_pa, pressure_pa);
            infer(pressure_pa, answered)?;
            let found = self.inverse.correct(sed_j_per_m3, answered, Inverse::STEPS);
            self.drive_pa.copy_from_slice(found);
        }
        Ok(())
    }

    /// Appends one intensity an actuator.
    pub(super) fn write(&self, bytes: &mut BytesMut) {
        for (pa, gain) in self.drive_pa.iter().zip(&self.gain) {
            bytes.put_f32_le((pa * gain).clamp(0.0, self.max));
        }
    }
}

#[cfg(test)]
mod tests {
    use papilla_proto::effects::{Actuator, Place};

    use super::{super::tests::Owned, *};

    fn layout(drive: Drive) -> Layout {
        let at = |column: f32| Actuator {
            at: Place::Px([column, 100.5]),
            radius_mm: None,
            gain: None,
            threshold: None,
        };
        Layout {
            actuators: vec![at(80.5), at(120.5)],
            input: ActuatorInput::Sed,
            drive,
            radius_mm: Some(1.0),
            gain: Some(2e-5),
            threshold: 0.0,
            max: 1.0,
        }
    }

    fn pins(layout: &Layout) -> Result<Pins, Problem> {
        let plane = Owned::plane();
        Pins::new(layout, plane.finger(), &plane.finger().geometry())
    }

    fn intensities(pins: &Pins) -> Vec<f32> {
        let mut bytes = BytesMut::new();
        pins.write(&mut bytes);
        bytes.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
    }

    #[test]
    fn intensity_is_gain_times_the_pressure_that_makes_the_map_and_at_most_the_greatest() {
        let mut fitted = pins(&layout(Drive::Fitted)).unwrap();
        let mut sed = vec![0.0; MAP_LEN];
        fitted.inverse.array().sed(&[2e4, 9e4], &mut sed);
        let never = |_: &[f32], _: &mut [f32]| Err("a fit alone asks nobody");
        fitted.fit(&sed, never).unwrap();
        let [near, far] = intensities(&fitted)[..] else { panic!("two pins") };
        assert!((near - 0.4).abs() < 0.01 && (far - 1.0).abs() < 1e-6, "{near} {far}");
    }

    #[test]
    fn the_network_is_asked_about_the_pressure_of_the_pins_and_not_for_nothing() {
        let mut corrected = pins(&layout(Drive::Corrected)).unwrap();
        let mut wanted = vec![0.0; MAP_LEN];
        let never = |_: &[f32], _: &mut [f32]| Err("no drive, no question");
        corrected.fit(&wanted, never).unwrap();
        corrected.inverse.array().sed(&[1e4, 2e4], &mut wanted);
        let half: Vec<f32> = wanted.iter().map(|sed| 0.25 * sed).collect();
        let asked = corrected.fit(&wanted, |pressure_pa, sed| {
            assert!((pressure_pa[100 * 224 + 120] / 2e4 - 1.0).abs() < 0.02);
            // A finger in which the same pressure makes a quarter of the SED.
            sed.copy_from_slice(&half);
            Ok::<(), ()>(())
        });
        asked.unwrap();
        for (found, due) in intensities(&corrected).iter().zip([0.4, 0.8]) {
            assert!((found / due - 1.0).abs() < 0.03, "{found} for {due}");
        }
        assert_eq!(corrected.fit(&wanted, |_, _| Err("broken")), Err("broken"));
    }

    #[test]
    fn what_is_unusable_is_named() {
        let refused = |layout: &Layout| {
            let problem = pins(layout).unwrap_err();
            assert_eq!(problem.field.as_deref(), Some("actuators"), "{problem}");
            problem.message
        };
        let good = layout(Drive::Fitted);
        let rates = Layout { input: ActuatorInput::Sa1Rate, ..good.clone() };
        assert!(refused(&rates).contains("'input'"));
        assert!(refused(&Layout { threshold: 1.0, ..good.clone() }).contains("'threshold'"));
        assert!(refused(&Layout { gain: Some(0.0), ..good.clone() }).contains("'gain'"));
        assert!(refused(&Layout { gain: Some(1e-44), ..good.clone() }).contains("greatest drive"));
        assert!(refused(&Layout { max: f32::NAN, ..good.clone() }).contains("'max'"));
        assert!(refused(&Layout { radius_mm: None, ..good.clone() }).contains("'radius_mm'"));
        assert!(refused(&Layout { radius_mm: Some(0.1), ..good.clone() }).contains("'radius_mm'"));
        let mut off = good.clone();
        off.actuators[1].at = Place::Px([1.0, 1.0]);
        assert!(refused(&off).contains("actuator 1"));
        assert!(refused(&Layout { actuators: Vec::new(), ..good }).contains("0 pins"));
    }
}
