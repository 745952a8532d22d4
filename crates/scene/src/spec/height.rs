//! Where the heights of a height field come from.

use glam::Vec2;

use crate::schema::{At, FilePath, at_least, fraction, positive, within};
use crate::{record, variants};

record! {
    /// A picture of heights.
    pub struct HeightImageSpec, "height image" {
        /// 16-bit `.png` (values 0 to 65535), `.tif` (GeoTIFF elevation; voids are filled from their neighbours) or `.exr`.
        #[example = "\"mountain.tif\""]
        file: FilePath,
        /// Multiplies the values of the picture.
        #[unit = "metres per unit"]
        #[example = "0.001"]
        height_scale: f32 = 1.0,
        /// Added after that.
        #[unit = "metres"]
        #[example = "-2.5"]
        height_offset: f32 = 0.0,
    }
}

record! {
    /// One plane wave: amplitude · sin(kx x + kz z + phase + angular_speed t).
    pub struct SineSpec, "wave" {
        /// Half the height from trough to crest.
        #[unit = "metres"]
        #[example = "0.3"]
        amplitude: f32,
        /// Angular frequency along x.
        #[unit = "radians per metre"]
        #[example = "0.5"]
        kx: f32 = 0.0,
        /// Angular frequency along z.
        #[unit = "radians per metre"]
        #[example = "0.3"]
        kz: f32 = 0.0,
        /// Phase at x = z = t = 0.
        #[unit = "radians"]
        #[example = "1.1"]
        phase: f32 = 0.0,
        /// Growth of the phase with time; 0 stands still.
        #[unit = "radians per second"]
        #[example = "2"]
        angular_speed: f32 = 0.0,
    }
}

record! {
    /// Plane waves.
    pub struct SinesSpec, "sum of sines" {
        /// The waves.
        #[example = "[{ amplitude = 0.3, kx = 0.5 }, { amplitude = 0.1, kz = 2 }]"]
        waves: Vec<SineSpec>,
    }
}

record! {
    /// Mountains.
    pub struct FractalSpec, "fractal terrain" {
        /// Which landscape.
        #[example = "7"]
        seed: u32 = 1,
        /// Octaves of noise.
        #[example = "10"]
        octaves: u32 = 9 => within(1.0, 24.0),
        /// Size of the largest features.
        #[unit = "metres"]
        #[example = "20"]
        wavelength: f32 = 4.0 => positive(),
        /// Frequency of an octave relative to the one before.
        #[example = "2.1"]
        lacunarity: f32 = 2.0 => within(1.01, 16.0),
        /// Amplitude of an octave relative to the one before: less is smoother.
        #[example = "0.4"]
        roughness: f32 = 0.5 => fraction(),
        /// About the greatest height above or below 0.
        #[unit = "metres"]
        #[example = "3"]
        amplitude: f32 = 1.0,
        /// 0 for rolling hills, 1 for ridges.
        #[example = "1"]
        ridges: f32 = 0.5 => fraction(),
    }
}

record! {
    /// Wind waves.
    pub struct OceanSpec, "ocean" {
        /// The sea repeats after this many metres.
        #[unit = "metres"]
        #[example = "100"]
        patch_size: f32 = 60.0 => positive(),
        /// Grid points along a side of the patch: a power of two from 8 to 4096.
        #[example = "512"]
        resolution: usize = 256 => within(8.0, 4096.0),
        /// Wind at ten metres above the water.
        #[unit = "metres per second"]
        #[example = "12"]
        wind_speed: f32 = 8.0 => within(0.1, 100.0),
        /// Where the wind blows to: 0 is +x, 90 is +z.
        #[unit = "degrees"]
        #[example = "45"]
        wind_direction_degrees: f32 = 30.0,
        /// Factor on all heights; 1 is physical.
        #[example = "1.5"]
        amplitude: f32 = 1.0 => at_least(0.0),
        /// Waves shorter than this are faded out; 0 keeps all.
        #[unit = "metres"]
        #[example = "0.5"]
        shortest_wave: f32 = 0.0 => at_least(0.0),
        /// Distance over which the wind has worked on the sea. Without it: a fully developed sea.
        #[unit = "metres"]
        #[example = "100000"]
        fetch: Option<f32> => positive(),
        /// If given, the motion repeats after so many seconds.
        #[unit = "seconds"]
        #[example = "10"]
        loop_seconds: Option<f32> => positive(),
        /// Which sea.
        #[example = "3"]
        seed: u32 = 1,
    }
}

