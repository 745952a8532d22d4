use glam::Vec2;

/// Heights y over a regular grid of posts in x and z. Post (i, j) stands at
/// x = min.x + (max.x − min.x) i / (columns − 1), z = min.y + (max.y − min.y) j / (rows − 1).
///
/// A cell is two triangles split along (i, j)–(i+1, j+1).
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    /// Posts along x, at least 2.
    pub columns: usize,
    /// Posts along z, at least 2.
    pub rows: usize,
    /// Least x and z, in metres.
    pub min: Vec2,
    /// Greatest x and z, in metres.
    pub max: Vec2,
    /// `columns * rows` finite heights in metres; post (i, j) is `heights[j * columns + i]`.
    pub heights: Vec<f32>,
    /// Shading normals interpolated between posts, instead of those of the triangles.
    pub smooth: bool,
}
