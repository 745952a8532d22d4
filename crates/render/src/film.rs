//! The film: sums of samples per pixel, in tiles that threads own one at a time, and named layers.
//!
//! Samples are added in the order of their index, in f64, so a film holds the same bits however the work was cut.
//! A sample with a NaN or an infinity is counted and kept out.
//!
//! A film may be of a [`Region`] of its picture alone: it then has the tiles of that region and no others, and a technique
//! puts into them the bits that it would put there if it filled the whole.

use std::collections::BTreeMap;

use glam::Vec3;
use halflight_image::{Picture, RgbImage};
use halflight_scene::lights::luminance;
use rayon::prelude::*;

/// Columns and rows of a tile: a multiple of the packets that coherent rays travel in.
pub const TILE_SIZE: usize = 16;

/// The sums of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    /// Sum of the radiance of the samples.
    pub sum: [f64; 3],
    /// Sum of the squared luminance of the samples.
    pub sum_squares: f64,
    /// How many samples were added.
    pub samples: u32,
}

impl Pixel {
    /// Adds a sample; returns whether it was finite. One that is not counts as black, so that the mean stays
    /// a mean over all samples.
    #[inline]
    pub fn add(&mut self, radiance: Vec3) -> bool {
        self.samples += 1;
        if !radiance.is_finite() {
            return false;
        }
        for (sum, value) in self.sum.iter_mut().zip(radiance.to_array()) {
            *sum += f64::from(value);
        }
        let luminance = f64::from(luminance(radiance));
        self.sum_squares += luminance * luminance;
        true
    }

    /// Mean radiance; black without samples.
    pub fn mean(&self) -> [f64; 3] {
        self.sum.map(|s| s / f64::from(self.samples.max(1)))
    }

    /// Variance of the mean luminance, estimated as if the samples were independent: with the stratified ones it
    /// is an upper bound. `None` with fewer than two samples.
    pub fn variance_of_mean(&self) -> Option<f64> {
        if self.samples < 2 {
            return None;
        }
        let n = f64::from(self.samples);
        let mean = self.luminance();
        Some(((self.sum_squares / n - mean * mean).max(0.0)) / (n - 1.0))
    }

    fn luminance(&self) -> f64 {
        let [r, g, b] = self.mean();
        f64::from(luminance(Vec3::new(r as f32, g as f32, b as f32)))
    }
}

/// A square of the film; at the right and lower border it may be smaller.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// Leftmost column.
    pub x: usize,
    /// Topmost row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The pixels, rows from the top.
    pub pixels: Vec<Pixel>,
    /// Samples that were not finite.
    pub non_finite: u64,
}

/// A rectangle of pixels of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Leftmost column.
    pub x: usize,
    /// Topmost row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Region {
    /// A whole picture.
    pub fn whole(width: usize, height: usize) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// Whether a pixel lies in it.
    #[inline]
    pub fn contains(&self, x: usize, y: usize) -> bool {
        (self.x..self.x + self.width).contains(&x) && (self.y..self.y + self.height).contains(&y)
    }

    /// Its part of what has one value for each pixel of a picture of `columns`, rows from the top.
    pub fn cut<T: Clone>(&self, values: &[T], columns: usize) -> Vec<T> {
        let rows = values.chunks_exact(columns).skip(self.y).take(self.height);
        rows.flat_map(|row| &row[self.x..self.x + self.width]).cloned().collect()
    }
}

/// What a technique fills: radiance, and layers of one value a pixel with the names they have in an OpenEXR file.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: usize,
    height: usize,
    region: Region,
    tiles: Vec<Tile>,
    /// Fewest samples of a pixel outside of the region, where the technique knows them and they may differ.
    elsewhere: Option<u32>,
    /// Layers by full channel name (`depth.Z`), rows from the top.
    pub layers: BTreeMap<String, Vec<f32>>,
}

impl Film {
    /// A film without samples.
    ///
    /// # Panics
    /// If a side is zero.
    pub fn new(width: usize, height: usize) -> Self {
        Self::part(width, height, Region::whole(width, height))
    }

