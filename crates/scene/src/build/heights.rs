//! Height fields as functions of time.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use glam::{Vec2, Vec3};
use halflight_file::LoadError;
use halflight_image::{HeightImage, Plane, load_height};
use halflight_shape::procedural::{
    BumpPath, DentedGround, FractalTerrain, MovingBump, Ocean, OceanSettings, OceanSpectrum,
    ProceduralHeight, SineTerm, SumOfSines,
};
use halflight_shape::{HeightField, HeightFieldError};

use super::Builder;
use crate::schema::{At, FilePath, Problem};
use crate::spec::{HeightFieldSpec, HeightKind, Shading, SineSpec};

/// Heights over a grid, as a function of time.
#[derive(Debug)]
pub(crate) enum HeightSource {
    /// The same at all times.
    Still(Arc<HeightField>),
    /// By formula.
    Formula { formula: ProceduralHeight, posts: [usize; 2], min: Vec2, max: Vec2, smooth: bool },
    /// By pictures in time.
    Sequence(Sequence),
}

/// A sequence of pictures, read when they are needed.
#[derive(Debug)]
pub(crate) struct Sequence {
    files: Vec<PathBuf>,
    rate: f64,
    min: Vec2,
    max: Vec2,
    size: [usize; 2],
    scale: f32,
    offset: f32,
    smooth: bool,
    /// The last two pictures that were needed.
    recent: Mutex<Vec<(usize, Arc<Plane>)>>,
}

impl HeightSource {
    /// Whether the heights depend on time.
    pub(crate) fn is_animated(&self) -> bool {
        match self {
            Self::Still(_) => false,
            Self::Formula { formula, .. } => formula.is_animated(),
            Self::Sequence(sequence) => sequence.files.len() > 1,
        }
    }

    /// Triangles of the field.
    pub(crate) fn facets(&self) -> usize {
        let [columns, rows] = match self {
            Self::Still(field) => [field.columns, field.rows],
            Self::Formula { posts, .. } => *posts,
            Self::Sequence(sequence) => sequence.size,
        };
        2 * (columns - 1) * (rows - 1)
    }

    /// The field at a time.
    pub(crate) fn at(&self, time_seconds: f64) -> Result<Arc<HeightField>, LoadError> {
        match self {
            Self::Still(field) => Ok(Arc::clone(field)),
            Self::Formula { formula, posts, min, max, smooth } => formula
                .evaluate(posts[0], posts[1], *min, *max, time_seconds)
                .map(|field| Arc::new(field.with_smooth(*smooth)))
                .map_err(|error| LoadError::new("height field", "a formula", error.to_string())),
            Self::Sequence(sequence) => sequence.at(time_seconds).map(Arc::new),
        }
    }
}

impl Sequence {
    fn at(&self, time_seconds: f64) -> Result<HeightField, LoadError> {
        let last = self.files.len() - 1;
        let position = (time_seconds * self.rate).clamp(0.0, last as f64);
        let (first, part) = (position.floor() as usize, position.fract() as f32);
        let before = self.plane(first)?;
        let mut heights: Vec<f32> = before.values.iter().map(|&h| self.offset + self.scale * h).collect();
        if part > 0.0 {
            let after = self.plane((first + 1).min(last))?;
            for (height, &h) in heights.iter_mut().zip(&after.values) {
                *height += part * (self.offset + self.scale * h - *height);
            }
        }
        HeightField::new(self.size[0], self.size[1], self.min, self.max, heights)
            .map(|field| field.with_smooth(self.smooth))
            .map_err(|error| LoadError::new("height field", &self.files[first], error.to_string()))
    }

    fn plane(&self, index: usize) -> Result<Arc<Plane>, LoadError> {
        let recall = || self.recent.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some((_, plane)) = recall().iter().find(|(known, _)| *known == index) {
            return Ok(Arc::clone(plane));
        }
        let path = &self.files[index];
        let plane = load_height(path)?.plane;
        if [plane.width, plane.height] != self.size {
            let [width, height] = self.size;
            let found = format!(
                "{} × {} posts, where the first picture has {width} × {height}",
                plane.width, plane.height
            );
            return Err(LoadError::new("picture of heights", path, found));
        }
        let plane = Arc::new(plane);
        let mut recent = recall();
        if recent.len() > 1 {
            recent.remove(0);
        }
        recent.push((index, Arc::clone(&plane)));
        Ok(plane)
    }
}

