//! Structs of the header, member by member.

use std::ffi::c_char;

use papilla_proto::{Window, contact::Pose};

use crate::Answer;

/// A list; `data` is null if it is empty.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct PapillaSamples {
    data: *const f32,
    count: usize,
}

impl From<&[f32]> for PapillaSamples {
    fn from(values: &[f32]) -> Self {
        let data = if values.is_empty() { std::ptr::null() } else { values.as_ptr() };
        Self { data, count: values.len() }
    }
}

/// What is known of a model.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct PapillaModelInfo {
    pub(super) name: *const c_char,
    pub(super) atlas_hash: *const c_char,
    pub(super) pressure_max_pa: f32,
    pub(super) sed_max_j_per_m3: f32,
    pub(super) mm_per_px: f32,
    pub(super) has_contact: u32,
    pub(super) vertex_count: u32,
    pub(super) triangle_count: u32,
    pub(super) triangles: *const u32,
    pub(super) skin_mm: *const f32,
    pub(super) skin_uv_px: *const f32,
    pub(super) interface_mm: *const f32,
    pub(super) interface_uv_px: *const f32,
}

/// A pose: origin and quaternion.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct PapillaPose {
    origin_mm: [f32; 3],
    quaternion: [f32; 4],
}

impl From<&PapillaPose> for Pose {
    fn from(pose: &PapillaPose) -> Self {
        Self { origin_mm: pose.origin_mm, quaternion: pose.quaternion }
    }
}

/// A net force.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct PapillaNetForce {
    pub(super) direction: [f32; 3],
    pub(super) force_n: f32,
}

/// What a frame came to.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct PapillaAnswer {
    flags: u32,
    has_sed: u32,
    column: u32,
    row: u32,
    width: u32,
    height: u32,
    map: PapillaSamples,
    vertices: PapillaSamples,
    pressure_pa: PapillaSamples,
    rates_hz: PapillaSamples,
    points: PapillaSamples,
    point_rates_hz: PapillaSamples,
    actuators: PapillaSamples,
    summary: *const f32,
    touch: *const f32,
    error_estimate: *const f32,
}

impl From<Answer<'_>> for PapillaAnswer {
    fn from(answer: Answer<'_>) -> Self {
        let Window { x, y, width, height } = answer.window;
        let numbers = |values: &[f32]| PapillaSamples::from(values).data;
        Self {
            flags: u32::from(answer.flags),
            has_sed: answer.has_sed.into(),
            column: u32::from(x),
            row: u32::from(y),
            width: u32::from(width),
            height: u32::from(height),
            map: answer.map.into(),
            vertices: answer.vertices.into(),
            pressure_pa: answer.pressure_pa.into(),
            rates_hz: answer.rates_hz.into(),
            points: answer.points.into(),
            point_rates_hz: answer.point_rates_hz.into(),
            actuators: answer.actuators.into(),
            summary: numbers(answer.summary),
            touch: numbers(answer.touch),
            error_estimate: numbers(answer.error_estimate),
        }
    }
}

/// On machines of 64 bits; `tests/native.c` asserts the same of the header.
#[cfg(target_pointer_width = "64")]
const _: () = {
    use std::mem::offset_of;
    assert!(size_of::<PapillaPose>() == 28 && size_of::<PapillaNetForce>() == 16);
    assert!(size_of::<PapillaModelInfo>() == 80 && offset_of!(PapillaModelInfo, triangles) == 40);
    assert!(size_of::<PapillaAnswer>() == 160 && offset_of!(PapillaAnswer, map) == 24);
};
