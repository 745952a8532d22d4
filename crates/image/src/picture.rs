use std::collections::BTreeMap;

/// Linear Rec. 709 radiance. Row 0 is the top; pixel (x, y) is `pixels[y * width + x]`.
#[derive(Clone, Debug, PartialEq)]
pub struct RgbImage {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` pixels, rows from the top.
    pub pixels: Vec<[f32; 3]>,
}

impl RgbImage {
    /// A black picture.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![[0.0; 3]; width * height] }
    }

    /// A picture whose pixel (x, y) is `f(x, y)`.
    pub fn from_fn(width: usize, height: usize, mut f: impl FnMut(usize, usize) -> [f32; 3]) -> Self {
        let pixels = (0..width * height).map(|i| f(i % width, i / width)).collect();
        Self { width, height, pixels }
    }
}

/// One value per pixel, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` values, rows from the top.
    pub values: Vec<f32>,
}

/// How the stored values of a texture relate to light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorSpace {
    /// Encoded with the sRGB curve: colours of 8-bit pictures.
    Srgb,
    /// As they are: normals, roughness, heights, and every floating-point picture.
    Linear,
}

/// A texture as it is kept in memory: in the precision it came in.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureImage {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` texels of red, green, blue, alpha, rows from the top.
    pub texels: Texels,
}

/// The texels of a [`TextureImage`].
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// Eight bits a channel; colour in the given space, alpha always linear.
    Bytes(Vec<[u8; 4]>, ColorSpace),
    /// Linear floats.
    Floats(Vec<[f32; 4]>),
}

/// A picture with named channels, as an OpenEXR file holds it: `R`, `G`, `B`, `A`, `depth.Z`, `normal.X` …
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The channels, each of `width * height` values, rows from the top.
    pub channels: Vec<Channel>,
    /// Text attributes: version, scene hash, command, seed, samples, seconds.
    pub metadata: BTreeMap<String, String>,
}

/// A rectangle of a larger picture: what one machine of several has rendered.
#[derive(Clone, Debug, PartialEq)]
pub struct PicturePart {
    /// Its pixels.
    pub picture: Picture,
    /// The column and the row, in the larger picture, of its first pixel.
    pub origin: [usize; 2],
    /// Columns and rows of the larger picture.
    pub whole: [usize; 2],
}

/// One named channel of a [`Picture`].
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The full name, layer first: `depth.Z`.
    pub name: String,
    /// The values, rows from the top.
    pub values: Vec<f32>,
}

impl Picture {
    /// A picture without channels.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, ..Self::default() }
    }

    /// The channel of that full name.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }

    /// Adds one channel of `width * height` values.
    ///
    /// # Panics
    /// If the number of values is not that of the pixels.
    pub fn push(&mut self, name: impl Into<String>, values: Vec<f32>) {
        assert_eq!(values.len(), self.width * self.height, "a channel has a value for every pixel");
        self.channels.push(Channel { name: name.into(), values });
    }

    /// The colour of the picture: the channels `R`, `G`, `B`, or `Y` thrice.
    pub fn rgb(&self) -> Option<RgbImage> {
        let gray = self.channel("Y");
        let [r, g, b] = ["R", "G", "B"].map(|name| self.channel(name).or(gray));
        let (r, g, b) = (r?, g?, b?);
        let pixels = r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]).collect();
        Some(RgbImage { width: self.width, height: self.height, pixels })
    }
}
