//! Networks with shapes that no shipped network has, compared with sums written as the trainer
//! defines them.

use super::super::net::{Net, Work, Workspace};
use super::super::parts::{CorrectionParts, LevelParts, Parts};
use crate::{MAP_LEN, MAP_SIDE_PX};

/// `[channels, n, n]`.
type Map = Vec<f64>;

/// A convolution to the map's own size.
fn convolve(map: &[f64], side: usize, weights: &[f32], channels: usize, kernel: usize) -> Map {
    let inputs = map.len() / (side * side);
    let half = (kernel / 2) as isize;
    let mut made = vec![0.0; channels * side * side];
    for (place, made) in made.iter_mut().enumerate() {
        let (channel, at) = (place / (side * side), place % (side * side));
        for input in 0..inputs {
            for tap in 0..kernel * kernel {
                let row = (at / side + tap / kernel) as isize - half;
                let column = (at % side + tap % kernel) as isize - half;
                let range = 0..side as isize;
                if range.contains(&row) && range.contains(&column) {
                    let weight = weights[(channel * inputs + input) * kernel * kernel + tap];
                    let pixel = (input * side + row as usize) * side + column as usize;
                    *made += f64::from(weight) * map[pixel];
                }
            }
        }
    }
    made
}

/// The 3 x 3 kernels that mix and interpolate.
fn between(mix: &[f32], components: usize) -> Vec<f32> {
    let lines = [[0.25, 0.75, 0.0], [0.0, 0.75, 0.25]];
    let mut kernels = vec![];
    for to in 0..components {
        for pixel in 0..4 {
            for from in 0..components {
                for tap in 0..9 {
                    let weight = lines[pixel / 2][tap / 3] * lines[pixel % 2][tap % 3];
                    kernels.push(mix[to * components + from] * weight);
                }
            }
        }
    }
    kernels
}

fn unshuffle(map: &[f64], side: usize) -> Map {
    (0..4 * side * side)
        .map(|place| {
            let (pixel, at) = (place / (side * side), place % (side * side));
            let (row, column) = (2 * (at / side) + pixel / 2, 2 * (at % side) + pixel % 2);
            map[row * 2 * side + column]
        })
        .collect()
}

fn shuffle(blocks: &[f64], side: usize) -> Map {
    let wide = 2 * side;
    (0..blocks.len())
        .map(|place| {
            let (channel, at) = (place / (wide * wide), place % (wide * wide));
            let (row, column) = (at / wide, at % wide);
            let pixel = 2 * (row % 2) + column % 2;
            blocks[((4 * channel + pixel) * side + row / 2) * side + column / 2]
        })
        .collect()
}

fn means(blocks: &[f64]) -> Map {
    let len = blocks.len() / 4;
    (0..len).map(|at| (0..4).map(|pixel| blocks[pixel * len + at]).sum::<f64>() / 4.0).collect()
}

/// `1 + weights place`, of a channel at a block.
fn gain(weights: &[f32], place: &[f32], channel: usize, at: usize, pixels: usize) -> f64 {
    let places = place.len() / pixels;
    let terms = (0..places)
        .map(|k| f64::from(weights[channel * places + k]) * f64::from(place[k * pixels + at]));
    1.0 + terms.sum::<f64>()
}

fn corrected(parts: &CorrectionParts, components: &mut Map, blocks: &[f64], side: usize) {
    let pixels = side * side;
    let inputs = [&components[..], blocks].concat();
    let value = convolve(&inputs, side, &parts.value, parts.hidden, parts.kernel);
    let gate = convolve(&inputs, side, &parts.gate, parts.hidden, parts.kernel);
    let hidden: Map = (0..value.len())
        .map(|place| {
            let (channel, at) = (place / pixels, place % pixels);
            let gain = gain(&parts.over_finger, &parts.place, channel, at, pixels);
            value[place] * gate[place].clamp(-1.0, 1.0) * gain
        })
        .collect();
    let added = convolve(&hidden, side, &parts.out, components.len() / pixels, 1);
    components.iter_mut().zip(added).for_each(|(component, added)| *component += added);
}

fn answer(parts: &Parts, pressure_pa: &[f32]) -> Map {
    let count = parts.components;
    let mut pixels: Map =
        pressure_pa.iter().map(|p| f64::from(*p) * f64::from(parts.unit)).collect();
    let mut blocks = vec![];
    for level in &parts.levels {
        blocks.push(unshuffle(&pixels, level.side));
        pixels = means(&blocks[blocks.len() - 1]);
    }
    let inner: Map = (0..parts.rank)
        .map(|k| {
            let terms = pixels.iter().enumerate();
            terms.map(|(at, p)| p * f64::from(parts.reach_in[at * parts.rank + k])).sum()
        })
        .collect();
    let mut above: Map = (0..count * pixels.len())
        .map(|at| {
            let weight = |k: usize| f64::from(parts.reach_out[k * count * pixels.len() + at]);
            inner.iter().enumerate().map(|(k, inner)| inner * weight(k)).sum()
        })
        .collect();
    let mut components = vec![];
    for (level, blocks) in parts.levels.iter().zip(&blocks).rev() {
        let LevelParts { side, kernel, .. } = *level;
        let pixels = side * side;
        components = convolve(&above, side, &between(&level.mix, count), 4 * count, 3);
        let near = convolve(blocks, side, &level.near, 4 * count, kernel);
        for (place, near) in near.iter().enumerate() {
            let (channel, at) = (place / pixels, place % pixels);
            components[place] += near * gain(&level.over_finger, &level.place, channel, at, pixels);
        }
        if let Some(parts) = &level.correction {
            corrected(parts, &mut components, blocks, side);
        }
        above = shuffle(&components, side);
    }
    let len = above.len() / count;
    let _ = components;
    let sed = (0..len).map(|at| (0..count).map(|c| above[c * len + at].powi(2)).sum::<f64>());
    sed.zip(&parts.mask).map(|(sed, mask)| sed * f64::from(*mask)).collect()
}

