//! A rectangle of the map: what a frame carries when it carries less than all of it.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::{MAP_LEN, MAP_SIDE_PX, SampleError, SampleType};

/// A rectangle of pixels. Width or height 0: no pixel at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Window {
    /// Column of the first pixel.
    pub x: u16,
    /// Row of the first pixel.
    pub y: u16,
    /// Columns.
    pub width: u16,
    /// Rows.
    pub height: u16,
}

impl Window {
    /// The whole map.
    pub const WHOLE: Self =
        Self { x: 0, y: 0, width: MAP_SIDE_PX as u16, height: MAP_SIDE_PX as u16 };

    /// No pixel.
    pub const EMPTY: Self = Self { x: 0, y: 0, width: 0, height: 0 };

    /// Pixels in it.
    #[must_use]
    pub fn pixel_count(self) -> usize {
        usize::from(self.width) * usize::from(self.height)
    }

    /// Whether it lies in the map.
    #[must_use]
    pub fn is_inside(self) -> bool {
        let end = |start: u16, length: u16| usize::from(start) + usize::from(length);
        end(self.x, self.width) <= MAP_SIDE_PX && end(self.y, self.height) <= MAP_SIDE_PX
    }

    /// The part of a map's samples that each row of the window is, from the first row to the
    /// last. A window that is not [inside](Self::is_inside) is cut.
    pub fn rows(self) -> impl Iterator<Item = Range<usize>> {
        let columns = usize::from(self.x).min(MAP_SIDE_PX)
            ..(usize::from(self.x) + usize::from(self.width)).min(MAP_SIDE_PX);
        let rows =
            usize::from(self.y)..(usize::from(self.y) + usize::from(self.height)).min(MAP_SIDE_PX);
        let rows = if columns.is_empty() { 0..0 } else { rows };
        rows.map(move |row| {
            let start = row * MAP_SIDE_PX;
            start + columns.start..start + columns.end
        })
    }

    /// The smallest window that holds every pixel of `map` (224 x 224) above `limit`, widened by
    /// `margin_px` on each side as far as the map goes; empty if there is no such pixel.
    #[must_use]
    pub fn around(map: &[f32], limit: f32, margin_px: u16) -> Self {
        let above = |row: &[f32]| row.iter().fold(false, |found, &v| found | (v > limit));
        let rows = || map.chunks_exact(MAP_SIDE_PX);
        let Some(top) = rows().position(above) else { return Self::EMPTY };
        let bottom = rows().rposition(above).unwrap_or(top);
        let (mut left, mut right) = (MAP_SIDE_PX, 0);
        for row in rows().skip(top).take(bottom - top + 1) {
            // Only what lies outside of the columns found so far can widen them.
            if let Some(column) = row[..left].iter().position(|&v| v > limit) {
                left = column;
            }
            if let Some(column) = row[right..].iter().rposition(|&v| v > limit) {
                right += column;
            }
        }
        let margin = usize::from(margin_px);
        let span = |first: usize, last: usize| {
            let start = first.saturating_sub(margin);
            (start as u16, ((last + margin).min(MAP_SIDE_PX - 1) + 1 - start) as u16)
        };
        let ((x, width), (y, height)) = (span(left, right), span(top, bottom));
        Self { x, y, width, height }
    }

    /// Decodes `payload`, the window's samples, into their places in `map` (224 x 224, in the
    /// unit of `scale`); all other pixels become 0.
    ///
    /// # Errors
    /// The payload's length does not fit the window, or the scale is unusable.
    pub fn decode(
        self,
        sample_type: SampleType,
        payload: &[u8],
        scale: f32,
        map: &mut [f32],
    ) -> Result<(), SampleError> {
        if self == Self::WHOLE {
            return sample_type.decode(payload, scale, map);
        }
        sample_type.require(payload.len(), self.pixel_count(), scale)?;
        if map.len() != MAP_LEN || !self.is_inside() {
            let needed = MAP_LEN * sample_type.bytes();
            let bytes = payload.len();
            return Err(SampleError::WrongLength { bytes, needed, samples: MAP_LEN, sample_type });
        }
        map.fill(0.0);
        let row_bytes = usize::from(self.width) * sample_type.bytes();
        for (row, bytes) in self.rows().zip(payload.chunks_exact(row_bytes.max(1))) {
            sample_type.decode(bytes, scale, &mut map[row])?;
        }
        Ok(())
    }

