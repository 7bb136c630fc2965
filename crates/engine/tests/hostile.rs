//! Model files that were damaged or made to do harm: refused, or answering like any other; never
//! a panic, never without end, never more memory than a map needs.
//!
//! A test binary of its own, for its allocator: it turns a request for more than [`MOST`] bytes
//! down, which ends the process, and remembers the largest.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]
// An allocator is unsafe by its nature; this one hands everything to the system's.
#![allow(unsafe_code)]

mod common;

use common::{altered, graph, node, press_pa};
use papilla_engine::{EngineError, MAP_LEN, load};
use prost::Message;
use std::{
    alloc::{GlobalAlloc, Layout, System},
    fs,
    ops::Range,
    sync::atomic::{AtomicUsize, Ordering},
    sync::mpsc,
    time::Duration,
};
use tract_onnx::pb::{
    AttributeProto, ModelProto, NodeProto, TensorProto, attribute_proto::AttributeType,
    tensor_proto::DataType,
};

/// No model may ask for more at once, bytes.
const MOST: usize = 3 << 30;

/// What loading and running a small model takes at once at most, bytes: a map, a file, a list of
/// patches of a convolution.
const MUCH: usize = 64 << 20;

struct Bounded;

static LARGEST: AtomicUsize = AtomicUsize::new(0);

fn is_too_much(bytes: usize) -> bool {
    LARGEST.fetch_max(bytes, Ordering::Relaxed);
    bytes > MOST
}