/// Weights of a size that keeps values about 1.
fn random(random: &mut fastrand::Rng, len: usize, terms: usize) -> Vec<f32> {
    let size = 1.0 / (terms as f32).sqrt();
    (0..len).map(|_| size * (2.0 * random.f32() - 1.0)).collect()
}

struct Shape {
    components: usize,
    kernel: usize,
    rank: usize,
    /// Width and kernel of the correction of each level, the finest first.
    corrections: Vec<Option<(usize, usize)>>,
    places: usize,
}

fn parts(shape: &Shape, rng: &mut fastrand::Rng) -> Parts {
    let Shape { components, kernel, rank, places, .. } = *shape;
    let mut levels = vec![];
    for (index, correction) in shape.corrections.iter().enumerate() {
        let side = (MAP_SIDE_PX / 2) >> index;
        let (channels, inputs) = (4 * components, 4 * components + 4);
        let place = random(rng, places * side * side, 1);
        levels.push(LevelParts {
            side,
            kernel,
            near: random(rng, channels * 4 * kernel * kernel, 4 * kernel * kernel),
            mix: random(rng, components * components, components),
            over_finger: random(rng, channels * places, 4 * places),
            place: place.clone(),
            correction: correction.map(|(hidden, kernel)| CorrectionParts {
                hidden,
                inputs,
                kernel,
                value: random(rng, hidden * inputs * kernel * kernel, inputs * kernel),
                gate: random(rng, hidden * inputs * kernel * kernel, inputs * kernel),
                out: random(rng, channels * hidden, hidden),
                over_finger: random(rng, hidden * places, 4 * places),
                place,
            }),
        });
    }
    let coarsest = levels[levels.len() - 1].side.pow(2);
    let mask = (0..MAP_LEN).map(|at| {
        let (row, column) = (at / MAP_SIDE_PX, at % MAP_SIDE_PX);
        // Holes, an island and blank rows.
        let is_blank =
            row < 5 || (30..40).contains(&row) || (row / 3 + column) % 11 == 0 || column > 213;
        if is_blank { 0.0 } else { 1.5 }
    });
    Parts {
        unit: 0.001,
        components,
        rank,
        reach_in: random(rng, coarsest * rank, 50),
        reach_out: random(rng, rank * components * coarsest, rank),
        mask: mask.collect(),
        levels,
    }
}

#[test]
fn networks_of_other_shapes_are_what_the_trainer_defines() {
    let mut rng = fastrand::Rng::with_seed(7);
    for shape in [
        Shape { components: 1, kernel: 1, rank: 1, corrections: vec![None], places: 1 },
        Shape {
            components: 5,
            kernel: 5,
            rank: 7,
            corrections: vec![None, Some((3, 1)), Some((5, 3))],
            places: 5,
        },
        Shape {
            components: 3,
            kernel: 7,
            rank: 33,
            corrections: vec![Some((1, 3)), Some((6, 1)), None],
            places: 2,
        },
        Shape {
            components: 2,
            kernel: 3,
            rank: 4,
            corrections: vec![None, None, None, None],
            places: 5,
        },
        Shape {
            components: 7,
            kernel: 9,
            rank: 5,
            corrections: vec![None, Some((13, 3))],
            places: 5,
        },
    ] {
        let parts = parts(&shape, &mut rng);
        let net = Net::new(&parts);
        let mut space = Workspace::new(&net);
        for patch in [[60, 90, 9], [0, 0, 3], [200, 205, 40], [0, 0, 224]] {
            let [top, left, size] = patch;
            let mut pressure_pa = vec![0.0; MAP_LEN];
            for (place, p) in pressure_pa.iter_mut().enumerate() {
                let (row, column) = (place / MAP_SIDE_PX, place % MAP_SIDE_PX);
                if (top..top + size).contains(&row) && (left..left + size).contains(&column) {
                    *p = 1000.0 * rng.f32();
                }
            }
            let due = answer(&parts, &pressure_pa);
            let greatest = due.iter().copied().fold(0.0, f64::max);
            assert!(greatest > 0.0);
            let mut found = vec![3.0; MAP_LEN];
            for (adds, times) in [(false, 1.0), (true, 2.0)] {
                let (net, space, sed_j_per_m3) = (&net, &mut space, &mut found[..]);
                Work { net, space, pressure_pa: &pressure_pa, sed_j_per_m3, adds }.run();
                for (place, (found, due)) in found.iter().zip(&due).enumerate() {
                    let apart = (f64::from(*found) - times * due).abs();
                    assert!(
                        apart <= 1e-5 * times * greatest,
                        "{patch:?} {} {}: {found}, not {due}",
                        place / MAP_SIDE_PX,
                        place % MAP_SIDE_PX
                    );
                }
            }
        }
    }
}
