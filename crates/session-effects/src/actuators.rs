//! `actuators`: what each electrode or tactor of a display is to do.

use bytes::{BufMut, BytesMut};
use papilla_proto::{Problem, effects::Layout};

use super::{Geometry, geometry::squared_distance, unusable};

/// Most actuators of a session.
const ACTUATORS_MAX: usize = 1024;

/// Most pixels in all receptive fields together: 8 MiB of weights.
const TAPS_MAX: usize = 1 << 20;

/// A display by its formula: the weights of all receptive fields behind one another.
#[derive(Debug)]
pub(super) struct Actuators {
    each: Vec<Each>,
    /// Flat index of a pixel and its weight; those of one actuator add up to 1.
    taps: Vec<(u32, f32)>,
    max: f32,
}

#[derive(Debug)]
struct Each {
    /// End of its weights in `taps`.
    end: usize,
    gain: f32,
    threshold: f32,
}

impl Actuators {
    /// # Errors
    /// Too many actuators, one off the interface, or a number that is none.
    pub(super) fn new(layout: &Layout, geometry: &Geometry) -> Result<Self, Problem> {
        let count = layout.actuators.len();
        if count == 0 || count > ACTUATORS_MAX {
            let message = format!("{count} actuators; name 1 to {ACTUATORS_MAX}");
            return Err(unusable("actuators", message));
        }
        let max = layout.max;
        if !(max.is_finite() && max > 0.0) {
            return Err(unusable("actuators", format!("'max' is {max}; it has to be above 0")));
        }
        let mut display = Self { each: Vec::with_capacity(count), taps: Vec::new(), max };
        for (number, actuator) in layout.actuators.iter().enumerate() {
            let due = |name: &str, value: Option<f32>, least: f32| {
                let good = value.filter(|v| v.is_finite() && *v >= least);
                good.ok_or_else(|| {
                    let found = value.map_or("missing".to_owned(), |v| v.to_string());
                    let message = format!(
                        "'{name}' of actuator {number} is {found}; {least} or more is due, of the \
                         actuator or of the layout"
                    );
                    unusable("actuators", message)
                })
            };
            let radius_mm = due("radius_mm", actuator.radius_mm.or(layout.radius_mm), 0.0)?;
            let gain = due("gain", actuator.gain.or(layout.gain), 0.0)?;
            let threshold = due("threshold", actuator.threshold.or(Some(layout.threshold)), 0.0)?;
            let name = format_args!("actuator {number}").to_string();
            let (own, centre_mm) = geometry.locate(actuator.at, "actuators", &name)?;
            display.field(own, centre_mm, radius_mm, geometry);
            if display.taps.len() > TAPS_MAX {
                let message = format!(
                    "the receptive fields up to actuator {number} hold more than {TAPS_MAX} \
                     pixels; make 'radius_mm' smaller"
                );
                return Err(unusable("actuators", message));
            }
            display.each.push(Each { end: display.taps.len(), gain, threshold });
        }
        display.taps.shrink_to_fit();
        Ok(display)
    }

    /// Appends the weights of a receptive field: a cap over the pixels within the radius.
    fn field(&mut self, own: u32, centre_mm: [f32; 3], radius_mm: f32, geometry: &Geometry) {
        let begin = self.taps.len();
        for &(index, place_mm) in &geometry.interface {
            let share = 1.0 - squared_distance(place_mm, centre_mm) / (radius_mm * radius_mm);
            // A radius of 0 makes the share infinite or no number: not above 0 and finite.
            if share > 0.0 && share.is_finite() {
                self.taps.push((index, share * geometry.interface_mm2[index as usize]));
            }
        }
        let sum: f32 = self.taps[begin..].iter().map(|&(_, weight)| weight).sum();
        if sum > 0.0 {
            self.taps[begin..].iter_mut().for_each(|(_, weight)| *weight /= sum);
        } else {
            self.taps.truncate(begin);
            self.taps.push((own, 1.0));
        }
    }

    pub(super) fn len(&self) -> usize {
        self.each.len()
    }

