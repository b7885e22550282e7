//! Where in the code something is.

use std::fmt;

/// A line in a shader file, mapped back through `#import`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ShaderPlace(Box<(String, u32)>);

impl ShaderPlace {
    pub(crate) fn new(file: impl Into<String>, line: u32) -> Self {
        Self(Box::new((file.into(), line)))
    }

    /// Path of the file as the source set names it, or the shader's label.
    pub fn file(&self) -> &str {
        &self.0.0
    }

    /// Line in that file, from 1; 0 when unknown.
    pub fn line(&self) -> u32 {
        self.0.1
    }
}

impl fmt::Display for ShaderPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.line() == 0 { f.write_str(self.file()) } else { write!(f, "{}:{}", self.file(), self.line()) }
    }
}

/// A pass and the line of Rust that declared it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PassPlace(Box<(String, String)>);

impl PassPlace {
    pub(crate) fn new(pass: impl Into<String>, rust: impl Into<String>) -> Self {
        Self(Box::new((pass.into(), rust.into())))
    }

    /// Name of the pass.
    pub fn pass(&self) -> &str {
        &self.0.0
    }

    /// `file:line` of the declaring call; empty when the frame came from a file.
    pub fn rust(&self) -> &str {
        &self.0.1
    }
}

impl fmt::Display for PassPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "pass `{}`", self.pass())?;
        if !self.rust().is_empty() {
            write!(f, " ({})", self.rust())?;
        }
        Ok(())
    }
}
