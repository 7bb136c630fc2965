//! The warm start of a finger's solver as bytes.

use papilla_contact::{Anchor, Hardest, Memory, PixelMemory, Side};
use papilla_session_state::{Reader, StateError, Writer};

/// More vertices than any patch holds, and than a map has pixels: what a damaged count can make the
/// reader take.
const VERTICES_MAX: usize = 1 << 16;

pub(crate) fn write(memory: &Memory, state: &mut Writer) {
    let Memory { vertices, near, stride, made, forces_n, made_with, reached, .. } = memory;
    for count in [vertices.len(), *near, *stride, *made] {
        state.number(count as u64);
    }
    vertices.iter().for_each(|vertex| state.number(u64::from(*vertex)));
    state.floats(forces_n.as_flattened());
    state.floats(made_with.as_flattened());
    let bits = |of: usize| reached.map(|reached| reached[of].to_bits());
    state.option(bits(0));
    state.option(bits(1));
    write_sides(&memory.sides, state);
}

fn write_sides(sides: &[Side], state: &mut Writer) {
    state.number(sides.len() as u64);
    for Side { way, origin_mm, witness, is_held, is_guess, hardest } in sides {
        for vector in [way, origin_mm] {
            for i in 0..3 {
                state.option(vector.map(|v| v[i].to_bits()));
            }
        }
        state.option(witness.map(u64::from));
        state.number(u64::from(hardest.is_some()));
        if let Some(Hardest { origin_mm, rotation, force_n }) = hardest {
            let values = origin_mm.iter().chain(rotation.as_flattened()).chain([force_n]);
            values.for_each(|value| state.number(value.to_bits()));
        }
        state.number(u64::from(*is_held) + 2 * u64::from(*is_guess));
    }
}

fn read_sides(state: &mut Reader<'_>) -> Result<Vec<Side>, StateError> {
    let count = state.count(VERTICES_MAX, "a number of objects")?;
    let side = |_| {
        let mut vectors = [Some([0.0; 3]); 2];
        for vector in &mut vectors {
            for i in 0..3 {
                match (state.option()?, &mut *vector) {
                    (Some(bits), Some(v)) => v[i] = f64::from_bits(bits),
                    _ => *vector = None,
                }
            }
        }
        let [way, origin_mm] = vectors;
        let witness = state.option()?.map(|vertex| vertex.min(u64::from(u32::MAX)) as u32);
        let mut hardest = None;
        if state.count(1, "a place of greatest force")? == 1 {
            let mut values = [0.0; 13];
            for value in &mut values {
                *value = f64::from_bits(state.number()?);
            }
            let [origin_mm, a, b, c] = [0, 3, 6, 9].map(|at| [0, 1, 2].map(|i| values[at + i]));
            hardest = Some(Hardest { origin_mm, rotation: [a, b, c], force_n: values[12] });
        }
        let bits = state.count(3, "how an object is held")?;
        let (is_held, is_guess) = (bits & 1 != 0, bits & 2 != 0);
        Ok(Side { way, origin_mm, witness, is_held, is_guess, hardest })
    };
    (0..count).map(side).collect()
}

/// Of a session whose objects may have friction.
pub(crate) fn write_anchors(anchors: &[Anchor], state: &mut Writer) {
    state.number(anchors.len() as u64);
    for Anchor { vertex, object, place_mm } in anchors {
        state.number(u64::from(*vertex));
        state.number(u64::from(*object));
        place_mm.iter().for_each(|value| state.number(value.to_bits()));
    }
}

pub(crate) fn read_anchors(state: &mut Reader<'_>) -> Result<Vec<Anchor>, StateError> {
    let count = state.count(VERTICES_MAX, "a number of anchors")?;
    let anchor = |_| {
        let vertex = state.count(u32::MAX as usize, "a vertex")? as u32;
        let object = state.count(u32::MAX as usize, "an object")? as u32;
        let mut place_mm = [0.0; 3];
        for value in &mut place_mm {
            *value = f64::from_bits(state.number()?);
        }
        Ok(Anchor { vertex, object, place_mm })
    };
    (0..count).map(anchor).collect()
}

pub(crate) fn write_pixels(memory: &PixelMemory, state: &mut Writer) {
    let PixelMemory { vertices, forces_n, pixels, pressure_pa } = memory;
    for indices in [vertices, pixels] {
        state.number(indices.len() as u64);
        indices.iter().for_each(|index| state.number(u64::from(*index)));
    }
    state.floats(forces_n.as_flattened());
    state.floats(pressure_pa);
}

pub(crate) fn read_pixels(state: &mut Reader<'_>) -> Result<PixelMemory, StateError> {
    let mut memory = PixelMemory::default();
    for indices in [&mut memory.vertices, &mut memory.pixels] {
        let count = state.count(VERTICES_MAX, "a number of vertices or pixels")?;
        let index = |_| state.count(u32::MAX as usize, "a vertex or pixel").map(|i| i as u32);
        *indices = (0..count).map(index).collect::<Result<_, _>>()?;
    }
    memory.forces_n.resize(memory.vertices.len(), [0.0; 6]);
    memory.pressure_pa.resize(memory.pixels.len(), 0.0);
    state.floats(memory.forces_n.as_flattened_mut())?;
    state.floats(&mut memory.pressure_pa)?;
    Ok(memory)
}

pub(crate) fn read(state: &mut Reader<'_>) -> Result<Memory, StateError> {
    let slots = state.count(VERTICES_MAX, "a number of vertices")?;
    let near = state.count(slots, "a number of near vertices")?;
    let stride = state.count(VERTICES_MAX, "a length of rows")?;
    let made = state.count(slots, "a number of rows")?;
    let vertex = |_| state.count(u32::MAX as usize, "a vertex").map(|vertex| vertex as u32);
    let vertices = (0..slots).map(vertex).collect::<Result<_, _>>()?;
    let (mut forces_n, mut made_with) = (vec![[0.0; 4]; slots], vec![[0.0; 4]; made]);
    state.floats(forces_n.as_flattened_mut())?;
    state.floats(made_with.as_flattened_mut())?;
    let [travel_mm, slope] = [state.option()?, state.option()?];
    let reached = travel_mm.zip(slope).map(|(a, b)| [a, b].map(f64::from_bits));
    let (anchors, sides) = (Vec::new(), read_sides(state)?);
    Ok(Memory { vertices, near, stride, made, forces_n, made_with, reached, anchors, sides })
}
