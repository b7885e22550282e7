//! `lightloom adapters`: what this machine offers, and which strategies run on it.

use lightloom_graph::wgpu::Features;
use lightloom_graph::{AdapterSummary, GpuError, adapters};
use lightloom_passes::RayBackend;
use lightloom_strategies::{Strategy, by_name, registry};
use std::fmt::Write as _;

use crate::format::bytes;
use crate::{Error, console};

pub(crate) fn run() -> Result<(), Error> {
    let adapters = adapters();
    if adapters.is_empty() {
        return Err(GpuError::NoAdapter.into());
    }
    let mut strategies = Vec::new();
    for entry in registry() {
        strategies.push(by_name(entry.name)?);
    }
    let mut text = String::new();
    for adapter in &adapters {
        text.push_str(&describe(adapter, &strategies));
    }
    text.push_str("LIGHTLOOM_ADAPTER=part-of-a-name chooses one of several.\n\n");
    for strategy in &strategies {
        text.push_str(&parameters(strategy.as_ref()));
    }
    console::print(&text)
}

fn describe(adapter: &AdapterSummary, strategies: &[Box<dyn Strategy>]) -> String {
    let info = &adapter.info;
    let limits = &adapter.limits;
    let driver = format!("{} {}", info.driver, info.driver_info);
    let facts = [
        ("kind", format!("{:?}, {:?}", info.device_type, info.backend)),
        ("driver", driver.trim().to_owned()),
        ("largest image", format!("{0}x{0}", limits.max_texture_dimension_2d)),
        ("largest buffer binding", bytes(limits.max_storage_buffer_binding_size)),
        ("rays", ray_backends(adapter.features).join(", ")),
        ("workgroup memory", bytes(limits.max_compute_workgroup_storage_size.into())),
    ];
    let mut text = format!("{}\n", info.name);
    for (name, value) in facts {
        let _ = writeln!(text, "  {name}: {value}");
    }
    for strategy in strategies {
        let missing = strategy.requirements().missing(adapter.features, limits);
        let verdict = if missing.is_empty() { "runs".to_owned() } else { format!("does not run: {}", missing.join("; ")) };
        let _ = writeln!(text, "  strategy {}: {verdict}", strategy.name());
    }
    text.push('\n');
    text
}

/// What `--trace` can be.
fn ray_backends(features: Features) -> Vec<&'static str> {
    let has = |backend: &RayBackend| backend.is_built() && features.contains(backend.features());
    RayBackend::ALL.iter().filter(|backend| has(backend)).map(|backend| backend.name()).collect()
}

fn parameters(strategy: &dyn Strategy) -> String {
    let mut text = format!("{}: {}\n", strategy.name(), strategy.description());
    for parameter in strategy.parameters() {
        let set = format!("--set {}={}", parameter.name, parameter.value);
        let _ = writeln!(text, "  {set:<28} {}", parameter.doc);
    }
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_is_listed_with_its_value() {
        for entry in registry() {
            let strategy = by_name(entry.name).unwrap();
            let text = parameters(strategy.as_ref());
            for parameter in strategy.parameters() {
                let set = format!("--set {}={}", parameter.name, parameter.value);
                assert!(text.contains(&set), "{set} is missing:\n{text}");
            }
        }
    }
}