    /// A film of a part of a picture: of the tiles whose first pixel lies in the region. Outside of them its
    /// [`image`](Self::image), [`picture`](Self::picture) and layers say nothing.
    ///
    /// # Panics
    /// If a side is zero, or the region holds no such tile.
    pub fn part(width: usize, height: usize, region: Region) -> Self {
        assert!(width > 0 && height > 0, "a film has pixels");
        let columns = width.div_ceil(TILE_SIZE);
        let corner = |index: usize| (index % columns * TILE_SIZE, index / columns * TILE_SIZE);
        let tile = |(x, y): (usize, usize)| {
            let (width, height) = (TILE_SIZE.min(width - x), TILE_SIZE.min(height - y));
            Tile { x, y, width, height, pixels: vec![Pixel::default(); width * height], non_finite: 0 }
        };
        let corners = (0..columns * height.div_ceil(TILE_SIZE)).into_par_iter().with_min_len(64).map(corner);
        let tiles: Vec<Tile> = corners.filter(|&(x, y)| region.contains(x, y)).map(tile).collect();
        assert!(!tiles.is_empty(), "a film has tiles");
        Self { width, height, region, tiles, elsewhere: None, layers: BTreeMap::new() }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The part of the picture that it is of.
    pub fn region(&self) -> Region {
        self.region
    }

    /// How many pixels it has.
    pub fn pixel_count(&self) -> usize {
        self.tiles.iter().map(|tile| tile.pixels.len()).sum()
    }

    /// Tells the fewest samples of a pixel outside of the region: what follows from [`min_samples`](Self::min_samples) is
    /// then the same in every part of a picture.
    pub fn set_samples_elsewhere(&mut self, fewest: u32) {
        self.elsewhere = Some(fewest);
    }

    /// The tiles, for threads to fill.
    pub fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }

    /// The tiles, row by row.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// Adds one sample to every pixel: `picture` holds width × height radiances, rows from the top. Returns how many were
    /// not finite and were kept out.
    ///
    /// # Panics
    /// If there are fewer radiances than pixels.
    pub fn add_picture(&mut self, picture: &[Vec3]) -> u64 {
        let before = self.non_finite();
        let width = self.width;
        self.tiles.par_iter_mut().for_each(|tile| {
            for (i, pixel) in tile.pixels.iter_mut().enumerate() {
                let (x, y) = (tile.x + i % tile.width, tile.y + i / tile.width);
                tile.non_finite += u64::from(!pixel.add(picture[y * width + x]));
            }
        });
        self.non_finite() - before
    }

    /// One number per pixel, rows from the top.
    pub fn map<T: Clone + Default>(&self, mut f: impl FnMut(&Pixel) -> T) -> Vec<T> {
        let mut result = vec![T::default(); self.width * self.height];
        for tile in &self.tiles {
            for (row, pixels) in tile.pixels.chunks(tile.width).enumerate() {
                let start = (tile.y + row) * self.width + tile.x;
                for (out, pixel) in result[start..].iter_mut().zip(pixels) {
                    *out = f(pixel);
                }
            }
        }
        result
    }

    /// Fewest samples of any pixel.
    pub fn min_samples(&self) -> u32 {
        let of_tile = |tile: &Tile| tile.pixels.iter().map(|p| p.samples).min();
        let fewest = self.tiles.par_iter().with_min_len(64).filter_map(of_tile).min();
        fewest.into_iter().chain(self.elsewhere).min().unwrap_or(0)
    }

    /// Samples a pixel, on the average.
    pub fn mean_samples(&self) -> f64 {
        self.pixels().map(|p| f64::from(p.samples)).sum::<f64>() / self.pixel_count() as f64
    }

    /// Samples that were not finite.
    pub fn non_finite(&self) -> u64 {
        self.tiles.iter().map(|t| t.non_finite).sum()
    }

    /// The mean over pixels of standard error / mean luminance, with the mean floored at a hundredth of the picture's,
    /// so that black pixels do not count for ever. `None` while a pixel has fewer than two samples.
    pub fn relative_error(&self) -> Option<f64> {
        let count = self.pixel_count() as f64;
        let floor = self.pixels().map(Pixel::luminance).sum::<f64>() / count * 0.01;
        if floor <= 0.0 {
            return (self.min_samples() >= 2).then_some(0.0);
        }
        // Summed tile by tile, so that the order does not depend on threads.
        let sums: Option<Vec<f64>> = self
            .tiles
            .par_iter()
            .map(|tile| {
                let error = |p: &Pixel| Some(p.variance_of_mean()?.sqrt() / p.luminance().max(floor));
                tile.pixels.iter().map(error).sum::<Option<f64>>()
            })
            .collect();
        Some(sums?.iter().sum::<f64>() / count)
    }

