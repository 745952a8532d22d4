//! The rows after the header.

use glam::{Vec2, Vec3};

use super::header::{Element, Header, Kind, Property, Scalar};
use super::source::Source;
use crate::TriangleMesh;
use crate::formats::color::srgb_to_linear_color;
use crate::formats::polygon::triangulate;

/// What stands in the way, and where.
pub(super) struct Trouble {
    pub(super) offset: usize,
    pub(super) found: String,
    pub(super) hint: Option<&'static str>,
}

/// The mesh and what was left out of it.
pub(super) fn body(
    header: &Header,
    source: &mut impl Source,
) -> Result<(TriangleMesh, Vec<String>), Trouble> {
    let mut mesh = TriangleMesh::default();
    let mut warnings = Vec::new();
    let Some(vertices) = header.elements.iter().find(|e| e.name == "vertex").map(|e| e.count) else {
        return Err(trouble(source, "there is no element `vertex`".into()));
    };
    let mut faces = Faces { vertices, ..Faces::default() };
    for element in &header.elements {
        check_count(header, element, source)?;
        match element.name.as_str() {
            "vertex" => read_vertices(element, source, &mut mesh)?,
            "face" => faces.read_polygons(element, source, &mut mesh)?,
            "tristrips" => faces.read_strips(element, source, &mut mesh)?,
            _ => skip_rows(element, source)?,
        }
    }
    if faces.with_few_corners > 0 {
        warnings.push(format!(
            "{} faces have fewer than three corners and were left out",
            faces.with_few_corners
        ));
    }
    if faces.corner_coordinates {
        warnings.push("texture coordinates by corner of a face are not read, only those by vertex".into());
    }
    if mesh.triangles.is_empty() {
        warnings.push("there are no faces in it, only points".into());
    }
    Ok((mesh, warnings))
}

fn trouble(source: &impl Source, found: String) -> Trouble {
    Trouble { offset: source.offset(), found, hint: None }
}

fn stopped(element: &Element, row: u64, source: &impl Source) -> Trouble {
    let found =
        format!("{} in row {row} of the {} of element `{}`", source.trouble(), element.count, element.name);
    trouble(source, found)
}

/// Refuses an element that claims more rows than the bytes left can hold.
fn check_count(header: &Header, element: &Element, source: &impl Source) -> Result<(), Trouble> {
    let least = element.count.saturating_mul(element.least_row_bytes(header.encoding));
    // In text the last number needs no blank after it.
    if least <= source.left() + 1 {
        return Ok(());
    }
    let found = format!(
        "element `{}` should have {} rows, at least {least} bytes, but {} bytes are left",
        element.name,
        element.count,
        source.left()
    );
    Err(Trouble { hint: Some("the file was cut short, or its header is wrong"), ..trouble(source, found) })
}

fn skip_rows(element: &Element, source: &mut impl Source) -> Result<(), Trouble> {
    if element.properties.is_empty() {
        return Ok(());
    }
    for row in 0..element.count {
        for property in &element.properties {
            skip_property(property, source).ok_or_else(|| stopped(element, row, source))?;
        }
    }
    Ok(())
}

fn skip_property(property: &Property, source: &mut impl Source) -> Option<()> {
    match property.kind {
        Kind::One(scalar) => source.skip(scalar, 1),
        Kind::List { count, item } => {
            // A negative or fractional count saturates to a number that is too small or too large to matter.
            let count = source.next(count)?;
            source.skip(item, count as u64)
        }
    }
}

/// What a property of a vertex means: the attribute and the component of it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Meaning {
    Position(usize),
    Normal(usize),
    Uv(usize),
    Color(usize),
    Nothing,
}

