//! `spikes`: when the touch units of the finger fire.

use bytes::{BufMut, BytesMut};
use papilla_afferents::{
    Cell, Class, Densities, Fingertip, Neuron, Settings, UNITS_MAX, Unit, place,
};
use papilla_proto::{
    MAP_SIDE_PX, Problem,
    spikes::{
        PlacedUnit, SPIKE_LEN, SPIKES_HEAD_LEN, SPIKES_MAX, Spike, Spikes as Parameters, UnitClass,
    },
};
use papilla_session_state::{Reader, StateError, Writer};

use super::{Finger, Geometry, unusable};

/// Side of the parts of the map whose force acts as one, pixels: some 2 mm, which a wave passes
/// in about one step of a membrane.
const CELL_PX: usize = 16;
const CELLS: usize = MAP_SIDE_PX / CELL_PX;

/// Greatest modulus, kPa, as of the effect `afferents`.
const E_REF_MAX_KPA: f32 = 1e6;

/// The units of a finger.
#[derive(Debug)]
pub(super) struct Spikes {
    finger: Fingertip,
    placed: Vec<PlacedUnit>,
    force_n: Vec<f32>,
    spikes_max: usize,
}

impl Spikes {
    /// # Errors
    /// Densities or a seed without units, too many of them, or units off the interface.
    pub(super) fn new(
        of: &Parameters,
        finger: Finger<'_>,
        geometry: &Geometry,
    ) -> Result<Self, Problem> {
        if !(of.e_ref_kpa > 0.0 && of.e_ref_kpa <= E_REF_MAX_KPA) {
            let message = format!(
                "'e_ref_kpa' is {}; it has to be above 0 and at most {E_REF_MAX_KPA}",
                of.e_ref_kpa
            );
            return Err(unusable("spikes", message));
        }
        if !(1..=SPIKES_MAX).contains(&of.spikes_max) {
            let message = format!("'spikes_max' is {}; name 1 to {SPIKES_MAX}", of.spikes_max);
            return Err(unusable("spikes", message));
        }
        let units = match &of.units {
            Some(_) => named(of, geometry)?,
            None => drawn(of, geometry)?,
        };
        let place_mm = |pixel: u32| {
            let (row, column) = (pixel as usize / MAP_SIDE_PX, pixel as usize % MAP_SIDE_PX);
            let on = |raster: &papilla_proto::atlas::Raster| {
                raster.position_mm(finger.atlas, row, column)
            };
            on(finger.skin).or_else(|| on(finger.interface)).unwrap_or_default()
        };
        let placed = |unit: &Unit| PlacedUnit {
            class: class_on_wire(unit.class),
            model: unit.model,
            px: [unit.pixel % MAP_SIDE_PX as u32, unit.pixel / MAP_SIDE_PX as u32]
                .map(|px| px as f32 + 0.5),
        };
        let placed = units.iter().map(placed).collect();
        let spikes_max = usize::from(of.spikes_max);
        let settings = Settings { e_ref_kpa: of.e_ref_kpa, noise: of.noise.then_some(of.seed) };
        let cells = cells(&geometry.skin_mm2, place_mm);
        Ok(Self {
            finger: Fingertip::new(units, &cells, place_mm, settings, spikes_max),
            placed,
            force_n: vec![0.0; cells.len()],
            spikes_max,
        })
    }

    /// The units, by number.
    pub(super) fn placed(&self) -> &[PlacedUnit] {
        &self.placed
    }

    /// Bytes of the section.
    pub(super) fn len(&self) -> usize {
        SPIKES_HEAD_LEN + SPIKE_LEN * self.spikes_max
    }

    /// Goes on to the next frame.
    pub(super) fn step(
        &mut self,
        geometry: &Geometry,
        pressure_pa: &[f32],
        sed_j_per_m3: &[f32],
        time_us: u64,
    ) {
        self.force_n.fill(0.0);
        let rows = pressure_pa.chunks_exact(MAP_SIDE_PX);
        let rows = rows.zip(geometry.skin_mm2.chunks_exact(MAP_SIDE_PX)).enumerate();
        for (row, (pressures, areas)) in rows {
            let of_row = self.force_n[row / CELL_PX * CELLS..].iter_mut();
            let [pressures, areas] = [pressures, areas].map(|row| row.chunks_exact(CELL_PX));
            for (force_n, (pressures, areas)) in of_row.zip(pressures.zip(areas)) {
                let products = pressures.iter().zip(areas).map(|(pa, mm2)| pa * mm2);
                *force_n += 1e-6 * products.sum::<f32>();
            }
        }
        self.finger.step(time_us, sed_j_per_m3, &self.force_n);
    }

