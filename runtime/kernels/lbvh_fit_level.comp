#version 450
#extension GL_GOOGLE_include_directive : require
// One level of a fitting pass: the nodes that the level before listed (lbvh_fit_first.comp).
#include "common.glsl"
#include "fit.glsl"
#include "fit_list.glsl"

void main() {
    uint i = lane_index();
    if (i >= listed()) return;
    arrive(finish_node(list[p.window_first + i]));
}
