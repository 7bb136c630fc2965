//! The fuzz corpora, replayed and mutated by ordinary tests: what `tests/fuzz/run` does with a
//! nightly compiler and feedback, in seconds with any compiler.

use std::{fs, path::Path};

/// Inputs made of the corpus; the same ones in every run.
const MUTATIONS: usize = 2000;

/// Fewer are made of a corpus of long inputs: bytes of all of them.
const BYTES_MAX: usize = 2 << 20;

/// Runs `entry` on every input in `corpus/target` and on mutations of them. A panic names the
/// input it came from, and `tests/fuzz/run` finds it again.
pub(crate) fn replay(corpus: &str, target: &str, entry: fn(&[u8])) {
    let folder = Path::new(corpus).join(target);
    let mut files: Vec<_> =
        fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(!files.is_empty(), "{} is empty", folder.display());
    let seeds: Vec<Vec<u8>> = files.iter().map(|file| fs::read(file).unwrap()).collect();
    seeds.iter().for_each(|seed| entry(seed));

    let mut random = fastrand::Rng::with_seed(5);
    let mut bytes = 0;
    for n in 0..MUTATIONS {
        if bytes > BYTES_MAX {
            break;
        }
        let at = random.usize(..seeds.len());
        let mut input = seeds[at].clone();
        for _ in 0..=random.usize(..4) {
            mutate(&mut input, &seeds[random.usize(..seeds.len())], &mut random);
        }
        bytes += input.len();
        let outcome = std::panic::catch_unwind(|| entry(&input));
        if let Err(panic) = outcome {
            let found = std::env::temp_dir().join(format!("papilla-fuzz-{target}-{n}"));
            fs::write(&found, &input).unwrap();
            eprintln!(
                "{target}: input {n}, made of {}, is {}",
                files[at].display(),
                found.display()
            );
            std::panic::resume_unwind(panic);
        }
    }
}

/// Bytes that parsers stumble over.
const AWKWARD: [&[u8]; 12] = [
    b"\0",
    b"\xff",
    b"\x7f",
    b"\xff\xff\xff\xff",
    b"-",
    b"9999999999999999999999",
    b"1e999",
    b"NaN",
    b"\n",
    b"\"",
    b"[",
    b"\xc3\x28",
];

/// One change, of the kinds that libFuzzer makes.
fn mutate(input: &mut Vec<u8>, other: &[u8], random: &mut fastrand::Rng) {
    if input.is_empty() {
        input.extend_from_slice(other);
        return;
    }
    let start = random.usize(..input.len());
    let end = start + random.usize(..=(input.len() - start).min(16));
    match random.u8(..8) {
        0 => input[start] ^= 1 << random.u8(..8),
        1 => input[start] = random.u8(..),
        2 => drop(input.drain(start..end)),
        3 => input.truncate(start),
        4 => {
            let copy = input[start..end].to_vec();
            drop(input.splice(start..start, copy));
        }
        5 => drop(input.splice(start..end, AWKWARD[random.usize(..AWKWARD.len())].iter().copied())),
        6 => {
            let from = random.usize(..=other.len());
            let to = from + random.usize(..=(other.len() - from).min(64));
            drop(input.splice(start..end, other[from..to].iter().copied()));
        }
        _ => {
            let step = random.u8(..8);
            input[start] = input[start].wrapping_add(step).wrapping_sub(4);
        }
    }
}
