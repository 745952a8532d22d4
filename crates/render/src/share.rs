//! Pictures divided among machines: share I of N is a rectangle of film tiles.
//!
//! Shares are bands of rows while there are rows of tiles for all, and pieces of such rows beyond. They cover every pixel
//! once, and hang on nothing but the size of the picture and N.

use std::fmt;
use std::str::FromStr;

use crate::film::{Region, TILE_SIZE};

/// One of so many parts of a picture: `3/8` is the third of eight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Share {
    /// From 1 to `count`.
    pub index: u32,
    /// How many parts there are.
    pub count: u32,
}

impl Share {
    /// Share `index` of `count`.
    ///
    /// # Errors
    /// If there is no such share.
    pub fn new(index: u32, count: u32) -> Result<Self, String> {
        if count == 0 || index == 0 || index > count {
            return Err(format!(
                "there is no tile {index} of {count}: tiles are numbered from 1 (1/{0} … {0}/{0})",
                count.max(1)
            ));
        }
        Ok(Self { index, count })
    }

    /// Its pixels, in a picture of that size.
    ///
    /// # Errors
    /// If the picture has fewer film tiles than there are shares.
    ///
    /// ```
    /// use halflight_render::share::Share;
    /// let share: Share = "2/3".parse()?;
    /// let region = share.region(640, 360)?;
    /// assert_eq!((region.x, region.y, region.width, region.height), (0, 112, 640, 128));
    /// # Ok::<(), String>(())
    /// ```
    pub fn region(&self, width: usize, height: usize) -> Result<Region, String> {
        let [columns, rows] = [width, height].map(|side| side.div_ceil(TILE_SIZE) as u64);
        let (index, count) = (u64::from(self.index - 1), u64::from(self.count));
        if count > rows * columns {
            return Err(format!(
                "a picture of {width}×{height} pixels can be divided into {} tiles at most, not {count}",
                rows * columns
            ));
        }
        // The start of part `i` of `of` in so many.
        let start = |i: u64, of: u64, many: u64| i * many / of;
        let pixels = |from: u64, to: u64, side: usize| {
            let [from, to] = [from, to].map(|at| (at as usize * TILE_SIZE).min(side));
            (from, to - from)
        };
        if count <= rows {
            let (y, height) = pixels(start(index, count, rows), start(index + 1, count, rows), height);
            return Ok(Region { x: 0, y, width, height });
        }
        // Row r of tiles has the shares from r·N/R on.
        let row = (0..rows).rev().find(|&row| start(row, rows, count) <= index).unwrap_or(0);
        let (first, end) = (start(row, rows, count), start(row + 1, rows, count));
        let (place, of) = (index - first, end - first);
        let (x, width) = pixels(start(place, of, columns), start(place + 1, of, columns), width);
        let (y, height) = pixels(row, row + 1, height);
        Ok(Region { x, y, width, height })
    }
}

impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Share {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.trim().parse().ok();
        let parts = text.split_once('/').and_then(|(index, count)| Some((number(index)?, number(count)?)));
        let (index, count) = parts.ok_or_else(|| format!("expected I/N, for example 1/4, found {text:?}"))?;
        Self::new(index, count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_cover_every_pixel_once_whatever_their_number() {
        for (width, height) in [(1, 1), (16, 16), (100, 70), (333, 50)] {
            let most = (width as u32).div_ceil(16) * (height as u32).div_ceil(16);
            for count in 1..=most {
                let mut covered = vec![0; width * height];
                for index in 1..=count {
                    let region = Share::new(index, count).unwrap().region(width, height).unwrap();
                    assert!(region.width > 0 && region.height > 0);
                    assert!(region.x.is_multiple_of(TILE_SIZE) && region.y.is_multiple_of(TILE_SIZE));
                    for y in region.y..region.y + region.height {
                        covered[y * width + region.x..][..region.width].iter_mut().for_each(|n| *n += 1);
                    }
                }
                assert!(covered.iter().all(|&n| n == 1), "{width}×{height} in {count}");
            }
            assert!(Share { index: 1, count: most + 1 }.region(width, height).is_err());
        }
    }

    #[test]
    fn shares_are_numbered_from_one() {
        assert_eq!("3/8".parse(), Ok(Share { index: 3, count: 8 }));
        assert_eq!("3/8".parse::<Share>().unwrap().to_string(), "3/8");
        for text in ["", "3", "0/4", "5/4", "1/0", "-1/4", "a/b", "1/2/3", "1/99999999999"] {
            assert!(text.parse::<Share>().is_err(), "{text}");
        }
    }
}