// SAFETY: every method hands its arguments on to the system's allocator unchanged, or says that
// there is no memory.
unsafe impl GlobalAlloc for Bounded {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if is_too_much(layout.size()) {
            return std::ptr::null_mut();
        }
        // SAFETY: as the caller promised.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if is_too_much(layout.size()) {
            return std::ptr::null_mut();
        }
        // SAFETY: as the caller promised.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if is_too_much(size) {
            return std::ptr::null_mut();
        }
        // SAFETY: as the caller promised.
        unsafe { System.realloc(place, layout, size) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: as the caller promised.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Bounded = Bounded;

/// What becomes of a file: it is refused, or its answer to a contact is finite and not negative, or
/// an error. A model that takes minutes hangs.
fn fate(onnx: Vec<u8>) -> Result<(), EngineError> {
    let (report, reports) = mpsc::channel();
    std::thread::spawn(move || {
        let fate = load(&onnx, None).and_then(|model| {
            let mut sed_j_per_m3 = vec![f32::NAN; MAP_LEN];
            model.session()?.infer(&press_pa(), &mut sed_j_per_m3)?;
            let good = |v: &f32| v.is_finite() && *v >= 0.0;
            assert!(sed_j_per_m3.iter().all(good), "a wrong map was given out for a right one");
            Ok(())
        });
        let _ = report.send(fate);
    });
    match reports.recv_timeout(Duration::from_secs(300)) {
        Ok(fate) => {
            let largest = LARGEST.load(Ordering::Relaxed);
            assert!(largest < MUCH, "{largest} bytes were asked for at once: {fate:?}");
            fate
        }
        Err(mpsc::RecvTimeoutError::Timeout) => panic!("the model hangs"),
        Err(mpsc::RecvTimeoutError::Disconnected) => panic!("the engine panicked"),
    }
}

fn ints(name: &str, ints: &[i64]) -> AttributeProto {
    let (name, r#type) = (name.to_owned(), AttributeType::Ints as i32);
    AttributeProto { name, r#type, ints: ints.to_vec(), ..Default::default() }
}

fn int(name: &str, i: i64) -> AttributeProto {
    let (name, r#type) = (name.to_owned(), AttributeType::Int as i32);
    AttributeProto { name, r#type, i, ..Default::default() }
}

fn longs(name: &str, values: &[i64]) -> TensorProto {
    let raw_data = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let dims = vec![values.len() as i64];
    let data_type = DataType::Int64 as i32;
    TensorProto { name: name.into(), dims, data_type, raw_data, ..Default::default() }
}

fn floats(name: &str, dims: &[i64]) -> TensorProto {
    let count = dims.iter().product::<i64>() as usize;
    let (dims, raw_data) = (dims.to_vec(), 1_f32.to_le_bytes().repeat(count));
    let data_type = DataType::Float as i32;
    TensorProto { name: name.into(), dims, data_type, raw_data, ..Default::default() }
}

/// The small model with `scale_out` made of the greatest value of what `kind` gives.
fn scaled_by(kind: &str, inputs: &[&str], more: &[TensorProto], how: &[AttributeProto]) -> Vec<u8> {
    let made =
        |kind: &str, inputs: &[&str], output: &str, attribute: &[AttributeProto]| NodeProto {
            op_type: kind.into(),
            name: output.into(),
            input: inputs.iter().map(|&input| input.to_owned()).collect(),
            output: vec![output.into()],
            attribute: attribute.to_vec(),
            ..Default::default()
        };
    altered(|model| {
        let graph = graph(model);
        let scale = graph.initializer.iter_mut().find(|t| t.name == "scale_out").unwrap();
        scale.name = "one".into();
        graph.initializer.extend_from_slice(more);
        graph.node.insert(0, made(kind, inputs, "huge", how));
        graph.node.insert(1, made("ReduceMax", &["huge"], "scale_out", &[int("keepdims", 0)]));
    })
}

#[test]
fn graphs_that_make_much_of_little() {
    let huge = &[longs("n", &[1 << 40])][..];
    let numbers = [longs("from", &[0]), longs("to", &[1 << 42]), longs("by", &[1])];
    let numbers = numbers.map(|t| TensorProto { dims: vec![], ..t });
    let row = longs("row", &[1, 1]);
    let tiles = [row.clone(), longs("n", &[1 << 40])];
    let pads = [row.clone(), longs("n", &[0, 1 << 38])];
    let hot = [row, longs("depth", &[1 << 40]), longs("values", &[0, 1])];
    let sizes = [longs("n", &[1, 1, 1 << 20, 1 << 20])];
    // Two lists of 160 kB whose sums have 4e8 values.
    let lists = [floats("column", &[20_000, 1]), floats("line", &[1, 20_000])];
    let window = vec![ints("kernel_shape", &[1 << 20, 1 << 20]), ints("pads", &[1 << 19; 4])];
    let float = int("dtype", 1);
    for (kind, inputs, more, how) in [
        ("ConstantOfShape", &["n"][..], huge, vec![]),
        ("Expand", &["one", "n"], huge, vec![]),
        ("Range", &["from", "to", "by"], &numbers, vec![]),
        ("Tile", &["row", "n"], &tiles, vec![]),
        ("OneHot", &["row", "depth", "values"], &hot, vec![]),
        ("Pad", &["row", "n"], &pads, vec![]),
        ("Pad", &["x", "n"], &[longs("n", &[0, 0, 1 << 38, 0, 0, 0, 0, 0])], vec![]),
        ("Resize", &["x", "", "", "n"], &sizes, vec![]),
        ("Add", &["column", "line"], &lists, vec![]),
        ("MatMul", &["column", "line"], &lists, vec![]),
        ("RandomNormal", &[], &[], vec![ints("shape", &[1 << 40]), float]),
        ("MaxPool", &["x"], &[], window.clone()),
        ("AveragePool", &["x"], &[], window),
        ("LRN", &["x"], &[], vec![int("size", i64::MAX)]),
        ("SpaceToDepth", &["x"], &[], vec![int("blocksize", i64::MAX)]),
        ("Loop", &["n"], huge, vec![]),
    ] {
        let error = fate(scaled_by(kind, inputs, more, &how)).expect_err(kind);
        assert!(error.to_string().len() > 20, "{error}");
    }
}

#[test]
fn initialisers_that_are_larger_than_the_file() {
    for dims in [
        vec![1 << 40],
        vec![i64::MAX, i64::MAX],
        vec![1 << 32, 1 << 32],
        vec![1 << 62, 2, 2, 0],
        vec![-1, 4],
    ] {
        for empty in [false, true] {
            let fate = fate(altered(|model| {
                let tensor = &mut graph(model).initializer[1];
                tensor.dims = dims.clone();
                if empty {
                    tensor.raw_data.clear();
                }
            }));
            // None has as many values as its shape says, but that of no values.
            assert!(
                matches!(fate, Err(EngineError::BrokenTensor { .. }))
                    || (empty && dims.contains(&0) && fate.is_err()),
                "{dims:?}: {fate:?}"
            );
        }
    }
}

#[test]
fn names_that_are_made_twice_or_too_late() {
    // What depends on constants alone must not pass for what depends on the map.
    let late = altered(|model| {
        let graph = graph(model);
        let last = graph.node.len() - 1;
        graph.node.swap(0, last);
    });
    let twice = altered(|model| node(model, "pool").output[0] = "bottom.w".into());
    for onnx in [late, twice] {
        assert!(matches!(fate(onnx), Err(EngineError::Operator { .. })));
    }
}

/// Where the file holds the raw data of its initialisers and of constants.
fn raw_data(onnx: &[u8]) -> Vec<Range<usize>> {
    let graph = ModelProto::decode(onnx).unwrap().graph.unwrap();
    let attributes = graph.node.into_iter().flat_map(|node| node.attribute);
    let constants = attributes.filter_map(|attribute| attribute.t);
    let tensors: Vec<_> = graph.initializer.into_iter().chain(constants).collect();
    let place = |t: &TensorProto| {
        let start = onnx.windows(t.raw_data.len()).position(|w| w == t.raw_data)?;
        Some(start..start + t.raw_data.len())
    };
    tensors.iter().filter(|t| t.raw_data.len() > 64).filter_map(place).collect()
}

/// Shipped networks of two widths.
fn shipped() -> [(&'static str, Vec<u8>); 2] {
    ["nano", "small"].map(|name| {
        let path = format!("{}/../../models/{name}.onnx", env!("CARGO_MANIFEST_DIR"));
        (name, fs::read(path).unwrap())
    })
}

#[test]
fn five_hundred_flipped_bits() {
    let mut random = fastrand::Rng::with_seed(500);
    let (mut refused, mut answered) = (0, 0);
    for (name, whole) in shipped() {
        let weights = raw_data(&whole);
        for n in 0..250 {
            let mut at = random.usize(..whole.len());
            // Half of them in what is not weights: there a bit changes most.
            while n % 2 == 0 && weights.iter().any(|part| part.contains(&at)) {
                at = random.usize(..whole.len());
            }
            let mut onnx = whole.clone();
            onnx[at] ^= 1 << random.u8(..8);
            match fate(onnx) {
                Ok(()) => answered += 1,
                Err(error) => {
                    assert!(error.to_string().len() > 20, "{name}, byte {at}: {error}");
                    refused += 1;
                }
            }
        }
    }
    // Neither all nor none: the flips reach both what is checked and what cannot be.
    assert!(refused > 100 && answered > 50, "{refused} refused, {answered} answered");
}

#[test]
fn shipped_models_cut_short() {
    let mut random = fastrand::Rng::with_seed(40);
    for (name, whole) in shipped() {
        let random = std::iter::repeat_with(|| random.usize(..whole.len())).take(40);
        for length in [0, 1, 2, whole.len() / 2, whole.len() - 1].into_iter().chain(random) {
            let fate = fate(whole[..length].to_vec());
            assert!(
                matches!(
                    fate,
                    Err(EngineError::NotOnnx { .. } | EngineError::MissingMetadata { .. })
                ),
                "{name}, {length} bytes: {fate:?}"
            );
        }
    }
}
