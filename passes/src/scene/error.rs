//! What can be wrong with a scene, said so that it can be mended.

use std::path::PathBuf;

/// Why a scene could not be loaded, framed, posed or uploaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file itself could not be read.
    #[error("cannot read `{file}`: {source}. Check the path and its permissions")]
    Read {
        /// The file that was asked for.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The container (GLB header and chunks) is broken.
    #[error("`{file}` is not a complete GLB: {problem}. Export or copy the file again")]
    Container {
        /// The scene file.
        file: String,
        /// What is wrong, with byte counts.
        problem: String,
    },
    /// The JSON does not parse or lacks what glTF requires.
    #[error("`{file}`, JSON line {line}, column {column}: {problem}")]
    Json {
        /// The scene file.
        file: String,
        /// Line within the JSON text, from 1.
        line: usize,
        /// Column within the JSON text, from 1.
        column: usize,
        /// What the parser said.
        problem: String,
    },
    /// The file says that it cannot be read without extensions that are not supported here.
    #[error(
        "`{file}` requires glTF extensions that Lightloom does not support: {extensions}. \
         Export without them (for instance uncompressed)"
    )]
    UnsupportedExtensions {
        /// The scene file.
        file: String,
        /// Their names, separated by commas.
        extensions: String,
    },
    /// Some value in the file contradicts the format.
    #[error("`{file}`, {place}: {problem}")]
    Malformed {
        /// The scene file.
        file: String,
        /// Where: mesh, primitive, accessor, buffer view, node, camera, light, material, image or animation.
        place: String,
        /// What is wrong there and, where it is not plain, the mend.
        problem: String,
    },
    /// A file that the scene refers to could not be read.
    #[error("`{file}`, {place}: cannot read `{resource}`: {source}. Put it beside the scene or use a GLB")]
    Resource {
        /// The scene file.
        file: String,
        /// The buffer or image that names it.
        place: String,
        /// The path that was tried.
        resource: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// An image does not decode.
    #[error("`{file}`, {place}: the image does not decode: {problem}. PNG and JPEG are supported")]
    Image {
        /// The scene file.
        file: String,
        /// Which image.
        place: String,
        /// What the decoder said.
        problem: String,
    },
    /// Nothing to render: no triangle of finite, positive area.
    #[error("scene `{scene}` has no triangles to render (points and lines do not count)")]
    Empty {
        /// The scene's name.
        scene: String,
    },
    /// No camera of that name or index.
    #[error("scene `{scene}` has no camera `{selector}`; it has {available}")]
    UnknownCamera {
        /// The scene's name.
        scene: String,
        /// What was asked for.
        selector: String,
        /// Names and indices that exist.
        available: String,
    },
    /// The environment's image does not decode, or is no radiance.
    #[error("the environment `{file}`: {problem}")]
    Environment {
        /// The image file, or what stands for it.
        file: String,
        /// What is wrong and the mend.
        problem: String,
    },
    /// No lamp of that name.
    #[error("scene `{scene}` has no light `{name}`; it has {available}")]
    UnknownLight {
        /// The scene's name.
        scene: String,
        /// What was asked for.
        name: String,
        /// Names that exist.
        available: String,
    },
    /// A lamp's photons cannot be multiplied by that.
    #[error("scene `{scene}`, light `{name}`: a photon weight of {weight} is out of range, give 0.0625 to 16")]
    PhotonWeight {
        /// The scene's name.
        scene: String,
        /// The lamp.
        name: String,
        /// The factor that was asked for.
        weight: f32,
    },
    /// The scene cannot be moved to that time.
    #[error("scene `{scene}` cannot be posed at {time} s: {problem}")]
    Pose {
        /// The scene's name.
        scene: String,
        /// The time that was asked for (s).
        time: f32,
        /// What is wrong, with the node where it is one.
        problem: String,
    },
    /// A hierarchy cannot follow triangles that it was not built over.
    #[error("the hierarchy was built over {built} triangles and cannot be refitted to {given}: build it anew")]
    Refit {
        /// Triangles of the hierarchy.
        built: u32,
        /// Triangles that it was to follow.
        given: u64,
    },
    /// The acceleration structure would be deeper than any traversal stack.
    #[error(
        "scene `{scene}`: its bounding volume hierarchy is {depth} levels deep, at most {limit} can be \
         traversed. Its triangles differ too much in size: remove the stray ones"
    )]
    TooDeep {
        /// The scene's name.
        scene: String,
        /// Levels of the hierarchy.
        depth: u32,
        /// Levels that fit the traversal stack.
        limit: u32,
    },
    /// A GPU resource of the scene exceeds what the device allows.
    #[error(
        "scene `{scene}`: `{resource}` needs {needed} {unit}, the device allows {allowed} ({limit}). \
         Use a smaller scene or a device with a higher limit"
    )]
    DeviceLimit {
        /// The scene's name.
        scene: String,
        /// Buffer or texture.
        resource: &'static str,
        /// How much it needs.
        needed: u64,
        /// What is counted: bytes, layers or texels.
        unit: &'static str,
        /// How much there is.
        allowed: u64,
        /// The name of the limit in `wgpu::Limits`, or Vulkan's.
        limit: &'static str,
    },
    /// The scene's rays cannot be traced as asked.
    #[error(transparent)]
    Rays(crate::RayBackendError),
}
