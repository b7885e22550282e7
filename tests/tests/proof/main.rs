//! Proofs of what Lightloom computes, on the software adapter: each against a closed form, an identity or an independent
//! renderer. Every tolerance is derived or its reason stated where it is used; all seeds are fixed.

mod animation;
mod beams;
mod bias_and_variance;
mod blinn_phong;
mod caustic_map;
mod closed_box;
mod closed_sphere;
mod composed;
mod convergence;
mod culling;
mod determinism;
mod discs;
mod equality;
mod frosted;
mod instant_radiosity;
mod ledger;
mod light_types;
mod lights;
mod plane;
mod progressive;
mod ray_backends;
mod ray_validation;
mod references;
mod refraction;
mod roulette;
mod rsm;
mod samplers;
mod screen_space;
mod shaders;
mod sharing;
mod shipped;
mod snapshots;
mod store;
mod thin_wall;
mod traversal;
