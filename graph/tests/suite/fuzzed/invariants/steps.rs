//! What runs as one render pass.

use super::{held, points::overlap};
use lightloom_graph::{Access, Attachment, Declaration, PassDecl, PassKind, Plan, Write};

fn attached(pass: &PassDecl) -> impl Iterator<Item = &Access> {
    pass.accesses.iter().filter(|access| access.attachment.is_some())
}

fn beside(pass: &PassDecl) -> impl Iterator<Item = &Access> {
    pass.accesses.iter().filter(|access| access.attachment.is_none())
}

fn is_clear(pass: &PassDecl) -> bool {
    attached(pass).any(|access| access.attachment == Some(Attachment::Clear))
}

/// A step of several passes is clears, then draws: the clears fill what the first draw keeps, the others keep what it drew, and
/// there is nothing that would need a barrier between them.
pub(super) fn may_share_a_render_pass(declaration: &Declaration, plan: &Plan) {
    for step in plan.steps.iter().filter(|step| step.len() > 1) {
        let passes: Vec<&PassDecl> = plan.order[step.clone()].iter().map(|&pass| &declaration.passes[pass]).collect();
        let names: Vec<&str> = passes.iter().map(|pass| &*pass.name).collect();
        assert!(passes.iter().all(|pass| pass.kind == PassKind::Raster), "only raster passes: {names:?}");
        assert!(!passes.iter().any(|pass| pass.heavy), "a heavy pass has a submission of its own: {names:?}");
        let (clears, draws) = passes.split_at(passes.iter().take_while(|pass| is_clear(pass)).count());
        let Some((first, more)) = draws.split_first() else { panic!("clears alone: {names:?}") };
        let targets = |pass| attached(pass).map(|access| (access.attachment, access.resource, access.part)).collect::<Vec<_>>();
        assert!(!targets(first).is_empty() && !draws.iter().any(|draw| is_clear(draw)), "clears, then draws: {names:?}");
        for draw in more {
            assert_eq!(targets(draw), targets(first), "the same attachments: {names:?}");
            assert!(attached(draw).all(|access| access.write == Write::Keep), "which it keeps: {names:?}");
        }
        for clear in clears {
            let loaded = |cleared: &Access| {
                let same = |access: &Access| (access.resource, access.part) == (cleared.resource, cleared.part);
                attached(first).any(|access| same(access) && access.write == Write::Keep)
            };
            assert!(!clear.pinned && clear.accesses.iter().all(loaded), "a clear of what the first draw keeps: {names:?}");
        }
        for (at, draw) in draws.iter().enumerate() {
            for access in beside(draw) {
                assert!(
                    !attached(first).any(|target| overlap(declaration, access, target)),
                    "draws into what it uses: {names:?}"
                );
                for other in draws[..at].iter().flat_map(|other| beside(other)) {
                    let alike = !access.writes() && !other.writes() && held(access) == held(other);
                    assert!(alike || !overlap(declaration, access, other), "no barriers inside: {names:?}");
                }
            }
        }
    }
}