fn meaning(property: &Property) -> Meaning {
    let Kind::One(_) = property.kind else { return Meaning::Nothing };
    match property.name.as_str() {
        "x" => Meaning::Position(0),
        "y" => Meaning::Position(1),
        "z" => Meaning::Position(2),
        "nx" | "normal_x" => Meaning::Normal(0),
        "ny" | "normal_y" => Meaning::Normal(1),
        "nz" | "normal_z" => Meaning::Normal(2),
        "s" | "u" | "texture_u" | "texture_s" | "tex_u" | "s0" | "u0" => Meaning::Uv(0),
        "t" | "v" | "texture_v" | "texture_t" | "tex_v" | "t0" | "v0" => Meaning::Uv(1),
        "red" | "r" | "diffuse_red" => Meaning::Color(0),
        "green" | "g" | "diffuse_green" => Meaning::Color(1),
        "blue" | "b" | "diffuse_blue" => Meaning::Color(2),
        _ => Meaning::Nothing,
    }
}

fn read_vertices(
    element: &Element,
    source: &mut impl Source,
    mesh: &mut TriangleMesh,
) -> Result<(), Trouble> {
    let meanings: Vec<Meaning> = element.properties.iter().map(meaning).collect();
    for (component, name) in ["x", "y", "z"].iter().enumerate() {
        if !meanings.contains(&Meaning::Position(component)) {
            return Err(trouble(source, format!("element `vertex` has no property `{name}`")));
        }
    }
    let count = element.count as usize;
    let all = |of: fn(usize) -> Meaning, n: usize| (0..n).all(|component| meanings.contains(&of(component)));
    let (normals, uvs, colors) = (all(Meaning::Normal, 3), all(Meaning::Uv, 2), all(Meaning::Color, 3));
    mesh.positions.reserve_exact(count);
    mesh.normals.reserve_exact(if normals { count } else { 0 });
    mesh.uvs.reserve_exact(if uvs { count } else { 0 });
    mesh.colors.reserve_exact(if colors { count } else { 0 });
    // Whole numbers are sRGB of their whole range.
    let color_scale = element.properties.iter().zip(&meanings).find_map(|(property, meaning)| {
        match (meaning, property.kind) {
            (Meaning::Color(0), Kind::One(scalar)) => scalar.largest(),
            _ => None,
        }
    });
    for row in 0..element.count {
        let (mut position, mut normal, mut uv, mut color) = ([0f32; 3], [0f32; 3], [0f32; 2], [0f32; 3]);
        for (property, meaning) in element.properties.iter().zip(&meanings) {
            let Kind::One(scalar) = property.kind else {
                skip_property(property, source).ok_or_else(|| stopped(element, row, source))?;
                continue;
            };
            let value = source.next(scalar).ok_or_else(|| stopped(element, row, source))? as f32;
            match *meaning {
                Meaning::Nothing => continue,
                // Scans hold normals that are not finite; they are repaired with those of no length.
                Meaning::Normal(component) => {
                    normal[component] = value;
                    continue;
                }
                Meaning::Position(component) => position[component] = value,
                Meaning::Uv(component) => uv[component] = value,
                Meaning::Color(component) => color[component] = value,
            }
            if !value.is_finite() {
                return Err(trouble(source, format!("`{}` of vertex {row} is {value}", property.name)));
            }
        }
        mesh.positions.push(Vec3::from(position));
        if normals {
            mesh.normals.push(Vec3::from(normal));
        }
        if uvs {
            mesh.uvs.push(Vec2::new(uv[0], 1.0 - uv[1]));
        }
        if colors {
            let color = Vec3::from(color);
            mesh.colors.push(match color_scale {
                Some(largest) => srgb_to_linear_color(color / largest as f32),
                None => color,
            });
        }
    }
    Ok(())
}

#[derive(Default)]
struct Faces {
    vertices: u64,
    with_few_corners: usize,
    corner_coordinates: bool,
}

