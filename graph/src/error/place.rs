//! Where in the code something is.

use std::{fmt, panic::Location};

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

/// A pass on its way into a graph: a [`PassPlace`] that is put into words only when something is wrong.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PassRef<'a> {
    pub(crate) name: &'a str,
    pub(crate) location: Option<&'static Location<'static>>,
}

impl<'a> PassRef<'a> {
    pub(crate) fn new(name: &'a str, location: &'static Location<'static>) -> Self {
        Self { name, location: Some(location) }
    }

    /// The same pass, at another of its lines.
    pub(crate) fn at(self, location: &'static Location<'static>) -> Self {
        Self { location: Some(location), ..self }
    }

    pub(crate) fn place(self) -> PassPlace {
        PassPlace::new(self.name, crate::declaration::rust_place(self.location))
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
