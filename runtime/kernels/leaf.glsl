// End of every leaf kernel: store the box of primitive `i` of the build and reduce the
// bounds of the box centres (times two) over the active ones.
shared float red_lo[3 * 256];
shared float red_hi[3 * 256];
shared uint red_active;

void store_leaf(bool in_range, uint i, bool active_, vec3 lo, vec3 hi) {
    uint lane = gl_LocalInvocationIndex;
    lo = clamp(lo, vec3(-RTR_FLT_MAX), vec3(RTR_FLT_MAX));
    hi = clamp(hi, vec3(-RTR_FLT_MAX), vec3(RTR_FLT_MAX));
    active_ = active_ && in_range;
    if (in_range) {
        leaf_box[2u * i] = vec4(active_ ? lo : vec3(RTR_FLT_MAX), active_ ? 1.0 : 0.0);
        leaf_box[2u * i + 1u] = vec4(active_ ? hi : vec3(-RTR_FLT_MAX), 0.0);
        marks[i] = 0u;
    }
    vec3 c = clamp(0.5 * lo + 0.5 * hi, vec3(-RTR_FLT_MAX), vec3(RTR_FLT_MAX));
    for (uint k = 0u; k < 3u; k++) {
        red_lo[k * 256u + lane] = active_ ? c[k] : RTR_FLT_MAX;
        red_hi[k * 256u + lane] = active_ ? c[k] : -RTR_FLT_MAX;
    }
    if (lane == 0u) red_active = 0u;
    barrier();
    if (active_) atomicAdd(red_active, 1u);
    // Two steps of 16: few barriers, since a barrier is dear where a workgroup is a loop
    // over vectors (llvmpipe).
    if (lane < 16u) {
        for (uint k = 0u; k < 3u; k++) {
            float l = red_lo[k * 256u + lane], h = red_hi[k * 256u + lane];
            for (uint s = lane + 16u; s < 256u; s += 16u) {
                l = min(l, red_lo[k * 256u + s]);
                h = max(h, red_hi[k * 256u + s]);
            }
            red_lo[k * 256u + lane] = l;
            red_hi[k * 256u + lane] = h;
        }
    }
    barrier();
    if (lane < 3u) {
        for (uint s = 1u; s < 16u; s++) {
            red_lo[lane * 256u] = min(red_lo[lane * 256u], red_lo[lane * 256u + s]);
            red_hi[lane * 256u] = max(red_hi[lane * 256u], red_hi[lane * 256u + s]);
        }
    }
    if (lane < 3u && red_active != 0u) {
        atomicMin(state[RTR_ST_CENTER_MIN + lane], order_encode(red_lo[lane * 256u]));
        atomicMax(state[RTR_ST_CENTER_MAX + lane], order_encode(red_hi[lane * 256u]));
    }
    if (lane == 0u && red_active != 0u) atomicAdd(state[RTR_ST_ACTIVE], red_active);
}
