//! Filling holes smoothly: a membrane stretched over each hole from its rim.
//!
//! The membrane solves Laplace's equation, ∇²h = 0, inside the hole with the rim's heights as its boundary.
//! A pyramid gives the first guess (averages of what is known, halved until every hole is closed, then interpolated
//! back: Gortler et al., "The Lumigraph", 1996, §3.5, "pull-push"), and Gauss–Seidel sweeps relax what it left of
//! seams. Cost: a few passes over the picture plus [`SWEEPS`] over the holes.

use crate::Plane;

/// After the pyramid the error is at the scale of single pixels, where a sweep at least halves it.
const SWEEPS: usize = 32;

/// Replaces the values that are not `valid`. At least one must be.
pub(crate) fn fill(plane: &mut Plane, valid: &[bool]) {
    if valid.iter().all(|&v| v) {
        return;
    }
    let weights: Vec<f32> = valid.iter().map(|&v| if v { 1.0 } else { 0.0 }).collect();
    let values: Vec<f32> = plane.values.iter().zip(valid).map(|(&h, &v)| if v { h } else { 0.0 }).collect();
    let mut levels = vec![Level { width: plane.width, height: plane.height, values, weights }];
    while let Some(last) = levels.last()
        && last.weights.contains(&0.0)
        && (last.width > 1 || last.height > 1)
    {
        let coarser = last.halved();
        levels.push(coarser);
    }
    while let Some(coarse) = levels.pop() {
        let Some(fine) = levels.last_mut() else {
            plane.values = coarse.values;
            break;
        };
        fine.fill_from(&coarse);
    }
    relax(plane, valid);
}

struct Level {
    width: usize,
    height: usize,
    values: Vec<f32>,
    weights: Vec<f32>,
}

impl Level {
    fn halved(&self) -> Level {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut out =
            Level { width, height, values: vec![0.0; width * height], weights: vec![0.0; width * height] };
        for y in 0..self.height {
            for x in 0..self.width {
                let (from, to) = (y * self.width + x, y / 2 * width + x / 2);
                out.values[to] += self.values[from] * self.weights[from];
                out.weights[to] += self.weights[from];
            }
        }
        for (value, weight) in out.values.iter_mut().zip(&mut out.weights) {
            if *weight > 0.0 {
                *value /= *weight;
                *weight = 1.0;
            }
        }
        out
    }

    fn fill_from(&mut self, coarse: &Level) {
        for y in 0..self.height {
            for x in 0..self.width {
                let i = y * self.width + x;
                if self.weights[i] == 0.0 {
                    self.values[i] = coarse.bilinear(x as f32 / 2.0 - 0.25, y as f32 / 2.0 - 0.25);
                }
            }
        }
    }

    fn bilinear(&self, x: f32, y: f32) -> f32 {
        let (x, y) = (x.clamp(0.0, (self.width - 1) as f32), y.clamp(0.0, (self.height - 1) as f32));
        let (x0, y0) = (x as usize, y as usize);
        let (x1, y1) = ((x0 + 1).min(self.width - 1), (y0 + 1).min(self.height - 1));
        let (fx, fy) = (x - x0 as f32, y - y0 as f32);
        let at = |x: usize, y: usize| self.values[y * self.width + x];
        let top = at(x0, y0) + fx * (at(x1, y0) - at(x0, y0));
        let bottom = at(x0, y1) + fx * (at(x1, y1) - at(x0, y1));
        top + fy * (bottom - top)
    }
}

fn relax(plane: &mut Plane, valid: &[bool]) {
    let (width, height) = (plane.width, plane.height);
    let holes: Vec<usize> = (0..valid.len()).filter(|&i| !valid[i]).collect();
    for _ in 0..SWEEPS {
        for &i in &holes {
            let (x, y) = (i % width, i / width);
            let neighbours = [
                (x > 0).then(|| i - 1),
                (x + 1 < width).then_some(i + 1),
                (y > 0).then(|| i - width),
                (y + 1 < height).then_some(i + width),
            ];
            let (sum, count) =
                neighbours.iter().flatten().fold((0.0, 0.0), |(s, n), &j| (s + plane.values[j], n + 1.0));
            if count > 0.0 {
                plane.values[i] = sum / count;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_in_a_plane_is_filled_with_the_plane() {
        let height = |x: usize, y: usize| 3.0 * x as f32 - 2.0 * y as f32 + 100.0;
        let mut plane = Plane { width: 40, height: 30, values: vec![-32768.0; 1200] };
        let mut valid = vec![false; 1200];
        for (i, v) in valid.iter_mut().enumerate() {
            let (x, y) = (i % 40, i / 40);
            *v = !((10..22).contains(&x) && (8..18).contains(&y));
            if *v {
                plane.values[i] = height(x, y);
            }
        }
        fill(&mut plane, &valid);
        for i in 0..1200 {
            assert!((plane.values[i] - height(i % 40, i / 40)).abs() < 1.0, "{i}: {}", plane.values[i]);
        }
    }

    #[test]
    fn one_known_pixel_fills_everything() {
        let mut plane = Plane { width: 7, height: 5, values: vec![f32::NAN; 35] };
        plane.values[17] = 12.5;
        let valid: Vec<bool> = (0..35).map(|i| i == 17).collect();
        fill(&mut plane, &valid);
        assert!(plane.values.iter().all(|&h| (h - 12.5).abs() < 1e-4));
    }
}
