//! PNG with text chunks.

use super::OutputError;

/// Encodes raw samples (16-bit ones big-endian) as PNG with tEXt chunks.
///
/// # Errors
/// [`OutputError::Encode`] when the samples do not fit the size.
pub fn encode_png(
    (width, height): (usize, usize),
    (color, depth): (png::ColorType, png::BitDepth),
    samples: &[u8],
    text: &[(&str, String)],
) -> Result<Vec<u8>, OutputError> {
    let failed =
        |e: png::EncodingError| OutputError::Encode { what: "PNG", message: e.to_string() };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::Balanced);
    for (key, value) in text {
        encoder.add_text_chunk((*key).to_string(), value.clone()).map_err(failed)?;
    }
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(samples).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}
