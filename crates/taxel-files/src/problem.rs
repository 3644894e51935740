//! Problem files of bodies with their meshes.

use std::path::{Path, PathBuf};

use taxel::shown;
use taxel::solutions::BodyFiles;
use taxel_bodies::problem::{Body, ProblemFile};

use crate::Stop;
use crate::hash::sha256;
use crate::reading::{bytes, text, with_laws, with_shipped_names};

/// A problem with its mesh, as they were read.
#[derive(Debug, Clone)]
pub struct NamedProblem {
    /// Name of the file, or of a shipped problem.
    pub name: String,
    /// Its text, with the law files that it names.
    pub text: String,
    /// What the text describes.
    pub file: ProblemFile,
    /// Name of the mesh, for messages.
    pub mesh_name: String,
    /// The file of the mesh, if it is not a shipped one.
    pub mesh_file: Option<PathBuf>,
    /// Its bytes.
    pub mesh: Vec<u8>,
}

impl NamedProblem {
    /// Reads a problem file, or a shipped one when no such file exists, and its mesh.
    ///
    /// # Errors
    /// A file that cannot be read, or its first mistake.
    pub fn read(path: &Path) -> Result<Self, Stop> {
        let name = shown::path(path);
        let shipped = ProblemFile::shipped_text(&name).filter(|_| !path.exists());
        let text = match shipped {
            Some(text) => text.to_owned(),
            None => text(path).map_err(|stop| {
                let names = ProblemFile::shipped_names();
                with_shipped_names(stop, path, "problem", names)
            })?,
        };
        let text = with_laws(path, &name, text)?;
        let file = ProblemFile::parse(&name, &text)?;
        if let Some(mesh) = ProblemFile::shipped_mesh(&name).filter(|_| shipped.is_some()) {
            return Ok(Self {
                mesh_name: file.mesh.file.clone(),
                mesh_file: None,
                mesh: mesh.to_vec(),
                name,
                text,
                file,
            });
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let mesh_file = folder.join(&file.mesh.file);
        let mesh = bytes(&mesh_file).map_err(|stop| match stop {
            Stop::WrongInput(message) => {
                let key = ["mesh", "file"];
                let help = "the name counts from the folder of the problem file";
                let error = taxel::toml_input::at_key(&name, &text, &key, &message, help);
                Stop::WrongInput(error.to_string())
            }
            stop @ Stop::Failed(_) => stop,
        })?;
        Ok(Self {
            mesh_name: shown::path(&mesh_file),
            mesh_file: Some(mesh_file),
            mesh,
            name,
            text,
            file,
        })
    }

    /// The body at rest.
    ///
    /// # Errors
    /// Mistakes that show with the mesh.
    pub fn body(&self) -> Result<Body, Stop> {
        let problem = (self.name.as_str(), self.text.as_str());
        let mesh = (self.mesh_name.as_str(), self.mesh.as_slice());
        Ok(Body::new(self.file.clone(), problem, mesh)?)
    }

    /// What must be the same for a saved state to fit.
    pub fn identity(&self) -> String {
        let both = [sha256(self.text.as_bytes()), sha256(&self.mesh)];
        both.join("-")
    }

    /// The problem as the table of a sensor takes it: what its text describes and its mesh are told
    /// apart from others by their SHA-256.
    pub fn body_files(self) -> BodyFiles {
        let described = format!("{:?}", self.file);
        BodyFiles {
            identity: Some([sha256(described.as_bytes()), sha256(&self.mesh)]),
            text: self.text,
            mesh: self.mesh,
        }
    }
}
