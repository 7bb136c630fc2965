//! Functions of a model.

use std::{
    ffi::{CString, c_char},
    sync::Arc,
};

use papilla_proto::{MAP_LEN, atlas::Patch, contact::Input};

use super::{
    handle::{self, Failure, Handle, LastError},
    types::PapillaModelInfo,
};
use crate::{Model, Status};

/// A model's handle.
#[derive(Debug, Default)]
pub(crate) struct PapillaModel {
    model: Option<Arc<Model>>,
    name: CString,
    atlas_hash: CString,
    error: LastError,
}

impl Handle for PapillaModel {
    fn last_error(&mut self) -> &mut LastError {
        &mut self.error
    }

    fn give_up(&mut self) {
        self.model = None;
    }
}

impl PapillaModel {
    /// The model, once it is loaded.
    pub(super) fn loaded(&self) -> Result<&Arc<Model>, Failure> {
        let message = "no model is loaded: call papilla_model_load first";
        self.model.as_ref().ok_or_else(|| Failure::new(Status::NotOpen, message))
    }
}

/// A handle without a model.
#[unsafe(no_mangle)]
pub(crate) extern "C" fn papilla_model_new() -> *mut PapillaModel {
    handle::new()
}

/// Frees a handle; sessions that were opened with it go on.
///
/// # Safety
/// `model` is null or of `papilla_model_new`, and not used again.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_model_free(model: *mut PapillaModel) {
    // SAFETY: as the caller promises.
    unsafe { handle::free(model) }
}

/// What the last failed call with this handle said; empty after one that went well.
///
/// # Safety
/// `model` is null or of `papilla_model_new`.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_model_error(model: *const PapillaModel) -> *const c_char {
    // SAFETY: as the caller promises.
    unsafe { model.as_ref() }.map_or(c"model is null".as_ptr(), |model| model.error.message())
}

/// Reads a folder of models.
///
/// # Safety
/// `model` is null or of `papilla_model_new`; texts are null or end with a zero.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_model_load(
    model: *mut PapillaModel,
    folder: *const c_char,
    tier: *const c_char,
    contact: *const c_char,
) -> i32 {
    let work = |handle: &mut PapillaModel| {
        // SAFETY: as the caller promises.
        let (folder, tier, contact) = unsafe {
            let folder = handle::due_text("folder", folder)?;
            (folder, handle::text("tier", tier)?, handle::path("contact", contact)?)
        };
        let model = Model::load(folder.as_ref(), tier, contact)?;
        let name = model.network_for(Input::Objects).card.name.clone();
        handle.name = CString::new(name).unwrap_or_default();
        handle.atlas_hash = CString::new(model.bundle.atlas.hash()).unwrap_or_default();
        handle.model = Some(Arc::new(model));
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { handle::with(model, work) }
}

/// What is known of a model that is loaded. Pointers stay until the next load, or the end.
///
/// # Safety
/// `model` is null or of `papilla_model_new`; `info` is null or room for one.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_model_info(
    model: *mut PapillaModel,
    info: *mut PapillaModelInfo,
) -> i32 {
    let work = |handle: &mut PapillaModel| {
        // SAFETY: as the caller promises.
        let info = unsafe { handle::room("info", info) }?;
        let model = handle.loaded()?;
        let [skin, interface] =
            [Patch::Skin, Patch::Interface].map(|p| model.bundle.atlas.patch(p));
        let network = model.network_for(Input::Objects).model.info();
        info.write(PapillaModelInfo {
            name: handle.name.as_ptr(),
            atlas_hash: handle.atlas_hash.as_ptr(),
            pressure_max_pa: network.pressure_max_pa,
            sed_max_j_per_m3: network.sed_max_j_per_m3,
            mm_per_px: model.bundle.atlas.mm_per_px(),
            has_contact: u32::from(model.bundle.contact.is_some()),
            vertex_count: model.bundle.atlas.vertex_count() as u32,
            triangle_count: model.bundle.atlas.triangles().len() as u32,
            triangles: model.bundle.atlas.triangles().as_flattened().as_ptr(),
            skin_mm: skin.positions_mm.as_flattened().as_ptr(),
            skin_uv_px: skin.uv_px.as_flattened().as_ptr(),
            interface_mm: interface.positions_mm.as_flattened().as_ptr(),
            interface_uv_px: interface.uv_px.as_flattened().as_ptr(),
        });
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { handle::with(model, work) }
}

/// Draws values at the vertices of the skin as a map.
///
/// # Safety
/// `model` is null or of `papilla_model_new`; `values` holds `count` values, `map` has room for
/// 224 x 224.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_model_rasterise(
    model: *mut PapillaModel,
    values: *const f32,
    count: usize,
    map: *mut f32,
) -> i32 {
    let work = |handle: &mut PapillaModel| {
        // SAFETY: as the caller promises.
        let (values, map) = unsafe {
            let map: *mut [f32; MAP_LEN] = map.cast();
            (handle::list("values", values, count)?, handle::room("map", map)?)
        };
        // SAFETY: zeros are floats.
        let map = unsafe {
            map.as_mut_ptr().write_bytes(0, 1);
            map.assume_init_mut()
        };
        let drawn = handle.loaded()?.rasterise(values, map);
        drawn.map_err(|error| Failure::new(Status::WrongLength, error.to_string()))
    };
    // SAFETY: as the caller promises.
    unsafe { handle::with(model, work) }
}
