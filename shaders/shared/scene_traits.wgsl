// What a scene's surfaces ask of the shaders. Kernels that trace rays are compiled once per combination that occurs: what
// no surface of the scene needs is left out. Set from Rust (`SceneTraits`); the defaults handle everything.

// Some surface is not plain Lambert: GGX or a mirror.
override SCENE_GLOSSY: bool = true;
// Glossy surfaces follow [MML13]'s model in place of glTF's, see shared/brdf.wgsl; an alternative, so not among what the defaults handle.
override SCENE_PHONG: bool = false;
// Some surface transmits light.
override SCENE_REFRACTS: bool = true;
// Some of them through rough interfaces.
override SCENE_ROUGH_REFRACTION: bool = true;
// Some material has a texture.
override SCENE_TEXTURES: bool = true;
// Alpha lets some rays pass.
override SCENE_ALPHA: bool = true;
// Light comes from the environment.
override SCENE_ENVIRONMENT: bool = true;
