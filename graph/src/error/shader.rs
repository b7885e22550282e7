//! Why a shader is refused.

use super::ShaderPlace;

/// Why a shader was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShaderError {
    /// The source set has no such file.
    #[error("no shader file `{path}` in the source set; known files: {known}")]
    UnknownFile {
        /// The path asked for.
        path: String,
        /// The paths there are.
        known: String,
    },
    /// A file of a watched folder, or the folder, cannot be read.
    #[error("cannot read shader file `{path}`: {message}")]
    Unreadable {
        /// The path below the folder, or the folder's.
        path: String,
        /// Why, and the mend.
        message: String,
    },
    /// An `#import` names a file that is not there.
    #[error(
        "{place}: `#import \"{path}\"` names no file of the source set; write the path from the set's root, such as \"shared/rng.wgsl\""
    )]
    UnknownImport {
        /// Where the import stands.
        place: ShaderPlace,
        /// The path asked for.
        path: String,
    },
    /// A line starts with `#` and is not an import.
    #[error("{place}: cannot read `{line}`; the only directive is `#import \"path.wgsl\"`")]
    Directive {
        /// Where the line stands.
        place: ShaderPlace,
        /// The line.
        line: String,
    },
    /// naga's WGSL parser refused the source.
    #[error("{place}: {message}")]
    Parse {
        /// Where.
        place: ShaderPlace,
        /// The parser's words.
        message: String,
    },
    /// naga's validator refused the module.
    #[error("{place}: {message}")]
    Validation {
        /// Where.
        place: ShaderPlace,
        /// The validator's words.
        message: String,
    },
    /// The module has no such entry point.
    #[error("{place}: no {stage} entry point `{entry}`; entry points here: {known}. An entry point carries the file's stem")]
    EntryPoint {
        /// The file.
        place: ShaderPlace,
        /// Stage looked for.
        stage: String,
        /// Name looked for.
        entry: String,
        /// Names there are.
        known: String,
    },
    /// `with_constant` names no `override`, or its value does not fit.
    #[error("{place}: override `{name}` = {value}: {message}; overrides here: {known}")]
    Constant {
        /// The file.
        place: ShaderPlace,
        /// Name of the override.
        name: String,
        /// Value given.
        value: f64,
        /// What is wrong.
        message: String,
        /// Names there are.
        known: String,
    },
    /// A binding of a kind the graph does not offer.
    #[error("{place}: binding `{binding}`: {what} cannot be bound through the graph; use a closure pass")]
    Unsupported {
        /// Where the binding stands.
        place: ShaderPlace,
        /// Its name.
        binding: String,
        /// What it is.
        what: String,
    },
    /// Two bindings share a group and a binding number.
    #[error("{place}: `{binding}` and `{other}` both sit at @group({group}) @binding({number}); give one another number")]
    SameSlot {
        /// Where the second stands.
        place: ShaderPlace,
        /// Second name.
        binding: String,
        /// First name.
        other: String,
        /// Bind group.
        group: u32,
        /// Binding number.
        number: u32,
    },
    /// The fragment stage returns something other than a struct whose members are the attachments.
    #[error(
        "{place}: fragment entry point `{entry}` must return a struct of `@location` members (each member's name is an attachment), or nothing"
    )]
    FragmentOutput {
        /// The file.
        place: ShaderPlace,
        /// Entry point.
        entry: String,
    },
}