record! {
    /// A hill that travels.
    pub struct BumpSpec, "moving bump" {
        /// Height of the hill; negative for a hollow.
        #[unit = "metres"]
        #[example = "0.8"]
        bump_height: f32 = 1.0,
        /// Standard deviation of its Gaussian.
        #[unit = "metres"]
        #[example = "0.5"]
        sigma: f32 = 0.5 => positive(),
        /// Corners of the path in x and z, run along at constant speed and back to the first.
        #[unit = "metres"]
        #[example = "[[-2, 0], [2, 0]]"]
        path: Vec<Vec2>,
        /// Speed along the path.
        #[unit = "metres per second"]
        #[example = "0.5"]
        speed: f32 = 1.0 => at_least(0.0),
        /// Instead of a path: the radius of a circle about the origin.
        #[unit = "metres"]
        #[example = "2"]
        circle_radius: Option<f32> => positive(),
        /// Time for one turn of the circle.
        #[unit = "seconds"]
        #[example = "8"]
        period_seconds: f32 = 4.0 => positive(),
        /// Plane waves that the hill travels over.
        #[example = "[{ amplitude = 0.1, kx = 3 }]"]
        waves: Vec<SineSpec>,
    }
}

record! {
    /// Ground that a ball presses in.
    pub struct DentedSpec, "dented ground" {
        /// Radius of the ball.
        #[unit = "metres"]
        #[example = "0.8"]
        radius: f32 = 0.5 => positive(),
        /// Where the middle of the ball is: for each time in seconds x, y and z. Between them it goes in straight lines.
        #[example = "[[0, -2, 0.9, 0], [1, 2, 0.9, 0]]"]
        path: Vec<[f32; 4]>,
        /// Plane waves that the ground has before.
        #[example = "[{ amplitude = 0.1, kx = 3 }]"]
        waves: Vec<SineSpec>,
    }
}

record! {
    /// Pictures of heights in time.
    pub struct ImageSequenceSpec, "image sequence" {
        /// The pictures, all of one size; `#` stands for the digits of the number.
        #[example = "\"frames/height.####.exr\""]
        files: At<String>,
        /// Number of the first picture.
        #[example = "1"]
        first: u32 = 0,
        /// How many pictures there are.
        #[example = "48"]
        count: u32 => within(1.0, 100_000.0),
        /// Pictures per second; heights between two pictures are mixed.
        #[unit = "per second"]
        #[example = "24"]
        rate: f32 = 24.0 => positive(),
        /// Multiplies the values of the pictures.
        #[unit = "metres per unit"]
        #[example = "0.001"]
        height_scale: f32 = 1.0,
        /// Added after that.
        #[unit = "metres"]
        #[example = "-2.5"]
        height_offset: f32 = 0.0,
    }
}

variants! {
    /// Where the heights of a height field come from.
    pub enum HeightKind, "heights" {
        /// A picture; a table with `file` and no `type` is one.
        "image" => Image(HeightImageSpec) if "file",
        /// Plane waves, standing or travelling.
        "sum-of-sines" => SumOfSines(SinesSpec),
        /// Mountains made of noise.
        "fractal" => Fractal(FractalSpec),
        /// Wind waves that evolve with time.
        "ocean" => Ocean(OceanSpec),
        /// A hill that travels over waves.
        "moving-bump" => MovingBump(BumpSpec),
        /// Ground that a ball has pressed in wherever it was until then, and that stays so.
        "dented" => Dented(DentedSpec),
        /// A picture for each time.
        "image-sequence" => Sequence(ImageSequenceSpec) if "files",
    }
}