    /// Nobody knows what presses: nothing fires, and membranes stay as they are until somebody does.
    pub(super) fn lose(&mut self) {
        self.finger.pause();
    }

    /// Appends the section.
    pub(super) fn write(&self, time_us: u64, bytes: &mut BytesMut) {
        let end = bytes.len() + self.len();
        bytes.put_u32_le(self.finger.fired());
        bytes.put_u32_le(self.finger.spikes().len() as u32);
        for spike in self.finger.spikes() {
            let spike = Spike { unit: spike.unit, time_us: spike.time_us };
            bytes.put_slice(&spike.encode(time_us));
        }
        bytes.resize(end, 0);
    }

    /// Writes what the last frame left.
    pub(super) fn save(&self, state: &mut Writer) {
        self.finger.save(&mut |number| state.number(number));
    }

    /// Goes on from what another one has written.
    pub(super) fn restore(&mut self, state: &mut Reader<'_>) -> Result<(), StateError> {
        self.finger.restore(&mut || state.number())
    }
}

/// Units at random places.
fn drawn(of: &Parameters, geometry: &Geometry) -> Result<Vec<Unit>, Problem> {
    let area = |&(index, _): &(u32, [f32; 3])| (index, geometry.interface_mm2[index as usize]);
    let pixels: Vec<_> = geometry.interface.iter().map(area).collect();
    let densities = Densities { per_cm2: [of.sa1_per_cm2, of.ra_per_cm2, of.pc_per_cm2] };
    place(&pixels, densities, of.seed).map_err(|error| unusable("spikes", error.to_string()))
}

/// The units that a hello places.
fn named(of: &Parameters, geometry: &Geometry) -> Result<Vec<Unit>, Problem> {
    let named = of.units.as_deref().unwrap_or_default();
    if named.is_empty() || named.len() > UNITS_MAX {
        let message = format!("{} units; name 1 to {UNITS_MAX}", named.len());
        return Err(unusable("spikes", message));
    }
    let unit = |(number, unit): (usize, &papilla_proto::spikes::Unit)| {
        let name = format_args!("unit {number}").to_string();
        let (pixel, _) = geometry.locate(unit.at, "spikes", &name)?;
        let class = match unit.class {
            UnitClass::Sa1 => Class::Sa1,
            UnitClass::Ra => Class::Ra,
            UnitClass::Pc => Class::Pc,
        };
        let models = Neuron::models(class);
        if usize::from(unit.model) >= models {
            let message =
                format!("{name} has model {}; {class} units have {models}, from 0", unit.model);
            return Err(unusable("spikes", message));
        }
        Ok(Unit { class, model: unit.model, pixel })
    };
    named.iter().enumerate().map(unit).collect()
}

fn class_on_wire(class: Class) -> UnitClass {
    match class {
        Class::Sa1 => UnitClass::Sa1,
        Class::Ra => UnitClass::Ra,
        Class::Pc => UnitClass::Pc,
    }
}

/// The parts of the skin, row by row: middle and area; parts off the skin have no area.
fn cells(skin_mm2: &[f32], place_mm: impl Fn(u32) -> [f32; 3]) -> Vec<Cell> {
    let mut sums = vec![[0.0_f64; 4]; CELLS * CELLS];
    for (pixel, &mm2) in skin_mm2.iter().enumerate().filter(|(_, mm2)| **mm2 > 0.0) {
        let (row, column) = (pixel / MAP_SIDE_PX, pixel % MAP_SIDE_PX);
        let sum = &mut sums[row / CELL_PX * CELLS + column / CELL_PX];
        let [x, y, z] = place_mm(pixel as u32).map(f64::from);
        for (sum, value) in sum.iter_mut().zip([x, y, z, 1.0]) {
            *sum += f64::from(mm2) * value;
        }
    }
    let cell = |[x, y, z, mm2]: &[f64; 4]| Cell {
        at_mm: [x, y, z].map(|sum| if *mm2 > 0.0 { (sum / mm2) as f32 } else { 0.0 }),
        area_mm2: *mm2 as f32,
    };
    sums.iter().map(cell).collect()
}

#[cfg(test)]
mod tests;
