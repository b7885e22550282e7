//! What can go wrong, each naming the pass, the resource, the place in the code and the mend.

mod place;
mod shader;
#[cfg(test)]
mod texts;
mod words;

pub(crate) use place::PassRef;
pub use place::{PassPlace, ShaderPlace};
pub use shader::ShaderError;
pub(crate) use words::{choices, did_you_mean, names, nearest};

/// Why a frame was refused or failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GraphError {
    // ---- binding by name, checked against the WGSL ----
    /// The WGSL has no variable of that name.
    #[error("{at}: `{binding}` is no binding of {shader}; it has {known}{hint}")]
    UnknownBinding {
        /// The pass.
        at: PassPlace,
        /// Name bound.
        binding: String,
        /// The shader.
        shader: ShaderPlace,
        /// Names there are.
        known: String,
        /// "; did you mean `x`?" or nothing.
        hint: String,
    },
    /// The entry point uses a variable nothing is bound to.
    #[error("{at}: nothing is bound to `{binding}` ({shader}, {kind}); add {mend}")]
    Unbound {
        /// The pass.
        at: PassPlace,
        /// The variable.
        binding: String,
        /// Where it is declared.
        shader: ShaderPlace,
        /// What it is.
        kind: String,
        /// The call to add.
        mend: String,
    },
    /// One name was bound twice.
    #[error("{at}: `{binding}` is bound twice, to `{first}` and to `{second}`; remove one")]
    BoundTwice {
        /// The pass.
        at: PassPlace,
        /// The variable.
        binding: String,
        /// First resource.
        first: String,
        /// Second resource.
        second: String,
    },
    /// A buffer where the WGSL has a texture, or the other way round.
    #[error("{at}: `{binding}` is {expected} ({shader}) but `{resource}` is {given}; bind {mend}")]
    Kind {
        /// The pass.
        at: PassPlace,
        /// The variable.
        binding: String,
        /// Where it is declared.
        shader: ShaderPlace,
        /// What the WGSL has.
        expected: Box<str>,
        /// Resource bound.
        resource: String,
        /// What it is.
        given: Box<str>,
        /// What to bind.
        mend: Box<str>,
    },
    /// Bound by `.read`, but the shader writes it.
    #[error(
        "{at}: `{resource}` is declared as read, but the shader writes `{binding}` ({shader}); declare `.write(\"{binding}\", &mut …)`"
    )]
    ReadIsWritten {
        /// The pass.
        at: PassPlace,
        /// The variable.
        binding: String,
        /// Resource bound.
        resource: String,
        /// Where the variable is declared.
        shader: ShaderPlace,
    },
    /// Bound by `.write`, but the shader never writes it.
    #[error(
        "{at}: `{resource}` is declared as written, but the shader never writes `{binding}` ({shader}); declare `.read(\"{binding}\", &…)`"
    )]
    WriteIsNotWritten {
        /// The pass.
        at: PassPlace,
        /// The variable.
        binding: String,
        /// Resource bound.
        resource: String,
        /// Where the variable is declared.
        shader: ShaderPlace,
    },
    /// Texture format and WGSL sample type disagree.
    #[error(
        "{at}: `{binding}` is {expected} ({shader}) but `{resource}` is {format}, which samples as {given}; declare `{binding}` as {mend}"
    )]
    SampleKind {
        /// The pass.
        at: PassPlace,
        /// The variable.
        binding: String,
        /// Where it is declared.
        shader: ShaderPlace,
        /// WGSL type.
        expected: Box<str>,
        /// Resource bound.
        resource: Box<str>,
        /// Its format.
        format: Box<str>,
        /// What it samples as.
        given: Box<str>,
        /// WGSL type that fits.
        mend: Box<str>,
    },
    /// The shader samples with a filter, the format cannot be filtered.
    #[error(
        "{at}: `{binding}` ({shader}) is sampled through a sampler, but `{resource}` is {format}, which cannot be filtered everywhere; use textureLoad or a 16-bit float format"
    )]
    NotFilterable {
        /// The pass.
        at: PassPlace,
        /// The variable.
        binding: String,
        /// Where it is declared.
        shader: ShaderPlace,
        /// Resource bound.
        resource: String,
        /// Its format.
        format: String,
    },
    /// Storage texture formats differ.
    #[error("{at}: `{binding}` is texture_storage of {expected} ({shader}) but `{resource}` is {given}; make the two the same")]
    StorageFormat {
        /// The pass.
        at: PassPlace,
        /// The variable.
        binding: String,
        /// Where it is declared.
        shader: ShaderPlace,
        /// Format in WGSL.
        expected: String,
        /// Resource bound.
        resource: String,
        /// Its format.
        given: String,
    },
    /// Texture shapes differ (2d, array, 3d, cube, multisampled).
    #[error("{at}: `{binding}` is {expected} ({shader}) but `{resource}` is {given}; {mend}")]
    TextureShape {
        /// The pass.
        at: PassPlace,
        /// The variable.
        binding: String,
        /// Where it is declared.
        shader: ShaderPlace,
        /// WGSL shape.
        expected: Box<str>,
        /// Resource bound.
        resource: String,
        /// Its shape.
        given: Box<str>,
        /// What to change.
        mend: Box<str>,
    },
    /// `.read_as` asks for a format the texture does not list.
    #[error(
        "{at}: `{resource}` is {format} and does not list {asked} as a view format; add `.view_format(…)` to its description"
    )]
    ViewFormat {
        /// The pass.
        at: PassPlace,
        /// Resource bound.
        resource: String,
        /// Its format.
        format: String,
        /// Format asked for.
        asked: String,
    },
    /// A Rust struct and a WGSL struct differ.
    #[error("{at}: `{binding}`: Rust struct `{rust_struct}` and WGSL struct `{wgsl_struct}` ({shader}) differ: {difference}")]
    Layout {
        /// The pass.
        at: PassPlace,
        /// The variable.
        binding: String,
        /// Where it is declared.
        shader: ShaderPlace,
        /// Rust struct's name.
        rust_struct: String,
        /// WGSL struct's name.
        wgsl_struct: String,
        /// First difference, with its mend.
        difference: String,
    },
    /// A buffer is smaller than the WGSL type.
    #[error("{at}: `{binding}` needs at least {needed} bytes ({shader}) but `{resource}` has {given}; make the buffer larger")]
    BufferTooSmall {
        /// The pass.
        at: PassPlace,
        /// The variable.
        binding: String,
        /// Where it is declared.
        shader: ShaderPlace,
        /// Bytes the WGSL type takes.
        needed: u64,
        /// Resource bound.
        resource: String,
        /// Its bytes.
        given: u64,
    },
    /// One resource is bound more than once and at least one binding writes it.
    #[error(
        "{at}: `{resource}` is bound as `{first}` and as `{second}`, and one of them writes; a pass sees a resource it writes through one binding only: write to another resource"
    )]
    WriteConflict {
        /// The pass.
        at: PassPlace,
        /// Resource bound.
        resource: String,
        /// First binding.
        first: String,
        /// Second binding.
        second: String,
    },
    /// A handle of another graph (an earlier frame's, perhaps).
    #[error("{at}: the handle `{resource}` belongs to another graph; declare the resource in this frame's graph")]
    ForeignHandle {
        /// The pass.
        at: PassPlace,
        /// The handle's name.
        resource: String,
    },
    /// Mips or layers that the texture does not have.
    #[error("{at}: `{resource}` has no {part}: it has {mips} mips and {layers} layers, counted from 0; name some of these")]
    NoSuchPart {
        /// The pass.
        at: PassPlace,
        /// Resource.
        resource: String,
        /// What was asked for.
        part: String,
        /// Mip levels there are.
        mips: u32,
        /// Layers there are.
        layers: u32,
    },
    /// Arguments of an indirect call that do not lie in their buffer.
    #[error(
        "{at}: the arguments at byte {offset} of `{resource}` ({given} bytes) take {needed} bytes from a multiple of 4; move them or make the buffer larger"
    )]
    Indirect {
        /// The pass.
        at: PassPlace,
        /// The buffer.
        resource: String,
        /// Where the arguments are said to be (bytes).
        offset: u64,
        /// Bytes they take.
        needed: u64,
        /// Bytes of the buffer.
        given: u64,
    },
    // ---- raster ----
    /// The fragment output has no member of that name.
    #[error("{at}: `{attachment}` is no output of the fragment stage ({shader}); it has {known}")]
    UnknownAttachment {
        /// The pass.
        at: PassPlace,
        /// Name given.
        attachment: String,
        /// The shader.
        shader: ShaderPlace,
        /// Members there are.
        known: String,
    },
    /// A fragment output has no texture.
    #[error(
        "{at}: the fragment stage writes `{attachment}` ({shader}) and no texture is attached; add `.color(\"{attachment}\", &mut …, Load::Clear([0.0; 4]))`"
    )]
    MissingAttachment {
        /// The pass.
        at: PassPlace,
        /// The member.
        attachment: String,
        /// The shader.
        shader: ShaderPlace,
    },
    /// An attachment does not suit: kind of value, depth format, samples.
    #[error("{at}: attachment `{attachment}`: `{resource}` ({format}) does not suit: {message}")]
    Attachment {
        /// The pass.
        at: PassPlace,
        /// Attachment name, or `depth`.
        attachment: String,
        /// Resource attached.
        resource: String,
        /// Its format.
        format: String,
        /// What is wrong and how to mend it.
        message: String,
    },
    /// Attachments differ in size or sample count.
    #[error(
        "{at}: attachments `{first}` ({first_size}) and `{second}` ({second_size}) differ in size or samples; make them the same"
    )]
    AttachmentSize {
        /// The pass.
        at: PassPlace,
        /// First resource.
        first: String,
        /// Its size.
        first_size: String,
        /// Second resource.
        second: String,
        /// Its size.
        second_size: String,
    },
    /// A raster pass with neither colour nor depth.
    #[error("{at}: no colour and no depth attachment; add `.color(…)` or `.depth(…)`")]
    NoAttachment {
        /// The pass.
        at: PassPlace,
    },
    // ---- copies, resources ----
    /// Two ends of a copy differ.
    #[error("{at}: cannot copy `{from}` ({from_desc}) to `{to}` ({to_desc}); make the descriptions the same")]
    CopyMismatch {
        /// The pass.
        at: PassPlace,
        /// Source.
        from: String,
        /// Its description.
        from_desc: String,
        /// Target.
        to: String,
        /// Its description.
        to_desc: String,
    },
    /// A texture that cannot be read back.
    #[error("{at}: `{resource}` ({desc}) cannot be read back: {message}")]
    Readback {
        /// The pass.
        at: PassPlace,
        /// Resource.
        resource: String,
        /// Its description.
        desc: String,
        /// Why, and the mend.
        message: String,
    },
    /// A resource of size zero.
    #[error("resource `{resource}` ({rust}) has size zero; give it at least one element")]
    EmptyResource {
        /// Resource.
        resource: String,
        /// Where it was declared.
        rust: String,
    },
    /// First contents that do not fit the resource.
    #[error("resource `{resource}` ({rust}): {message}")]
    Initial {
        /// Resource.
        resource: String,
        /// Where it was declared.
        rust: String,
        /// What is wrong and how to mend it.
        message: String,
    },
    /// A `previous` handle is written.
    #[error("{at}: writes `{resource}`, the previous frame's contents; write the `current` handle of the pair")]
    WritesPrevious {
        /// The pass.
        at: PassPlace,
        /// Resource.
        resource: String,
    },
    /// A pass reads what nothing wrote: stale contents.
    #[error("{at}: reads `{resource}` ({how}), which nothing wrote earlier in the frame, so it would see stale contents; {mend}")]
    StaleRead {
        /// The pass.
        at: PassPlace,
        /// Resource.
        resource: String,
        /// Binding or access.
        how: String,
        /// What to do.
        mend: String,
    },
    /// Passes need each other's results.
    #[error("cycle: {path}; each reads what a later one writes: break it with a history resource")]
    Cycle {
        /// `a` → `b` → `a`, with the resources.
        path: String,
    },
    // ---- frame files ----
    /// Not JSON, or not the form of a frame.
    #[error("frame file, line {line}, column {column}: {message}")]
    FrameSyntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// serde's words.
        message: String,
    },
    /// Two resources or two passes share a name.
    #[error("frame `{frame}`: {what} `{name}` appears twice (numbers {first} and {second}); rename one")]
    DuplicateName {
        /// Frame.
        frame: String,
        /// "resource" or "pass".
        what: &'static str,
        /// The name.
        name: String,
        /// Index of the first, from 0.
        first: usize,
        /// Index of the second, from 0.
        second: usize,
    },
    /// A pass names a resource that is not there.
    #[error("frame `{frame}`: pass `{pass}` {verb} `{resource}`, which is not among the resources{hint}")]
    UnknownResource {
        /// Frame.
        frame: String,
        /// Pass.
        pass: String,
        /// "reads" or "writes".
        verb: &'static str,
        /// Name or number given.
        resource: String,
        /// "; did you mean `x`?" or nothing.
        hint: String,
    },
    /// A resource whose description makes no sense.
    #[error("frame `{frame}`: resource `{resource}`: {message}")]
    BadResource {
        /// Frame.
        frame: String,
        /// Resource.
        resource: String,
        /// What is wrong.
        message: String,
    },
    // ---- taps ----
    /// No pass has that name.
    #[error("frame `{frame}` has no pass `{pass}`; did you mean {near}?")]
    UnknownPass {
        /// Frame.
        frame: String,
        /// Name given.
        pass: String,
        /// Names there are, nearest first.
        near: String,
    },
    /// What a pass writes cannot be tapped.
    #[error("{at}: cannot be tapped: {message}")]
    Tap {
        /// The pass.
        at: PassPlace,
        /// Why, and the mend.
        message: String,
    },
    // ---- execution ----
    /// An imported resource was declared without its wgpu object.
    #[error(
        "{at}: imported `{resource}` has no wgpu object, so the frame can be planned but not executed; pass it to `import_…`"
    )]
    ImportMissing {
        /// A pass that needs it.
        at: PassPlace,
        /// Resource.
        resource: String,
    },
    /// An imported object differs from its description or lacks a usage.
    #[error("{at}: imported `{resource}`: {message}")]
    ImportMismatch {
        /// A pass that needs it.
        at: PassPlace,
        /// Resource.
        resource: String,
        /// What differs.
        message: String,
    },
    /// More than the device allows; found before anything is created.
    #[error("{what} asks for {asked} where the device's {limit} is {allowed}; {mend}")]
    Limit {
        /// Resource or pass.
        what: String,
        /// Amount asked for.
        asked: u64,
        /// wgpu's name of the limit.
        limit: &'static str,
        /// The limit.
        allowed: u64,
        /// What to do.
        mend: String,
    },
    /// The format cannot be used in this way on this device.
    #[error("resource `{resource}`: {format} cannot be used as {usage} on this device; choose another format")]
    FormatUsage {
        /// Resource.
        resource: String,
        /// Format.
        format: String,
        /// Usage it lacks.
        usage: String,
    },
    /// An acceleration structure on a device without ray queries.
    #[error(
        "acceleration structure `{resource}`: the device lacks EXPERIMENTAL_RAY_QUERY; ask for it when the device is opened \
         (`GpuRequest::experimental`), or trace by a hierarchy of your own"
    )]
    RayQuery {
        /// Resource.
        resource: String,
    },
    /// A closure pass returned an error.
    #[error("{at}: {message}")]
    Closure {
        /// The pass.
        at: PassPlace,
        /// Its words.
        message: String,
    },
    /// wgpu refused a call; a check of ours is missing.
    #[error("wgpu refused {during}: {message}")]
    Gpu {
        /// What was being done.
        during: String,
        /// wgpu's words.
        message: String,
    },
    /// The device is out of memory.
    #[error(
        "the device ran out of memory during {during}, with {bytes} bytes in the graph's pool; use smaller images or fewer photons"
    )]
    OutOfMemory {
        /// What was being done.
        during: String,
        /// Bytes the executor holds.
        bytes: u64,
    },
    /// The device was lost.
    #[error("the device was lost ({message}); create a new one and a new executor")]
    DeviceLost {
        /// The driver's words.
        message: String,
    },
    /// The observer stopped the frame.
    #[error("cancelled after {done} of {total} passes")]
    Cancelled {
        /// Passes finished.
        done: usize,
        /// Passes in the plan.
        total: usize,
    },
    /// Several mistakes in one declaration.
    #[error("{} mistakes in one frame:{}", .0.len(), list(.0))]
    Many(Vec<Self>),
}

fn list(errors: &[GraphError]) -> String {
    errors.iter().fold(String::new(), |text, error| text + "\n  - " + &error.to_string())
}

impl GraphError {
    /// One error as itself, several as [`GraphError::Many`]; `None` when there are none.
    pub(crate) fn collect(mut errors: Vec<Self>) -> Option<Self> {
        match errors.len() {
            0 => None,
            1 => errors.pop(),
            _ => Some(Self::Many(errors)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_small_enough_to_return() {
        assert!(size_of::<GraphError>() < 128, "{}", size_of::<GraphError>());
        assert!(size_of::<ShaderError>() < 128, "{}", size_of::<ShaderError>());
    }
}
