//! `contact_window`, and the samples of a window.

use bytes::BytesMut;
use papilla_codec::{Output, append, scale_of};
use papilla_proto::{SampleError, SampleType, Window};

/// Appends the samples of `window` to `bytes`; returns their scale, that of the window's greatest.
///
/// # Errors
/// Values that are not finite or below zero.
pub(crate) fn encode(
    window: Window,
    sample_type: SampleType,
    map: &[f32],
    bytes: &mut BytesMut,
) -> Result<f32, SampleError> {
    let scale = if sample_type.is_scaled() {
        let values = window.rows().flat_map(|row| map.get(row).unwrap_or_default());
        let top = values.fold(0.0, |top, &v| if v > top { v } else { top });
        scale_of(Output::Samples(sample_type), top)
    } else {
        1.0
    };
    if window == Window::WHOLE {
        append(sample_type, map, scale, bytes)?;
        return Ok(scale);
    }
    let at = bytes.len();
    bytes.resize(at + window.pixel_count() * sample_type.bytes(), 0);
    window.encode(sample_type, map, scale, &mut bytes[at..])?;
    Ok(scale)
}
