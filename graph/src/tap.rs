//! Looks at what a pass in the middle of a frame wrote.
//!
//! ```text
//!   a ──▶ b ──▶ c            b's texture is overwritten by c, or shares its memory with c's:
//!          └──▶ readback     the copy stands right behind b in recorded order, so neither matters
//! ```
//!
//! The copy is a root like every readback, so the passes that lead to it are not culled. The rejected way, an option of the
//! executor that copies while it runs the plan, would have to know of merged passes, of memory that is shared, and of attachments
//! that are never stored; as a pass, the planner sees to all of it.

use crate::{
    Graph, Readback, TextureDesc,
    copy::unreadable,
    declaration::{Access, PassDecl, PassKind, Place, ResourceKind, Write},
    error::{GraphError, choices, names, nearest},
    graph::{Work, unique},
};
use std::panic::Location;

/// A texture that a pass wrote, on its way to the CPU.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Tap {
    /// Names the bytes in the frame's output: mip 0, all layers.
    pub readback: Readback,
    /// Name of the texture.
    pub resource: String,
    /// What it is.
    pub desc: TextureDesc,
}

/// Names in the message about an unknown pass.
const NEAR: usize = 6;

impl Graph<'_> {
    /// Brings back what the pass of that name writes, as it is right behind this pass. `binding` is the name of the binding or
    /// of the texture; `None` where the pass writes one texture only.
    ///
    /// Declare the rest of the frame first: passes get their names as they are declared.
    ///
    /// # Errors
    /// [`GraphError::UnknownPass`], and [`GraphError::Tap`] where it is unclear what to bring back, or cannot be done.
    #[track_caller]
    pub fn tap(&mut self, pass: &str, binding: Option<&str>) -> Result<Tap, GraphError> {
        let passes = &self.declaration.passes;
        let Some(index) = passes.iter().position(|decl| *decl.name == *pass) else {
            let known = passes.iter().map(|decl| &*decl.name);
            return Err(GraphError::UnknownPass {
                frame: self.declaration.name.clone(),
                pass: pass.to_owned(),
                near: choices(nearest(pass, known, NEAR)),
            });
        };
        let decl = &passes[index];
        let (resource, desc) = self.tapped(decl, binding).map_err(|message| GraphError::Tap { at: decl.place(), message })?;
        let tap = Tap {
            readback: Readback { graph: self.id, index: self.readbacks },
            resource: self.declaration.resources[resource].name.to_string(),
            desc,
        };
        self.readbacks += 1;
        let usage = wgpu::TextureUsages::COPY_SRC.bits();
        let copy = PassDecl {
            name: unique(&mut self.pass_names, format!("tap {pass}").into()),
            kind: PassKind::Copy,
            heavy: false,
            side_effect: true,
            pinned: false,
            accesses: vec![Access::new(resource, "tap", true, Write::No, usage)],
            place: Place(Some(Location::caller())),
        };
        self.declaration.passes.insert(index + 1, copy);
        self.work.insert(index + 1, Work::Readback { resource, index: tap.readback.index });
        Ok(tap)
    }

    /// The texture meant, or why there is none.
    fn tapped(&self, decl: &PassDecl, binding: Option<&str>) -> Result<(usize, TextureDesc), String> {
        let name = |access: &Access| &*self.declaration.resources[access.resource].name;
        let writes: Vec<&Access> = decl.accesses.iter().filter(|access| access.writes()).collect();
        let texture = |access: &Access| match &self.declaration.resources[access.resource].kind {
            ResourceKind::Texture(desc) => Some(desc),
            ResourceKind::Buffer(_) | ResourceKind::Tlas => None,
        };
        let bindings = |accesses: &[&Access]| names(accesses.iter().map(|access| &*access.binding));
        let textures: Vec<&Access> = writes.iter().copied().filter(|access| texture(access).is_some()).collect();
        let access = match (binding, textures.as_slice()) {
            (Some(binding), _) => *writes
                .iter()
                .find(|access| *access.binding == *binding || name(access) == binding)
                .ok_or_else(|| format!("it does not write `{binding}`; it writes {}", bindings(&writes)))?,
            (None, [only]) => only,
            (None, []) if writes.is_empty() => return Err("it writes nothing; tap a pass that does".to_owned()),
            (None, []) => {
                return Err(format!("it writes only buffers ({}); tap a pass that writes a texture", bindings(&writes)));
            }
            (None, several) => return Err(format!("it writes several textures; name one of {}", bindings(several))),
        };
        let Some(desc) = texture(access) else {
            return Err(format!("`{}` is a buffer; tap a texture, or read it back by `readback_buffer`", access.binding));
        };
        if let Some(reason) = unreadable(desc) {
            return Err(format!("`{}` is {desc}: {reason}", access.binding));
        }
        if !access.part.mips_of(desc.mip_level_count).contains(&0) {
            return Err(format!(
                "it writes {} of `{}`, and a tap brings back mip 0; tap a pass that writes it",
                access.part, access.binding
            ));
        }
        Ok((access.resource, desc.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BufferDesc, Handle, PlanOptions, Texture};

    fn texture(graph: &mut Graph<'_>, name: &str) -> Handle<Texture> {
        graph.texture(name, TextureDesc::new_2d([4, 4], wgpu::TextureFormat::R32Float))
    }

    fn writes(graph: &mut Graph<'_>, pass: &str, targets: &mut [&mut Handle<Texture>]) {
        let mut builder = graph.closure(pass);
        for target in targets {
            builder = builder.write(target);
        }
        builder.record(|_| Ok(()));
    }

    fn refusal(graph: &mut Graph<'_>, pass: &str, binding: Option<&str>) -> String {
        graph.tap(pass, binding).unwrap_err().to_string()
    }

    #[test]
    fn a_tap_stands_behind_its_pass_and_keeps_it() {
        let mut graph = Graph::new("f");
        let mut a = texture(&mut graph, "a");
        writes(&mut graph, "first", &mut [&mut a]);
        writes(&mut graph, "second", &mut [&mut a]);
        assert!(graph.plan(&PlanOptions::default()).unwrap().order.is_empty(), "nothing reads `a`, so all is culled");
        let tap = graph.tap("first", None).unwrap();
        assert_eq!((tap.resource.as_str(), tap.desc.size), ("a", [4, 4, 1]));
        let declaration = graph.declaration().unwrap();
        let plan = graph.plan(&PlanOptions::default()).unwrap();
        let order: Vec<&str> = plan.order.iter().map(|&pass| &*declaration.passes[pass].name).collect();
        assert_eq!(order, ["first", "tap first"], "what overwrites it afterwards stays culled");
    }

    #[test]
    fn unclear_taps_say_what_to_name() {
        let mut graph = Graph::new("f");
        let (mut a, mut b) = (texture(&mut graph, "a"), texture(&mut graph, "b"));
        writes(&mut graph, "both", &mut [&mut a, &mut b]);
        let mut words = graph.buffer("words", BufferDesc::words(4));
        graph.clear_buffer(&mut words);
        let text = refusal(&mut graph, "bath", None);
        assert!(text.contains("no pass `bath`; did you mean `both`?"), "{text}");
        let text = refusal(&mut graph, "both", None);
        assert!(text.contains("pass `both`") && text.contains("several textures; name one of"), "{text}");
        let text = refusal(&mut graph, "both", Some("c"));
        assert!(text.contains("does not write `c`"), "{text}");
        let text = refusal(&mut graph, "clear words", None);
        assert!(text.contains("writes only buffers (`clear`)"), "{text}");
        let text = refusal(&mut graph, "clear words", Some("words"));
        assert!(text.contains("is a buffer"), "{text}");
        assert_eq!(graph.tap("both", Some("b")).unwrap().resource, "b");
    }

    #[test]
    fn what_has_no_copyable_layout_is_refused() {
        let mut graph = Graph::new("f");
        let mut many = graph.texture("many", TextureDesc::new_2d([4, 4], wgpu::TextureFormat::R32Float).samples(4));
        writes(&mut graph, "draw", &mut [&mut many]);
        let text = refusal(&mut graph, "draw", None);
        assert!(text.contains("several samples"), "{text}");
    }
}
