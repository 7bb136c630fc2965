//! Records and an atlas for tests of the file formats; no physics in them.

#![allow(clippy::unwrap_used, reason = "for tests")]

use crate::record::{Cells, Checks, Pose, Sample};
use crate::{CHECK_COLUMNS, FORMAT, IndentationEntry, Manifest, Split, Splits, Units};
use crate::{dataset_sha256, sha256_hex, shard_file};
use papilla_atlas::{Atlas, PatchVertices};

/// Two cells beside each other.
#[must_use]
pub fn two_cells() -> Cells {
    let nodes = |first: u32| std::array::from_fn(|n| first + n as u32 / 3 * 5 + n as u32 % 3);
    Cells {
        place: vec![[1, 0, 0, 128, 128], [1, 0, 128, 128, 128]],
        nodes: vec![nodes(0), nodes(2)],
    }
}

/// A well-formed record whose numbers follow from depth and vertex.
#[must_use]
pub fn record(depth_mm: f64, vertex_count: usize) -> Sample {
    posed_record(Pose { pitch_deg: 0.0, roll_deg: 0.0, yaw_deg: 0.0 }, depth_mm, vertex_count)
}

/// As [`record`], depending on the pose too.
#[must_use]
pub fn posed_record(pose: Pose, depth_mm: f64, vertex_count: usize) -> Sample {
    let field = |scale: f64| -> Vec<f64> {
        let phase = pose.pitch_deg / 30.0 + pose.roll_deg / 20.0;
        let wave = |i: usize| 1.0 + (i as f64 * 0.7 + phase).sin();
        (0..vertex_count).map(|i| scale * depth_mm * wave(i)).collect()
    };
    Sample {
        cells: None,
        depth_mm,
        slide_mm: [0.0; 2],
        force_n: [0.0, 0.0, depth_mm * depth_mm],
        pressure_mpa: field(0.01),
        sed_dermis_mpa: field(0.002),
        sed_epidermis_mpa: field(0.003),
        shear_mpa: Vec::new(),
        outside_calibration: 0.0,
        checks: Checks {
            residual_relative: 1e-9,
            contact_force_vs_pressure_integral: 1e-4,
            plate_vs_support_reaction: 1e-8,
            energy_vs_work: 2e-4,
            j_min: 0.95,
            penetration_mm_max: 1e-5,
            newton_iterations: 5,
            ..Checks::default()
        },
    }
}

/// What a manifest says of a flat plate's indentation whose shard has these bytes.
#[must_use]
pub fn entry(id: usize, split: Split, samples: usize, shard: &[u8]) -> IndentationEntry {
    IndentationEntry {
        id,
        file: shard_file(id),
        sha256: sha256_hex(shard),
        split,
        samples,
        indenter: "plate".into(),
        shape: "plate".into(),
        pose: Pose { pitch_deg: 10.0, roll_deg: -5.0, yaw_deg: 0.0 },
        offset_mm: [0.0; 2],
        checks: Checks::default(),
    }
}

/// A manifest of these, whose greatest pressure (Pa) and SED (J/m3) are `most`.
#[must_use]
pub fn manifest(atlas: &Atlas, presses: Vec<IndentationEntry>, most: [f64; 2]) -> Manifest {
    let of = |split| presses.iter().filter(|p| p.split == split).map(|p| p.id).collect();
    Manifest {
        format: FORMAT,
        atlas_hash: atlas.hash().to_owned(),
        campaign: serde_json::Value::Null,
        seed: 0,
        software: "tests".into(),
        units: Units::default(),
        effects: vec!["layers".into()],
        vertex_count: atlas.vertex_count(),
        pressure_max_pa: most[0],
        sed_max_j_per_m3: most[1],
        check_columns: CHECK_COLUMNS.map(String::from).to_vec(),
        failed: Vec::new(),
        dropped: Vec::new(),
        splits: Splits { train: of(Split::Train), test: of(Split::Test) },
        dataset_sha256: dataset_sha256(presses.iter().map(|p| p.sha256.as_str())),
        presses,
    }
}

/// A flat square atlas of `side` x `side` quads.
#[must_use]
pub fn atlas(side: usize) -> Atlas {
    let patch = |inset: f32, z: f32| {
        let mut vertices = PatchVertices::default();
        for i in 0..(side + 1) * (side + 1) {
            let (row, column) = ((i / (side + 1)) as f32, (i % (side + 1)) as f32);
            let px = |t: f32| 20.0 + inset + (184.0 - 2.0 * inset) * t / side as f32;
            vertices.uv_px.push([px(column), px(row)]);
            vertices.positions_mm.push([px(row) * 0.1, -px(column) * 0.1, z]);
        }
        vertices
    };
    let mut triangles = Vec::new();
    for row in 0..side {
        for column in 0..side {
            let at = |r: usize, c: usize| ((row + r) * (side + 1) + column + c) as u32;
            triangles.extend([[at(0, 0), at(1, 0), at(0, 1)], [at(0, 1), at(1, 0), at(1, 1)]]);
        }
    }
    Atlas::new(0.1, triangles, patch(0.0, -1.0), patch(4.0, -0.8)).unwrap()
}