    /// Encodes the window's samples of `map` (224 x 224) into `payload`.
    ///
    /// # Errors
    /// As [`decode`](Self::decode).
    pub fn encode(
        self,
        sample_type: SampleType,
        map: &[f32],
        scale: f32,
        payload: &mut [u8],
    ) -> Result<(), SampleError> {
        if self == Self::WHOLE {
            return sample_type.encode(map, scale, payload);
        }
        sample_type.require(payload.len(), self.pixel_count(), scale)?;
        let row_bytes = usize::from(self.width) * sample_type.bytes();
        for (row, bytes) in self.rows().zip(payload.chunks_exact_mut(row_bytes.max(1))) {
            sample_type.encode(map.get(row).unwrap_or_default(), scale, bytes)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_window() -> impl Strategy<Value = Window> {
        (0..224u16, 0..224u16).prop_flat_map(|(x, y)| {
            (0..=224 - x, 0..=224 - y).prop_map(move |(width, height)| Window {
                x,
                y,
                width,
                height,
            })
        })
    }

    /// A map whose samples are whole numbers, all different enough to show a displacement.
    fn numbered() -> Vec<f32> {
        (0..MAP_LEN).map(|i| (i * 7919 % 251) as f32).collect()
    }

    #[test]
    fn a_window_around_single_pixels_is_exact() {
        let mut map = vec![0.0; MAP_LEN];
        assert_eq!(Window::around(&map, 0.0, 9), Window::EMPTY);
        map[20 * MAP_SIDE_PX + 30] = 2.0;
        assert_eq!(Window::around(&map, 0.0, 0), Window { x: 30, y: 20, width: 1, height: 1 });
        assert_eq!(Window::around(&map, 2.0, 0), Window::EMPTY, "above, not at, the limit");
        map[41 * MAP_SIDE_PX + 28] = 1.0;
        map[30 * MAP_SIDE_PX + 223] = 1.0;
        let tight = Window::around(&map, 0.0, 0);
        assert_eq!(tight, Window { x: 28, y: 20, width: 196, height: 22 });
        let wide = Window::around(&map, 0.0, 25);
        assert_eq!(wide, Window { x: 3, y: 0, width: 221, height: 67 });
        assert_eq!(Window::around(&map, 0.0, 500), Window::WHOLE);
        assert_eq!(Window::around(&vec![1.0; MAP_LEN], 0.0, 3), Window::WHOLE);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn windows_come_back_and_the_rest_is_zero(window in any_window(), number in 0u8..4) {
            let sample_type = SampleType::from_wire(number).unwrap();
            let map = numbered();
            let mut payload = vec![0; window.pixel_count() * sample_type.bytes()];
            window.encode(sample_type, &map, 1.0, &mut payload).unwrap();
            let mut back = vec![-1.0; MAP_LEN];
            window.decode(sample_type, &payload, 1.0, &mut back).unwrap();
            let inside = |i: usize| {
                let (row, column) = ((i / MAP_SIDE_PX) as u16, (i % MAP_SIDE_PX) as u16);
                (window.x..window.x + window.width).contains(&column)
                    && (window.y..window.y + window.height).contains(&row)
            };
            for i in 0..MAP_LEN {
                let due = if inside(i) { map[i] } else { 0.0 };
                prop_assert_eq!(back[i].to_bits(), due.to_bits(), "pixel {}", i);
            }
        }

        #[test]
        fn the_window_around_is_the_smallest(
            places in prop::collection::vec(0..MAP_LEN, 1..6), margin in 0u16..40,
        ) {
            let mut map = vec![0.0; MAP_LEN];
            places.iter().for_each(|&place| map[place] = 1.0);
            let window = Window::around(&map, 0.0, margin);
            let span = |of: fn(usize) -> usize| {
                let found = || places.iter().map(|&p| of(p));
                let start = found().min().unwrap().saturating_sub(usize::from(margin));
                (start, (found().max().unwrap() + usize::from(margin)).min(223) + 1 - start)
            };
            let (columns, rows) = (span(|p| p % MAP_SIDE_PX), span(|p| p / MAP_SIDE_PX));
            prop_assert_eq!((usize::from(window.x), usize::from(window.width)), columns);
            prop_assert_eq!((usize::from(window.y), usize::from(window.height)), rows);
        }

        #[test]
        fn no_window_and_no_length_panics(
            numbers in any::<[u16; 4]>(), bytes in 0usize..5000, number in 0u8..4,
        ) {
            let [x, y, width, height] = numbers.map(|n| n % 300);
            let window = Window { x, y, width, height };
            let sample_type = SampleType::from_wire(number).unwrap();
            let mut map = vec![0.0; MAP_LEN];
            let decoded = window.decode(sample_type, &vec![1; bytes], 1.0, &mut map);
            let fits = bytes == window.pixel_count() * sample_type.bytes() && window.is_inside();
            prop_assert_eq!(decoded.is_ok(), fits);
            let _ = window.encode(sample_type, &map, 1.0, &mut vec![0; bytes]);
        }
    }
}
