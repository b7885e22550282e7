//! The pipeline's shaders, from WGSL to SPIR-V.

use crate::scene::SceneTraits;
use lightloom_graph::wgpu::naga::{
    self, ShaderStage,
    back::{PipelineConstants, pipeline_constants::process_overrides, spv},
    proc::{BoundsCheckPolicies, BoundsCheckPolicy},
    valid::{Capabilities, ValidationFlags, Validator},
};
use lightloom_graph::{FlatWgsl, ShaderError, WgslSources, error_chain};

/// Path of the shaders.
pub(super) const PATH: &str = "passes/ray_pipeline/trace_rays.wgsl";
/// The stages and their entry points.
pub(super) const STAGES: [(ShaderStage, &str); 4] = [
    (ShaderStage::RayGeneration, "trace_rays"),
    (ShaderStage::Miss, "trace_rays_miss"),
    (ShaderStage::ClosestHit, "trace_rays_closest_hit"),
    (ShaderStage::AnyHit, "trace_rays_any_hit"),
];
/// The function whose end is the end of a candidate.
const IGNORE: &str = "ignore_intersection";

/// The flattened text. Edits of a live set do not reach it.
#[derive(Clone, Debug)]
pub(super) struct Shader {
    flat: FlatWgsl,
}

impl Shader {
    pub(super) fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { flat: sources.flatten(PATH)? })
    }

    /// The SPIR-V of each stage, in the order of [`STAGES`], for a scene of these traits. `bindings` says where the variables of
    /// the two groups lie; the others are not used.
    pub(super) fn compile(&self, traits: SceneTraits, bindings: &spv::BindingMap) -> Result<[Vec<u32>; 4], String> {
        let source = self.flat.source();
        let module =
            naga::front::wgsl::parse_str(source).map_err(|error| self.place(error.location(source), &error_chain(&error)))?;
        let capabilities = Capabilities::RAY_TRACING_PIPELINE | Capabilities::SHADER_FLOAT16_IN_FLOAT32;
        let info = Validator::new(ValidationFlags::all(), capabilities)
            .validate(&module)
            .map_err(|error| self.place(error.location(source), &error_chain(error.as_inner())))?;
        let constants: PipelineConstants =
            traits.constants().into_iter().map(|(name, value)| (name.to_owned(), f64::from(value))).collect();
        // Whoever adds the pass may say that there are more rays than the buffer holds. Texels are looked up where the scene says.
        let inside = BoundsCheckPolicy::Restrict;
        // Ray tracing needs SPIR-V 1.4; the names are how `IGNORE` is found again.
        let options = spv::Options {
            bounds_check_policies: BoundsCheckPolicies { index: inside, buffer: inside, ..BoundsCheckPolicies::default() },
            lang_version: (1, 4),
            flags: spv::WriterFlags::DEBUG,
            binding_map: bindings.clone(),
            fake_missing_bindings: false,
            ..spv::Options::default()
        };
        let stage = |(stage, name): (ShaderStage, &str)| {
            let (module, info) = process_overrides(&module, &info, Some((stage, name)), &constants)
                .map_err(|error| self.place(None, &error_chain(&error)))?;
            let entry = spv::PipelineOptions { shader_stage: stage, entry_point: name.to_owned() };
            let words = spv::write_vec(&module, &info, &options, Some(&entry));
            words.map(drop_geometry).map_err(|error| self.place(None, &error_chain(&error)))
        };
        let [generation, miss, closest, any] = STAGES.map(stage);
        let mut any = any?;
        if traits.alpha {
            replace_ignore(&mut any)?;
        }
        Ok([generation?, miss?, closest?, any])
    }

    fn place(&self, location: Option<naga::SourceLocation>, message: &str) -> String {
        let (file, line) = location.map_or((PATH, 0), |location| self.flat.locate(location.line_number));
        format!("{file}:{line}: {message}")
    }
}

