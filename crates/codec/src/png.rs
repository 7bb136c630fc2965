//! Maps as gray PNG: what an image program can draw and show.

use std::io::{Cursor, Write};

use papilla_proto::{ErrorCode, MAP_SIDE_PX, Problem, SampleType};
use png::{BitDepth, ColorType, Decoder, Encoder, EncodingError, Limits, Transformations};

use super::{EncodeError, refusal, wrong_shape};

/// Memory the decoder may take beyond the image; a hostile file gets no further.
const DECODER_BYTES_MAX: usize = 4 << 20;

/// Whether `bytes` start like a PNG file.
pub fn is_png(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x89PNG\r\n\x1a\n")
}

/// Decodes an 8- or 16-bit gray PNG; full white is `pressure_max_pa`.
pub(super) fn decode(
    bytes: &[u8],
    pressure_max_pa: f32,
    pressure_pa: &mut [f32],
) -> Result<(), Problem> {
    let bad = |error: png::DecodingError| Problem::new(ErrorCode::BadPng, error.to_string());
    let limits = Limits { bytes: DECODER_BYTES_MAX };
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(bad)?;
    let info = reader.info();
    let (rows, columns) = (info.height as usize, info.width as usize);
    if (rows, columns) != (MAP_SIDE_PX, MAP_SIDE_PX) {
        return Err(wrong_shape(rows, columns));
    }
    let sample_type = match (info.color_type, info.bit_depth) {
        (ColorType::Grayscale, BitDepth::Eight) => SampleType::U8,
        (ColorType::Grayscale, BitDepth::Sixteen) => SampleType::U16,
        (colour, depth) => {
            let colour = match colour {
                ColorType::Grayscale => "gray",
                ColorType::GrayscaleAlpha => "gray with alpha",
                ColorType::Rgb => "RGB",
                ColorType::Rgba => "RGBA",
                ColorType::Indexed => "of indexed colours",
            };
            let bits = depth as u8;
            let message = format!("the PNG is {colour} of {bits} bits; 8- or 16-bit gray is due");
            return Err(Problem::new(ErrorCode::WrongType, message));
        }
    };
    let mut pixels = vec![0; pressure_pa.len() * sample_type.bytes()];
    reader.next_frame(&mut pixels).map_err(bad)?;
    if sample_type == SampleType::U16 {
        // PNG is big-endian, samples are little-endian.
        pixels.as_chunks_mut::<2>().0.iter_mut().for_each(|pair| pair.swap(0, 1));
    }
    let scale = pressure_max_pa / sample_type.unit_max();
    sample_type.decode(&pixels, scale, pressure_pa).map_err(refusal)
}

/// Writes a 16-bit gray PNG; full white is `white_j_per_m3`.
pub(super) fn encode(
    sed_j_per_m3: &[f32],
    white_j_per_m3: f32,
    out: impl Write,
) -> Result<(), EncodingError> {
    let mut pixels = Vec::with_capacity(sed_j_per_m3.len() * 2);
    let scale = white_j_per_m3 / f32::from(u16::MAX);
    for &value in sed_j_per_m3 {
        pixels.extend_from_slice(&((value / scale + 0.5) as u16).to_be_bytes());
    }
    let mut encoder = Encoder::new(out, MAP_SIDE_PX as u32, MAP_SIDE_PX as u32);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_depth(BitDepth::Sixteen);
    // The client waits: small enough is better than smallest.
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels)?;
    writer.finish()
}

/// Writes a mask, 224 x 224, as an 8-bit gray PNG, white where true.
///
/// # Errors
/// A mask of another length, or `out` takes no more.
pub fn encode_mask(mask: &[bool], out: impl Write) -> Result<(), EncodeError> {
    let pixels: Vec<u8> = mask.iter().map(|&inside| if inside { 255 } else { 0 }).collect();
    let mut encoder = Encoder::new(out, MAP_SIDE_PX as u32, MAP_SIDE_PX as u32);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_depth(BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels)?;
    Ok(writer.finish()?)
}

#[cfg(test)]
mod tests {
    use papilla_proto::MAP_LEN;
    use proptest::prelude::*;

    use super::*;

    fn image(width: u32, height: u32, colour: ColorType, depth: BitDepth, data: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        let mut encoder = Encoder::new(&mut out, width, height);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        out
    }

    fn code_of(bytes: &[u8]) -> ErrorCode {
        decode(bytes, 1.0, &mut vec![0.0; MAP_LEN]).unwrap_err().code
    }

    #[test]
    fn what_is_written_reads_back_within_half_a_unit() {
        let map: Vec<f32> = (0..MAP_LEN).map(|i| i as f32 * 0.25).collect();
        let mut bytes = Vec::new();
        encode(&map, 13_000.0, &mut bytes).unwrap();
        let mut back = vec![0.0; MAP_LEN];
        decode(&bytes, 13_000.0, &mut back).unwrap();
        let scale = 13_000.0 / 65_535.0;
        for (a, b) in map.iter().zip(&back) {
            assert!((a - b).abs() <= SampleType::U16.error_max(*a, scale), "{a} {b}");
        }
    }

    #[test]
    fn eight_bits_are_taken_too() {
        let gray = image(224, 224, ColorType::Grayscale, BitDepth::Eight, &vec![51; MAP_LEN]);
        let mut map = vec![0.0; MAP_LEN];
        decode(&gray, 1000.0, &mut map).unwrap();
        assert!(map.iter().all(|p| (p - 200.0).abs() < 1e-3));
    }

    #[test]
    fn other_images_are_refused_for_what_they_are() {
        let (gray, rgb) = (ColorType::Grayscale, ColorType::Rgb);
        let eight = BitDepth::Eight;
        assert_eq!(code_of(&image(2, 3, gray, eight, &[0; 6])), ErrorCode::WrongShape);
        assert_eq!(
            code_of(&image(224, 224, rgb, eight, &vec![0; 3 * MAP_LEN])),
            ErrorCode::WrongType
        );
        assert_eq!(code_of(b"no png"), ErrorCode::BadPng);
        let whole = image(224, 224, gray, eight, &vec![9; MAP_LEN]);
        assert_eq!(code_of(&whole[..whole.len() / 2]), ErrorCode::BadPng);
    }

    proptest! {
        #[test]
        fn damaged_files_do_not_panic(at in 0usize..200, with in any::<u8>()) {
            let mut bytes = image(224, 224, ColorType::Grayscale, BitDepth::Eight, &vec![9; MAP_LEN]);
            let at = at % bytes.len();
            bytes[at] = with;
            let _ = decode(&bytes, 1.0, &mut vec![0.0; MAP_LEN]);
        }
    }
}
