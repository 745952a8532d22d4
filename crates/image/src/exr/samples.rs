//! From decompressed blocks to planes of floats.

use exr::block::UncompressedBlock;
use exr::meta::attribute::{ChannelList, SampleType};
use half::f16;

/// The channels of one part, over its data window.
pub(super) struct Planes {
    width: usize,
    height: usize,
    channels: Vec<(SampleType, Vec<f32>)>,
    bytes_per_pixel: usize,
}

impl Planes {
    pub(super) fn new(width: usize, height: usize, list: &ChannelList) -> Self {
        let channels = list.list.iter().map(|c| (c.sample_type, vec![0.0; width * height])).collect();
        let bytes_per_pixel = list.list.iter().map(|c| c.sample_type.bytes_per_sample()).sum();
        Self { width, height, channels, bytes_per_pixel }
    }

    /// Puts a block in its place. A block holds, for each row, the row of each channel in turn.
    pub(super) fn insert(&mut self, block: &UncompressedBlock) -> Result<(), String> {
        let (x0, y0) = (block.index.pixel_position.0, block.index.pixel_position.1);
        let (width, height) = (block.index.pixel_size.0, block.index.pixel_size.1);
        let inside = x0 + width <= self.width && y0 + height <= self.height;
        if !inside || block.data.len() != width * height * self.bytes_per_pixel {
            return Err(format!("a block of {width} × {height} pixels at ({x0}, {y0}) does not fit"));
        }
        let mut rest = block.data.as_slice();
        for y in y0..y0 + height {
            for (kind, plane) in &mut self.channels {
                let (row, after) = rest.split_at(width * kind.bytes_per_sample());
                rest = after;
                let start = y * self.width + x0;
                decode_row(*kind, row, &mut plane[start..start + width]);
            }
        }
        Ok(())
    }

    /// The planes cut and padded to a window whose top left corner is at `offset` from theirs.
    pub(super) fn into_window(self, offset: [i64; 2], width: usize, height: usize) -> Vec<Vec<f32>> {
        if offset == [0, 0] && (width, height) == (self.width, self.height) {
            return self.channels.into_iter().map(|(_, plane)| plane).collect();
        }
        let x0 = (-offset[0]).clamp(0, width as i64) as usize;
        let x1 = (self.width as i64 - offset[0]).clamp(0, width as i64) as usize;
        let window = |plane: Vec<f32>| {
            let mut out = vec![0.0; width * height];
            for y in 0..height {
                let source = y as i64 + offset[1];
                if (0..self.height as i64).contains(&source) && x0 < x1 {
                    let start = source as usize * self.width + (x0 as i64 + offset[0]) as usize;
                    out[y * width + x0..y * width + x1].copy_from_slice(&plane[start..start + x1 - x0]);
                }
            }
            out
        };
        self.channels.into_iter().map(|(_, plane)| window(plane)).collect()
    }
}

/// Samples come in the byte order of this machine: the crate has turned them.
fn decode_row(kind: SampleType, bytes: &[u8], out: &mut [f32]) {
    fn each<const N: usize>(bytes: &[u8], out: &mut [f32], convert: impl Fn([u8; N]) -> f32) {
        for (value, &chunk) in out.iter_mut().zip(bytes.as_chunks::<N>().0) {
            *value = convert(chunk);
        }
    }
    match kind {
        SampleType::F16 => each(bytes, out, |b| f16::from_ne_bytes(b).to_f32()),
        SampleType::F32 => each(bytes, out, f32::from_ne_bytes),
        SampleType::U32 => each(bytes, out, |b| u32::from_ne_bytes(b) as f32),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_cuts_and_pads() {
        let plane = vec![1.0, 2.0, 3.0, 4.0];
        let planes = || Planes {
            width: 2,
            height: 2,
            channels: vec![(SampleType::F32, plane.clone())],
            bytes_per_pixel: 4,
        };
        assert_eq!(planes().into_window([0, 0], 2, 2)[0], plane);
        assert_eq!(planes().into_window([1, 1], 2, 2)[0], [4.0, 0.0, 0.0, 0.0]);
        assert_eq!(planes().into_window([-1, -1], 3, 3)[0], [0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 0.0, 3.0, 4.0]);
        assert_eq!(planes().into_window([5, 0], 2, 1)[0], [0.0, 0.0]);
    }
}
