//! What flows from pass to pass, by resource.

use crate::{
    Subresources,
    declaration::{Declaration, Write},
    plan::Plan,
};

/// `to` sees what `from` wrote to `resource`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Flow {
    pub(super) from: usize,
    pub(super) resource: usize,
    pub(super) to: usize,
}

/// All flows, sorted, each once. As the planner's data edges, with the resource beside.
pub(super) fn flows(declaration: &Declaration) -> Vec<Flow> {
    // Per resource: who wrote which part. A writer that keeps what was there stands for those before it, whom it reads itself.
    let mut writers: Vec<Vec<(usize, Subresources)>> = vec![Vec::new(); declaration.resources.len()];
    let mut flows = Vec::new();
    for (to, pass) in declaration.passes.iter().enumerate() {
        for access in &pass.accesses {
            if access.writes() && !access.read && access.write == Write::Overwrite {
                continue;
            }
            let resource = access.resource;
            for &(from, part) in writers.get(resource).into_iter().flatten().rev() {
                if from != to && part.overlaps(access.part) {
                    flows.push(Flow { from, resource, to });
                }
                if part.is_all() || part == access.part {
                    break;
                }
            }
        }
        for access in pass.accesses.iter().filter(|access| access.writes()) {
            if let Some(writers) = writers.get_mut(access.resource) {
                if access.part.is_all() {
                    writers.clear();
                }
                writers.push((to, access.part));
            }
        }
    }
    flows.sort_unstable();
    flows.dedup();
    flows
}

/// Passes that stand in one box: the plan's steps in their order, then each culled pass alone.
pub(super) fn boxes(declaration: &Declaration, plan: &Plan) -> Vec<Vec<usize>> {
    let known = |pass: &usize| *pass < declaration.passes.len();
    let step = |positions: &std::ops::Range<usize>| {
        plan.order.get(positions.clone()).unwrap_or_default().iter().copied().filter(known).collect::<Vec<usize>>()
    };
    let culled = plan.culled.iter().map(|culled| culled.index).filter(known).map(|index| vec![index]);
    plan.steps.iter().map(step).chain(culled).filter(|passes| !passes.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PlanOptions, plan};

    #[test]
    fn readers_see_the_last_writer_which_sees_what_it_keeps() {
        let frame = r#"{"frame": "f",
            "resources": [{"name": "a", "kind": "buffer", "origin": "transient", "bytes": 4},
                          {"name": "out", "kind": "buffer", "origin": "imported", "bytes": 4}],
            "passes": [{"name": "lost", "kind": "compute", "writes": [{"resource": "a"}]},
                       {"name": "write", "kind": "compute", "writes": [{"resource": "a"}]},
                       {"name": "add", "kind": "compute", "writes": [{"resource": "a", "preserve": true}]},
                       {"name": "read", "kind": "compute", "reads": ["a"], "writes": [{"resource": "out"}]}]}"#;
        let declaration = Declaration::from_frame_json(frame).unwrap();
        let flow = |from, to| Flow { from, resource: 0, to };
        assert_eq!(flows(&declaration), [flow(1, 2), flow(2, 3)]);
        let plan = plan(&declaration, &PlanOptions::default()).unwrap();
        assert_eq!(boxes(&declaration, &plan), [vec![1], vec![2], vec![3], vec![0]]);
    }

    #[test]
    fn mips_flow_apart() {
        let frame = r#"{"frame": "f",
            "resources": [{"name": "a", "kind": "texture", "origin": "transient", "format": "r32float", "size": [4, 4, 1], "mips": 3}],
            "passes": [{"name": "base", "kind": "compute", "writes": [{"resource": "a"}]},
                       {"name": "down", "kind": "compute", "writes": [{"resource": "a"}]},
                       {"name": "read", "kind": "compute", "reads": ["a"]}]}"#;
        let mut declaration = Declaration::from_frame_json(frame).unwrap();
        declaration.passes[0].accesses[0].part = Subresources::mip(0);
        declaration.passes[1].accesses[0].part = Subresources::mip(1);
        declaration.passes[2].accesses[0].part = Subresources::mip(0);
        assert_eq!(flows(&declaration), [Flow { from: 0, resource: 0, to: 2 }], "the writer of the other mip stands between");
    }
}