    /// Appends one intensity an actuator.
    pub(super) fn write(&self, map: &[f32], bytes: &mut BytesMut) {
        let mut begin = 0;
        for each in &self.each {
            let taps = &self.taps[begin..each.end];
            let mean: f32 = taps.iter().map(|&(index, weight)| weight * map[index as usize]).sum();
            bytes.put_f32_le((each.gain * (mean - each.threshold)).clamp(0.0, self.max));
            begin = each.end;
        }
    }
}

#[cfg(test)]
mod tests {
    use papilla_proto::effects::{Actuator, ActuatorInput, Drive, Place};

    use super::{super::tests::plane, *};

    fn layout(actuators: &[Actuator]) -> Layout {
        Layout {
            actuators: actuators.to_vec(),
            input: ActuatorInput::Sed,
            drive: Drive::Formula,
            radius_mm: Some(1.0),
            gain: Some(0.5),
            threshold: 2.0,
            max: 4.0,
        }
    }

    fn at(u: f32, v: f32) -> Actuator {
        Actuator { at: Place::Px([u, v]), radius_mm: None, gain: None, threshold: None }
    }

    fn intensities(layout: &Layout, map: &[f32]) -> Vec<f32> {
        let display = Actuators::new(layout, &plane()).unwrap();
        assert_eq!(display.len(), layout.actuators.len());
        let mut bytes = BytesMut::new();
        display.write(map, &mut bytes);
        bytes.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
    }

    #[test]
    fn a_constant_map_gives_gain_times_what_is_above_the_threshold() {
        let map = vec![7.0; 224 * 224];
        let more = Actuator { gain: Some(2.0), threshold: Some(6.5), ..at(50.0, 60.0) };
        let deaf = Actuator { threshold: Some(7.5), ..at(60.0, 60.0) };
        let loud = Actuator { gain: Some(100.0), ..at(70.0, 60.0) };
        let found = intensities(&layout(&[at(100.0, 100.0), more, deaf, loud]), &map);
        for (found, due) in found.iter().zip([2.5, 1.0, 0.0, 4.0]) {
            assert!((found - due).abs() < 1e-4, "{found} for {due}");
        }
    }

    #[test]
    fn a_cap_over_a_spot_weighs_as_its_formula() {
        // 0.1 mm a pixel: (1 - d^2 / r^2) integrates to pi r^2 / 2 over the disc, so a pixel at
        // the centre weighs 2 (0.1)^2 / (pi r^2), one at half the radius three quarters of that.
        for (pixels_off, share) in [(0, 1.0), (10, 0.75), (21, 0.0)] {
            let mut map = vec![0.0; 224 * 224];
            map[100 * 224 + 100 + pixels_off] = 1e4;
            let one = Actuator {
                radius_mm: Some(2.0),
                gain: Some(1e-4),
                threshold: Some(0.0),
                ..at(100.5, 100.5)
            };
            let due = share * 2.0 * 0.01 / (std::f32::consts::PI * 4.0);
            let found = intensities(&layout(&[one]), &map)[0];
            assert!((found - due).abs() < 0.01 * due.max(1e-6), "{found} for {due}");
        }
    }

    #[test]
    fn a_field_smaller_than_a_pixel_is_that_pixel() {
        let mut map = vec![0.0; 224 * 224];
        map[60 * 224 + 50] = 3.0;
        for radius_mm in [0.0, 1e-6] {
            let one = Actuator { radius_mm: Some(radius_mm), ..at(50.9, 60.1) };
            assert!((intensities(&layout(&[one]), &map)[0] - 0.5).abs() < 1e-6);
        }
    }

    #[test]
    fn what_is_unusable_is_named() {
        let refused = |layout: &Layout| Actuators::new(layout, &plane()).unwrap_err().message;
        let good = layout(&[at(100.0, 100.0)]);
        assert!(refused(&layout(&[])).contains("0 actuators"));
        let off = refused(&layout(&[at(100.0, 100.0), at(1.0, 1.0)]));
        assert!(off.contains("actuator 1"), "{off}");
        assert!(refused(&Layout { radius_mm: None, ..good.clone() }).contains("radius_mm"));
        assert!(refused(&Layout { gain: Some(f32::NAN), ..good.clone() }).contains("gain"));
        assert!(refused(&Layout { max: 0.0, ..good }).contains("max"));
        let many = Layout { radius_mm: Some(99.0), ..layout(&[at(100.0, 100.0); 99]) };
        assert!(refused(&many).contains("smaller"));
    }
}