impl Faces {
    fn read_polygons(
        &mut self,
        element: &Element,
        source: &mut impl Source,
        mesh: &mut TriangleMesh,
    ) -> Result<(), Trouble> {
        self.corner_coordinates |= element.properties.iter().any(|p| p.name == "texcoord");
        // The least row has a list of three, or the count was not checked yet: do not trust it further.
        mesh.triangles.reserve((element.count as usize).min(source.left() as usize / 4));
        let mut corners = Vec::new();
        let mut cut = Vec::new();
        self.read_lists(element, source, &mut corners, |few, corners| {
            match *corners {
                [a, b, c] => mesh.triangles.push([a, b, c]),
                [] | [_] | [_, _] => *few += 1,
                _ => {
                    // Faces may stand before the vertices, whose places are then not known yet.
                    let place = |v: &u32| mesh.positions.get(*v as usize).copied().unwrap_or(Vec3::ZERO);
                    let places: Vec<Vec3> = corners.iter().map(place).collect();
                    cut.clear();
                    triangulate(&places, &mut cut);
                    mesh.triangles.extend(cut.iter().map(|t| t.map(|i| corners[i])));
                }
            }
        })
    }

    fn read_strips(
        &mut self,
        element: &Element,
        source: &mut impl Source,
        mesh: &mut TriangleMesh,
    ) -> Result<(), Trouble> {
        let mut corners = Vec::new();
        self.read_lists(element, source, &mut corners, |_, corners| {
            for strip in corners.split(|corner| *corner == RESTART) {
                for (i, w) in strip.windows(3).enumerate() {
                    let triangle = if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] };
                    // Repeated vertices only turn the strip round.
                    if w[0] != w[1] && w[1] != w[2] && w[2] != w[0] {
                        mesh.triangles.push(triangle);
                    }
                }
            }
        })
    }

    /// Calls `each` with the vertex list of each row. In strips, −1 begins a new one.
    fn read_lists(
        &mut self,
        element: &Element,
        source: &mut impl Source,
        corners: &mut Vec<u32>,
        mut each: impl FnMut(&mut usize, &[u32]),
    ) -> Result<(), Trouble> {
        let names = ["vertex_indices", "vertex_index"];
        let is_list = |p: &Property| names.contains(&p.name.as_str()) && matches!(p.kind, Kind::List { .. });
        let Some(wanted) = element.properties.iter().position(is_list) else {
            if element.count == 0 {
                return Ok(());
            }
            return Err(trouble(source, format!("element `{}` has no list `vertex_indices`", element.name)));
        };
        let strips = element.name == "tristrips";
        for row in 0..element.count {
            for (i, property) in element.properties.iter().enumerate() {
                match property.kind {
                    Kind::List { count, item } if i == wanted => {
                        self.read_corners(element, row, (count, item), source, strips, corners)?;
                    }
                    _ => skip_property(property, source).ok_or_else(|| stopped(element, row, source))?,
                }
            }
            each(&mut self.with_few_corners, corners);
        }
        Ok(())
    }

    fn read_corners(
        &self,
        element: &Element,
        row: u64,
        (count, item): (Scalar, Scalar),
        source: &mut impl Source,
        strips: bool,
        corners: &mut Vec<u32>,
    ) -> Result<(), Trouble> {
        let length = source.next(count).ok_or_else(|| stopped(element, row, source))?;
        if length < 0.0 || length.fract() != 0.0 || source.least_bytes(item, length as u64) > source.left() {
            let found = format!(
                "row {row} of element `{}` should list {length} vertices, but {} bytes are left",
                element.name,
                source.left()
            );
            return Err(trouble(source, found));
        }
        corners.clear();
        for _ in 0..length as u64 {
            let index = source.next(item).ok_or_else(|| stopped(element, row, source))?;
            if strips && index == -1.0 {
                corners.push(RESTART);
            } else if index >= 0.0 && index < self.vertices as f64 && index.fract() == 0.0 {
                corners.push(index as u32);
            } else {
                let found = format!(
                    "row {row} of element `{}` refers to vertex {index}, but there are {} vertices, counted from 0",
                    element.name, self.vertices
                );
                return Err(trouble(source, found));
            }
        }
        Ok(())
    }
}

/// Stands for −1 in the list of a strip; no vertex has this number, since their count fits in 32 bits.
const RESTART: u32 = u32::MAX;
