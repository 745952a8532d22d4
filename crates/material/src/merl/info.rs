//! A measured BRDF described in numbers.

use std::f32::consts::PI;
use std::fmt;

use glam::Vec3;

use super::grid::{CELLS, PHI_D, THETA_D, THETA_H, cell, theta_h_at};
use super::{Lookup, MeasuredBrdf};

/// The directional albedo for one view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlbedoAt {
    /// The angle of the view from the normal.
    pub view_degrees: f32,
    /// What a uniform light of radiance one is returned as.
    pub albedo: Vec3,
}

/// What [`MeasuredBrdf::describe`] finds.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredInfo {
    /// The name of the file.
    pub name: String,
    /// The look-up it was loaded for.
    pub lookup: Lookup,
    /// The directional albedo at several views. Above one where the table returns more light than it gets.
    pub albedo: Vec<AlbedoAt>,
    /// The largest reflectance per steradian of each colour.
    pub max: Vec3,
    /// Where the largest stands: θ_h, θ_d, φ_d of the cell's centre, in degrees.
    pub max_at_degrees: [f32; 3],
    /// The part of the cells that are marked as not measured. About 0.24 lie below the horizon in every file.
    pub invalid_fraction: f64,
    /// The albedo of the diffuse part: π times the median reflectance far from the highlight (θ_h from 40° to 60°,
    /// θ_d below 30°).
    pub diffuse: Vec3,
    /// The reflectance per steradian at the top of the highlight: the mean of the first ring for θ_d below 10°.
    pub peak: Vec3,
    /// The half-width of the highlight: the θ_h at which the green reflectance has fallen half-way from the peak to
    /// the diffuse part, for θ_d below 10°. In degrees.
    pub half_width_degrees: f32,
}

impl MeasuredBrdf {
    /// The material in numbers; takes some milliseconds.
    pub fn describe(&self) -> MeasuredInfo {
        let cells = self.table.cells();
        let mut max = Vec3::ZERO;
        let mut largest = (0.0, 0);
        for (index, &value) in cells.iter().enumerate() {
            let value = Vec3::from_array(value);
            max = max.max(value);
            if value.max_element() > largest.0 {
                largest = (value.max_element(), index);
            }
        }
        let (phi_d, theta_d, theta_h) =
            (largest.1 % PHI_D, largest.1 / PHI_D % THETA_D, largest.1 / (PHI_D * THETA_D));
        let diffuse = self.diffuse_reflectance();
        let peak = self.ring_mean(0);
        let half = 0.5 * (peak.y + diffuse.y);
        let width = (0..THETA_H).find(|&ring| self.ring_mean(ring).y < half).unwrap_or(THETA_H);
        MeasuredInfo {
            name: self.name.clone(),
            lookup: self.lookup(),
            albedo: [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0]
                .map(|view_degrees: f32| AlbedoAt {
                    view_degrees,
                    albedo: self.directional_albedo(view_degrees.to_radians()),
                })
                .into(),
            max,
            max_at_degrees: [
                ring_degrees(theta_h as f64 + 0.5),
                (theta_d as f32 + 0.5) * 90.0 / THETA_D as f32,
                (phi_d as f32 + 0.5) * 180.0 / PHI_D as f32,
            ],
            invalid_fraction: self.invalid_cells as f64 / CELLS as f64,
            diffuse: diffuse * PI,
            peak,
            half_width_degrees: ring_degrees(width as f64),
        }
    }

    /// The mean reflectance of a ring of θ_h, for θ_d below 10°.
    fn ring_mean(&self, ring: usize) -> Vec3 {
        let count = THETA_D / 9;
        let values = &self.table.cells()[cell(ring, 0, 0)..cell(ring, count, 0)];
        values.iter().map(|&v| Vec3::from_array(v)).sum::<Vec3>() / values.len() as f32
    }

    /// The median reflectance far from the highlight.
    fn diffuse_reflectance(&self) -> Vec3 {
        let mut values = [const { Vec::new() }; 3];
        for ring in (0..THETA_H).filter(|&ring| (40.0..60.0).contains(&ring_degrees(ring as f64 + 0.5))) {
            for value in &self.table.cells()[cell(ring, 0, 0)..cell(ring, THETA_D / 3, 0)] {
                for (channel, list) in values.iter_mut().enumerate() {
                    list.push(value[channel]);
                }
            }
        }
        Vec3::from_array(values.map(|mut list| {
            let middle = list.len() / 2;
            *list.select_nth_unstable_by(middle, f32::total_cmp).1
        }))
    }
}

fn ring_degrees(x: f64) -> f32 {
    theta_h_at(x).to_degrees() as f32
}

impl fmt::Display for MeasuredInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rgb = |v: Vec3| format!("{:.4} {:.4} {:.4}", v.x, v.y, v.z);
        writeln!(f, "{}: measured isotropic BRDF, 90 × 90 × 180 cells", self.name)?;
        writeln!(f, "  not measured      {:.1} % of the cells", 100.0 * self.invalid_fraction)?;
        let [theta_h, theta_d, phi_d] = self.max_at_degrees;
        writeln!(
            f,
            "  largest value     {} /sr, at θh {theta_h:.2}°, θd {theta_d:.1}°, φd {phi_d:.1}°",
            rgb(self.max)
        )?;
        writeln!(
            f,
            "  highlight         {} /sr, half-width {:.2}°",
            rgb(self.peak),
            self.half_width_degrees
        )?;
        writeln!(f, "  diffuse albedo    {}", rgb(self.diffuse))?;
        for at in &self.albedo {
            writeln!(f, "  albedo at {:>4.0}°   {}", at.view_degrees, rgb(at.albedo))?;
        }
        Ok(())
    }
}
