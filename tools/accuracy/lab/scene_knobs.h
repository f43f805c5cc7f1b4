// Points beside the tiers, made from a scene that host_scene.cpp built: what the laboratory measures, not what rtc does.
#pragma once

#include "host_scene.h"

namespace rtc::lab {

// Node boxes of `bits` bits, 16 or 8, in nodes of 32 bytes that lab_nodes.glsl reads: on a grid over the structure, or
// on each node's own coarser one within it. Each contains the box it stands for, as decoded on the device. Throws
// tools::Error for boxes that are not finite.
HostScene with_small_boxes(const HostScene& scene, int bits);

// Inverse transforms of instances computed in floats, instead of in double and rounded once. `world_to_object` stays
// what exact arithmetic is asked about.
HostScene with_float_inverse(const HostScene& scene);

}  // namespace rtc::lab