impl Builder {
    /// The heights that a scene file asks for.
    pub(crate) fn heights(&mut self, spec: &HeightFieldSpec) -> Option<HeightSource> {
        let smooth = spec.shading == Shading::Smooth;
        let origin = spec.heights.origin.clone();
        let formula = match &spec.heights.kind {
            HeightKind::Image(image) => {
                let loaded = self.height_image(&image.file)?;
                let (min, max) = extent_of(&loaded, spec.extent);
                let field =
                    HeightField::from_plane(&loaded.plane, min, max, image.height_scale, image.height_offset);
                return match field {
                    Ok(field) => Some(HeightSource::Still(Arc::new(field.with_smooth(smooth)))),
                    Err(error) => self.impossible(&image.file.origin, &error),
                };
            }
            HeightKind::Sequence(sequence) => {
                let files = self.sequence_files(&sequence.files, sequence.first, sequence.count)?;
                let first = FilePath { origin: sequence.files.origin.clone(), path: files[0].clone() };
                let loaded = self.height_image(&first)?;
                let (min, max) = extent_of(&loaded, spec.extent);
                let field = HeightField::from_plane(
                    &loaded.plane,
                    min,
                    max,
                    sequence.height_scale,
                    sequence.height_offset,
                );
                if let Err(error) = field {
                    return self.impossible(&sequence.files.origin, &error);
                }
                return Some(HeightSource::Sequence(Sequence {
                    files,
                    rate: f64::from(sequence.rate),
                    min,
                    max,
                    size: [loaded.plane.width, loaded.plane.height],
                    scale: sequence.height_scale,
                    offset: sequence.height_offset,
                    smooth,
                    recent: Mutex::new(vec![(0, Arc::new(loaded.plane))]),
                }));
            }
            HeightKind::SumOfSines(s) => ProceduralHeight::SumOfSines(sines(&s.waves)),
            HeightKind::Fractal(s) => ProceduralHeight::FractalTerrain(FractalTerrain {
                seed: s.seed,
                octaves: s.octaves,
                wavelength: s.wavelength,
                lacunarity: s.lacunarity,
                roughness: s.roughness,
                amplitude: s.amplitude,
                base: 0.0,
                ridges: s.ridges,
            }),
            HeightKind::Ocean(s) => {
                let settings = OceanSettings {
                    patch_size: s.patch_size,
                    resolution: s.resolution,
                    wind_speed: s.wind_speed,
                    wind_direction: (s.wind_direction_degrees % 360.0).to_radians(),
                    amplitude: s.amplitude,
                    shortest_wave: s.shortest_wave,
                    spectrum: match s.fetch {
                        Some(fetch) => OceanSpectrum::Jonswap { fetch },
                        None => OceanSpectrum::Phillips,
                    },
                    loop_seconds: s.loop_seconds,
                    seed: s.seed,
                };
                match Ocean::new(settings) {
                    Ok(ocean) => ProceduralHeight::Ocean(Arc::new(ocean)),
                    Err(error) => return self.impossible(&origin, &error),
                }
            }
            HeightKind::MovingBump(s) => {
                let path = match s.circle_radius {
                    Some(radius) => {
                        BumpPath::Circle { center: Vec2::ZERO, radius, period_seconds: s.period_seconds }
                    }
                    None if s.path.is_empty() => BumpPath::Polyline { points: vec![Vec2::ZERO], speed: 0.0 },
                    None => BumpPath::Polyline { points: s.path.clone(), speed: s.speed },
                };
                let base = Arc::new(ProceduralHeight::SumOfSines(sines(&s.waves)));
                ProceduralHeight::MovingBump(MovingBump { height: s.bump_height, sigma: s.sigma, path, base })
            }
            HeightKind::Dented(s) => ProceduralHeight::Dented(DentedGround {
                radius: s.radius,
                path: s.path.iter().map(|&[time, x, y, z]| (time, Vec3::new(x, y, z))).collect(),
                base: Arc::new(ProceduralHeight::SumOfSines(sines(&s.waves))),
            }),
        };
        let half = 0.5 * spec.extent.unwrap_or(Vec2::splat(10.0));
        let posts = spec.posts.map(|n| n as usize);
        if let Err(error) = formula.validate() {
            return self.impossible(&origin, &error);
        }
        let source = HeightSource::Formula { formula, posts, min: -half, max: half, smooth };
        if source.is_animated() {
            return Some(source);
        }
        match source.at(0.0) {
            Ok(field) => Some(HeightSource::Still(field)),
            Err(error) => {
                self.reader.report(Problem::load(&origin, &error));
                None
            }
        }
    }

