//! From text to lists of numbers.

use glam::{Vec2, Vec3};

use super::lines::{Statement, number, shown, statements};
use crate::formats::color::srgb_to_linear_color;

/// Stands for a texture coordinate or normal that a corner does not have.
pub(super) const NONE: u32 = u32::MAX;

/// A corner of a face: position, texture coordinate, normal, counted from 0.
pub(super) type Corner = [u32; 3];

const KINDS: [&str; 3] = ["position", "texture coordinate", "normal"];

/// What an OBJ file says.
#[derive(Default)]
pub(super) struct Parsed {
    pub(super) positions: Vec<Vec3>,
    /// As many as positions, or none.
    pub(super) colors: Vec<Vec3>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) normals: Vec<Vec3>,
    pub(super) corners: Vec<Corner>,
    /// Where in `corners` each face ends.
    pub(super) face_ends: Vec<u32>,
    /// Runs of faces: the first face, and its material.
    pub(super) runs: Vec<(usize, u32)>,
    /// Names by slot; the empty name is for faces before any `usemtl`.
    pub(super) material_names: Vec<String>,
    pub(super) libraries: Vec<String>,
    /// Statements that are not known, with their lines; a few of them.
    pub(super) unknown: Vec<(usize, String)>,
    unknown_count: usize,
    lines_and_points: usize,
    free_form: usize,
    /// The largest index seen of each kind, and its line: a face may stand before its vertices.
    largest: [(u32, usize); 3],
}

/// Reads a file. Errors are a line and what was found there.
pub(super) fn parse(bytes: &[u8]) -> Result<Parsed, (usize, String)> {
    let mut parsed = Parsed::default();
    statements(bytes, |statement| parsed.statement(&statement).map_err(|found| (statement.line, found)))?;
    let counts = [parsed.positions.len(), parsed.uvs.len(), parsed.normals.len()];
    for (kind, ((largest, line), count)) in parsed.largest.into_iter().zip(counts).enumerate() {
        if line > 0 && largest as usize >= count {
            let number = u64::from(largest) + 1;
            return Err((line, format!("a face refers to {} {number}, but there are {count}", KINDS[kind])));
        }
    }
    Ok(parsed)
}

impl Parsed {
    /// Sentences about what was left out.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.lines_and_points > 0 {
            warnings.push(format!("{} lines and points were left out", self.lines_and_points));
        }
        if self.free_form > 0 {
            warnings.push(format!(
                "{} statements of free-form curves and surfaces were left out",
                self.free_form
            ));
        }
        if let Some((line, word)) = self.unknown.first() {
            let count = self.unknown_count;
            warnings.push(format!("{count} statements are not known, the first {word} in line {line}"));
        }
        warnings
    }

    fn statement(&mut self, statement: &Statement) -> Result<(), String> {
        let rest = statement.rest;
        match statement.keyword {
            "v" => self.position(rest)?,
            "vt" => {
                let [u, v] = numbers(rest, 1)?;
                self.uvs.push(Vec2::new(u, 1.0 - v));
            }
            "vn" => {
                let mut words = rest.split_ascii_whitespace();
                // Normals that are not finite are repaired with those of no length.
                let mut component =
                    || words.next().and_then(|w| w.parse().ok()).ok_or("a normal has three numbers");
                self.normals.push(Vec3::new(component()?, component()?, component()?));
            }
            "f" | "fo" => self.face(rest, statement.line)?,
            "usemtl" => self.use_material(rest),
            "mtllib" => self.libraries.extend(library_names(rest)),
            "l" | "p" => self.lines_and_points += 1,
            "o" | "g" | "s" | "mg" | "bevel" | "c_interp" | "d_interp" | "lod" | "usemap" | "maplib"
            | "shadow_obj" | "trace_obj" => {}
            "vp" | "cstype" | "deg" | "bmat" | "step" | "curv" | "curv2" | "surf" | "parm" | "trim"
            | "hole" | "scrv" | "sp" | "end" | "con" | "ctech" | "stech" => self.free_form += 1,
            other => {
                self.unknown_count += 1;
                if self.unknown.is_empty() {
                    self.unknown.push((statement.line, shown(other)));
                }
            }
        }
        Ok(())
    }

    fn position(&mut self, rest: &str) -> Result<(), String> {
        let mut values = [0f32; 7];
        let mut count = 0;
        for word in rest.split_ascii_whitespace().take(7) {
            values[count] = number(word)?;
            count += 1;
        }
        if count < 3 {
            return Err(format!("a position has {count} numbers where three are needed"));
        }
        // x y z, x y z w, x y z r g b, or x y z w r g b; w is for free-form surfaces only.
        if count >= 6 {
            let color = Vec3::from_slice(&values[count - 3..count]);
            self.colors.resize(self.positions.len(), Vec3::ONE);
            self.colors.push(srgb_to_linear_color(color));
        } else if !self.colors.is_empty() {
            self.colors.push(Vec3::ONE);
        }
        self.positions.push(Vec3::from_slice(&values[..3]));
        Ok(())
    }

    fn face(&mut self, rest: &str, line: usize) -> Result<(), String> {
        if self.material_names.is_empty() {
            self.use_material("");
        }
        for word in rest.split_ascii_whitespace() {
            let mut corner = [NONE; 3];
            let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
            for (kind, index) in word.split('/').enumerate() {
                if kind > 2 || (kind == 0 && index.is_empty()) {
                    return Err(format!("{} is not a corner of a face", shown(word)));
                }
                if index.is_empty() {
                    continue;
                }
                let value: i64 =
                    index.parse().map_err(|_| format!("{} is not a corner of a face", shown(word)))?;
                // Negative numbers count back from the last one so far.
                let value = if value < 0 { counts[kind] as i64 + value } else { value - 1 };
                let index = u32::try_from(value).ok().filter(|index| *index != NONE).ok_or_else(|| {
                    format!(
                        "a face refers to {} {}, but there are {}",
                        KINDS[kind],
                        shown(index),
                        counts[kind]
                    )
                })?;
                if index >= self.largest[kind].0 {
                    self.largest[kind] = (index, line);
                }
                corner[kind] = index;
            }
            self.corners.push(corner);
        }
        let end =
            u32::try_from(self.corners.len()).map_err(|_| "there are more than 2³² corners of faces")?;
        self.face_ends.push(end);
        Ok(())
    }

    fn use_material(&mut self, name: &str) {
        // The same few names come again and again, most often the last one.
        let slot = self.material_names.iter().rposition(|known| known == name).unwrap_or_else(|| {
            self.material_names.push(name.into());
            self.material_names.len() - 1
        });
        let faces = self.face_ends.len();
        self.runs.pop_if(|(first, _)| *first == faces);
        self.runs.push((faces, slot as u32));
    }
}

/// The leading numbers of a statement, of which `least` must be there.
fn numbers<const N: usize>(rest: &str, least: usize) -> Result<[f32; N], String> {
    let mut values = [0f32; N];
    let mut count = 0;
    for word in rest.split_ascii_whitespace().take(N) {
        values[count] = number(word)?;
        count += 1;
    }
    if count < least { Err(format!("{count} numbers where at least {least} are needed")) } else { Ok(values) }
}

/// `mtllib a.mtl b.mtl`, or one name with blanks in it.
fn library_names(rest: &str) -> Vec<String> {
    let names: Vec<&str> = rest.split_ascii_whitespace().collect();
    if names.iter().all(|name| name.to_lowercase().ends_with(".mtl")) {
        names.into_iter().map(Into::into).collect()
    } else {
        vec![rest.into()]
    }
}
