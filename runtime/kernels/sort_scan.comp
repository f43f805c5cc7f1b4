#version 450
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"
#include "sums.glsl"

void main() { scan_words(RTR_ST_SUMS, p.blocks * RTR_SORT_BINS); }