    fn impossible<T>(&mut self, origin: &crate::schema::Origin, error: &HeightFieldError) -> Option<T> {
        self.reader.report(Problem::new(origin, error.to_string()));
        None
    }

    fn height_image(&mut self, file: &FilePath) -> Option<HeightImage> {
        match load_height(&file.path) {
            Ok(image) => {
                self.note_file(&file.path);
                if image.filled_voids > 0 {
                    let (name, count) = (file.path.display(), image.filled_voids);
                    self.warnings.push(format!("{name}: {count} voids were filled from their neighbours"));
                }
                Some(image)
            }
            Err(error) => {
                self.failed(file, &error);
                None
            }
        }
    }

    /// The files of a numbered sequence; all must be there.
    fn sequence_files(&mut self, pattern: &At<String>, first: u32, count: u32) -> Option<Vec<PathBuf>> {
        let Some(start) = pattern.find('#') else {
            let problem =
                Problem::new(&pattern.origin, "expected `#` where the number of the picture stands");
            self.reader
                .report(problem.help("as in \"height.####.exr\", for height.0000.exr, height.0001.exr …"));
            return None;
        };
        let digits = pattern[start..].chars().take_while(|&c| c == '#').count();
        let (before, after) = (&pattern[..start], &pattern[start + digits..]);
        let mut files = Vec::new();
        for number in (u64::from(first)..).take(count as usize) {
            let name = format!("{before}{number:0digits$}{after}");
            let file = FilePath::named(&name, &pattern.origin);
            if !file.path.is_file() {
                let problem =
                    Problem::new(&pattern.origin, format!("there is no picture {}", file.path.display()));
                self.reader.report(
                    problem.help(format!("the sequence needs {count} pictures from number {first} on")),
                );
                return None;
            }
            self.note_file(&file.path);
            files.push(file.path);
        }
        Some(files)
    }
}

fn sines(waves: &[SineSpec]) -> SumOfSines {
    let term = |w: &SineSpec| SineTerm {
        amplitude: w.amplitude,
        kx: w.kx,
        kz: w.kz,
        phase: w.phase,
        angular_speed: w.angular_speed,
    };
    SumOfSines { terms: waves.iter().map(term).collect() }
}

/// Where a picture of heights lies: the given extent, or that of the file, or a metre a post; about the origin.
fn extent_of(image: &HeightImage, given: Option<Vec2>) -> (Vec2, Vec2) {
    let steps = Vec2::new(image.plane.width.max(2) as f32 - 1.0, image.plane.height.max(2) as f32 - 1.0);
    let spacing = image.metres_per_pixel.map_or(Vec2::ONE, |[x, z]| Vec2::new(x as f32, z as f32).abs());
    let half = 0.5 * given.unwrap_or(steps * spacing);
    (-half, half)
}

/// A picture of heights as a landscape worth looking at, when nothing is known but the picture: in metres if the file
/// tells its place on Earth, else with a relief of a sixth of its width; exaggerated if it would be flat otherwise.
pub(crate) fn relief(image: &HeightImage) -> (Vec2, Vec2, f32, f32) {
    let (min, max) = extent_of(image, None);
    let width = (max - min).max_element();
    let (low, high) = image
        .plane
        .values
        .iter()
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &h| (low.min(h), high.max(h)));
    let range = (high - low).max(f32::MIN_POSITIVE);
    let scale = match image.metres_per_pixel {
        Some(_) => (0.08 * width / range).max(1.0),
        None => width / (6.0 * range),
    };
    let scale = if scale.is_finite() { scale } else { 1.0 };
    (min, max, scale, -scale * low)
}
