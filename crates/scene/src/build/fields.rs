//! Learned fields of directed distances as shapes.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use halflight_ddf::{DirectedField, FieldTracer, field_points, mesh_hash};
use halflight_file::LoadError;
use halflight_trace::{Geometry, MeshTracer};

use super::Builder;
use crate::schema::FilePath;

/// A field, with or without its mesh to fall back to.
#[derive(Debug)]
pub(crate) struct FieldShape {
    pub(crate) tracer: FieldTracer,
    geometry: Arc<Geometry>,
}

impl FieldShape {
    fn new(tracer: FieldTracer) -> Self {
        let geometry = Arc::new(Geometry::Custom(Arc::new(tracer.clone())));
        Self { tracer, geometry }
    }

    pub(crate) fn geometry(&self) -> Arc<Geometry> {
        Arc::clone(&self.geometry)
    }

    /// Points of its surface, enough to see how far it reaches.
    pub(crate) fn outline(&self) -> Vec<Vec3> {
        const POINTS: usize = 2000;
        let field = self.tracer.field();
        let unit = field.unit();
        let points = field_points(field, POINTS, 0);
        points.into_iter().map(|p| unit.from_unit(p)).collect()
    }
}

impl Builder {
    /// A field from a file, and its mesh if there is one to fall back to.
    pub(crate) fn field(&mut self, file: &FilePath, mesh: Option<&FilePath>) -> Option<FieldShape> {
        let field = match DirectedField::load(&file.path) {
            Ok(field) => Arc::new(field),
            Err(error) => {
                self.failed(file, &error);
                return None;
            }
        };
        self.note_file(&file.path);
        let Some(mesh_file) = mesh else { return Some(FieldShape::new(FieldTracer::new(field))) };
        let mut mesh = self.model(mesh_file)?.rest_surface().mesh;
        if let Err(error) = mesh.repair() {
            let error = LoadError::new("the mesh of a field", &mesh_file.path, error.to_string());
            self.failed(mesh_file, &error);
            return None;
        }
        if mesh_hash(&mesh) != field.provenance.source_hash {
            self.warnings.push(format!(
                "{}: this is not the mesh that {} was learned from",
                mesh_file.path.display(),
                file.path.display()
            ));
        }
        let tracer = Arc::new(MeshTracer::build(Arc::new(mesh)));
        Some(FieldShape::new(FieldTracer::with_fallback(field, tracer)))
    }

    /// A field from a path that the program itself names.
    pub(crate) fn bare_field(&mut self, path: &Path) -> Result<FieldShape, LoadError> {
        let field = DirectedField::load(path)?;
        self.note_file(path);
        Ok(FieldShape::new(FieldTracer::new(Arc::new(field))))
    }
}