/// One instruction of SPIR-V: its opcode, and its words behind the first.
struct Instruction<'a> {
    at: usize,
    opcode: u16,
    operands: &'a [u32],
}

/// The instructions of a module that naga wrote.
fn instructions(words: &[u32]) -> impl Iterator<Item = Instruction<'_>> {
    const HEADER_WORDS: usize = 5;
    let mut at = HEADER_WORDS;
    std::iter::from_fn(move || {
        let first = *words.get(at)?;
        let length = (first >> 16) as usize;
        let operands = words.get(at + 1..at + length)?;
        let instruction = Instruction { at, opcode: first as u16, operands };
        at += length;
        Some(instruction)
    })
}

/// The module without the capability of geometry shaders, which naga declares for an index of a primitive in any stage, and which
/// the stages of ray tracing do not need.
fn drop_geometry(mut words: Vec<u32>) -> Vec<u32> {
    const OP_CAPABILITY: u16 = 17;
    const GEOMETRY: u32 = 2;
    let at = instructions(&words).find(|i| i.opcode == OP_CAPABILITY && i.operands == [GEOMETRY]).map(|i| i.at);
    if let Some(at) = at {
        words.drain(at..at + 2);
    }
    words
}

/// Ends the function [`IGNORE`] by `OpIgnoreIntersectionKHR` in place of its `OpReturn`: both end a block, and both are one word.
fn replace_ignore(words: &mut [u32]) -> Result<(), String> {
    const OP_NAME: u16 = 5;
    const OP_FUNCTION: u16 = 54;
    const OP_RETURN: u16 = 253;
    const OP_IGNORE_INTERSECTION_KHR: u32 = 4448;
    let named = |instruction: &Instruction<'_>| {
        let name = instruction.operands.iter().skip(1).flat_map(|word| word.to_le_bytes());
        instruction.opcode == OP_NAME && name.take_while(|&byte| byte != 0).eq(IGNORE.bytes())
    };
    let id = instructions(words).find(named).map(|instruction| instruction.operands[0]);
    let end = id.and_then(|id| {
        let begins = |i: &Instruction<'_>| i.opcode == OP_FUNCTION && i.operands.get(1) == Some(&id);
        instructions(words).skip_while(|i| !begins(i)).find(|i| i.opcode == OP_RETURN).map(|i| i.at)
    });
    let end = end.ok_or_else(|| format!("{PATH}: naga wrote no function `{IGNORE}`"))?;
    words[end] = 1 << 16 | OP_IGNORE_INTERSECTION_KHR;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compile(alpha: bool) -> [Vec<u32>; 4] {
        let bindings = super::super::vulkan::bindings();
        Shader::new(&crate::shaders()).unwrap().compile(SceneTraits { alpha, ..SceneTraits::default() }, &bindings).unwrap()
    }

    #[test]
    fn only_candidates_of_scenes_with_alpha_are_let_pass() {
        let ignored = |words: &[u32]| instructions(words).filter(|i| i.opcode == 4448).count();
        assert_eq!(compile(true).map(|words| ignored(&words)), [0, 0, 0, 1], "in the any-hit shader alone");
        assert_eq!(compile(false).map(|words| ignored(&words)), [0; 4], "nothing passes");
    }

    #[test]
    fn modules_are_whole_instructions() {
        for words in compile(true) {
            let last = instructions(&words).last().unwrap();
            assert_eq!(last.at + 1 + last.operands.len(), words.len(), "the last instruction ends the module");
            assert!(!instructions(&words).any(|i| i.opcode == 17 && i.operands == [2]), "no geometry shaders are needed");
        }
    }

    #[test]
    fn an_error_names_the_file_and_the_line() {
        let wrong = crate::shaders().with(&[("shared/rays.wgsl", "// a\nfn b() { oops }")]);
        let error = Shader::new(&wrong).unwrap().compile(SceneTraits::default(), &spv::BindingMap::default()).unwrap_err();
        assert!(error.starts_with("shared/rays.wgsl:2: "), "{error}");
    }
}
