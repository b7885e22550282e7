//! Embree, by way of its Python package: a process that keeps the scene and traces a file of rays when told to.

use lightloom_passes::Ray;
use lightloom_passes::scene::Triangle;
use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// What makes it available.
pub(crate) const INSTALL: &str = "pip install embreex numpy";

/// A running `embree.py`.
pub(crate) struct Embree {
    process: Child,
    /// `None` once closed, which ends the process.
    to: Option<ChildStdin>,
    from: BufReader<ChildStdout>,
    folder: tempfile::TempDir,
}

impl Embree {
    /// Builds Embree's scene; `None` where Python or its package `embreex` is missing.
    pub(crate) fn start(triangles: &[Triangle]) -> Result<Option<Self>, Box<dyn Error>> {
        let importable = Command::new("python3").args(["-c", "import embreex, numpy"]).stderr(Stdio::null()).status();
        if !importable.is_ok_and(|status| status.success()) {
            return Ok(None);
        }
        let folder = tempfile::tempdir()?;
        let corners: Vec<[[f32; 3]; 3]> = triangles.iter().map(|t| t.positions_world.map(|p| p.to_array())).collect();
        let path = folder.path().join("triangles");
        std::fs::write(&path, bytemuck::cast_slice::<_, u8>(&corners))?;
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/traversal/embree.py");
        let mut process = Command::new("python3").arg(script).arg(path).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let (to, from) = (process.stdin.take(), process.stdout.take().ok_or("no output")?);
        Ok(Some(Self { process, to, from: BufReader::new(from), folder }))
    }

    /// The triangles that `rays` met, and the time (ms).
    pub(crate) fn trace(&mut self, rays: &[Ray]) -> Result<(Vec<u32>, f64), Box<dyn Error>> {
        let path = self.folder.path().join("rays");
        std::fs::write(&path, bytemuck::cast_slice::<_, u8>(rays))?;
        writeln!(self.to.as_mut().ok_or("closed")?, "{}", path.display())?;
        let mut line = String::new();
        self.from.read_line(&mut line)?;
        let ms = line.trim().parse().map_err(|_| format!("embree.py said `{}` in place of a time", line.trim()))?;
        let bytes = std::fs::read(PathBuf::from(format!("{}.hits", path.display())))?;
        Ok((bytemuck::pod_collect_to_vec(&bytes), ms))
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        self.to = None;
        // It has nothing left to do, and a failure has been told where it showed.
        let _ = self.process.wait();
    }
}
