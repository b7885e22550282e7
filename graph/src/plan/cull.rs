//! Leaves out passes whose results nothing uses, and says why.

use super::{Culled, dependencies::Edge};
use crate::declaration::{Declaration, PassDecl, Write};

/// Per pass whether it runs, and the reasons of those that do not.
pub(super) fn cull(declaration: &Declaration, edges: &[Edge]) -> (Vec<bool>, Vec<Culled>) {
    let mut needs: Vec<Vec<usize>> = vec![Vec::new(); declaration.passes.len()];
    for edge in edges.iter().filter(|edge| edge.data) {
        needs[edge.to].push(edge.from);
    }
    let mut live = vec![false; declaration.passes.len()];
    let mut stack: Vec<usize> =
        (0..declaration.passes.len()).filter(|&pass| is_root(declaration, &declaration.passes[pass])).collect();
    while let Some(pass) = stack.pop() {
        if !std::mem::replace(&mut live[pass], true) {
            stack.extend(&needs[pass]);
        }
    }
    let uses = uses(declaration);
    let culled = (0..live.len())
        .filter(|&pass| !live[pass])
        .map(|index| Culled { index, pass: declaration.passes[index].name.clone(), reason: reason(declaration, &uses, index) })
        .collect();
    (live, culled)
}

fn is_root(declaration: &Declaration, pass: &PassDecl) -> bool {
    pass.side_effect
        || pass.accesses.iter().filter(|access| access.writes()).any(|access| {
            let resource = &declaration.resources[access.resource];
            resource.keep || resource.origin.outlives_frame()
        })
}

/// Per resource: the passes that use it, with whether they see earlier contents.
fn uses(declaration: &Declaration) -> Vec<Vec<(usize, bool)>> {
    let mut uses = vec![Vec::new(); declaration.resources.len()];
    for (index, pass) in declaration.passes.iter().enumerate() {
        for access in &pass.accesses {
            uses[access.resource].push((index, access.read || access.write != Write::Overwrite));
        }
    }
    uses
}

fn reason(declaration: &Declaration, uses: &[Vec<(usize, bool)>], index: usize) -> String {
    let pass = &declaration.passes[index];
    let mut reasons = Vec::new();
    for access in pass.accesses.iter().filter(|access| access.writes()) {
        let name = &declaration.resources[access.resource].name;
        let after = uses[access.resource].partition_point(|&(other, _)| other <= index);
        reasons.push(match uses[access.resource].get(after) {
            None => format!("nothing reads `{name}`"),
            Some(&(other, true)) => format!("`{name}` is used by `{}`, which is culled too", declaration.passes[other].name),
            Some(&(other, false)) => format!("`{}` overwrites `{name}` before anything reads it", declaration.passes[other].name),
        });
    }
    if reasons.is_empty() { "writes nothing and has no side effect".to_owned() } else { reasons.join("; ") }
}

#[cfg(test)]
mod tests {
    use super::super::{PlanOptions, plan};
    use crate::Declaration;

    #[test]
    fn every_culled_pass_has_its_reason() {
        let frame = r#"{"frame": "f",
            "resources": [{"name": "out", "kind": "buffer", "origin": "imported", "bytes": 4},
                          {"name": "a", "kind": "buffer", "origin": "transient", "bytes": 4},
                          {"name": "b", "kind": "buffer", "origin": "transient", "bytes": 4}],
            "passes": [{"name": "overwritten", "kind": "compute", "reads": [], "writes": [{"resource": "a"}]},
                       {"name": "source", "kind": "compute", "reads": [], "writes": [{"resource": "a"}]},
                       {"name": "dead", "kind": "compute", "reads": ["a"], "writes": [{"resource": "b"}]},
                       {"name": "dead too", "kind": "compute", "reads": ["b"], "writes": [{"resource": "b", "preserve": true}]},
                       {"name": "idle", "kind": "compute", "reads": ["a"], "writes": []},
                       {"name": "sink", "kind": "compute", "reads": ["a"], "writes": [{"resource": "out"}]}]}"#;
        let plan = plan(&Declaration::from_frame_json(frame).unwrap(), &PlanOptions::default()).unwrap();
        assert_eq!(plan.order, [1, 5]);
        let reasons: Vec<(&str, &str)> = plan.culled.iter().map(|c| (c.pass.as_str(), c.reason.as_str())).collect();
        assert_eq!(
            reasons,
            [
                ("overwritten", "`source` overwrites `a` before anything reads it"),
                ("dead", "`b` is used by `dead too`, which is culled too"),
                ("dead too", "nothing reads `b`"),
                ("idle", "writes nothing and has no side effect"),
            ]
        );
    }
}