    /// Mean radiance per pixel.
    pub fn image(&self) -> RgbImage {
        let pixels = self.map(|p| p.mean().map(|c| c as f32));
        RgbImage { width: self.width, height: self.height, pixels }
    }

    /// Radiance, alpha and all layers, without metadata.
    pub fn picture(&self) -> Picture {
        let mut picture = Picture::new(self.width, self.height);
        for (channel, name) in ["R", "G", "B"].into_iter().enumerate() {
            picture.push(name, self.map(|p| p.mean()[channel] as f32));
        }
        for (name, values) in &self.layers {
            picture.push(name.clone(), values.clone());
        }
        picture
    }

    /// As [`Self::picture`]; the layers are moved out of the film instead of copied.
    pub fn take_picture(&mut self) -> Picture {
        let layers = std::mem::take(&mut self.layers);
        let mut picture = self.picture();
        for (name, values) in layers {
            picture.push(name, values);
        }
        picture
    }

    fn pixels(&self) -> impl Iterator<Item = &Pixel> {
        self.tiles.iter().flat_map(|t| &t.pixels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::Sampler;

    #[test]
    fn tiles_cover_every_pixel_once() {
        for (width, height) in [(1, 1), (16, 16), (17, 33), (100, 7)] {
            let mut film = Film::new(width, height);
            for tile in film.tiles_mut() {
                let (x, y, columns) = (tile.x, tile.y, tile.width);
                for (i, pixel) in tile.pixels.iter_mut().enumerate() {
                    pixel.add(Vec3::new((x + i % columns) as f32, (y + i / columns) as f32, 0.0));
                }
            }
            let image = film.image();
            for (i, pixel) in image.pixels.iter().enumerate() {
                assert_eq!(*pixel, [(i % width) as f32, (i / width) as f32, 0.0]);
            }
            assert_eq!(film.min_samples(), 1);
        }
    }

    #[test]
    fn a_film_of_a_part_has_the_tiles_of_its_region_only() {
        let region = Region { x: 16, y: 0, width: 24, height: 32 };
        let mut film = Film::part(40, 50, region);
        film.add_picture(&[Vec3::ONE; 40 * 50]);
        let counts = film.map(|p| p.samples);
        for (i, &count) in counts.iter().enumerate() {
            assert_eq!(count == 1, region.contains(i % 40, i / 40), "{i}");
        }
        assert_eq!((film.min_samples(), film.mean_samples(), film.pixel_count()), (1, 1.0, 24 * 32));
        assert_eq!(region.cut(&counts, 40), vec![1; 24 * 32]);
        film.set_samples_elsewhere(0);
        assert_eq!(film.min_samples(), 0);
    }

    #[test]
    fn a_sample_that_is_not_finite_is_kept_out() {
        let mut pixel = Pixel::default();
        assert!(pixel.add(Vec3::ONE));
        assert!(!pixel.add(Vec3::new(f32::NAN, 0.0, 0.0)));
        assert!(!pixel.add(Vec3::splat(f32::INFINITY)));
        assert_eq!((pixel.samples, pixel.sum), (3, [1.0; 3]));
    }

    #[test]
    fn the_relative_error_falls_with_the_root_of_the_samples() {
        let error = |n: u32| {
            let mut film = Film::new(20, 20);
            for (t, tile) in film.tiles_mut().iter_mut().enumerate() {
                for (i, pixel) in tile.pixels.iter_mut().enumerate() {
                    for s in 0..n {
                        let noise = Sampler::new(0, i as u32, t as u32, s).next_four()[0];
                        pixel.add(Vec3::splat(noise));
                    }
                }
            }
            film.relative_error().unwrap()
        };
        let ratio = error(64) / error(1024);
        assert!((ratio - 4.0).abs() < 0.3, "{ratio}");
        assert!(Film::new(4, 4).relative_error().is_none() || Film::new(4, 4).min_samples() == 0);
    }
}
